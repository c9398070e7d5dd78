//! One tissue under one model, and the two pulls of Figs. 6 and 7.
//!
//! A pull goes in equal levels: a quarter of each level's time on the way, three quarters held, then the force on the suture
//! point is read from its port, as the hand feels it. That is slow beside the tissue's own motion, not the limit of rest.

use super::boxes::{BoxSpec, build};
use sim_core::scene::config::SceneConfig;
use sim_core::scene::step::Scene;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::integrator::Integrator;
use sim_core::tissue::network::{SpringNetwork, TissueState};
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::regulation::{Attachments, Engagement};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;

/// Solver period: the presets', seconds.
const PERIOD_S: f64 = 5e-3;
/// Sub-steps of extended position-based dynamics, as systems that use it in real time can afford.
const XPBD_SUBSTEPS: u32 = 4;

/// A model of Figs. 6 and 7.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// UTSM, VOSM or TTSM with relaxed attachments, as the presets have it.
    Ours,
    /// The same springs without attachments.
    Plain,
    /// The same springs with hard tethers, β = 0.
    HardTether,
    /// The same springs by extended position-based dynamics.
    Xpbd,
    /// Connected spring boxes after Choi.
    SpringBoxes,
}

impl Model {
    /// All of them, ours first.
    pub const ALL: [Self; 5] = [Self::Ours, Self::Plain, Self::HardTether, Self::Xpbd, Self::SpringBoxes];

    /// Name in tables and legends.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ours => "relaxed LRA (ours)",
            Self::Plain => "plain mass-spring",
            Self::HardTether => "hard LRA (β = 0)",
            Self::Xpbd => "XPBD",
            Self::SpringBoxes => "spring boxes (after Choi)",
        }
    }
}

/// Which pull.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pull {
    /// One suture point across the open wound, its partner free: Fig. 6.
    OnePoint,
    /// Both suture points together until the edges touch: Fig. 7.
    Together,
}

/// How slowly a specimen is pulled.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Levels on the way.
    pub levels: u32,
    /// Solver periods of one level.
    pub periods: u32,
}

/// A network with its suture points, ready to be pulled.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// Nodes and springs.
    pub network: SpringNetwork,
    /// Suture points: left and right of pair `i` are `2i` and `2i + 1`.
    pub patches: PatchSet,
    /// At rest.
    pub state: TissueState,
    /// Relaxed attachments.
    pub attachments: Option<Attachments>,
    /// The pair that is pulled.
    pub pair: u32,
    /// Distance of its points at which the edges touch, metres.
    pub contact_m: f64,
}

/// One level of a pull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Way of the left point from rest, metres.
    pub deformation_m: f64,
    /// Distance of the two points, metres.
    pub distance_m: f64,
    /// Force on the left point, newtons.
    pub force_n: f64,
}

/// Prepares a tissue under a model; `None` when the scene cannot be built.
#[must_use]
pub fn specimen(config: &SceneConfig, model: Model) -> Option<Specimen> {
    let mut config = config.clone();
    config.line = None;
    config.control = None;
    config.wound.contact_stiffness_n_per_mm = None;
    match model {
        Model::Plain | Model::Xpbd | Model::SpringBoxes => config.attachment = None,
        Model::HardTether => config.attachment.iter_mut().for_each(|a| a.beta = 0.0),
        Model::Ours => {}
    }
    let scene = Scene::new(&config, None).ok()?;
    let pair = scene.places().len() / 2;
    let place = scene.places().get(pair)?;
    let contact_m = place.closed_m - config.suture.closed_gap_mm * 1e-3;
    if model == Model::SpringBoxes {
        return build(&BoxSpec {
            spacing_m: scene.tissue().spacing_m,
            wound_length_m: scene.tissue().wound_length_m,
            gap_m: (place.right_m - place.left_m).norm() - contact_m,
            bite_m: config.suture.bite_mm * 1e-3,
            patch_radius_m: config.suture.patch_radius_mm * 1e-3,
            stiffness_n_per_m: config.material.stiffness_n_per_mm * 1e3,
            drag_n_s_per_m: config.material.drag_n_s_per_m,
        });
    }
    Some(Specimen {
        network: scene.solver().network().clone(),
        patches: scene.solver().patches().clone(),
        state: scene.solver().state().clone(),
        attachments: scene.stages().attachments.clone(),
        pair: pair as u32,
        contact_m,
    })
}

/// Pulls a specimen; `None` when the solver refuses it.
#[must_use]
pub fn pull(specimen: &Specimen, model: Model, pull: Pull, pace: Pace) -> Option<Vec<Level>> {
    let mut params = SolverParams::with_period(PERIOD_S);
    if model == Model::Xpbd {
        params.integrator = Integrator::Xpbd;
        params.substeps = SubstepPolicy::Demanded(XPBD_SUBSTEPS);
    }
    let mut solver = TissueSolver::new(specimen.network.clone(), specimen.patches.clone(), params).ok()?;
    solver.reset(&specimen.state).ok()?;
    let patches = [PatchId(2 * specimen.pair), PatchId(2 * specimen.pair + 1)];
    let mut stages = Stages { attachments: specimen.attachments.clone(), ..Stages::default() };
    let hands = [HandleSlot(0), HandleSlot(1)];
    let [left, right] = patches.map(|p| solver.patches().mean(p, &solver.state().position_m));
    let across = (right - left).normalize();
    let (held, way_m): (&[Vec3], f64) = match pull {
        Pull::OnePoint => (&[across], (right - left).norm() - specimen.contact_m),
        Pull::Together => (&[across, -across], 0.5 * ((right - left).norm() - specimen.contact_m)),
    };
    for (&hand, patch) in hands.iter().zip(patches).take(held.len()) {
        solver.grasp(hand, patch).ok()?;
        if let Some(attachments) = &mut stages.attachments
            && let Some(index) = attachments.of_patch(patch)
        {
            attachments.engage(index, Engagement::Engaged);
        }
    }
    let mut curve = vec![Level { deformation_m: 0.0, distance_m: (right - left).norm(), force_n: 0.0 }];
    let rest_n = solver.port(hands[0], &stages)?.force_n;
    for level in 0..pace.levels {
        for period in 1..=pace.periods {
            let share = (4.0 * f64::from(period) / f64::from(pace.periods)).min(1.0);
            let way = way_m * (f64::from(level) + share) / f64::from(pace.levels);
            for ((&hand, direction), start) in hands.iter().zip(held).zip([left, right]) {
                solver.lead(hand, start + direction * way);
            }
            solver.step(&mut stages);
        }
        let now = patches.map(|p| solver.patches().mean(p, &solver.state().position_m));
        curve.push(Level {
            deformation_m: (now[0] - left).norm(),
            distance_m: (now[1] - now[0]).norm(),
            // A pre-strained tissue at rest pulls on the point already; the hand feels the change.
            force_n: (solver.port(hands[0], &stages)?.force_n - rest_n).norm(),
        });
    }
    Some(curve)
}
