//! `scene check`: what a file holds, or why it cannot be used.

use super::Format;
use crate::error::ServerError;
use crate::scene_file;
use serde_json::json;
use sim_core::scene::config::TissueConfig;
use std::path::Path;

/// Loads a scene file with its mesh and says what would be simulated.
pub(super) fn scene_check(file: &Path, format: Format) -> Result<String, ServerError> {
    let scene = scene_file::load(file)?;
    let config = &scene.config;
    let model = match config.tissue {
        TissueConfig::Utsm { .. } => "utsm",
        TissueConfig::Vosm { .. } => "vosm",
        TissueConfig::Ttsm { .. } => "ttsm",
    };
    let stages = [
        ("attachment", config.attachment.is_some()),
        ("line", config.line.is_some()),
        ("control", config.control.is_some()),
    ];
    let present: Vec<&str> = stages.iter().filter(|s| s.1).map(|s| s.0).collect();
    let mesh = scene.mesh.as_ref().map(|m| (m.vertices_m.len(), m.faces.len()));
    Ok(match format {
        Format::Json => {
            let mesh = mesh.map(|(vertices, triangles)| json!({ "vertices": vertices, "triangles": triangles }));
            let document = json!({ "name": config.name, "model": model, "pairs": config.suture.pairs,
                "rate_hz": config.solver.rate_hz, "stages": present, "mesh": mesh });
            format!("{document}\n")
        }
        Format::Text => {
            let mesh = mesh.map_or(String::new(), |(v, t)| format!(", mesh of {v} vertices and {t} triangles"));
            format!(
                "{}: {model}{mesh}, {} suture pairs, {} Hz, stages: {}\n",
                config.name,
                config.suture.pairs,
                config.solver.rate_hz,
                if present.is_empty() { "none".to_owned() } else { present.join(", ") }
            )
        }
    })
}
