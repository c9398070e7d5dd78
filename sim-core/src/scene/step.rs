//! One scene and one step of it: hand → suturing → grips → tissue (springs, attachments, stitches) → Table 1 and
//! control → ports for the servo.
//!
//! The order within a step is fixed, the inputs are explicit, nothing is allocated after load: equal inputs give
//! equal bits. Deliberately absent: clocks, messages, and the 1 kHz integration of the suture points (servo).

use crate::absent::{Keep, SUTURE_LINE, Stage};
use crate::tissue::crew::{Alone, Crew};
use crate::tissue::handle::MAX_HANDLES;
use crate::tissue::model::Tissue;
use crate::tissue::network::TissueState;
use crate::tissue::patch_set::PatchId;
use crate::tissue::port::Port;
use crate::tissue::regulation::Engagement;
use crate::tissue::settle::{SettleParams, Settled, settle};
use crate::tissue::solver::{Stages, StepReport, TissueSolver};
use crate::tissue::triangle_mesh::TriangleMesh;
use crate::vector::Vec3;
use crate::wound::control::ControlMode;

mod resume;
mod view;

pub use resume::ResumeError;

use std::sync::Arc;

use super::build::{SceneError, build_tissue, hands, require_rest, solver_params};
use super::config::SceneConfig;
use super::grip::{Grip, Grips};
use super::line_course::{CourseInput, LineCourse};
use super::plan::{ScenePlan, in_range};
use super::second_hand::{SecondEvent, SecondHand};
use super::sleep::require_sleep;
use super::stages::{PairFacts, pair_facts, patch_set, push_contacts, read_springs, require_literal_steps, stages};
use super::stitching::{Stitching, left_patch, right_patch};
use super::suturing::{HandInput, PairPlace, Side, Suturing, SuturingEvent};

/// A hand farther than this from the wound is not believed, metres: lengths to it would overflow.
const FARTHEST_HAND_M: f64 = 100.0;

/// What the servo tells a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoInput {
    /// Stylus and button.
    pub hand: HandInput,
    /// The same of a second device, where there is one.
    pub second: Option<HandInput>,
    /// Epoch of the port that the servo used.
    pub port_epoch: u32,
    /// Suture points as the servo has integrated them, by slot, metres.
    pub handles_m: [Option<Vec3>; MAX_HANDLES],
}

/// A scene at work.
#[derive(Clone, Debug)]
pub struct Scene {
    config: SceneConfig,
    plan: ScenePlan,
    tissue: Tissue,
    solver: TissueSolver,
    stages: Stages,
    settled: TissueState,
    settling: Settled,
    facts: Vec<PairFacts>,
    places: Vec<PairPlace>,
    suturing: Suturing,
    second: SecondHand,
    grips: Grips,
    stitching: Option<Stage<Stitching, SUTURE_LINE>>,
    course: Option<Stage<LineCourse, SUTURE_LINE>>,
    steps: u64,
    last: StepReport,
}

