//! Which module may name which: the column of sim-core, the two rooms of haptic-server, the wire.
//!
//! sim-core: `scene → wound → suture_line → tissue → kinematics → finite, units, vector`; a module
//! names only itself and what stands to its right. `servo` and `solver` never name each other.
//! `iceoryx2` and the service names stand in `protocol` only.

use crate::scan::{word_at, words};
use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

/// sim-core from the ground up; modules of one row may name each other.
const COLUMN: [&[&str]; 6] =
    [&["absent", "finite", "units", "vector"], &["kinematics"], &["tissue"], &["suture_line"], &["wound"], &["scene"]];

/// What each crate's source must not name.
const FOREIGN: [(&str, &[&str]); 3] = [
    ("protocol/src/", &["sim_core", "haptic_server", "viewer_client"]),
    ("sim-core/src/", &["protocol::", "haptic_server", "viewer_client", "iceoryx2"]),
    ("viewer-client/src/", &["sim_core", "haptic_server", "iceoryx2"]),
];

fn floor(module: &str) -> Option<usize> {
    COLUMN.iter().position(|row| row.contains(&module))
}

/// Names that follow `crate::` or a chain of `super::` that reaches the crate root, with offsets.
fn crate_references(code: &str, module_depth: usize) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let to_root = "super::".repeat(module_depth.max(1));
    for prefix in ["crate::", to_root.as_str()] {
        for at in words(code, prefix) {
            let start = at + prefix.len();
            if code[..at].ends_with("super::") || code[start..].starts_with("super::") {
                continue;
            }
            if code[start..].starts_with('{') {
                found.extend(group_heads(code, start + 1));
            } else {
                found.push((start, word_at(code, start)));
            }
        }
    }
    found
}

/// First name of each entry of a `{a::b, c}` group that opens before `from`.
fn group_heads(code: &str, from: usize) -> Vec<(usize, &str)> {
    let (mut heads, mut depth, mut fresh) = (Vec::new(), 1, true);
    for (i, byte) in code.bytes().enumerate().skip(from) {
        match byte {
            b'{' => depth += 1,
            b'}' => depth -= 1,
            b',' if depth == 1 => fresh = true,
            _ if byte.is_ascii_whitespace() => {}
            _ if fresh => {
                heads.push((i, word_at(code, i)));
                fresh = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    heads
}

fn column_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.is_rust()) {
        let Some(inside) = file.path.strip_prefix("sim-core/src/") else { continue };
        let parts: Vec<&str> = inside.trim_end_matches(".rs").split('/').collect();
        if parts[0] == "lib" {
            continue;
        }
        let Some(own) = floor(parts[0]) else {
            findings
                .push(format!("{}: module {} has no floor; give it one in COLUMN of this test", file.path, parts[0]));
            continue;
        };
        let depth = parts.iter().filter(|p| **p != "mod").count();
        for (at, name) in crate_references(&file.product, depth) {
            if floor(name).is_some_and(|other| other > own) {
                findings.push(format!(
                    "{}: {} names the upper floor {name}; move the shared part down or pass it in as an argument",
                    file.place(at),
                    parts[0]
                ));
            }
        }
    }
    findings
}

fn room_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for (own, other) in [("servo", "solver"), ("solver", "servo")] {
        let folder = format!("haptic-server/src/{own}");
        for file in files.iter().filter(|f| f.is_rust() && f.path.starts_with(&folder)) {
            let depth = file.path["haptic-server/src/".len()..].split('/').filter(|p| *p != "mod.rs").count();
            for (at, name) in crate_references(&file.product, depth) {
                if name == other {
                    findings.push(format!(
                        "{}: {own} names {other}; let the two meet in protocol, sim-core or lockstep only",
                        file.place(at)
                    ));
                }
            }
        }
    }
    findings
}

fn foreign_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.is_rust()) {
        for (_, names) in FOREIGN.iter().filter(|(folder, _)| file.path.starts_with(folder)) {
            for name in *names {
                findings.extend(words(&file.code, name).map(|at| {
                    format!(
                        "{}: names {name}; this crate must not know it (docs/ARCHITECTURE.md, folders)",
                        file.place(at)
                    )
                }));
            }
        }
    }
    findings
}

fn wire_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files
        .iter()
        .filter(|f| f.is_rust() && !f.path.starts_with("protocol/") && !f.path.starts_with("tests/tests/tidy/"))
    {
        for name in ["iceoryx2", "ServiceName", "service_builder", "ipc::Service"] {
            findings.extend(words(&file.code, name).map(|at| {
                format!(
                    "{}: names {name}; ports and service names belong to protocol/src (add a port there)",
                    file.place(at)
                )
            }));
        }
    }
    findings
}

#[test]
fn sim_core_is_one_column() {
    assert_clean(column_findings);
    assert_discerns(
        column_findings,
        &[
            ("sim-core/src/tissue/a.rs", "use crate::wound::Ledger;"),
            ("sim-core/src/kinematics/a.rs", "use crate::{vector::Vec3, tissue::network};"),
            ("sim-core/src/kinematics/a.rs", "fn f(x: super::super::scene::Plan) {}"),
            ("sim-core/src/helpers.rs", "fn f() {}"),
        ],
        &[
            ("sim-core/src/wound/a.rs", "use crate::{vector::Vec3, tissue::network};\nuse super::ledger::Row;"),
            ("sim-core/src/tissue/a.rs", "// crate::wound\nfn f() {}\n#[cfg(test)]\nmod tests { use crate::wound; }"),
        ],
    );
}

#[test]
fn servo_and_solver_never_name_each_other() {
    assert_clean(room_findings);
    assert_discerns(
        room_findings,
        &[
            ("haptic-server/src/servo/tick.rs", "use crate::solver::Step;"),
            ("haptic-server/src/solver/mod.rs", "use super::{servo::Tick, config};"),
        ],
        &[("haptic-server/src/servo/tick.rs", "use crate::config::ServoConfig;\n/// not crate::solver\nfn f() {}")],
    );
}

#[test]
fn no_crate_names_one_that_it_must_not_know() {
    assert_clean(foreign_findings);
    assert_discerns(
        foreign_findings,
        &[
            ("viewer-client/src/lib.rs", "use sim_core::vector::Vec3;"),
            ("protocol/src/a.rs", "fn f(x: sim_core::units::Metres) {}"),
            ("sim-core/src/lib.rs", "use protocol::wire;"),
        ],
        &[("viewer-client/src/lib.rs", "use protocol::wire; // sim_core")],
    );
}

#[test]
fn shared_memory_and_service_names_stand_in_protocol_only() {
    assert_clean(wire_findings);
    assert_discerns(
        wire_findings,
        &[("haptic-server/src/servo/bridge.rs", "use iceoryx2::prelude::*;")],
        &[("protocol/src/ports.rs", "use iceoryx2::prelude::*;"), ("haptic-server/src/a.rs", "// iceoryx2\nfn f() {}")],
    );
}
