//! The explicit references: classical Runge–Kutta, and staggered Verlet with Crank–Nicolson drag, on driven networks.
//!
//! Steps keep `ω_max·dt` at or below the ratio asked for, and `dt·c/m` below 2.5, the reach of Runge–Kutta on the drag.
//! Verlet costs a quarter of Runge–Kutta per step and is of order 2; at `ω_max·dt ≤ 0.1` slow motion is followed to about
//! `(ω dt)²/24` of its own phase.

use super::driven::{Driven, Samples};
use super::edges::{EdgeList, largest_frequency};
use std::sync::atomic::{AtomicBool, Ordering};

/// Which explicit method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExplicitMethod {
    /// Classical Runge–Kutta, order 4.
    RungeKutta,
    /// Staggered Verlet with Crank–Nicolson drag, order 2.
    Verlet,
}

/// Largest `dt·c/m` of a Runge–Kutta step.
const DRAG_REACH: f64 = 2.5;

/// Step for a driven network that keeps `ω_max·dt ≤ ratio`, seconds, and the number of spring evaluations of a run.
#[must_use]
pub fn explicit_step_s(driven: &Driven<'_>, method: ExplicitMethod, ratio: f64) -> (f64, f64) {
    let moves = driven.moves();
    // The power iteration comes out low by a few per cent.
    let omega = 1.05 * largest_frequency(driven.network, &moves, &driven.start());
    let nodes = driven.network.mass_kg.iter().zip(&driven.network.drag_n_s_per_m).zip(&moves);
    let rate = nodes.filter(|(_, moves)| **moves).map(|((m, c), _)| c / m).fold(0.0, f64::max);
    let by_waves = if omega > 0.0 { ratio / omega } else { driven.sample_s };
    let (by_drag, stages) = match method {
        ExplicitMethod::RungeKutta => (if rate > 0.0 { DRAG_REACH / rate } else { f64::INFINITY }, 4.0),
        ExplicitMethod::Verlet => (f64::INFINITY, 1.0),
    };
    let dt = by_waves.min(by_drag).min(driven.sample_s);
    (dt, stages * driven.end_s / dt * driven.network.springs.len() as f64)
}

/// Runs with steps of at most `dt_s`; `None` when stopped.
#[must_use]
pub fn explicit_run(driven: &Driven<'_>, method: ExplicitMethod, dt_s: f64, stop: &AtomicBool) -> Option<Samples> {
    let per_sample = driven.steps_per_sample(dt_s);
    let dt = driven.sample_s / per_sample as f64;
    let mut run = Run::new(driven, dt);
    if method == ExplicitMethod::Verlet {
        run.half_kick(dt);
    }
    let mut samples = Samples::default();
    for sample in 0..driven.sample_count() {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        for step in 0..per_sample {
            let t = (sample * per_sample + step) as f64 * dt;
            match method {
                ExplicitMethod::RungeKutta => run.runge_kutta(t, dt),
                ExplicitMethod::Verlet => run.leap(t, dt),
            }
        }
        run.record(method, dt, &mut samples);
    }
    Some(samples)
}

struct Run<'a> {
    driven: &'a Driven<'a>,
    edges: EdgeList,
    start: Vec<[f64; 3]>,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
    /// (1/m, c/m), zero where a node does not move by its equation.
    rates: Vec<(f64, f64)>,
    /// What Verlet keeps of a velocity and adds per newton in a step, zero where a node does not move by its equation.
    kicks: Vec<(f64, f64)>,
    stage_x: Vec<[f64; 3]>,
    stage_v: Vec<[f64; 3]>,
    sum_x: Vec<[f64; 3]>,
    sum_v: Vec<[f64; 3]>,
}

