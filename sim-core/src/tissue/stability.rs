//! The stability number of a network, and the sub-steps that keep it below 1.
//!
//! Semi-implicit with implicit drag: `S = λ_max((4M + 2hC)^{-1/2} h²K (4M + 2hC)^{-1/2})`, stable for
//! `S < 1`, i.e. `λ h² < 4 m + 2 c h` on a uniform net. The paper's explicit form:
//! `S = λ_max((4M)^{-1/2} (h²K + 2hC) (4M)^{-1/2})`, i.e. `λ h² + 2 c h < 4 m`. `K` is the tangent at
//! the given state with `g = max(1 − L/l, 0)` (no spring counts as negative), fixed nodes removed.
//! λ by power iteration from a fixed start vector: equal inputs give equal bits.
//! Deliberately absent: a NaN check as a test of stability; unstable nets can sit in a bounded cycle.

use crate::tissue::force::COINCIDENT_M;
use crate::tissue::integrator::Integrator;
use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;
use std::fmt;

/// Power iterations: from a rough start the largest eigenvalue is within 2 % by then, which the
/// target below covers.
const POWER_ITERATIONS: usize = 40;

/// Sub-steps are chosen for `S` below this: 2 % for the eigenvalue estimate, the rest for the growth
/// of the tangent when tissue is stretched (`g` rises from 0 to about 0.3 at 50 % strain).
pub const TARGET_NUMBER: f64 = 0.8;

/// Why the sub-steps are what they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubstepReason {
    /// One step per period is stable.
    OneIsEnough,
    /// Chosen so that the stability number stays below [`TARGET_NUMBER`].
    Chosen,
    /// Demanded by the configuration.
    Demanded,
}

/// Verdict on a network, a period and an integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stability {
    /// Integrator it is about.
    pub integrator: Integrator,
    /// Solver period, seconds.
    pub period_s: f64,
    /// Sub-steps per period.
    pub substeps: u32,
    /// Largest eigenvalue of the tangent stiffness, newtons per metre.
    pub lambda_max_n_per_m: f64,
    /// Stability number at the sub-step; stable below 1.
    pub number: f64,
    /// Why so many sub-steps.
    pub reason: SubstepReason,
}

impl Stability {
    /// Length of a sub-step, seconds.
    #[must_use]
    pub fn substep_s(&self) -> f64 {
        self.period_s / f64::from(self.substeps)
    }
}

impl fmt::Display for Stability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let why = match self.reason {
            SubstepReason::OneIsEnough => "one step per period is stable",
            SubstepReason::Chosen => "sub-steps chosen by the stability number",
            SubstepReason::Demanded => "sub-steps demanded by the configuration",
        };
        write!(
            f,
            "{}: S = {:.3} at {:.3} ms ({} per {:.3} ms period), lambda_max = {:.1} N/m; {why}",
            self.integrator.name(),
            self.number,
            self.substep_s() * 1e3,
            self.substeps,
            self.period_s * 1e3,
            self.lambda_max_n_per_m
        )
    }
}

/// Tangent stiffness of a network at one state, one entry per spring between movable or fixed nodes.
#[derive(Clone, Debug)]
pub struct Tangent {
    entries: Vec<TangentEntry>,
    fixed: Vec<u8>,
}

#[derive(Clone, Copy, Debug)]
struct TangentEntry {
    a: u32,
    b: u32,
    axial: f64,
    transverse: f64,
    direction: Vec3,
}

impl Tangent {
    /// Tangent at `position_m`.
    #[must_use]
    pub fn at(network: &SpringNetwork, position_m: &[Vec3]) -> Self {
        let entries = network.springs.iter().map(|s| {
            let d = position_m[s.b as usize] - position_m[s.a as usize];
            let length = d.norm().max(COINCIDENT_M);
            let g = (1.0 - s.rest_length_m / length).max(0.0);
            let transverse = s.stiffness_n_per_m * g;
            TangentEntry { a: s.a, b: s.b, axial: s.stiffness_n_per_m - transverse, transverse, direction: d / length }
        });
        Self { entries: entries.collect(), fixed: network.fixed.clone() }
    }

    /// `out = K v`, with fixed nodes removed.
    pub fn apply(&self, v: &[Vec3], out: &mut [Vec3]) {
        out.fill(Vec3::zeros());
        for e in &self.entries {
            let (a, b) = (e.a as usize, e.b as usize);
            let d = v[b] - v[a];
            let f = d * e.transverse + e.direction * (e.axial * e.direction.dot(&d));
            out[a] -= f;
            out[b] += f;
        }
        for (row, &fixed) in out.iter_mut().zip(&self.fixed) {
            if fixed != 0 {
                *row = Vec3::zeros();
            }
        }
    }

