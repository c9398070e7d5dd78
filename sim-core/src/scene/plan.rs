//! Which stages a scene has. Decided once, at load: an absent stage is `None` (no loop, no branch per node, no
//! memory, no topic), never a stage that is skipped.

use super::build::SceneError;
use super::config::{
    AttachmentReading, ControlReading, DistanceReading, KinematicsReading, SceneConfig, SpringLawReading,
    VelocityReading,
};
use crate::absent::{ATTACHMENTS, SUTURE_CONTROL, SUTURE_LINE};
use crate::kinematics::attachment::check_relaxation;
use crate::kinematics::integrate::KinematicsForm;
use crate::kinematics::suture_point::SpringLaw;
use crate::suture_line::line::SutureLineParams;
use crate::tissue::geodesic::DistanceKind;
use crate::tissue::regulation::{ProjectedVelocity, RegulationMode};
use crate::wound::control::{ControlMode, ControlParams};
use crate::wound::stitch::StitchParams;

/// A line wraps each of the two suture points of a stitch by a quarter turn.
const STITCH_WRAP_RAD: f64 = std::f64::consts::PI;

/// Algorithm 1 in this scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttachmentPlan {
    /// β.
    pub beta: f64,
    /// How it acts.
    pub mode: RegulationMode,
    /// Followers lie within this distance, metres.
    pub radius_m: f64,
    /// How distance is measured.
    pub distance: DistanceKind,
}

/// How Eq. (2) and (3) are read at the suture points of this scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuturePlan {
    /// Springs to the neighbours.
    pub spring_law: SpringLaw,
    /// Steps of the servo's ticks.
    pub kinematics: KinematicsForm,
}

/// The suture line in this scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePlan {
    /// The line itself.
    pub course: SutureLineParams,
    /// Tied stitches.
    pub stitch: StitchParams,
    /// Friction μ of the line in a suture point.
    pub friction: f64,
}

/// Algorithm 2 in this scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlPlan {
    /// Mode at start.
    pub mode: ControlMode,
    /// Limits.
    pub params: ControlParams,
    /// Floor on `D_o`, metres.
    pub distance_floor_m: f64,
}

/// The optional stages of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenePlan {
    /// Eq. (2) and (3) at the suture points.
    pub suture: SuturePlan,
    /// Relaxed Long Range Attachments.
    pub attachments: Option<AttachmentPlan>,
    /// Stiffness of wound edges that touch, newtons per metre.
    pub contact_n_per_m: Option<f64>,
    /// Suture line and stitches.
    pub line: Option<LinePlan>,
    /// Suture control; needs the line.
    pub control: Option<ControlPlan>,
}

impl ScenePlan {
    /// Validates the optional sections of a scene.
    ///
    /// # Errors
    /// [`SceneError::Value`] names the key, what was found and what is allowed.
    pub fn new(config: &SceneConfig) -> Result<Self, SceneError> {
        Ok(Self {
            suture: suture(config)?,
            attachments: attachments(config)?,
            contact_n_per_m: contact(config)?,
            line: line(config)?,
            control: control(config)?,
        })
    }

