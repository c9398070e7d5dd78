//! Absent stages cost nothing: a scene without a stage against a build without it.
//!
//! One comparison per scene holds for every optional stage at once: the scene has none of them, and the other build
//! has the code of none. The recording is compared on the servo's tick. That the comparison can fail is shown by
//! the same count with the stage present.

use super::cases::{SCENES, coarse};

/// Largest difference, as a share of the step.
pub const ABSENCE_TOLERANCE: f64 = 1e-3;

/// Two cases that shall cost the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Absence {
    /// Scene, or `servo`.
    pub scene: &'static str,
    /// Present in the program, absent in the scene.
    pub without: String,
    /// Absent in the program.
    pub bare: String,
    /// Present in both: costs more.
    pub present: Vec<String>,
}

/// The comparisons.
#[must_use]
pub fn absences() -> Vec<Absence> {
    let scene = |scene: &'static str| Absence {
        scene,
        without: coarse(scene, "full/none"),
        bare: coarse(scene, "bare/none"),
        present: ["attachments", "line", "contact"].map(|part| coarse(scene, &format!("full/{part}"))).to_vec(),
    };
    let servo = Absence {
        scene: "servo",
        without: "servo/silent".to_owned(),
        bare: "servo/without".to_owned(),
        present: vec!["servo/recording".to_owned()],
    };
    SCENES.into_iter().map(scene).chain([servo]).collect()
}

impl Absence {
    /// All its cases.
    pub fn cases(&self) -> impl Iterator<Item = &String> {
        [&self.without, &self.bare].into_iter().chain(&self.present)
    }

    /// Difference of two counts as a share of the second.
    #[must_use]
    pub fn share(without: f64, bare: f64) -> f64 {
        (without - bare) / bare
    }
}
