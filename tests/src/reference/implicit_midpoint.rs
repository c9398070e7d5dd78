//! The implicit reference: midpoint rule, full Newton to 1e-10, matrix-free conjugate gradients with 3 × 3 block Jacobi.
//!
//! With `v_m = (x⁺ − x)/dt`: `(2/dt) M (v_m − v) + C v_m = F((x + x⁺)/2)`, `v⁺ = 2 v_m − v`. Order 2, errors in even powers
//! of the step, so that one Richardson extrapolation gives order 4. Shares nothing with sim-core, and nothing with the
//! explicit reference but the list of springs.

use super::driven::{Driven, Samples};
use super::edges::{Compression, EdgeList, EdgeTangent};
use nalgebra::{Matrix3, Vector3};
use std::sync::atomic::{AtomicBool, Ordering};

/// Newton ends when the residual is below this part of the force scale (stiffest spring times 1 cm).
const NEWTON_TOLERANCE: f64 = 1e-10;
/// The linear residual falls to this part of the Newton residual.
const LINEAR_TOLERANCE: f64 = 1e-5;
/// Most Newton iterations of a step.
const MAX_NEWTON: usize = 30;
/// Most linear iterations of a Newton iteration.
const MAX_LINEAR: usize = 4000;

/// Runs with steps of at most `dt_s`; `None` when stopped, or when Newton does not end.
#[must_use]
pub fn midpoint_run(driven: &Driven<'_>, dt_s: f64, stop: &AtomicBool) -> Option<Samples> {
    let per_sample = driven.steps_per_sample(dt_s);
    let dt = driven.sample_s / per_sample as f64;
    let mut run = Run::new(driven, dt);
    let mut samples = Samples::default();
    for sample in 0..driven.sample_count() {
        for step in 0..per_sample {
            if stop.load(Ordering::Relaxed) || !run.step((sample * per_sample + step) as f64 * dt) {
                return None;
            }
        }
        run.record(&mut samples);
    }
    Some(samples)
}

struct Run<'a> {
    driven: &'a Driven<'a>,
    edges: EdgeList,
    dt: f64,
    tolerance_n: f64,
    moves: Vec<bool>,
    start: Vec<[f64; 3]>,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    middle: Vec<[f64; 3]>,
    force: Vec<[f64; 3]>,
    residual: Vec<[f64; 3]>,
    change: Vec<[f64; 3]>,
    tangent: EdgeTangent,
    solver: Conjugate,
}

impl<'a> Run<'a> {
    fn new(driven: &'a Driven<'a>, dt: f64) -> Self {
        let start = driven.start();
        let zero = vec![[0.0; 3]; start.len()];
        let edges = EdgeList::new(driven.network);
        let nodes = driven.network.mass_kg.iter().zip(&driven.network.drag_n_s_per_m);
        let diagonal = nodes.map(|(m, c)| 4.0 * m / (dt * dt) + 2.0 * c / dt).collect();
        Self {
            driven,
            dt,
            tolerance_n: NEWTON_TOLERANCE * edges.stiffest_n_per_m() * 1e-2,
            edges,
            moves: driven.moves(),
            x: start.clone(),
            middle: start.clone(),
            start,
            v: zero.clone(),
            force: zero.clone(),
            residual: zero.clone(),
            change: zero.clone(),
            tangent: EdgeTangent::default(),
            solver: Conjugate::new(diagonal),
        }
    }

    /// One step from `t`; false when Newton does not end.
    fn step(&mut self, t: f64) -> bool {
        let dt = self.dt;
        for i in 0..self.x.len() {
            if self.moves[i] {
                self.middle[i] = std::array::from_fn(|d| self.x[i][d] + 0.5 * dt * self.v[i][d]);
            }
        }
        let (now, then) = ((self.driven.path)(t), (self.driven.path)(t + dt));
        for &node in self.driven.held {
            let from = self.start[node as usize];
            self.middle[node as usize] = std::array::from_fn(|d| from[d] + 0.5 * (now[d] + then[d]));
        }
        let mut ended = false;
        for _ in 0..MAX_NEWTON {
            let size = self.measure_residual();
            if size <= self.tolerance_n {
                ended = true;
                break;
            }
            let goal = (LINEAR_TOLERANCE * size).max(0.2 * self.tolerance_n);
            let mut solved = false;
            for compression in [Compression::Exact, Compression::Clamped] {
                self.edges.tangent(&self.middle, compression, &mut self.tangent);
                solved = self.solver.solve(&self.tangent, &self.moves, &self.residual, goal, &mut self.change);
                if solved {
                    break;
                }
            }
            if !solved {
                return false;
            }
            for (x, c) in self.middle.iter_mut().zip(&self.change) {
                for d in 0..3 {
                    x[d] += c[d];
                }
            }
        }
        for i in 0..self.x.len() {
            if self.moves[i] {
                for d in 0..3 {
                    let mean = 2.0 * (self.middle[i][d] - self.x[i][d]) / dt;
                    self.x[i][d] += dt * mean;
                    self.v[i][d] = 2.0 * mean - self.v[i][d];
                }
            }
        }
        self.driven.place(&self.start, t + dt, &mut self.x);
        ended
    }