impl Scene {
    /// Builds the tissue, lets it settle, and prepares the stages that the scene has.
    ///
    /// # Errors
    /// [`SceneError`] when the scene, its mesh or its integrator cannot be used.
    pub fn new(config: &SceneConfig, mesh: Option<&TriangleMesh>) -> Result<Self, SceneError> {
        let plan = ScenePlan::new(config)?;
        let mut tissue = build_tissue(config, mesh)?;
        read_springs(&plan, &mut tissue);
        let patches = patch_set(&tissue)?;
        let mut solver = TissueSolver::new(tissue.network.clone(), patches, solver_params(config)?)?;
        let mut settled = tissue.network.rest_state();
        let settling = require_rest(settle(&tissue.network, None, &mut settled.position_m, &SettleParams::default()))?;
        solver.reset(&settled)?;
        solver.reassess()?;
        require_sleep(&config.solver, &solver)?;
        if hands(&config.solver)?.is_some() {
            // Divided from the start: the bits do not hang on who does the work, or when they come.
            solver.share(Arc::new(Alone));
        }
        let closed_gap_m =
            in_range("suture.closed_gap_mm", config.suture.closed_gap_mm, 0.0, 100.0, "0 to 100")? * 1e-3;
        let capture_m =
            in_range("suture.capture_radius_mm", config.suture.capture_radius_mm, 0.0, 1000.0, "0 to 1000")? * 1e-3;
        in_range("suture.point_mass_g", config.suture.point_mass_g, 0.0, 1000.0, "0 to 1000")?;
        let facts = pair_facts(&tissue, solver.patches(), &settled, closed_gap_m);
        let stages = stages(&plan, &tissue, solver.patches(), &settled, &facts)?;
        require_literal_steps(&plan, &solver, &stages, config.suture.point_mass_g * 1e-3)?;
        let mut scene = Self {
            suturing: Suturing::new(tissue.pairs.len(), capture_m),
            second: SecondHand::new(capture_m),
            places: Vec::with_capacity(tissue.pairs.len()),
            stitching: Stitching::new(&plan).and_then(Keep::keep),
            course: plan.line.and_then(|l| Keep::keep(LineCourse::new(l.course))),
            config: config.clone(),
            plan,
            tissue,
            solver,
            stages,
            settled,
            settling,
            facts,
            grips: Grips::default(),
            steps: 0,
            last: StepReport::default(),
        };
        scene.measure_places();
        Ok(scene)
    }

    /// How many hands the scene asks for; `None` where its sweep is not divided.
    #[must_use]
    pub fn threads(&self) -> Option<u32> {
        self.config.solver.threads
    }

    /// Gives the work on the springs to a crew, if the scene asks for one.
    pub fn share(&mut self, crew: &Arc<dyn Crew>) {
        if self.threads().is_some() {
            self.solver.share(crew.clone());
        }
    }

    /// Back to the start of the scene. The control keeps its mode.
    pub fn restore(&mut self) {
        let mode = self.stitching.as_ref().and_then(|s| s.control_mode());
        self.let_go();
        // The settled state is of this network and finite: it was accepted at load.
        let _ = self.solver.reset(&self.settled);
        if let Some(attachments) = &mut self.stages.attachments {
            (0..attachments.len()).for_each(|a| attachments.engage(a, Engagement::Idle));
        }
        if let Some(pairs) = &mut self.stages.pairs {
            pairs.clear();
            push_contacts(&self.plan, &self.facts, self.solver.patches(), pairs);
        }
        self.stitching = Stitching::new(&self.plan).and_then(Keep::keep);
        self.course = self.plan.line.and_then(|l| Keep::keep(LineCourse::new(l.course)));
        if let Some(mode) = mode {
            self.set_control_mode(mode);
        }
        self.suturing.restart();
        self.measure_places();
    }

    /// Lets go of everything the hands hold.
    pub fn let_go(&mut self) {
        self.grips.let_go(&mut self.solver);
        self.grips.let_go_second(&mut self.solver);
    }

    /// One step of the solver's period. A hand that is not finite or absurdly far counts as no hand.
    pub fn step(&mut self, servo: Option<&ServoInput>) -> StepReport {
        let is_near = |hand: &&HandInput| hand.position_m.norm() <= FARTHEST_HAND_M;
        let hand = servo.map(|input| &input.hand).filter(is_near);
        if let Some(input) = servo {
            if let Some(hand) = hand {
                for event in self.suturing.advance(hand, &self.places).into_iter().flatten() {
                    self.apply(event, hand.position_m);
                }
            }
            let second = input.second.as_ref().filter(is_near);
            for event in self.second.advance(second, &self.places).into_iter().flatten() {
                match event {
                    SecondEvent::Taken(pair, side) => self.grips.hold_second(&mut self.solver, pair, side),
                    SecondEvent::Released => self.grips.let_go_second(&mut self.solver),
                }
            }
            if input.port_epoch == self.grips.epoch() {
                self.grips.follow(&mut self.solver, &input.handles_m);
            }
        }
        self.last = self.solver.step(&mut self.stages);
        self.steps += 1;
        if let (Some(stitching), Some(pairs)) = (&mut self.stitching, &mut self.stages.pairs) {
            let position_m = &self.solver.state().position_m;
            stitching.measure(position_m, self.solver.patches(), pairs, self.solver.params().period_s);
            for shift in stitching.shifts() {
                self.solver.displace(shift.patch, shift.shift_m);
            }
            stitching.measure_again(&self.solver.state().position_m, self.solver.patches());
        }
        self.measure_places();
        self.follow_line(hand.map(|h| h.position_m));
        self.last
    }

