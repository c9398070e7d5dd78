//! Tests of the scene loader: round trip of the presets, refusals with their place, folder bounds.

use super::*;
use crate::exit;
use proptest::prelude::*;
use sim_core::scene::presets;

fn skin_text() -> String {
    toml::to_string(&presets::skin()).expect("presets are representable")
}

fn refusal(text: &str) -> String {
    let error = parse(text.as_bytes(), "s.toml").expect_err(text);
    assert_eq!(error.exit_code(), exit::BAD_DATA);
    error.to_string()
}

#[test]
fn presets_survive_the_way_through_a_file() {
    for config in [presets::skin(), presets::liver(), presets::vessel()] {
        let text = toml::to_string(&config).expect("presets are representable");
        assert_eq!(parse(text.as_bytes(), "s.toml").expect("own text"), config);
    }
}

#[test]
fn a_misspelt_key_names_its_place_and_the_nearest_key() {
    let text = skin_text().replace("\nstiffness_n_per_mm", "\nstifness_n_per_mm");
    let line = 1 + text.lines().position(|l| l.contains("stifness")).expect("replaced");
    let message = refusal(&text);
    assert!(message.starts_with(&format!("s.toml:{line}:1: ")), "{message}");
    assert!(message.contains("did you mean `stiffness_n_per_mm`?"), "{message}");
}

#[test]
fn a_wrong_type_and_a_missing_section_are_placed() {
    let message = refusal(&skin_text().replace("rate_hz = 200.0", "rate_hz = \"fast\""));
    assert!(message.contains("invalid type"), "{message}");
    assert!(refusal("name = \"x\"\n").contains("missing field"));
}

#[test]
fn text_that_is_not_utf8_is_placed() {
    let error = parse(b"name = \"x\"\n# \xff", "s.toml").expect_err("not UTF-8");
    assert!(error.to_string().starts_with("s.toml:2:3: "), "{error}");
}

#[test]
fn cut_at_every_byte_never_panics() {
    let text = skin_text();
    for end in 0..text.len() {
        let _ = parse(&text.as_bytes()[..end], "s.toml");
    }
}

#[test]
fn a_missing_file_is_no_input_and_a_huge_one_bad_data() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("s.toml");
    assert_eq!(load(&path).expect_err("missing").exit_code(), exit::NO_INPUT);
    std::fs::write(&path, "#".repeat(LARGEST_SCENE_BYTES as usize + 1)).expect("write");
    assert_eq!(load(&path).expect_err("huge").exit_code(), exit::BAD_DATA);
}

#[test]
fn a_mesh_comes_from_the_scenes_folder_only() {
    let folder = tempfile::tempdir().expect("folder");
    let inside = folder.path().join("scenes");
    std::fs::create_dir(&inside).expect("folder");
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(inside.join("m.obj"), tetrahedron).expect("write");
    std::fs::write(folder.path().join("m.obj"), tetrahedron).expect("write");
    std::os::unix::fs::symlink("../m.obj", inside.join("link.obj")).expect("link");
    let path = inside.join("s.toml");
    let outside = folder.path().join("m.obj").display().to_string();
    for (name, code) in [
        ("m.obj", exit::OK),
        ("./m.obj", exit::OK),
        ("../m.obj", exit::BAD_DATA),
        (outside.as_str(), exit::BAD_DATA),
        ("link.obj", exit::BAD_DATA),
        ("", exit::BAD_DATA),
        ("none.obj", exit::NO_INPUT),
    ] {
        let mut config = presets::liver();
        if let TissueConfig::Vosm { mesh, .. } = &mut config.tissue {
            *mesh = Some(name.to_owned());
        }
        std::fs::write(&path, toml::to_string(&config).expect("representable")).expect("write");
        match load(&path) {
            Ok(scene) => assert_eq!((code, scene.mesh.map(|m| m.faces.len())), (exit::OK, Some(4)), "{name}"),
            Err(error) => assert_eq!(error.exit_code(), code, "{name}: {error}"),
        }
    }
}

#[test]
fn a_value_that_the_scene_refuses_is_placed_at_its_key() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("s.toml");
    // The same name stands in more than one section.
    for (section, key) in [("solver", "rate_hz"), ("tissue", "length_mm"), ("wound", "length_mm")] {
        let mut lines: Vec<String> = skin_text().lines().map(str::to_owned).collect();
        let head = lines.iter().position(|l| *l == format!("[{section}]")).expect("a section");
        let at = head + lines[head..].iter().position(|l| l.starts_with(key)).expect("a key of it");
        lines[at] = format!("{key} = -200.0");
        std::fs::write(&path, lines.join("\n")).expect("write");
        let scene = load(&path).expect("well-formed");
        let error = sim_core::scene::step::Scene::new(&scene.config, None).expect_err("nothing of it is negative");
        let choice = SceneArgs {
            scene: SceneChoice::File(path.clone()),
            procedure: None,
            control: None,
            capture_radius_mm: None,
        };
        let message = refused(&choice, &error).to_string();
        assert!(message.starts_with(&format!("{}:{}:1: ", path.display(), at + 1)), "{section}: {message}");
    }
}

#[test]
fn the_command_line_sets_control_and_capture_radius() {
    let choice = SceneArgs {
        scene: SceneChoice::Skin,
        procedure: Some(ProcedureChoice::LiverSurgery),
        control: Some(ControlChoice::Paper),
        capture_radius_mm: Some(9.0),
    };
    let scenes = chosen(&choice).expect("presets");
    assert_eq!(scenes.len(), 3);
    for scene in scenes {
        assert_eq!(scene.config.control.map(|c| c.mode), Some(ControlReading::Paper));
        assert_eq!(scene.config.suture.capture_radius_mm, 9.0);
    }
}

#[test]
fn edit_distance_by_hand() {
    assert_eq!(edits("kitten", "sitting"), 3);
    assert_eq!(edits("", "abc"), 3);
    assert_eq!(edits("same", "same"), 0);
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in ".{0,200}") {
        let _ = parse(text.as_bytes(), "s.toml");
    }
}
