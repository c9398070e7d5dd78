//! Dependency directions as the `Cargo.toml` files state them, and the shape of the workspace.
//!
//! haptic-server → sim-core, protocol · viewer-client → protocol · tests → all ·
//! no edge between protocol and sim-core.

use crate::source::SourceFile;
use crate::{assert_clean, assert_discerns};

/// Each member and the members that it may depend on.
const EDGES: [(&str, &[&str]); 9] = [
    ("protocol", &[]),
    ("sim-core", &[]),
    ("haptic-server", &["protocol", "sim-core"]),
    ("viewer-client", &["protocol"]),
    ("tests", &["protocol", "sim-core", "haptic-server", "bare-core", "plain-kernels", "virtual-omni"]),
    ("tests/bare-core", &[]),
    ("tests/plain-kernels", &["sim-core"]),
    ("tests/viewer", &["protocol", "viewer-client"]),
    ("tests/virtual-omni", &["protocol", "sim-core", "haptic-server"]),
];

/// Crates that only one member may name.
const OWNED: [(&str, &str); 2] = [("iceoryx2", "protocol"), ("mcap", "protocol")];

/// Keys of all dependency tables of a manifest.
fn dependencies(manifest: &toml::Table) -> Vec<&str> {
    ["dependencies", "dev-dependencies", "build-dependencies"]
        .iter()
        .filter_map(|table| manifest.get(*table)?.as_table())
        .flat_map(|table| table.keys().map(String::as_str))
        .collect()
}

fn edge_findings(files: &[SourceFile]) -> Vec<String> {
    let mut findings = Vec::new();
    for file in files {
        let Some(member) = file.path.strip_suffix("/Cargo.toml") else { continue };
        let Some((_, allowed)) = EDGES.iter().find(|(name, _)| *name == member) else {
            findings.push(format!("{}: a member that the house does not know; the top level is fixed", file.path));
            continue;
        };
        let manifest: toml::Table = match file.text.parse() {
            Ok(manifest) => manifest,
            Err(error) => {
                findings.push(format!("{}: {error}", file.path));
                continue;
            }
        };
        for name in dependencies(&manifest) {
            if EDGES.iter().any(|(other, _)| *other == name) && !allowed.contains(&name) {
                findings.push(format!("{}: must not depend on {name} (docs/ARCHITECTURE.md, folders)", file.path));
            }
            if OWNED.iter().any(|(crate_name, owner)| *crate_name == name && *owner != member) {
                findings.push(format!("{}: {name} belongs to another member; use what that member offers", file.path));
            }
        }
        for (table, key) in [("lints", "workspace"), ("package", "license")] {
            if manifest.get(table).and_then(|t| t.get(key)).is_none() {
                findings.push(format!("{}: [{table}] has no {key}; take it from the workspace", file.path));
            }
        }
    }
    findings
}

#[test]
fn dependencies_point_one_way() {
    assert_clean(edge_findings);
    let tail = "\n[package]\nlicense.workspace = true\n[lints]\nworkspace = true\n";
    let with = |table: &str| format!("{table}{tail}");
    assert_discerns(
        edge_findings,
        &[
            ("viewer-client/Cargo.toml", &with("[dependencies]\nsim-core.workspace = true")),
            ("protocol/Cargo.toml", &with("[dev-dependencies]\nsim-core = { path = \"../sim-core\" }")),
            ("sim-core/Cargo.toml", &with("[dependencies]\nprotocol.workspace = true")),
            ("haptic-server/Cargo.toml", &with("[dependencies]\niceoryx2.workspace = true")),
            ("extras/Cargo.toml", &with("")),
            ("protocol/Cargo.toml", "[package]\nlicense.workspace = true"),
        ],
        &[("haptic-server/Cargo.toml", &with("[dependencies]\nprotocol.workspace = true\nsim-core.workspace = true"))],
    );
}

#[test]
fn every_member_has_its_manifest() {
    let files = crate::source::tracked_files();
    for (member, _) in EDGES {
        let path = format!("{member}/Cargo.toml");
        assert!(files.iter().any(|f| f.path == path), "{path} is missing; the top level is fixed");
    }
}
