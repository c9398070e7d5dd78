//! The servo's suture point between virtual coupling and tissue: stability over Kvc and m at 1 kHz.
//!
//! Implicit, one 3 × 3 solve: stable for every Kvc and m. As printed, every force at time t:
//! (S + Kvc) dt² + 2 (c + Bvc) dt < 4m, the literal limit of Eq. (2) with coupling and tissue in parallel.

use super::boundary::Boundary;
use super::probe::{DISTURBANCE, Motion, bisect, edge_width, edge_windows, grows};
use crate::accuracy::section::Effort;
use sim_core::kinematics::coupling::{CouplingParams, StylusState, coupling_force};
use sim_core::kinematics::integrate::{KinematicsForm, NodeState, literal_min_mass_kg};
use sim_core::kinematics::port_tick::{AffinePort, PortRung, tick_held};
use sim_core::kinematics::suture_point::{SuturePointForces, damping_force, step_as_printed};
use sim_core::vector::{Mat3, Vec3};

/// Tissue stiffness S, newtons per metre.
const TISSUE_N_PER_M: f64 = 540.0;
/// Drag of the point, newton seconds per metre.
const DRAG_N_S_PER_M: f64 = 3.0;
/// Bvc, newton seconds per metre.
const COUPLING_N_S_PER_M: f64 = 1.0;
/// Servo period, seconds.
const DT_S: f64 = 1e-3;
/// Scale of the disturbance, metres.
const SCALE_M: f64 = 5e-3;
const REST: [Vec3; 1] = [Vec3::new(0.0, 0.0, 0.0)];

/// A held point, its stylus at rest.
pub(super) struct HeldPoint {
    node: NodeState,
    place: [Vec3; 1],
    port: AffinePort,
    coupling: CouplingParams,
    form: KinematicsForm,
}

impl HeldPoint {
    pub(super) fn new(coupling_n_per_m: f64, mass_kg: f64, form: KinematicsForm) -> Self {
        let start = Vec3::new(1.0, -0.7, 0.4) * (DISTURBANCE * SCALE_M);
        Self {
            node: NodeState { position_m: start, velocity_m_per_s: Vec3::zeros() },
            place: [start],
            port: AffinePort {
                position_m: Vec3::zeros(),
                velocity_m_per_s: Vec3::zeros(),
                force_n: Vec3::zeros(),
                stiffness_n_per_m: Mat3::identity() * TISSUE_N_PER_M,
                one_ring_n_per_m: Mat3::identity() * TISSUE_N_PER_M,
                // Far: the linear law is what is mapped.
                trust_radius_m: f64::MAX,
                mass_kg,
                drag_n_s_per_m: DRAG_N_S_PER_M,
            },
            coupling: CouplingParams { stiffness_n_per_m: coupling_n_per_m, damping_n_s_per_m: COUPLING_N_S_PER_M },
            form,
        }
    }
}

impl Motion for HeldPoint {
    fn step(&mut self) {
        let stylus = StylusState::default();
        self.node = match self.form {
            KinematicsForm::ImplicitDrag => {
                tick_held(self.node, &self.port, stylus, Vec3::zeros(), self.coupling, PortRung::Affine, DT_S).node
            }
            KinematicsForm::Literal => {
                let forces = SuturePointForces {
                    hand_n: coupling_force(self.coupling, stylus, Vec3::zeros(), self.node),
                    link_n: Vec3::zeros(),
                    spring_n: self.port.stiffness_n_per_m * -self.node.position_m,
                    damping_n: damping_force(DRAG_N_S_PER_M, self.node.velocity_m_per_s),
                };
                step_as_printed(self.node, &forces, self.port.mass_kg, DT_S)
            }
        };
        self.place = [self.node.position_m];
    }

    fn position_m(&self) -> &[Vec3] {
        &self.place
    }

    fn rest_m(&self) -> &[Vec3] {
        &REST
    }

    fn spacing_m(&self) -> f64 {
        SCALE_M
    }
}

/// Least stable mass as printed, kilograms.
pub(super) fn least_mass_kg(coupling_n_per_m: f64) -> f64 {
    literal_min_mass_kg(TISSUE_N_PER_M + coupling_n_per_m, DRAG_N_S_PER_M + COUPLING_N_S_PER_M, DT_S)
}

/// Name of a form.
pub(super) fn name(form: KinematicsForm) -> &'static str {
    match form {
        KinematicsForm::ImplicitDrag => "implicit 3 × 3 solve",
        KinematicsForm::Literal => "as printed, one step",
    }
}

/// Boundaries over Kvc.
pub(super) fn boundaries(effort: Effort) -> Vec<Boundary> {
    let couplings: &[f64] = if effort == Effort::Full { &[10.0, 100.0, 400.0, 1e3, 1e4, 1e5] } else { &[400.0, 1e4] };
    let forms = [KinematicsForm::ImplicitDrag, KinematicsForm::Literal];
    let edge = |form, coupling: f64| {
        let formula = least_mass_kg(coupling);
        Boundary {
            topology: "servo node".to_owned(),
            integrator: name(form).to_owned(),
            at: format!(
                "Kvc = {coupling} N/m, S = {TISSUE_N_PER_M} N/m, c = {DRAG_N_S_PER_M} and Bvc = {COUPLING_N_S_PER_M} N·s/m, dt = 1 ms"
            ),
            quantity: "m (kg)",
            measured: bisect(1e-9, 1e3, edge_width(effort), |mass| {
                grows(&mut HeldPoint::new(coupling, mass, form), edge_windows(effort))
            }),
            formula: (form == KinematicsForm::Literal).then_some(formula),
        }
    };
    forms.into_iter().flat_map(|form| couplings.iter().map(move |k| edge(form, *k))).collect()
}
