//! Scenes stepped by sim-core's source with every optional stage left out at compile time.

use bare_core as core;

#[expect(clippy::duplicate_mod, reason = "the same script for the same source built without its optional stages")]
#[path = "../scene_steps.rs"]
pub(super) mod scene_steps;
