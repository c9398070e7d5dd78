//! sim-core is a function of its inputs; its kinematics touch no heap; unsafe has few rooms.

use crate::scan::words;
use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

/// What sim-core must not name: clocks, files, sockets, environment, processes, threads, chance.
const IMPURE: [&str; 16] = [
    "std::time",
    "std::fs",
    "std::net",
    "std::env",
    "std::process",
    "std::thread",
    "std::io",
    "Instant",
    "SystemTime",
    "HashMap",
    "HashSet",
    "rand::",
    "thread_local!",
    "println!",
    "eprintln!",
    "static mut",
];

/// What kinematics must not name.
const HEAP: [&str; 15] = [
    "Vec<",
    "Vec::",
    "vec!",
    "Box<",
    "Box::",
    "Rc<",
    "Arc<",
    "String",
    "format!",
    "to_vec",
    "to_owned",
    "to_string",
    "collect",
    "DVector",
    "DMatrix",
];

/// Files (or beginnings of file paths) that may hold unsafe code; the two of OpenHaptics are the edges of a C interface:
/// the driver calls a vendor's library, and the virtual device exports the same names. The plain kernels are C functions.
const UNSAFE_ROOMS: [&str; 8] = [
    "haptic-server/src/realtime.rs",
    "haptic-server/src/crash",
    "haptic-server/src/device/openhaptics/ffi.rs",
    "tests/virtual-omni/src/abi",
    "haptic-server/src/device/firewire/ioctl.rs",
    "tests/plain-kernels/src/lib.rs",
    "tests/tests/realtime/allocator.rs",
    "tests/viewer/tests/steady/allocator.rs",
];

fn named<'a>(file: &'a SourceFile, names: &'a [&'a str], why: &'a str) -> impl Iterator<Item = String> + 'a {
    names.iter().flat_map(move |name| {
        words(&file.product, name).map(move |at| format!("{}: names {name}; {why}", file.place(at)))
    })
}

fn impurity_findings(files: &[SourceFile]) -> Vec<String> {
    let why = "sim-core is pure: pass the value in, or do it in haptic-server";
    files.iter().filter(|f| f.path.starts_with("sim-core/src/")).flat_map(|f| named(f, &IMPURE, why)).collect()
}

fn heap_findings(files: &[SourceFile]) -> Vec<String> {
    let why = "kinematics may run at 1 kHz: take a slice or a fixed array";
    files.iter().filter(|f| f.path.starts_with("sim-core/src/kinematics")).flat_map(|f| named(f, &HEAP, why)).collect()
}

fn unsafe_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|f| f.is_rust()) {
        let room = UNSAFE_ROOMS.iter().any(|room| file.path.starts_with(room));
        for at in words(&file.code, "unsafe") {
            let line = file.text[..at].bytes().filter(|b| *b == b'\n').count();
            let reasoned = file.text.lines().skip(line.saturating_sub(4)).take(5).any(|l| l.contains("SAFETY:"));
            if !room {
                findings.push(format!(
                    "{}: unsafe outside the rooms that may hold it; use rustix or move it",
                    file.place(at)
                ));
            } else if !reasoned {
                findings.push(format!("{}: unsafe without `// SAFETY:` just above", file.place(at)));
            }
        }
    }
    findings
}

#[test]
fn sim_core_has_no_clock_no_io_and_no_chance() {
    assert_clean(impurity_findings);
    assert_discerns(
        impurity_findings,
        &[
            ("sim-core/src/a.rs", "use std::time::Duration;"),
            ("sim-core/src/a.rs", "fn f() { let x = std::env::var(\"A\"); }"),
            ("sim-core/src/a.rs", "use std::collections::HashMap;"),
        ],
        &[("sim-core/src/a.rs", "// std::time\nfn f() {}\n#[cfg(test)]\nmod tests { use std::fs; }")],
    );
}

#[test]
fn kinematics_names_no_heap_type() {
    assert_clean(heap_findings);
    assert_discerns(
        heap_findings,
        &[
            ("sim-core/src/kinematics/a.rs", "fn f(x: &Vec<f64>) {}"),
            ("sim-core/src/kinematics/a.rs", "fn f(x: &[f64]) { x.to_vec(); }"),
            ("sim-core/src/kinematics/a.rs", "fn f(x: &[f64]) { let y = x.iter().collect(); }"),
        ],
        &[("sim-core/src/kinematics/a.rs", "fn f(x: &[Vec3]) {}\n#[cfg(test)]\nmod tests { fn g() { vec![1]; } }")],
    );
}

#[test]
fn unsafe_code_stays_in_its_rooms() {
    assert_clean(unsafe_findings);
    assert_discerns(
        unsafe_findings,
        &[
            ("protocol/src/a.rs", "// SAFETY: none\nunsafe { f() }"),
            ("haptic-server/src/realtime.rs", "fn f() { unsafe { g() } }"),
        ],
        &[
            ("haptic-server/src/realtime.rs", "// SAFETY: the pointer is ours.\nunsafe { f() }"),
            ("protocol/src/a.rs", "#![forbid(unsafe_code)] // unsafe"),
        ],
    );
}
