//! Compliant distance constraints between two patches: stitches, the suture control's hold, touching wound edges.
//!
//! Position level, implicit: tension `λ = K · max(|x_a − x_b| − D, 0)` at the *end* of the step, found
//! from `Δλ = (C − λ/K)/(1/K + nᵀ(W_a + W_b)n)` by a few Gauss–Seidel sweeps over all pairs in fixed
//! order; `W` is the displacement of a patch per newton in one step (its attachment links included),
//! `h²/(m + c h)` weighted, zero where the patch is prescribed. λ is clamped to the holding force.
//! Force and statics do not depend on the step. Deliberately absent: knots, slip and friction, which
//! the wound control decides between steps by changing `target_m` or dropping the pair.

use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::vector::{Mat3, Vec3};

mod implicit;

/// Gauss–Seidel sweeps: pairs couple only through shared patches, where each sweep halves the error
/// or better; 12 leave less than 1e-3 of it.
const SWEEPS: usize = 12;

/// Patch centres closer than this give a pair no direction, metres.
const COINCIDENT_M: f64 = 1e-9;

/// Which way a pair may act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairSense {
    /// Pulls the patches together, never apart (a stitch).
    PullOnly,
    /// Pushes the patches apart, never together (wound edges that touch).
    PushOnly,
    /// Holds the distance both ways (the paper's control).
    TwoSided,
}

/// One pair of patches held at a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairConstraint {
    /// First patch.
    pub a: PatchId,
    /// Second patch.
    pub b: PatchId,
    /// Distance of the centroids that is held, metres.
    pub target_m: f64,
    /// Stiffness, newtons per metre; infinite for a rigid link.
    pub stiffness_n_per_m: f64,
    /// Holding force: the tension is cut off here, newtons.
    pub max_force_n: f64,
    /// Which way it acts.
    pub sense: PairSense,
}

/// Why a pair is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("pair of patches {a} and {b}: {what}")]
pub struct PairError {
    /// First patch.
    pub a: u32,
    /// Second patch.
    pub b: u32,
    /// What is wrong and what is needed.
    pub what: &'static str,
}

/// All pairs of a scene with their tensions.
#[derive(Clone, Debug, Default)]
pub struct Pairs {
    pairs: Vec<Pair>,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    constraint: PairConstraint,
    /// From `b` to `a`, unit, at the start of the sweep; zero where there is none.
    direction: Vec3,
    excess_m: f64,
    tension_n: f64,
    /// Of the last stretch in an implicit step.
    axial_n_per_m: f64,
}

/// How a patch gives way within one step: displacement per newton, and displacement so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchResponse {
    pub(crate) mobility: Mat3,
    pub(crate) shift_m: Vec3,
}

impl PatchResponse {
    /// A patch that only its own mass and drag hold back.
    pub(crate) fn free(mobility_m_per_n: f64) -> Self {
        Self { mobility: Mat3::identity() * mobility_m_per_n, shift_m: Vec3::zeros() }
    }
}

