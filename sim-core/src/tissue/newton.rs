//! Newton's method for one implicit step.
//!
//! Finds `y` with `r(y) = F(y) − D (y − b) = 0`, where `b` is the place a node would go to without springs and `D` its
//! resistance (`bdf2`): `A δ = r`, `y ← y + δ` with the clamped tangent `A` (`step_matrix`), solved by `pcg` down to the
//! linear tolerance, and further where the step is short: ‖r‖ ≤ 10 ρ³ ‖r(x)‖ with ρ = ‖r(ŷ)‖/‖r(x)‖ for the prediction
//! `ŷ`, a forcing term after Eisenstat and Walker (1996). What is left acts as a force on the nodes; ‖r(x)‖ grows as 1/h
//! and ρ falls as h, so it falls as h², and the order of the scheme shows. One or two iterations from a predicted start
//! do in a running simulation; the reference setting goes on to 1e-10. When other attachments or pairs pull than the
//! last solve assumed, a few more are done. A node goes at most the displacement limit from where it was, and a residual
//! far beyond what would take it there is cut, so that no load can leave the range of numbers. A body that nothing holds
//! keeps its momentum whatever is left of the residual: its springs cannot change it, so the mean is solved exactly.
//! Deliberately absent: a line search.

use crate::tissue::couplings::{Active, Couplings};
use crate::tissue::network::SpringNetwork;
use crate::tissue::node::Node;
use crate::tissue::patch_set::PatchSet;
use crate::tissue::pcg::Pcg;
use crate::tissue::step_matrix::StepMatrix;
use crate::tissue::sweep::SpringSweep;
use crate::vector::Vec3;

/// More iterations while the set of acting attachments and pairs changes.
const ACTIVE_SET_PASSES: u32 = 4;

/// A component of a residual counts up to this many times what takes a node to its limit with all its neighbours held.
const RESIDUAL_CAP: f64 = 10.0;

/// A solve need not place nodes better than this part of the mesh spacing, at a linear tolerance of 1 and a step of
/// [`NEGLIGIBLE_AT_S`]; over shorter steps it falls as the step's own error does, h³.
const NEGLIGIBLE_SPACINGS: f64 = 1e-7;

/// Seconds.
const NEGLIGIBLE_AT_S: f64 = 5e-3;

/// Nor better than rounding lets it.
const ROUNDING_SPACINGS: f64 = 4e-16;

/// The factor of ρ³. With 1 the order is 1.96 from 0.4 to 0.025 ms on a net with little drag and a step of 5 ms takes 4 % more
/// iterations than without; with 10, 1.84 and 1 %; without, the error grows below 0.2 ms.
const SHORT_STEP: f64 = 10.0;

/// How far an implicit step is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonParams {
    /// Iterations of Newton's method; fewer once the residual is below the tolerance.
    pub iterations: u32,
    /// Residual at which it ends, relative to that at the start of the step.
    pub tolerance: f64,
    /// Residual at which a linear solve ends, relative to that at the start of the step; a short step goes further.
    pub linear_tolerance: f64,
    /// Most iterations of a linear solve.
    pub max_linear_iterations: u32,
}

impl Default for NewtonParams {
    fn default() -> Self {
        Self { iterations: 1, tolerance: 1e-10, linear_tolerance: 1e-3, max_linear_iterations: 500 }
    }
}

impl NewtonParams {
    /// For reference solutions: solved to 1e-10.
    #[must_use]
    pub fn reference() -> Self {
        Self { iterations: 50, tolerance: 1e-10, linear_tolerance: 1e-12, max_linear_iterations: 5000 }
    }
}

/// The vector with its largest component cut to `most`; finite whenever the vector is.
pub(crate) fn cap(vector: Vec3, most: f64) -> Vec3 {
    let peak = vector.amax();
    if peak > most { (vector / peak) * most } else { vector }
}

/// What one step is about.
pub(crate) struct NewtonView<'a> {
    pub(crate) network: &'a SpringNetwork,
    /// `b`, metres.
    pub(crate) free_m: &'a [Vec3],
    /// Positions at the start of the step, metres.
    pub(crate) start_m: &'a [Vec3],
    /// Length of the step, seconds.
    pub(crate) h: f64,
    pub(crate) limit_m: f64,
    pub(crate) spacing_m: f64,
    pub(crate) hold: Hold,
    pub(crate) params: &'a NewtonParams,
}

/// Whether anything holds the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hold {
    /// Every node may move.
    Free,
    /// Some nodes are fixed or in a hand.
    Held,
}

/// What a solve did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Solved {
    pub(crate) sweeps: u32,
    pub(crate) linear_iterations: u32,
    pub(crate) coincident: u32,
    pub(crate) active: Active,
}

/// Matrix and vectors of the method.
#[derive(Clone, Debug)]
pub(crate) struct Newton {
    pub(crate) matrix: StepMatrix,
    pcg: Pcg,
}

impl Newton {
    pub(crate) fn new(network: &SpringNetwork) -> Self {
        Self { matrix: StepMatrix::new(network), pcg: Pcg::new(network.node_count()) }
    }

