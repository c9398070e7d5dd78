//! The spring forces of a network on flat arrays, as fast as its shape allows.
//!
//! `F_a += (k − k L/|x_b − x_a|)(x_b − x_a)`, `F_b −=` the same (Zhang et al., Eq. (3), second line), with `k L` stored.
//! Sheets and tubes: consecutive nodes along diagonals (`stencil`), the few springs off them as `edges`. Any other mesh:
//! `rows`. Springs whose ends coincide (nearer than [`COINCIDENT_M`]) have no direction: they give no force and are
//! counted. Equal inputs give equal bits on one instruction set; between instruction sets and between paths the sums
//! differ by rounding. Deliberately absent: drag (the integrators treat it), attachments and stitches (constraints).

mod aligned;
mod diagonals;
pub mod dispatch;
mod portable;
mod quads;
pub mod single;
mod single_stencil;
mod stencil;
mod strips;
#[cfg(test)]
mod tests;
pub(super) mod tiles;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::tissue::crew::{Alone, Crew};
use crate::tissue::force::{COINCIDENT_M, push};
use crate::tissue::network::{Spring, SpringNetwork};
use crate::vector::Vec3;
use diagonals::Diagonals;
use dispatch::KernelLevel;
use quads::Quads;
use single::{Ends, Singles};
use single_stencil::SingleStencil;
use std::sync::Arc;
use stencil::Stencil;
use strips::Strips;

/// How a sweep visits the springs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KernelPath {
    /// Each spring once, in the row of its lower node.
    Rows,
    /// Each spring from both ends; every node writes only its own force.
    Gather,
    /// Each spring once, along diagonals; springs off them one by one.
    Stencil,
    /// Strip by strip, for a crew; each on the path that suits it.
    Strips,
}

/// Numbers of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f64` throughout.
    #[default]
    Double,
    /// Two `f32` per coordinate, one for all else, to [`single::SINGLE_TOLERANCE`]; for finite positions within 1e15 m.
    /// Coincident ends give no force but are not counted.
    Single,
}

/// Share of springs on diagonals from which the stencil is chosen.
const STENCIL_SHARE: f64 = 0.6;

/// All springs of a network, ready to sweep.
#[derive(Clone, Debug)]
pub struct SpringSweep {
    layout: Layout,
    level: KernelLevel,
    path: KernelPath,
    precision: Precision,
    /// Both ends of each spring, to count those that coincide.
    ends: Vec<[u32; 2]>,
    /// Springs that pull only: few, their push is taken out again after the sweep.
    pulls_only: Vec<Spring>,
}

#[derive(Clone, Debug)]
enum Layout {
    Quads(Quads),
    Stencil(Box<Stencil>, Option<Quads>),
    Singles(Singles),
    SingleStencil(Box<SingleStencil>, Option<Quads>),
    Strips(Strips),
}

impl SpringSweep {
    /// Lays out a network on the path that suits it, in double precision, for the best instruction set.
    #[must_use]
    pub fn new(network: &SpringNetwork) -> Self {
        Self::automatic(network, Precision::Double, KernelLevel::Best)
    }

    /// Lays out a network on the path that suits it.
    #[must_use]
    pub fn automatic(network: &SpringNetwork, precision: Precision, level: KernelLevel) -> Self {
        let (diagonals, rest) = Diagonals::find(&network.springs);
        let regular = diagonals.springs as f64 >= STENCIL_SHARE * network.springs.len() as f64;
        if !regular || network.springs.is_empty() {
            return Self::with(network, KernelPath::Rows, precision, level);
        }
        if precision == Precision::Single {
            return Self::with(network, KernelPath::Stencil, precision, level);
        }
        let rest = (!rest.is_empty()).then(|| Quads::edges(&rest));
        let stencil = Box::new(Stencil::new(diagonals, network.node_count()));
        Self::from_layout(network, Layout::Stencil(stencil, rest), KernelPath::Stencil, Precision::Double, level)
    }

    /// Lays out a network in strips, for several hands.
    #[must_use]
    pub fn shared(network: &SpringNetwork, precision: Precision, level: KernelLevel, crew: Arc<dyn Crew>) -> Self {
        let strips = Layout::Strips(Strips::new(network, precision, level, crew));
        Self::from_layout(network, strips, KernelPath::Strips, precision, level)
    }

