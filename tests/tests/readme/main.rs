//! The README keeps its word: its commands exist, its options parse, its scene file is one, its files are there. The other
//! pages' commands parse, too.

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use haptic_server::cli::{ServerCli, SolverCli};
use sim_core::scene::config::SceneConfig;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).expect("there is a README")
}

/// Code blocks fenced with this language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    text.split(&fence).skip(1).filter_map(|rest| rest.split("\n```").next()).map(str::to_owned).collect()
}

#[test]
fn the_scene_file_is_a_scene_and_no_key_is_unknown() {
    let scenes = blocks(&readme(), "toml");
    assert_eq!(scenes.len(), 1, "one example");
    let scene: SceneConfig = toml::from_str(&scenes[0]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.name, "forearm");
    assert!(scene.attachment.is_some() && scene.line.is_some() && scene.control.is_some(), "it shows every section");
}

#[test]
fn the_commands_and_options_named_exist() {
    let server = ServerCli::command();
    let text = readme();
    let mut seen = 0;
    for (start, _) in text.match_indices("haptic-server ") {
        let rest = &text[start + "haptic-server ".len()..];
        let word = rest.split(|c: char| !c.is_ascii_alphanumeric() && c != '-').next().unwrap_or_default();
        assert!(server.find_subcommand(word).is_some(), "haptic-server has no command {word:?}");
        seen += 1;
    }
    assert!(seen >= 4, "only {seen} commands found: has the README changed its shape?");
    let harness = ["--json", "--out", "--scene", "--duration", "--help"];
    let known = |option: &str| {
        let name = option.trim_start_matches('-');
        let has = |c: &clap::Command| c.get_arguments().any(|a| a.get_long() == Some(name));
        server.get_subcommands().any(has) || has(&SolverCli::command()) || harness.contains(&option)
    };
    let block = blocks(&text, "").into_iter().find(|b| b.contains("--scene")).expect("the command line in short");
    for option in block.split(|c: char| !c.is_ascii_alphanumeric() && c != '-').filter(|w| w.starts_with("--")) {
        assert!(known(option), "no command has the option {option}");
    }
}

#[test]
fn ci_runs_the_test_command_that_the_readme_names() {
    let commands = blocks(&readme(), "sh");
    assert!(commands.iter().any(|c| c == "cargo test --workspace"), "{commands:?}");
    let ci = std::fs::read_to_string(root().join(".ci/run")).expect("there is a .ci/run");
    assert!(ci.contains("grep -m1 '^cargo test' README.md"), ".ci/run takes its test command from the README");
}

#[test]
fn every_file_it_sends_the_reader_to_is_there() {
    let text = readme();
    let paths =
        text.split('`').skip(1).step_by(2).filter(|p| p.contains('/') && !p.contains(' ') && !p.contains("://"));
    let paths: Vec<&str> = paths.filter(|p| Path::new(p).extension().is_some() || p.starts_with('.')).collect();
    assert!(paths.len() >= 4, "{paths:?}");
    for path in paths {
        assert!(root().join(path).exists(), "README.md names {path}, which is not there");
    }
}

/// Command lines of `haptic-server` in a page: in shell blocks and in the running text, without comments.
fn command_lines(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fence = None;
    for line in page.lines() {
        if let Some(language) = line.strip_prefix("```") {
            fence = if fence.is_some() { None } else { Some(language) };
            continue;
        }
        let texts: Vec<&str> = match fence {
            Some("sh") => line.split(" #").take(1).collect(),
            Some(_) => Vec::new(),
            None => line.split('`').skip(1).step_by(2).collect(),
        };
        let of_server =
            texts.iter().filter_map(|text| text.find("haptic-server ").map(|at| text[at..].trim().to_owned()));
        found.extend(of_server);
    }
    found
}

/// Words as a shell would see them, as far as these pages need it: quotes hold words together.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    parts
        .flat_map(|(n, part)| match n % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect::<Vec<_>>(),
            _ => vec![part.to_owned()],
        })
        .collect()
}

#[test]
fn every_command_of_the_pages_is_one() {
    let docs = std::fs::read_dir(root().join("docs")).expect("there are pages");
    let paths = docs.map(|entry| entry.expect("readable").path()).filter(|p| p.extension().is_some_and(|e| e == "md"));
    let mut seen = 0;
    for path in paths.chain([root().join("README.md")]) {
        for line in command_lines(&std::fs::read_to_string(&path).expect("readable")) {
            seen += 1;
            // A command may be named without what it needs.
            let named_only = [ErrorKind::MissingRequiredArgument, ErrorKind::MissingSubcommand, ErrorKind::DisplayHelp];
            match ServerCli::try_parse_from(words(&line)) {
                Err(error) if !named_only.contains(&error.kind()) => panic!("{}: `{line}`: {error}", path.display()),
                _ => {}
            }
        }
    }
    assert!(seen >= 20, "only {seen} command lines found: have the pages changed their shape?");
}

#[test]
fn a_command_line_is_found_and_cut_out_of_its_page() {
    let page = "Say `haptic-server doctor --json` or `x`.\n```sh\nA=b ./haptic-server run --device \"openhaptics:A B\"  # why\n```\n\
                ```\nhaptic-server tells\n```\n";
    let lines = command_lines(page);
    assert_eq!(lines, ["haptic-server doctor --json", "haptic-server run --device \"openhaptics:A B\""]);
    assert_eq!(words(&lines[1])[3], "openhaptics:A B");
}
