//! One scene, stepped. This file is compiled twice, for `super::core` = sim-core and for the same source without its
//! optional stages, so that both run the same script.
//!
//! At load stitches are tied where there is a line (pairs 1 and 2), and the hand takes and releases the left point of
//! pair 0, which engages its attachments. While steps count the hand is away, or still holds that point and the scene
//! measures its port.

use super::core::scene::config::{SceneConfig, TissueConfig};
use super::core::scene::presets;
use super::core::scene::sleep::SleepReading;
use super::core::scene::step::{Scene, ServoInput};
use super::core::scene::stitching::TiedStitch;
use super::core::scene::suturing::HandInput;
use super::core::wound::ledger::StitchHistory;
use crate::instructions::Step;
use crate::instructions::cases::{COARSE, Hand, Parts};
use std::hint::black_box;

/// Rest length of a tied loop as a share of the open distance: the stitch pulls.
const TIED_SHARE: f64 = 0.8;

/// The preset of a name, on a mesh, with no other stages than these.
pub(in crate::instructions) fn config(name: &str, mesh: &str, parts: &Parts) -> Option<SceneConfig> {
    let mut config = presets::by_name(name)?;
    if mesh == COARSE {
        match &mut config.tissue {
            TissueConfig::Utsm { spacing_mm, .. } => *spacing_mm = 3.0,
            TissueConfig::Vosm { subdivisions, .. } => *subdivisions = 3,
            TissueConfig::Ttsm { around, along, layers, .. } => (*around, *along, *layers) = (10, 14, 2),
        }
        config.suture.patch_radius_mm *= 1.3;
    }
    config.attachment = config.attachment.filter(|_| parts.has("attachments"));
    config.line = config.line.filter(|_| parts.has("line"));
    config.control = config.control.filter(|_| parts.has("control"));
    if parts.has("sleep") {
        config.solver.sleep = SleepReading::On;
    }
    if !parts.has("contact") {
        config.wound.contact_stiffness_n_per_mm = None;
    }
    Some(config)
}

/// The scene after the script, and what the hand does from then on.
pub(in crate::instructions) fn sutured(
    config: &SceneConfig,
    hand: Hand,
) -> Result<(Scene, Option<ServoInput>), String> {
    let mut scene = Scene::new(config, None).map_err(|e| e.to_string())?;
    if config.line.is_some() {
        let places = scene.places().to_vec();
        let stitch = |pair: usize| TiedStitch {
            pair,
            left_original_m: places[pair].left_m,
            right_original_m: places[pair].right_m,
            rest_length_m: places[pair].distance_m() * TIED_SHARE,
            slipped_m: 0.0,
            history: StitchHistory::default(),
        };
        scene.resume(&[stitch(1), stitch(2)]).map_err(|e| e.to_string())?;
    }
    let at = scene.places().first().ok_or("the scene has no suture pair")?.left_m;
    let input = |press_count, release_count| ServoInput {
        hand: HandInput { position_m: at, press_count, release_count },
        port_epoch: scene.grips().epoch(),
        second: None,
        handles_m: [None; _],
    };
    let (still, pressed, released) = (input(0, 0), input(1, 0), input(1, 1));
    scene.step(Some(&still));
    scene.step(Some(&pressed));
    if hand == Hand::Holds {
        return Ok((scene, Some(pressed)));
    }
    scene.step(Some(&released));
    Ok((scene, None))
}

/// The scene as a case.
pub(in crate::instructions) fn prepare(name: &str, mesh: &str, parts: &Parts, hand: Hand) -> Result<Step, String> {
    let config = config(name, mesh, parts).ok_or_else(|| format!("there is no scene {name}"))?;
    let (mut scene, input) = sutured(&config, hand)?;
    Ok(Box::new(move || {
        black_box(scene.step(input.as_ref()));
        let grip = scene.grips().iter().next().copied();
        if let Some(grip) = grip {
            black_box(scene.port(&grip));
        }
    }))
}
