//! `scene check`: builds the scene of a file as the solver would and says what it holds, or why it is refused.

use super::choice::SceneChoice;
use super::{Format, SceneArgs};
use crate::error::ServerError;
use crate::scene_file;
use serde_json::json;
use sim_core::scene::config::TissueConfig;
use sim_core::scene::step::Scene;
use std::path::Path;

/// Loads a scene file with its mesh, builds it, and says what would be simulated.
pub(crate) fn scene_check(file: &Path, format: Format) -> Result<String, ServerError> {
    let source = scene_file::load(file)?;
    let choice = SceneArgs {
        scene: SceneChoice::File(file.to_owned()),
        procedure: None,
        control: None,
        capture_radius_mm: None,
    };
    let scene = Scene::new(&source.config, source.mesh.as_ref()).map_err(|e| scene_file::refused(&choice, &e))?;
    let config = &source.config;
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
    let network = &scene.tissue().network;
    let (nodes, springs) = (network.node_count(), network.springs.len());
    let stability = scene.solver().stability();
    let integrator = stability.integrator.name();
    let pairs = scene.tissue().pairs.len();
    Ok(match format {
        Format::Json => {
            let document = json!({
                "name": config.name, "model": model, "nodes": nodes, "springs": springs, "pairs": pairs,
                "rate_hz": config.solver.rate_hz, "integrator": integrator, "substeps": stability.substeps,
                "stability_number": stability.number, "stages": present, "integrator_reason": scene.solver().integrator_reason(),
            });
            format!("{document}\n")
        }
        Format::Text => format!(
            "{}: {model}, {nodes} nodes, {springs} springs, {pairs} suture pairs; {} Hz, {integrator}, {} sub-steps, \
             S = {:.4}; stages: {}\n{}\n",
            config.name,
            config.solver.rate_hz,
            stability.substeps,
            stability.number,
            if present.is_empty() { "none".to_owned() } else { present.join(", ") },
            scene.solver().integrator_reason()
        ),
    })
}