    /// Name and presence of every stage, for the log and the reports.
    #[must_use]
    pub fn stages(&self) -> [(&'static str, bool); 4] {
        [
            ("attachments", self.attachments.is_some()),
            ("wound_contact", self.contact_n_per_m.is_some()),
            ("suture_line", self.line.is_some()),
            ("suture_control", self.control.is_some()),
        ]
    }
}

fn suture(config: &SceneConfig) -> Result<SuturePlan, SceneError> {
    let spring_law = match config.suture.spring_law {
        SpringLawReading::Bilateral => SpringLaw::Bilateral,
        SpringLawReading::PaperTension => SpringLaw::PaperTension,
    };
    if spring_law == SpringLaw::PaperTension && config.attachment.is_none() {
        let needs = "takes its beta from Eq. (1); add an [attachment] section or use \"bilateral\"";
        return Err(SceneError::Reading { key: "suture.spring_law", found: "paper_tension", needs });
    }
    let kinematics = match config.suture.kinematics {
        KinematicsReading::ImplicitDrag => KinematicsForm::ImplicitDrag,
        KinematicsReading::Literal => KinematicsForm::Literal,
    };
    if kinematics == KinematicsForm::Literal && config.line.as_ref().is_some_and(|l| l.friction != 0.0) {
        let needs = "takes every force at time t, and dry friction has no stable step so; set line.friction = 0 or use \
                     \"implicit_drag\"";
        return Err(SceneError::Reading { key: "suture.kinematics", found: "literal", needs });
    }
    Ok(SuturePlan { spring_law, kinematics })
}

fn attachments(config: &SceneConfig) -> Result<Option<AttachmentPlan>, SceneError> {
    let Some(a) = &config.attachment else { return Ok(None) };
    built("attachment", ATTACHMENTS)?;
    let beta = check_relaxation(a.beta).map_err(|_| SceneError::Value {
        key: "attachment.beta",
        found: a.beta,
        allowed: "0 (hard) to 1 (none)",
    })?;
    let reference_step_s =
        in_range("attachment.beta_reference_ms", a.beta_reference_ms, 0.01, 1000.0, "0.01 to 1000")? * 1e-3;
    let mode = match (a.mode, a.velocity) {
        (AttachmentReading::Paper, VelocityReading::Corrected) => RegulationMode::Paper(ProjectedVelocity::Corrected),
        (AttachmentReading::Paper, VelocityReading::Literal) => RegulationMode::Paper(ProjectedVelocity::Literal),
        (AttachmentReading::Compliant, VelocityReading::Corrected) => RegulationMode::Compliant { reference_step_s },
        (AttachmentReading::Compliant, VelocityReading::Literal) => {
            let needs = "is about nodes that are projected; set attachment.mode = \"paper\" or use \"corrected\"";
            return Err(SceneError::Reading { key: "attachment.velocity", found: "literal", needs });
        }
    };
    let distance = match a.distance {
        DistanceReading::Geodesic => DistanceKind::Geodesic,
        DistanceReading::Euclidean => DistanceKind::Euclidean,
    };
    let radius_m = in_range("attachment.radius_mm", a.radius_mm, 0.0, 1000.0, "0 to 1000")? * 1e-3;
    Ok(Some(AttachmentPlan { beta, mode, radius_m, distance }))
}

fn contact(config: &SceneConfig) -> Result<Option<f64>, SceneError> {
    let Some(stiffness) = config.wound.contact_stiffness_n_per_mm else { return Ok(None) };
    let checked = in_range("wound.contact_stiffness_n_per_mm", stiffness, 1e-3, 1e3, "0.001 to 1000")?;
    Ok(Some(checked * 1e3))
}

fn line(config: &SceneConfig) -> Result<Option<LinePlan>, SceneError> {
    let Some(l) = &config.line else { return Ok(None) };
    built("line", SUTURE_LINE)?;
    let friction = in_range("line.friction", l.friction, 0.0, 5.0, "0 to 5")?;
    let stiffness =
        in_range("line.stitch_stiffness_n_per_mm", l.stitch_stiffness_n_per_mm, 1e-3, 1e3, "0.001 to 1000")?;
    let stitch = StitchParams {
        stiffness_n_per_m: stiffness * 1e3,
        knot_hold_n: in_range("line.knot_hold_n", l.knot_hold_n, 0.0, 100.0, "0 to 100")?,
        friction,
        wrap_rad: STITCH_WRAP_RAD,
    };
    let course = SutureLineParams::new(l.length_mm * 1e-3, l.axial_stiffness_n, l.links as usize)?;
    Ok(Some(LinePlan { course, stitch, friction }))
}

fn control(config: &SceneConfig) -> Result<Option<ControlPlan>, SceneError> {
    let Some(c) = &config.control else { return Ok(None) };
    built("control", SUTURE_CONTROL)?;
    if config.line.is_none() {
        return Err(SceneError::ControlWithoutLine);
    }
    let mode = match c.mode {
        ControlReading::Off => ControlMode::Off,
        ControlReading::On => ControlMode::Sound,
        ControlReading::Paper => ControlMode::Paper,
    };
    let params = ControlParams {
        closing_speed_m_per_s: in_range("control.rate_mm_per_s", c.rate_mm_per_s, 0.01, 1000.0, "0.01 to 1000")? * 1e-3,
        max_holding_force_n: in_range("control.tear_force_n", c.tear_force_n, 0.0, 1000.0, "0 to 1000")?,
        ..ControlParams::default()
    };
    let floor = in_range("control.distance_floor_mm", c.distance_floor_mm, 0.01, 100.0, "0.01 to 100")?;
    Ok(Some(ControlPlan { mode, params, distance_floor_m: floor * 1e-3 }))
}

/// Refuses a section whose stage this build leaves out.
pub(super) fn built(section: &'static str, built: bool) -> Result<(), SceneError> {
    if built { Ok(()) } else { Err(SceneError::NotBuilt(section)) }
}

/// Accepts a value of a closed range.
pub(super) fn in_range(
    key: &'static str,
    found: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<f64, SceneError> {
    if (low..=high).contains(&found) { Ok(found) } else { Err(SceneError::Value { key, found, allowed }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;

    #[test]
    fn a_section_left_out_is_a_stage_that_is_absent() {
        let mut config = presets::skin();
        config.attachment = None;
        config.control = None;
        let plan = ScenePlan::new(&config).unwrap();
        assert_eq!(plan.stages().map(|s| s.1), [false, true, true, false]);
    }

    #[test]
    fn control_without_a_line_is_refused() {
        let mut config = presets::skin();
        config.line = None;
        assert_eq!(ScenePlan::new(&config), Err(SceneError::ControlWithoutLine));
    }

    #[test]
    fn values_out_of_range_name_their_key() {
        let mut config = presets::skin();
        config.attachment.as_mut().unwrap().beta = 1.5;
        let error = ScenePlan::new(&config).unwrap_err().to_string();
        assert!(error.contains("attachment.beta") && error.contains("1.5"), "{error}");
    }
}