impl<'a> Run<'a> {
    fn new(driven: &'a Driven<'a>, dt: f64) -> Self {
        let start = driven.start();
        let zero = vec![[0.0; 3]; start.len()];
        let nodes = driven.network.mass_kg.iter().zip(&driven.network.drag_n_s_per_m).zip(driven.moves());
        let rates: Vec<(f64, f64)> =
            nodes.map(|((m, c), moves)| if moves { (1.0 / m, c / m) } else { (0.0, 0.0) }).collect();
        let kick = |&(inverse_mass, drag): &(f64, f64)| {
            let half = 0.5 * drag * dt;
            let moves = if inverse_mass > 0.0 { 1.0 } else { 0.0 };
            (moves * (1.0 - half) / (1.0 + half), dt * inverse_mass / (1.0 + half))
        };
        Self {
            kicks: rates.iter().map(kick).collect(),
            rates,
            driven,
            edges: EdgeList::new(driven.network),
            x: start.clone(),
            v: zero.clone(),
            force: zero.clone(),
            stage_x: start.clone(),
            stage_v: zero.clone(),
            sum_x: zero.clone(),
            sum_v: zero,
            start,
        }
    }

    fn runge_kutta(&mut self, t: f64, dt: f64) {
        const AHEAD: [f64; 4] = [0.5, 0.5, 1.0, 0.0];
        const WEIGHT: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
        const AT: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
        self.stage_x.copy_from_slice(&self.x);
        self.stage_v.copy_from_slice(&self.v);
        self.sum_x.copy_from_slice(&self.x);
        self.sum_v.copy_from_slice(&self.v);
        for stage in 0..4 {
            self.driven.place(&self.start, t + AT[stage] * dt, &mut self.stage_x);
            self.edges.forces(&self.stage_x, &mut self.force);
            self.driven.add_loads(&mut self.force);
            let (weight, ahead) = (WEIGHT[stage] * dt, AHEAD[stage] * dt);
            for i in 0..self.x.len() {
                let (inverse_mass, drag) = self.rates[i];
                if inverse_mass == 0.0 {
                    continue;
                }
                for d in 0..3 {
                    let speed = self.stage_v[i][d];
                    let acceleration = self.force[i][d] * inverse_mass - drag * speed;
                    self.sum_x[i][d] += weight * speed;
                    self.sum_v[i][d] += weight * acceleration;
                    self.stage_x[i][d] = self.x[i][d] + ahead * speed;
                    self.stage_v[i][d] = self.v[i][d] + ahead * acceleration;
                }
            }
        }
        std::mem::swap(&mut self.x, &mut self.sum_x);
        std::mem::swap(&mut self.v, &mut self.sum_v);
        self.driven.place(&self.start, t + dt, &mut self.x);
    }

    /// The staggered velocity half a step before the start, at rest there: `v(−dt/2) = −(dt/2) F/m`.
    fn half_kick(&mut self, dt: f64) {
        self.edges.forces(&self.x, &mut self.force);
        self.driven.add_loads(&mut self.force);
        for ((v, f), (inverse_mass, _)) in self.v.iter_mut().zip(&self.force).zip(&self.rates) {
            *v = f.map(|c| -0.5 * dt * c * inverse_mass);
        }
    }

    fn leap(&mut self, t: f64, dt: f64) {
        self.edges.forces(&self.x, &mut self.force);
        self.driven.add_loads(&mut self.force);
        let nodes = self.x.iter_mut().zip(&mut self.v).zip(self.force.iter().zip(&self.kicks));
        for ((x, v), (force, &(keep, gain))) in nodes {
            for d in 0..3 {
                v[d] = keep * v[d] + gain * force[d];
                x[d] += dt * v[d];
            }
        }
        self.driven.place(&self.start, t + dt, &mut self.x);
    }

    fn record(&mut self, method: ExplicitMethod, dt: f64, samples: &mut Samples) {
        self.edges.forces(&self.x, &mut self.force);
        samples.force_n.push(self.driven.held_force(&self.force));
        let mut kinetic = 0.0;
        for i in 0..self.x.len() {
            let (inverse_mass, drag) = self.rates[i];
            if inverse_mass == 0.0 {
                continue;
            }
            for d in 0..3 {
                let speed = match method {
                    ExplicitMethod::RungeKutta => self.v[i][d],
                    // Half a step on from the staggered velocity.
                    ExplicitMethod::Verlet => {
                        let kick = self.force[i][d] * inverse_mass - drag * self.v[i][d];
                        self.v[i][d] + 0.5 * dt * kick
                    }
                };
                kinetic += 0.5 * speed * speed / inverse_mass;
            }
        }
        samples.energy_j.push(kinetic + self.edges.energy_j(&self.x));
        samples.position_m.push(self.x.clone());
    }
}