    /// Moves `position_m` from the prediction to the solution. `force_n` is for the forces.
    pub(crate) fn solve(
        &mut self,
        view: &NewtonView<'_>,
        springs: &mut SpringSweep,
        couplings: &mut Couplings<'_>,
        position_m: &mut [Vec3],
        force_n: &mut [Vec3],
    ) -> Solved {
        let mut done = Solved::default();
        let linear = view.params.linear_tolerance;
        let short = (view.h / NEGLIGIBLE_AT_S).min(1.0);
        let negligible = view.spacing_m * (NEGLIGIBLE_SPACINGS * linear * short.powi(3)).max(ROUNDING_SPACINGS);
        let floor = negligible * negligible * self.matrix.bound().iter().sum::<f64>();
        let mut first = None;
        let mut limited = 0_u32;
        for iteration in 0.. {
            let solved_for = done.active;
            done.active = couplings.stretch(position_m, self.matrix.bound());
            let settled = iteration > 0 && done.active == solved_for;
            if iteration >= view.params.iterations
                && (settled || iteration >= view.params.iterations + ACTIVE_SET_PASSES)
            {
                break;
            }
            done.coincident = springs.sweep(position_m, force_n);
            done.sweeps += 1;
            couplings.add_forces(force_n);
            self.find_residual(view, position_m, force_n);
            self.matrix.assemble(view.network, position_m);
            couplings.add_blocks(&mut self.matrix);
            self.matrix.invert();
            for ((s, y), x) in self.pcg.search.iter_mut().zip(&*position_m).zip(view.start_m) {
                *s = Node::from(&(y - x));
            }
            let whole = self.pcg.size_before(&self.matrix, couplings);
            let scale = *first.get_or_insert(whole);
            let enough = (view.params.tolerance * view.params.tolerance * scale).max(floor);
            if settled && self.pcg.size(&self.matrix) <= enough {
                break;
            }
            // `size` is the square of a norm, and so is the goal.
            let ahead = self.pcg.size(&self.matrix);
            let short = SHORT_STEP * SHORT_STEP * whole * (ahead / whole).powi(3);
            let goal = (linear * linear * whole).min(short).max(floor);
            done.linear_iterations += self.pcg.solve(&self.matrix, couplings, goal, view.params.max_linear_iterations);
            for ((y, shift), x) in position_m.iter_mut().zip(&self.pcg.solution).zip(view.start_m) {
                *y += shift.vector();
                let way = *y - x;
                let length = way.norm();
                if length > view.limit_m {
                    limited += 1;
                    *y = x + (way / length) * view.limit_m;
                }
            }
        }
        // A node that was cut has lost momentum; its share is not for the others to make up.
        if view.hold == Hold::Free && limited == 0 {
            self.keep_momentum(view, position_m);
        }
        done
    }

    /// `r = F − D (y − b)`, 0 for nodes that may not move.
    fn find_residual(&mut self, view: &NewtonView<'_>, position_m: &[Vec3], force_n: &[Vec3]) {
        let nodes = self.matrix.resistance().iter().zip(self.matrix.bound());
        let places = position_m.iter().zip(view.free_m).zip(force_n);
        for ((r, (&d, &bound)), ((y, b), f)) in self.pcg.residual.iter_mut().zip(nodes).zip(places) {
            let left = if bound > 0.0 { f - (y - b) * d } else { Vec3::zeros() };
            *r = Node::from(&cap(left, RESIDUAL_CAP * bound * view.limit_m));
        }
    }

    /// Shifts a free body so that `Σ D (y − b) = 0`: the forces of springs, attachments and pairs sum to 0.
    fn keep_momentum(&self, view: &NewtonView<'_>, position_m: &mut [Vec3]) {
        let (mut sum, mut weight) = (Vec3::zeros(), 0.0);
        for ((y, b), &d) in position_m.iter().zip(view.free_m).zip(self.matrix.resistance()) {
            sum += (b - y) * d;
            weight += d;
        }
        let shift = sum / weight;
        if weight > 0.0 && shift.norm() <= view.limit_m {
            position_m.iter_mut().for_each(|y| *y += shift);
        }
    }
}

/// Linear iterations of a first Newton iteration when the node in the middle of the free ones is shifted, in an implicit
/// Euler step of `h` seconds. Counted on the net itself: equal nets give equal counts.
pub(crate) fn trial_iterations(network: &SpringNetwork, position_m: &[Vec3], h: f64, params: &NewtonParams) -> u32 {
    let free = || (0..network.node_count()).filter(|&node| network.fixed[node] == 0);
    let (sum, count) = free().fold((Vec3::zeros(), 0_u32), |(sum, n), node| (sum + position_m[node], n + 1));
    let center = sum / f64::from(count.max(1));
    let off = |node: &usize| (position_m[*node] - center).norm_squared();
    let Some(middle) = free().min_by(|a, b| off(a).total_cmp(&off(b))) else { return 0 };
    let moves = |node: usize| f64::from(network.fixed[node] == 0 && node != middle);
    let mobility: Vec<f64> = (0..network.node_count()).map(moves).collect();
    let mut newton = Newton::new(network);
    newton.matrix.resist(network, &mobility, 1.0 / (h * h), 1.0 / h);
    newton.matrix.assemble(network, position_m);
    newton.matrix.invert();
    let patches = PatchSet::default();
    let couplings = Couplings::new(&patches, None, None);
    newton.pcg.search[middle] = Node::from(&Vec3::repeat(1.0));
    let Newton { matrix, pcg } = &mut newton;
    matrix.multiply(&pcg.search, &mut pcg.residual);
    let goal = params.linear_tolerance * params.linear_tolerance * pcg.size(matrix);
    pcg.solve(matrix, &couplings, goal, params.max_linear_iterations)
}
