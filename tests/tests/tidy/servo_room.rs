//! The 1 kHz room: its lint wall stands, nothing in it panics, and a force leaves by one door.

use crate::scan::words;
use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

const SERVO: &str = "haptic-server/src/servo/";

/// The only file that turns a wanted force into a command.
const DOOR: &str = "haptic-server/src/servo/safety";

/// What a device may send without the door.
const ZERO_FORCE: &str = "force_n: Vec3::zeros()";

/// Lints of the wall, denied at the top of the servo module.
const WALL: [&str; 3] = ["clippy::disallowed_methods", "clippy::disallowed_types", "clippy::disallowed_macros"];

fn door_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.path.starts_with("haptic-server/src/") && !f.path.starts_with(DOOR)) {
        for at in words(&file.product, "DeviceCommand {") {
            let before = file.product[..at].trim_end();
            let names_it = before.ends_with("struct")
                || before.ends_with("->")
                || before.ends_with("for")
                || before.ends_with("impl");
            let inside = file.product[at + "DeviceCommand {".len()..].trim_start();
            let takes_apart = before.ends_with("let");
            if !names_it && !takes_apart && !inside.starts_with(ZERO_FORCE) {
                let place = file.place(at);
                findings
                    .push(format!("{place}: a force is made outside servo/safety; pass it through the safety stage"));
            }
        }
    }
    findings
}

fn panic_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.path.starts_with(SERVO)) {
        for name in [".unwrap()", ".expect(", "panic!", "unreachable!", "todo!"] {
            findings.extend(
                words(&file.product, name).map(|at| {
                    format!("{}: {name} in the servo room; answer with a fault or a default", file.place(at))
                }),
            );
        }
    }
    findings
}

fn wall_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files {
        if file.path == "haptic-server/src/servo/mod.rs" {
            let missing = WALL.iter().filter(|lint| !denies(&file.code, lint));
            findings.extend(missing.map(|lint| format!("{}: does not deny {lint}", file.path)));
        }
        if file.path == "clippy.toml" {
            findings.extend(wall_entry_findings(file));
        }
    }
    findings
}

/// Whether `lint` stands in a `#![deny(…)]`.
fn denies(code: &str, lint: &str) -> bool {
    code.match_indices("#![deny(").any(|(at, _)| code[at..].split(']').next().is_some_and(|block| block.contains(lint)))
}

fn wall_entry_findings(file: &SourceFile) -> Vec<String> {
    let table: toml::Table = match file.text.parse() {
        Ok(table) => table,
        Err(error) => return vec![format!("{}: {error}", file.path)],
    };
    let mut findings = Vec::new();
    for key in ["disallowed-methods", "disallowed-types", "disallowed-macros"] {
        let entries = table.get(key).and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
        if entries.is_empty() {
            findings.push(format!("{}: {key} is empty; the servo's wall needs its entries", file.path));
        }
        let bare = entries.iter().filter(|e| e.get("path").is_none() || e.get("reason").is_none());
        findings.extend(bare.map(|e| format!("{}: {key}: {e} has no reason", file.path)));
    }
    findings
}

#[test]
fn a_force_leaves_through_safety_only() {
    assert_clean(door_findings);
    assert_discerns(
        door_findings,
        &[
            ("haptic-server/src/servo/tick.rs", "fn f() -> DeviceCommand { DeviceCommand { force_n: wanted } }"),
            ("haptic-server/src/device/hid.rs", "send(DeviceCommand { force_n });"),
        ],
        &[
            ("haptic-server/src/servo/safety.rs", "fn f() -> DeviceCommand { DeviceCommand { force_n } }"),
            (
                "haptic-server/src/device/mod.rs",
                "pub struct DeviceCommand { a: u8 }\nfn f() { c(DeviceCommand { force_n: Vec3::zeros() }) }",
            ),
        ],
    );
}

#[test]
fn the_servo_room_does_not_panic() {
    assert_clean(panic_findings);
    assert_discerns(
        panic_findings,
        &[
            ("haptic-server/src/servo/tick.rs", "fn f() { x.unwrap(); }"),
            ("haptic-server/src/servo/a.rs", "fn f() { panic!() }"),
        ],
        &[
            (
                "haptic-server/src/servo/tick.rs",
                "fn f() { x.unwrap_or_default(); }\n#[cfg(test)]\nmod tests { fn g() { x.unwrap(); } }",
            ),
            ("haptic-server/src/config.rs", "fn f() { x.expect(1); }"),
        ],
    );
}

#[test]
fn the_lint_wall_stands() {
    assert_clean(wall_findings);
    let entry = "[{ path = \"a\", reason = \"b\" }]";
    let whole = format!("disallowed-methods = {entry}\ndisallowed-types = {entry}\ndisallowed-macros = {entry}\n");
    assert_discerns(
        wall_findings,
        &[
            ("haptic-server/src/servo/mod.rs", "//! Head.\n#![deny(clippy::disallowed_methods)]"),
            ("clippy.toml", "allow-unwrap-in-tests = true"),
            ("clippy.toml", &whole.replace(", reason = \"b\"", "")),
        ],
        &[
            (
                "haptic-server/src/servo/mod.rs",
                "#![deny(\n    clippy::disallowed_methods,\n    clippy::disallowed_types,\n    clippy::disallowed_macros\n)]",
            ),
            ("clippy.toml", &whole),
        ],
    );
}
