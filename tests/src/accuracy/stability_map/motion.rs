//! A net under one integrator, one step at a time, with no limit and no containment in the way: what the maps run.
//!
//! Forces by the solver's own sweep, factors by its integrators. Verlet's half-step velocities obey the same update as
//! the others: v ← keep·v + gain·F, x ← x + h·v.

use super::probe::{DISTURBANCE, Motion};
use super::topology::Topology;
use sim_core::tissue::integrator::{Integrator, NodeFactors, advance};
use sim_core::tissue::network::TissueState;
use sim_core::tissue::sweep::SpringSweep;
use sim_core::vector::Vec3;

/// A point of a map over a net: the same mass and drag on every node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) integrator: Integrator,
    pub(super) mass_kg: f64,
    pub(super) drag_n_s_per_m: f64,
    pub(super) dt_s: f64,
}

/// A disturbed net that is stepped.
pub(super) struct NetMotion<'a> {
    net: &'a Topology,
    sweep: SpringSweep,
    factors: Vec<NodeFactors>,
    state: TissueState,
    force_n: Vec<Vec3>,
    dt_s: f64,
}

impl<'a> NetMotion<'a> {
    pub(super) fn new(net: &'a Topology, point: Point) -> Self {
        let factors = point.integrator.factors(point.mass_kg, point.drag_n_s_per_m, point.dt_s);
        let factor = |fixed: &u8| if *fixed == 0 { factors } else { NodeFactors::default() };
        let mut state = net.network.rest_state();
        for (i, x) in state.position_m.iter_mut().enumerate().filter(|(i, _)| net.network.fixed[*i] == 0) {
            // Parts in every mode, the shortest waves among them; in the plane only for flat nets, which are free across.
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let i = i as f64;
            let push = Vec3::new((i * 1.7).sin() + sign, (i * 2.9).cos() - 0.7 * sign, (i * 4.1).sin() + 0.4 * sign);
            *x += push.component_mul(&net.disturbed_along) * (DISTURBANCE * net.spacing_m);
        }
        Self {
            net,
            sweep: net.sweep.clone(),
            factors: net.network.fixed.iter().map(factor).collect(),
            force_n: vec![Vec3::zeros(); state.position_m.len()],
            state,
            dt_s: point.dt_s,
        }
    }
}

impl Motion for NetMotion<'_> {
    fn step(&mut self) {
        self.sweep.sweep(&self.state.position_m, &mut self.force_n);
        advance(&self.factors, &self.force_n, &mut self.state, self.dt_s, f64::INFINITY);
    }

    fn position_m(&self) -> &[Vec3] {
        &self.state.position_m
    }

    fn rest_m(&self) -> &[Vec3] {
        &self.net.network.rest_m
    }

    fn spacing_m(&self) -> f64 {
        self.net.spacing_m
    }
}