    /// Lays out a network on a given path; in strips with one pair of hands.
    #[must_use]
    pub fn with(network: &SpringNetwork, path: KernelPath, precision: Precision, level: KernelLevel) -> Self {
        let (springs, nodes) = (&network.springs, network.node_count());
        let layout = match (path, precision) {
            (KernelPath::Strips, _) => Layout::Strips(Strips::new(network, precision, level, Arc::new(Alone))),
            (KernelPath::Rows, Precision::Double) => Layout::Quads(Quads::rows(springs, nodes)),
            (KernelPath::Gather, Precision::Double) => Layout::Quads(Quads::gather(springs, nodes)),
            (KernelPath::Rows, Precision::Single) => Layout::Singles(Singles::new(network, Ends::Lower)),
            (KernelPath::Gather, Precision::Single) => Layout::Singles(Singles::new(network, Ends::Both)),
            (KernelPath::Stencil, _) => {
                let (diagonals, rest) = Diagonals::find(springs);
                let rest = (!rest.is_empty()).then(|| Quads::edges(&rest));
                match precision {
                    Precision::Double => Layout::Stencil(Box::new(Stencil::new(diagonals, nodes)), rest),
                    Precision::Single => Layout::SingleStencil(Box::new(SingleStencil::new(&diagonals, nodes)), rest),
                }
            }
        };
        Self::from_layout(network, layout, path, precision, level)
    }

    fn from_layout(
        network: &SpringNetwork,
        layout: Layout,
        path: KernelPath,
        precision: Precision,
        level: KernelLevel,
    ) -> Self {
        let ends = network.springs.iter().map(|s| [s.a, s.b]).collect();
        let pulls_only = network.pulls_only.iter().map(|&i| network.springs[i as usize]).collect();
        Self { layout, level, path, precision, ends, pulls_only }
    }

    /// The path taken.
    #[must_use]
    pub fn path(&self) -> KernelPath {
        self.path
    }

    /// The numbers taken.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// The limit on instruction sets.
    #[must_use]
    pub fn level(&self) -> KernelLevel {
        self.level
    }

    /// Springs on diagonals.
    #[must_use]
    pub fn regular_springs(&self) -> usize {
        match &self.layout {
            Layout::Quads(_) | Layout::Singles(_) => 0,
            Layout::Stencil(_, rest) | Layout::SingleStencil(_, rest) => {
                self.ends.len() - rest.as_ref().map_or(0, Quads::springs)
            }
            Layout::Strips(strips) => strips.regular_springs(),
        }
    }

    /// Writes the spring force on every node. Returns the number of springs whose ends coincide; they give no force.
    ///
    /// # Panics
    /// When the slices are shorter than the network has nodes.
    pub fn sweep(&mut self, position_m: &[Vec3], force_n: &mut [Vec3]) -> u32 {
        let least = match &mut self.layout {
            Layout::Quads(quads) => self.level.for_quads().run(quads.sweep(position_m, force_n)),
            Layout::Stencil(stencil, rest) => {
                let least = self.level.run(stencil.sweep(position_m, force_n));
                let level = self.level.for_quads();
                rest.as_mut().map_or(least, |rest| least.min(level.run(rest.sweep(position_m, force_n))))
            }
            Layout::Singles(singles) => {
                self.level.for_quads().run(singles.sweep(position_m, force_n));
                f64::MAX
            }
            Layout::SingleStencil(stencil, rest) => {
                self.level.run(stencil.sweep(position_m, force_n));
                if let Some(rest) = rest {
                    self.level.for_quads().run(rest.sweep(position_m, force_n));
                }
                f64::MAX
            }
            Layout::Strips(strips) => strips.sweep(position_m, force_n),
        };
        for s in &self.pulls_only {
            let (a, b) = (s.a as usize, s.b as usize);
            let pushed = push(&position_m[a], &position_m[b], s.stiffness_n_per_m, s.rest_length_m);
            force_n[a] -= pushed;
            force_n[b] += pushed;
        }
        if least < COINCIDENT_M * COINCIDENT_M { self.count_coincident(position_m) } else { 0 }
    }

    /// Springs whose ends coincide.
    #[cold]
    pub(super) fn count_coincident(&self, position_m: &[Vec3]) -> u32 {
        let near =
            |ends: &&[u32; 2]| (position_m[ends[1] as usize] - position_m[ends[0] as usize]).norm() < COINCIDENT_M;
        self.ends.iter().filter(near).count() as u32
    }
}
