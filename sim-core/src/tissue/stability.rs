//! The stability number of a network, and the sub-steps that keep it below 1.
//!
//! Semi-implicit with implicit drag: `S = λ_max((4M + 2hC)^{-1/2} h²K (4M + 2hC)^{-1/2})`, stable for
//! `S < 1`, i.e. `λ h² < 4 m + 2 c h` on a uniform net. The paper's explicit form:
//! `S = λ_max((4M)^{-1/2} (h²K + 2hC) (4M)^{-1/2})`, i.e. `λ h² + 2 c h < 4 m`. `K` is the tangent at
//! the given state with `g = max(1 − L/l, 0)` (no spring counts as negative), fixed nodes removed.
//! λ by Lanczos iteration from a fixed start vector: equal inputs give equal bits.
//! Deliberately absent: a NaN check as a test of stability; unstable nets can sit in a bounded cycle.

use crate::tissue::force::COINCIDENT_M;
use crate::tissue::integrator::Integrator;
use crate::tissue::network::SpringNetwork;
use crate::vector::Vec3;
use std::fmt;

/// Lanczos steps. The stiffest modes of a net lie close together: 40 power iterations came out 2.7 % low
/// on a 25 × 25 net; 40 Lanczos steps cost the same and are within 0.001 % of 400 there and on a 60 × 60 net.
const KRYLOV_STEPS: usize = 40;

/// The Krylov space is exhausted when the next vector is this much smaller than the eigenvalues.
const KRYLOV_END: f64 = 1e-10;

/// Halvings of the bracket of an eigenvalue: down to rounding.
const BISECTIONS: usize = 60;

/// Sub-steps are chosen for `S` below this: the margin is for the growth of the tangent when tissue is
/// stretched (`g` rises from 0 to about 0.3 at 50 % strain).
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
    /// The integrator is stable at any step.
    AnyIsStable,
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
            SubstepReason::AnyIsStable => "stable at any step",
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

    /// Largest eigenvalue of `D^{-1/2} (α K + diag(B)) D^{-1/2}` for the node diagonals `D` and `B`, by Lanczos.
    fn largest(&self, scale: &[f64], stiffness_factor: f64, extra: &[f64]) -> f64 {
        let nodes = self.fixed.len();
        let mut v: Vec<Vec3> = (0..nodes).map(|i| start_vector(i) * f64::from(1 - self.fixed[i].min(1))).collect();
        let (mut last, mut scaled, mut next) = (vec![Vec3::zeros(); nodes], v.clone(), v.clone());
        let (mut diagonal, mut side) = (Vec::with_capacity(KRYLOV_STEPS), Vec::with_capacity(KRYLOV_STEPS));
        let mut beta = v.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
        let negligible = f64::EPSILON * beta;
        v.iter_mut().for_each(|v| *v /= beta.max(f64::MIN_POSITIVE));
        while diagonal.len() < KRYLOV_STEPS && beta > negligible {
            for (s, (v, d)) in scaled.iter_mut().zip(v.iter().zip(scale)) {
                *s = v / d.sqrt();
            }
            self.apply(&scaled, &mut next);
            let old = side.last().copied().unwrap_or(0.0);
            let mut alpha = 0.0;
            for i in 0..nodes {
                next[i] = (next[i] * stiffness_factor + scaled[i] * extra[i]) / scale[i].sqrt() - last[i] * old;
                alpha += v[i].dot(&next[i]);
            }
            next.iter_mut().zip(&v).for_each(|(w, v)| *w -= v * alpha);
            beta = next.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
            std::mem::swap(&mut last, &mut v);
            for (v, w) in v.iter_mut().zip(&next) {
                *v = w / beta.max(f64::MIN_POSITIVE);
            }
            diagonal.push(alpha);
            side.push(beta);
            if beta <= KRYLOV_END * alpha.abs() {
                break;
            }
        }
        largest_of_tridiagonal(&diagonal, &side)
    }
}

/// Largest eigenvalue of a symmetric tridiagonal matrix by bisection on the Sturm count; `side[i]` stands
/// between rows `i` and `i + 1`.
fn largest_of_tridiagonal(diagonal: &[f64], side: &[f64]) -> f64 {
    let reach = |i: usize| diagonal[i] + side[i] + if i > 0 { side[i - 1] } else { 0.0 };
    let mut high = (0..diagonal.len()).map(reach).fold(0.0, f64::max);
    let mut low = 0.0;
    // All eigenvalues lie below `at` when every pivot of T − at·I is negative.
    let all_below = |at: f64| {
        let mut pivot = -1.0;
        for (i, d) in diagonal.iter().enumerate() {
            let b = if i > 0 { side[i - 1] } else { 0.0 };
            pivot = d - at - b * b / pivot;
            if pivot >= 0.0 {
                return false;
            }
        }
        true
    };
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if all_below(middle) { high = middle } else { low = middle }
    }
    high
}

/// A fixed start vector with parts in every mode: components from a small integer hash, with the sign
/// alternating so that the shortest waves (the stiffest modes) are strong from the start.
fn start_vector(node: usize) -> Vec3 {
    let part = |axis: usize| {
        let hash = (node * 3 + axis).wrapping_mul(0x9E37_79B9) & 0xFFFF;
        hash as f64 / 65_536.0 - 0.5
    };
    let sign = if node.is_multiple_of(2) { 1.0 } else { -1.0 };
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
        // An unconditionally stable integrator is given the number that the explicit form would have.
        Integrator::SemiImplicit | Integrator::Bdf2 | Integrator::Xpbd => {
            nodes.map(|(m, c)| (4.0 * m + 2.0 * c * h, 0.0)).unzip()
        }
        Integrator::PaperExplicit => nodes.map(|(m, c)| (4.0 * m, 2.0 * c * h)).unzip(),
        Integrator::Verlet => nodes.map(|(m, _)| (4.0 * m, 0.0)).unzip(),
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