impl Pairs {
    /// No pair yet, room for `capacity`.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self { pairs: Vec::with_capacity(capacity) }
    }

    /// Adds a pair and returns its index.
    ///
    /// # Errors
    /// [`PairError`]: patches unknown or equal, target or force not finite and at least 0, stiffness
    /// not above 0.
    pub fn push(&mut self, patches: &PatchSet, constraint: PairConstraint) -> Result<usize, PairError> {
        check(patches, &constraint)?;
        self.pairs.push(Pair {
            constraint,
            direction: Vec3::zeros(),
            excess_m: 0.0,
            tension_n: 0.0,
            axial_n_per_m: 0.0,
        });
        Ok(self.pairs.len() - 1)
    }

    /// Replaces a pair, keeping its index.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn set(&mut self, patches: &PatchSet, index: usize, constraint: PairConstraint) -> Result<(), PairError> {
        check(patches, &constraint)?;
        let what = "there is no pair of this index; add it first";
        let missing = PairError { a: constraint.a.0, b: constraint.b.0, what };
        self.pairs.get_mut(index).ok_or(missing)?.constraint = constraint;
        Ok(())
    }

    /// Drops all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Number of pairs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// True without pairs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The constraint of a pair.
    #[must_use]
    pub fn constraint(&self, index: usize) -> Option<&PairConstraint> {
        self.pairs.get(index).map(|p| &p.constraint)
    }

    /// Tension of a pair at the end of the last step, newtons, positive when it pulls together.
    #[must_use]
    pub fn tension_n(&self, index: usize) -> f64 {
        self.pairs.get(index).map_or(0.0, |p| p.tension_n)
    }

    /// Force of all pairs on one patch at the end of the last step, newtons.
    #[must_use]
    pub fn force_on(&self, patch: PatchId) -> Vec3 {
        self.pairs.iter().fold(Vec3::zeros(), |sum, p| {
            let sign = f64::from(p.constraint.b == patch) - f64::from(p.constraint.a == patch);
            sum + p.direction * (sign * p.tension_n)
        })
    }

    /// The pairs that act on a patch now: other patch, direction, stiffness.
    pub(crate) fn acting_on(&self, patch: PatchId) -> impl Iterator<Item = (PatchId, Vec3, f64)> {
        let acting = self.pairs.iter().filter(|p| p.tension_n != 0.0 && p.tension_n.abs() < p.constraint.max_force_n);
        acting.filter_map(move |p| {
            let c = &p.constraint;
            let other = if c.a == patch { c.b } else { c.a };
            (c.a == patch || c.b == patch).then_some((other, p.direction, c.stiffness_n_per_m))
        })
    }

    /// Finds the tensions from the predicted positions and adds the displacements to `responses`.
    /// Returns the number of pairs that pull or push.
    pub(crate) fn solve(&mut self, patches: &PatchSet, position_m: &[Vec3], responses: &mut [PatchResponse]) -> u32 {
        for p in &mut self.pairs {
            let d = patches.mean(p.constraint.a, position_m) - patches.mean(p.constraint.b, position_m);
            let length = d.norm();
            p.tension_n = 0.0;
            p.direction = if length < COINCIDENT_M { Vec3::zeros() } else { d / length };
            p.excess_m = length - p.constraint.target_m;
        }
        for _ in 0..SWEEPS {
            for p in &mut self.pairs {
                p.relax(responses);
            }
        }
        self.pairs.iter().filter(|p| p.tension_n != 0.0).count() as u32
    }
}

impl Pair {
    fn relax(&mut self, responses: &mut [PatchResponse]) {
        let c = &self.constraint;
        let (a, b) = (c.a.0 as usize, c.b.0 as usize);
        let n = self.direction;
        let compliance = 1.0 / c.stiffness_n_per_m;
        let mobility = n.dot(&((responses[a].mobility + responses[b].mobility) * n));
        let room = compliance + mobility;
        if room <= 0.0 || n == Vec3::zeros() {
            return;
        }
        let excess = self.excess_m + n.dot(&(responses[a].shift_m - responses[b].shift_m));
        let (lowest, highest) = match c.sense {
            PairSense::PullOnly => (0.0, c.max_force_n),
            PairSense::PushOnly => (-c.max_force_n, 0.0),
            PairSense::TwoSided => (-c.max_force_n, c.max_force_n),
        };
        let wanted = self.tension_n + (excess - compliance * self.tension_n) / room;
        let change = wanted.clamp(lowest, highest) - self.tension_n;
        self.tension_n += change;
        let pull = n * change;
        responses[a].shift_m -= responses[a].mobility * pull;
        responses[b].shift_m += responses[b].mobility * pull;
    }
}

fn check(patches: &PatchSet, c: &PairConstraint) -> Result<(), PairError> {
    let error = |what| Err(PairError { a: c.a.0, b: c.b.0, what });
    if !patches.contains(c.a) || !patches.contains(c.b) {
        return error("names a patch that does not exist");
    }
    if c.a == c.b {
        return error("needs two different patches");
    }
    if !(c.target_m.is_finite() && c.target_m >= 0.0) {
        return error("the distance to hold must be finite and at least 0");
    }
    if c.stiffness_n_per_m.is_nan() || c.stiffness_n_per_m <= 0.0 {
        return error("the stiffness must be above 0");
    }
    if c.max_force_n.is_nan() || c.max_force_n < 0.0 {
        return error("the holding force must be at least 0");
    }
    Ok(())
}
