//! What a scene shows of itself.

use super::Scene;
use crate::scene::config::SceneConfig;
use crate::scene::grip::Grips;
use crate::scene::line_course::LineCourse;
use crate::scene::plan::ScenePlan;
use crate::scene::suturing::{PairPlace, Suturing};
use crate::tissue::model::{Tissue, TissueKind};
use crate::tissue::settle::Settled;
use crate::tissue::solver::{Stages, StepReport, TissueSolver};
use crate::wound::control::ControlMode;
use crate::wound::ledger::LedgerRow;

impl Scene {
    /// What the scene file says.
    #[must_use]
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// Which stages the scene has.
    #[must_use]
    pub fn plan(&self) -> &ScenePlan {
        &self.plan
    }

    /// The tissue as built.
    #[must_use]
    pub fn tissue(&self) -> &Tissue {
        &self.tissue
    }

    /// The solver, for its state, stability and parameters.
    #[must_use]
    pub fn solver(&self) -> &TissueSolver {
        &self.solver
    }

    /// Where the pairs are now.
    #[must_use]
    pub fn places(&self) -> &[PairPlace] {
        &self.places
    }

    /// Where the suturing stands.
    #[must_use]
    pub fn suturing(&self) -> &Suturing {
        &self.suturing
    }

    /// Suture points that the servo integrates.
    #[must_use]
    pub fn grips(&self) -> &Grips {
        &self.grips
    }

    /// Rows of Table 1; none without a suture line.
    #[must_use]
    pub fn ledger_rows(&self) -> &[LedgerRow] {
        self.stitching.as_ref().map_or(&[], |s| s.ledger().rows())
    }

    /// The suture line; `None` when the scene has none.
    #[must_use]
    pub fn line(&self) -> Option<&LineCourse> {
        self.course.as_ref().map(|c| c as &LineCourse)
    }

    /// `D_floor` of `ER`, metres; 0 in a scene without a suture line.
    #[must_use]
    pub fn distance_floor_m(&self) -> f64 {
        self.stitching.as_ref().map_or(0.0, |s| s.ledger().distance_floor_m())
    }

    /// Control mode; `None` when the scene has no control.
    #[must_use]
    pub fn control_mode(&self) -> Option<ControlMode> {
        self.stitching.as_ref().and_then(|s| s.control_mode())
    }

    /// How the tissue settled at load.
    #[must_use]
    pub fn settling(&self) -> &Settled {
        &self.settling
    }

    /// Steps since load.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// What happened in the last step.
    #[must_use]
    pub fn last_report(&self) -> &StepReport {
        &self.last
    }

    /// The optional stages, for reports (reactions of the attachments).
    #[must_use]
    pub fn stages(&self) -> &Stages {
        &self.stages
    }

    /// The code of the tissue model on the wire: 0 skin, 1 liver, 2 vessel.
    #[must_use]
    pub fn kind_code(&self) -> u32 {
        match self.tissue.kind {
            TissueKind::Utsm => 0,
            TissueKind::Vosm => 1,
            TissueKind::Ttsm => 2,
        }
    }
}