    /// Largest eigenvalue of `D^{-1/2} (α K + diag(B)) D^{-1/2}` for the node diagonals `D` and `B`.
    ///
    /// The least `B/D` is taken off before the iteration and put back after it: where drag makes up most of every
    /// eigenvalue, they lie close together and the iteration would not tell them apart.
    fn largest(&self, scale: &[f64], stiffness_factor: f64, extra: &[f64]) -> f64 {
        let nodes = self.fixed.len();
        let mut v: Vec<Vec3> = (0..nodes).map(|i| start_vector(i) * f64::from(1 - self.fixed[i].min(1))).collect();
        let (mut scaled, mut w) = (vec![Vec3::zeros(); nodes], vec![Vec3::zeros(); nodes]);
        if v.iter().all(|v| *v == Vec3::zeros()) {
            return 0.0;
        }
        let shift = extra.iter().zip(scale).map(|(b, d)| b / d).fold(f64::INFINITY, f64::min);
        let mut lambda = 0.0;
        for _ in 0..POWER_ITERATIONS {
            let norm = v.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
            if norm == 0.0 {
                break;
            }
            for (v, (s, d)) in v.iter_mut().zip(scaled.iter_mut().zip(scale)) {
                *v /= norm;
                *s = *v / d.sqrt();
            }
            self.apply(&scaled, &mut w);
            lambda = 0.0;
            for i in 0..nodes {
                let next = (w[i] * stiffness_factor + scaled[i] * (extra[i] - shift * scale[i])) / scale[i].sqrt();
                lambda += v[i].dot(&next);
                v[i] = next;
            }
        }
        lambda + shift
    }
}

/// A fixed start vector with parts in every mode: components from a small integer hash, with the sign
/// alternating so that the shortest waves (the stiffest modes) are strong from the start.
fn start_vector(node: usize) -> Vec3 {
    let part = |axis: usize| {
        let hash = (node * 3 + axis).wrapping_mul(0x9E37_79B9) & 0xFFFF;
        hash as f64 / 65_536.0 - 0.5
    };
    let sign = if node % 2 == 0 { 1.0 } else { -1.0 };
    Vec3::new(part(0) + 0.25 * sign, part(1) - 0.25 * sign, part(2) + 0.25 * sign)
}

/// Largest eigenvalue of the tangent stiffness, newtons per metre.
#[must_use]
pub fn lambda_max(tangent: &Tangent) -> f64 {
    let nodes = tangent.fixed.len();
    tangent.largest(&vec![1.0; nodes], 1.0, &vec![0.0; nodes])
}

/// Stability number of a step of `h` seconds.
#[must_use]
pub fn stability_number(tangent: &Tangent, network: &SpringNetwork, integrator: Integrator, h: f64) -> f64 {
    let nodes = network.mass_kg.iter().zip(&network.drag_n_s_per_m);
    let (scale, extra): (Vec<f64>, Vec<f64>) = match integrator {
        Integrator::SemiImplicit => nodes.map(|(m, c)| (4.0 * m + 2.0 * c * h, 0.0)).unzip(),
        Integrator::PaperExplicit => nodes.map(|(m, c)| (4.0 * m, 2.0 * c * h)).unzip(),
    };
    tangent.largest(&scale, h * h, &extra)
}

/// Fewest sub-steps of `period_s` whose stability number is below `target`, with that number; `None`
/// when more than `limit` are needed. The number falls at least as `1/n` and at most as `1/n²`, so
/// stepping up from the `1/n²` guess never passes the answer.
#[must_use]
pub fn fewest_substeps(
    tangent: &Tangent,
    network: &SpringNetwork,
    integrator: Integrator,
    period_s: f64,
    target: f64,
    limit: u32,
) -> Option<(u32, f64)> {
    let mut substeps = 1_u32;
    while substeps <= limit {
        let number = stability_number(tangent, network, integrator, period_s / f64::from(substeps));
        if number < target {
            return Some((substeps, number));
        }
        let guess = (f64::from(substeps) * (number / target).sqrt()).min(f64::from(u32::MAX)) as u32;
        substeps = guess.max(substeps.saturating_add(1));
    }
    None
}