    /// `F(x_m) − (2/dt) M (v_m − v) − C v_m` on the moving nodes; returns its norm.
    fn measure_residual(&mut self) -> f64 {
        self.edges.forces(&self.middle, &mut self.force);
        self.driven.add_loads(&mut self.force);
        let (dt, network) = (self.dt, self.driven.network);
        let mut squared = 0.0;
        for i in 0..self.x.len() {
            if !self.moves[i] {
                self.residual[i] = [0.0; 3];
                continue;
            }
            let (m, c) = (network.mass_kg[i], network.drag_n_s_per_m[i]);
            for d in 0..3 {
                let mean = 2.0 * (self.middle[i][d] - self.x[i][d]) / dt;
                let r = self.force[i][d] - 2.0 / dt * m * (mean - self.v[i][d]) - c * mean;
                self.residual[i][d] = r;
                squared += r * r;
            }
        }
        squared.sqrt()
    }

    fn record(&mut self, samples: &mut Samples) {
        self.edges.forces(&self.x, &mut self.force);
        samples.force_n.push(self.driven.held_force(&self.force));
        let nodes = self.v.iter().zip(&self.driven.network.mass_kg).zip(&self.moves);
        let kinetic =
            nodes.filter(|(_, moves)| **moves).map(|((v, m), _)| 0.5 * m * v.iter().map(|c| c * c).sum::<f64>());
        samples.energy_j.push(kinetic.sum::<f64>() + self.edges.energy_j(&self.x));
        samples.position_m.push(self.x.clone());
    }
}

/// Preconditioned conjugate gradients on `diagonal + K`.
struct Conjugate {
    diagonal: Vec<f64>,
    blocks: Vec<Matrix3<f64>>,
    r: Vec<[f64; 3]>,
    z: Vec<[f64; 3]>,
    p: Vec<[f64; 3]>,
    product: Vec<[f64; 3]>,
}

impl Conjugate {
    fn new(diagonal: Vec<f64>) -> Self {
        let n = diagonal.len();
        let zero = vec![[0.0; 3]; n];
        Self {
            diagonal,
            blocks: vec![Matrix3::zeros(); n],
            r: zero.clone(),
            z: zero.clone(),
            p: zero.clone(),
            product: zero,
        }
    }

    /// Solves to a residual of norm `goal`; false when the matrix shows itself indefinite or the iterations run out.
    fn solve(
        &mut self,
        tangent: &EdgeTangent,
        moves: &[bool],
        right: &[[f64; 3]],
        goal: f64,
        x: &mut [[f64; 3]],
    ) -> bool {
        for (block, d) in self.blocks.iter_mut().zip(&self.diagonal) {
            *block = Matrix3::identity() * *d;
        }
        tangent.add_diagonal(&mut self.blocks);
        for block in &mut self.blocks {
            *block = block.try_inverse().unwrap_or_else(Matrix3::zeros);
        }
        x.fill([0.0; 3]);
        self.r.copy_from_slice(right);
        self.precondition();
        self.p.copy_from_slice(&self.z);
        let mut rz = dot(&self.r, &self.z);
        for _ in 0..MAX_LINEAR {
            if dot(&self.r, &self.r).sqrt() <= goal {
                return true;
            }
            for (q, (p, d)) in self.product.iter_mut().zip(self.p.iter().zip(&self.diagonal)) {
                *q = p.map(|c| c * d);
            }
            tangent.add_product(&self.p, &mut self.product);
            for (q, moves) in self.product.iter_mut().zip(moves) {
                if !moves {
                    *q = [0.0; 3];
                }
            }
            let curvature = dot(&self.p, &self.product);
            if curvature <= 0.0 || curvature.is_nan() {
                return false;
            }
            let alpha = rz / curvature;
            for (((x, r), p), q) in x.iter_mut().zip(&mut self.r).zip(&self.p).zip(&self.product) {
                for d in 0..3 {
                    x[d] += alpha * p[d];
                    r[d] -= alpha * q[d];
                }
            }
            self.precondition();
            let next = dot(&self.r, &self.z);
            let beta = next / rz;
            rz = next;
            for (p, z) in self.p.iter_mut().zip(&self.z) {
                for d in 0..3 {
                    p[d] = z[d] + beta * p[d];
                }
            }
        }
        false
    }

    fn precondition(&mut self) {
        for ((z, r), block) in self.z.iter_mut().zip(&self.r).zip(&self.blocks) {
            *z = (block * Vector3::from(*r)).into();
        }
    }
}

fn dot(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).sum()
}
