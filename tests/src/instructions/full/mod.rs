//! Scenes stepped by sim-core as it is built for use.

use sim_core as core;

#[path = "../scene_steps.rs"]
pub(super) mod scene_steps;