    fn follow_line(&mut self, stylus_m: Option<Vec3>) {
        let Some(course) = &mut self.course else { return };
        let rows = self.stitching.as_ref().map_or(&[][..], |s| s.ledger().rows());
        course.step(CourseInput {
            suturing: &self.suturing,
            places: &self.places,
            tied: &mut rows.iter().map(|r| [r.left_current_m, r.right_current_m]),
            stylus_m,
            pulled_length_m: self.grips.line_rest_length_m(),
        });
    }

    /// Ties the stitch in hand now.
    ///
    /// # Errors
    /// Why there is nothing to tie, as a sentence.
    pub fn tie(&mut self) -> Result<(), &'static str> {
        let event = self.suturing.tie(&self.places)?;
        self.apply(event, Vec3::zeros());
        Ok(())
    }

    /// Changes the control mode. Returns false when the scene has no control.
    pub fn set_control_mode(&mut self, mode: ControlMode) -> bool {
        let (Some(stitching), Some(pairs)) = (&mut self.stitching, &mut self.stages.pairs) else { return false };
        stitching.set_control_mode(mode, pairs, self.solver.patches())
    }

    fn apply(&mut self, event: SuturingEvent, stylus_m: Vec3) {
        match event {
            SuturingEvent::LeftTaken(pair) => {
                self.grips.hold(&mut self.solver, pair, Side::Left);
                self.engage(left_patch(pair));
            }
            SuturingEvent::LineTaken(pair) if self.plan.line.is_some() => {
                let place = self.places[pair];
                self.grips.pull(&mut self.solver, pair, stylus_m, place.right_m, place.left_m);
                self.engage(right_patch(pair));
            }
            SuturingEvent::LineTaken(pair) => self.grips.hold(&mut self.solver, pair, Side::Right),
            SuturingEvent::DragBegun(pair, side) => self.grips.hold(&mut self.solver, pair, side),
            SuturingEvent::LeftReleased(_) | SuturingEvent::LineReleased(_) | SuturingEvent::DragEnded(_) => {
                self.grips.let_go(&mut self.solver);
            }
            SuturingEvent::Tied(pair) => {
                self.grips.let_go(&mut self.solver);
                let place = self.places[pair];
                if let (Some(stitching), Some(pairs)) = (&mut self.stitching, &mut self.stages.pairs) {
                    let open = self.facts[pair].open_distance_m;
                    stitching.tie(pair, open, [place.left_m, place.right_m], pairs, self.solver.patches());
                }
            }
        }
    }

    fn engage(&mut self, patch: PatchId) {
        if let Some(attachments) = &mut self.stages.attachments
            && let Some(index) = attachments.of_patch(patch)
        {
            attachments.engage(index, Engagement::Engaged);
        }
    }

    fn measure_places(&mut self) {
        let (patches, x) = (self.solver.patches(), &self.solver.state().position_m);
        self.places.clear();
        self.places.extend(self.facts.iter().enumerate().map(|(pair, facts)| PairPlace {
            left_m: patches.mean(left_patch(pair), x),
            right_m: patches.mean(right_patch(pair), x),
            closed_m: facts.closed_m,
        }));
    }

    /// Port of a grip with the mass of needle and patch (m_j of Eq. (3)).
    pub fn port(&mut self, grip: &Grip) -> Option<Port> {
        let port = self.solver.port(grip.slot, &self.stages)?;
        Some(Port { mass_kg: port.mass_kg + self.config.suture.point_mass_g * 1e-3, ..port })
    }
}
