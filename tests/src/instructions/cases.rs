//! Names of the cases, and what each steps.
//!
//! | case | one step |
//! |---|---|
//! | `MESH/SCENE/full/PARTS` | of the scene with these optional stages, none or joined by `+` |
//! | `MESH/SCENE/bare/PARTS` | of the same in a build without optional stages |
//! | `MESH/SCENE/holding` | of the scene without optional stages while the hand holds a point, and its port |
//! | `MESH/SCENE/sweep` | the spring forces alone, once |
//! | `MESH/SCENE/outer` | of the network without inner layers |
//! | `MESH/SCENE/INTEGRATOR` | of the tissue alone by that integrator |
//! | `servo/recording`, `servo/silent`, `servo/without` | a tick: recording, not recording, in a build that cannot |

use super::{Step, bare, full, solver_cases, tick_cases};
use sim_core::tissue::integrator::Integrator;

/// The scenes by name.
pub const SCENES: [&str; 3] = ["skin", "liver", "vessel"];
/// Meshes of a few hundred nodes; any other word is the preset's own.
pub const COARSE: &str = "coarse";

/// Optional stages of a scene: `attachments`, `contact`, `line`, `control`, `sleep`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts(String);

/// What the hand does while steps count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hand {
    /// Nothing.
    Away,
    /// Holds a suture point.
    Holds,
}

impl Parts {
    /// These parts.
    #[must_use]
    pub fn new(text: &str) -> Self {
        Self(text.to_owned())
    }

    /// Whether a part is among them.
    #[must_use]
    pub fn has(&self, part: &str) -> bool {
        self.0.split('+').any(|own| own == part)
    }

    fn check(&self) -> Result<(), String> {
        let known = ["none", "attachments", "contact", "line", "control", "sleep"];
        match self.0.split('+').find(|own| !known.contains(own)) {
            Some(own) => Err(format!("there is no part {own}; take of {}", known.join(", "))),
            None => Ok(()),
        }
    }
}

/// A case of a scene on its coarse mesh.
#[must_use]
pub fn coarse(scene: &str, work: &str) -> String {
    format!("{COARSE}/{scene}/{work}")
}

/// Prepares a case.
///
/// # Errors
/// What is wrong with its name, or why its scene is refused.
pub fn prepare(case: &str) -> Result<Step, String> {
    let words: Vec<&str> = case.split('/').collect();
    let none = Parts::new("none");
    match words[..] {
        ["servo", kind] => tick_cases::prepare(kind),
        [mesh, scene, build @ ("full" | "bare"), parts] => {
            let parts = Parts::new(parts);
            parts.check()?;
            match build {
                "full" => full::scene_steps::prepare(scene, mesh, &parts, Hand::Away),
                _ => bare::scene_steps::prepare(scene, mesh, &parts, Hand::Away),
            }
        }
        [mesh, scene, "holding"] => full::scene_steps::prepare(scene, mesh, &none, Hand::Holds),
        [mesh, scene, "sweep"] => solver_cases::sweep(scene, mesh),
        [mesh, scene, "outer"] => solver_cases::outer(scene, mesh),
        [mesh, scene, name] => match Integrator::ALL.into_iter().find(|i| i.name() == name) {
            Some(integrator) => solver_cases::tissue(scene, mesh, integrator),
            None => Err(format!("there is no work {name}")),
        },
        _ => Err("a case is MESH/SCENE/WORK, MESH/SCENE/BUILD/PARTS or servo/KIND".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_say_nothing_are_refused() {
        for bad in ["", "skin", "coarse/lung/full/none", "coarse/skin/full/lines", "coarse/skin/rk4", "servo/loud"] {
            assert!(prepare(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_build_without_stages_refuses_a_scene_that_has_them() {
        for part in ["attachments", "line", "sleep"] {
            let refusal = prepare(&coarse("skin", &format!("bare/{part}"))).err().unwrap_or_default();
            assert!(refusal.contains("this build leaves out"), "{part}: {refusal}");
        }
    }

    #[test]
    fn parts_are_told_apart() {
        let parts = Parts::new("attachments+line");
        assert!(parts.has("line") && parts.has("attachments") && !parts.has("control"));
    }
}
