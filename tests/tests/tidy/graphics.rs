//! Who leaves the viewer out compiles no graphics: nothing else in the workspace reaches a graphics crate.
//!
//! Read from `Cargo.lock`, which names every dependency of every package, also those for tests, other systems and options.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Members that may draw.
const DRAWING: [&str; 2] = ["viewer-client", "viewer-tests"];
/// What a package that draws cannot do without.
const GRAPHICS: [&str; 8] = ["wgpu", "wgpu-core", "wgpu-hal", "naga", "winit", "egui", "egui-winit", "egui-wgpu"];

/// Packages of a lock file with their dependencies by name.
fn dependencies(lock: &str) -> BTreeMap<String, BTreeSet<String>> {
    let lock: toml::Table = lock.parse().expect("cargo writes TOML");
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let packages = lock.get("package").and_then(toml::Value::as_array).into_iter().flatten();
    for package in packages.filter_map(toml::Value::as_table) {
        let text = |value: &toml::Value| value.as_str().map(str::to_owned);
        let Some(name) = package.get("name").and_then(text) else { continue };
        let of = package.get("dependencies").and_then(toml::Value::as_array).into_iter().flatten().filter_map(text);
        // A name with more than one version is followed by its version; two versions count as one package here.
        let names = of.filter_map(|entry| entry.split(' ').next().map(str::to_owned));
        all.entry(name).or_default().extend(names);
    }
    all
}

/// Graphics crates that a member reaches.
fn reached(all: &BTreeMap<String, BTreeSet<String>>, member: &str) -> Vec<String> {
    let (mut seen, mut open) = (BTreeSet::from([member]), vec![member]);
    while let Some(name) = open.pop() {
        let next = all.get(name).into_iter().flatten().map(String::as_str);
        open.extend(next.filter(|other| seen.insert(other)));
    }
    seen.into_iter().filter(|name| GRAPHICS.contains(name)).map(str::to_owned).collect()
}

/// Names of the members, from their manifests.
fn members() -> Vec<String> {
    let manifests = crate::source::tracked_files().into_iter().filter(|f| f.path.ends_with("/Cargo.toml"));
    let name = |text: &str| {
        let manifest: toml::Table = text.parse().ok()?;
        Some(manifest.get("package")?.get("name")?.as_str()?.to_owned())
    };
    manifests.filter_map(|f| name(&f.text)).collect()
}

#[test]
fn only_the_viewer_and_its_tests_reach_a_graphics_crate() {
    let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.lock");
    let all = dependencies(&std::fs::read_to_string(lock).expect("the workspace keeps its lock file"));
    let members = members();
    assert!(members.len() >= 8, "{members:?}");
    for member in &members {
        assert!(all.contains_key(member), "{member} is not in Cargo.lock");
        let graphics = reached(&all, member);
        if DRAWING.contains(&member.as_str()) {
            assert!(!graphics.is_empty(), "{member} draws nothing: is this check still about the right crates?");
        } else {
            assert!(graphics.is_empty(), "{member} reaches {graphics:?}; only {DRAWING:?} may draw");
        }
    }
}

#[test]
fn a_graphics_crate_behind_another_is_found() {
    let lock = "[[package]]\nname = \"a\"\ndependencies = [\"b 1.0.0\"]\n[[package]]\nname = \"b\"\nversion = \"1.0.0\"\n\
                dependencies = [\"a\", \"winit\"]\n[[package]]\nname = \"c\"\n";
    let all = dependencies(lock);
    assert_eq!(reached(&all, "a"), ["winit"]);
    assert!(reached(&all, "c").is_empty());
}
