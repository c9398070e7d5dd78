//! Absent stages cost nothing: a scene without a stage against a build without it.
//!
//! One comparison covers all five stages together (attachments, line, control, inner layers, sleep), on the skin, under
//! the semi-implicit integrator: the scene has none of them here, and the other build has the code of none. (`--features bare-core/inner-layers` lets that build take liver and vessel, any
//! other feature of `bare-core` singles out what is left.) The recording is compared on the servo's tick. That a
//! comparison can fail is shown by the same count with the stage present, against the count that lacks this stage alone;
//! for control on the coarse mesh, since its 232 instructions are 0.1 % of a step of the preset, no more than the tolerance.

use super::cases::coarse;

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
    /// Present, beside the case that lacks only this: costs something else, more or, asleep, less.
    pub present: Vec<[String; 2]>,
}

/// The comparisons.
#[must_use]
pub fn absences() -> Vec<Absence> {
    let preset = |work: &str| format!("preset/skin/{work}");
    let stages = [("attachments", "none"), ("line", "none"), ("sleep", "none")];
    let control = ["full/line+control", "full/line"].map(|work| coarse("skin", work));
    let skin = Absence {
        scene: "skin",
        without: preset("full/none"),
        bare: preset("bare/none"),
        present: stages
            .map(|(with, beside)| [with, beside].map(|parts| preset(&format!("full/{parts}"))))
            .into_iter()
            .chain([control])
            .collect(),
    };
    let servo = Absence {
        scene: "servo",
        without: "servo/silent".to_owned(),
        bare: "servo/without".to_owned(),
        present: vec![["servo/recording", "servo/silent"].map(str::to_owned)],
    };
    vec![skin, servo]
}

impl Absence {
    /// All its cases.
    pub fn cases(&self) -> impl Iterator<Item = &String> {
        [&self.without, &self.bare].into_iter().chain(self.present.iter().flatten())
    }

    /// Difference of two counts as a share of the second.
    #[must_use]
    pub fn share(without: f64, bare: f64) -> f64 {
        (without - bare) / bare
    }
}
