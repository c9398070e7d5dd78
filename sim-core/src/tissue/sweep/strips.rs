//! The force sweep in strips of consecutive nodes, for a crew: `F_a = Σ (k − k L/|d|) d` (Zhang et al., Eq. (3), second
//! line).
//!
//! A strip sweeps the springs between its own nodes on the path that suits them, then gathers its ends of the springs that
//! reach into other strips (its seam). It writes the forces on its own nodes only, so strips need not know of each other,
//! and how many there are depends on the mesh alone: the bits are the same for any number of hands, and within
//! rounding of those of an undivided sweep. Seams are in double precision whatever the strips are in.
//! Deliberately absent: what springs that only pull do not give; the caller takes it out.

use super::dispatch::{Kernel, KernelLevel, Lanes};
use super::{Precision, SpringSweep};
use crate::tissue::crew::Crew;
use crate::tissue::force::COINCIDENT_M;
use crate::tissue::network::{Spring, SpringNetwork};
use crate::vector::Vec3;
use std::ops::Range;
use std::sync::Arc;

/// Least nodes of a strip: fewer are swept in some ten microseconds, which is what it costs to wake a hand.
const STRIP_NODES: usize = 2048;
/// Strips begin at multiples of this, as the stretches of the stencil do.
const GRAIN: usize = 8;
/// More hands than this are not to be had.
const MOST_STRIPS: usize = 64;
/// Springs side by side.
const LANES: usize = 4;

/// All springs of a network, strip by strip.
#[derive(Clone, Debug)]
pub(super) struct Strips {
    strips: Vec<Strip>,
    crew: Arc<dyn Crew>,
}

/// Some consecutive nodes.
#[derive(Clone, Debug)]
struct Strip {
    nodes: Range<usize>,
    inside: Box<SpringSweep>,
    seam: Seam,
    level: KernelLevel,
    /// Whether the last sweep met ends that coincide.
    met_coincident: bool,
}

/// The half-springs of a strip that reach into others.
#[derive(Clone, Debug, Default)]
struct Seam {
    /// Nodes with such springs, by number within the strip.
    nodes: Vec<u32>,
    /// Fours of each of them, and the end of the last one's.
    start: Vec<u32>,
    fours: Vec<SeamFour>,
}

/// Four half-springs of one node; places without one repeat another with `k = k L = 0`.
#[derive(Clone, Copy, Debug)]
struct SeamFour {
    other: [u32; LANES],
    stiffness: [f64; LANES],
    preload: [f64; LANES],
}

impl Strips {
    /// Cuts a network.
    pub(super) fn new(network: &SpringNetwork, precision: Precision, level: KernelLevel, crew: Arc<dyn Crew>) -> Self {
        let count = network.node_count();
        // Halving gives two and four hands the same work.
        let strips = 1_usize << (count / STRIP_NODES).max(1).ilog2();
        let length = count.div_ceil(strips.min(MOST_STRIPS)).next_multiple_of(GRAIN).max(GRAIN);
        let ranges = (0..count).step_by(length).map(|start| start..count.min(start + length));
        let strip = |nodes: Range<usize>| Strip {
            inside: Box::new(SpringSweep::automatic(&network.part(nodes.clone()), precision, level)),
            seam: Seam::new(network, &nodes),
            nodes,
            level,
            met_coincident: false,
        };
        Self { strips: ranges.map(strip).collect(), crew }
    }

    /// Writes the force on every node. Returns 0 when ends of springs coincide somewhere, else a huge number.
    pub(super) fn sweep(&mut self, position_m: &[Vec3], force_n: &mut [Vec3]) -> f64 {
        share(self.crew.as_ref(), &mut self.strips, position_m, force_n);
        if self.strips.iter().any(|strip| strip.met_coincident) { 0.0 } else { f64::MAX }
    }

    /// Springs on diagonals.
    pub(super) fn regular_springs(&self) -> usize {
        self.strips.iter().map(|strip| strip.inside.regular_springs()).sum()
    }
}

/// Strips and the forces on their nodes, halved until one strip is left.
fn share(crew: &dyn Crew, strips: &mut [Strip], position_m: &[Vec3], force_n: &mut [Vec3]) {
    if let [strip] = strips {
        return strip.sweep(position_m, force_n);
    }
    if strips.is_empty() {
        return;
    }
    let (first, second) = strips.split_at_mut(strips.len() / 2);
    let cut = second[0].nodes.start - first[0].nodes.start;
    let (first_n, second_n) = force_n.split_at_mut(cut);
    crew.join(&mut || share(crew, first, position_m, first_n), &mut || share(crew, second, position_m, second_n));
}

impl Strip {
    fn sweep(&mut self, position_m: &[Vec3], force_n: &mut [Vec3]) {
        let coincident = self.inside.sweep(&position_m[self.nodes.clone()], force_n);
        let own_m = &position_m[self.nodes.clone()];
        let least = self.level.for_quads().run(SeamSweep { seam: &self.seam, own_m, position_m, force_n });
        self.met_coincident = coincident > 0 || least < COINCIDENT_M * COINCIDENT_M;
    }
}

impl Seam {
    fn new(network: &SpringNetwork, own: &Range<usize>) -> Self {
        let is_own = |node: u32| own.contains(&(node as usize));
        let mut ends: Vec<(u32, u32, &Spring)> = Vec::new();
        for s in &network.springs {
            match (is_own(s.a), is_own(s.b)) {
                (true, false) => ends.push((s.a, s.b, s)),
                (false, true) => ends.push((s.b, s.a, s)),
                _ => {}
            }
        }
        ends.sort_by_key(|e| (e.0, e.1));
        let mut seam = Self { start: vec![0], ..Self::default() };
        for row in ends.chunk_by(|e, f| e.0 == f.0) {
            seam.nodes.push(row[0].0 - own.start as u32);
            seam.fours.extend(row.chunks(LANES).map(SeamFour::new));
            seam.start.push(seam.fours.len() as u32);
        }
        seam
    }
}

impl SeamFour {
    fn new(ends: &[(u32, u32, &Spring)]) -> Self {
        let spring = |lane: usize| ends.get(lane).map(|e| e.2);
        Self {
            other: std::array::from_fn(|lane| ends[lane.min(ends.len() - 1)].1),
            stiffness: std::array::from_fn(|lane| spring(lane).map_or(0.0, |s| s.stiffness_n_per_m)),
            preload: std::array::from_fn(|lane| spring(lane).map_or(0.0, |s| s.stiffness_n_per_m * s.rest_length_m)),
        }
    }
}

/// One sweep along a seam: adds to the forces. Returns the least squared distance it met.
struct SeamSweep<'a> {
    seam: &'a Seam,
    /// Of the strip.
    own_m: &'a [Vec3],
    /// Of all nodes.
    position_m: &'a [Vec3],
    /// Of the strip.
    force_n: &'a mut [Vec3],
}

impl Kernel for SeamSweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let Self { seam, own_m, position_m, force_n } = self;
        let (zero, floor) = (lanes.quad([0.0; LANES]), lanes.quad([COINCIDENT_M * COINCIDENT_M; LANES]));
        let mut least = lanes.quad([f64::MAX; LANES]);
        for (&node, fours) in seam.nodes.iter().zip(seam.start.windows(2)) {
            let own = quad(lanes, &own_m[node as usize]);
            let (mut x, mut y, mut z) = (zero, zero, zero);
            for four in &seam.fours[fours[0] as usize..fours[1] as usize] {
                let [p, q, r, s] = [
                    quad(lanes, &position_m[four.other[0] as usize]),
                    quad(lanes, &position_m[four.other[1] as usize]),
                    quad(lanes, &position_m[four.other[2] as usize]),
                    quad(lanes, &position_m[four.other[3] as usize]),
                ];
                let [dx, dy, dz] =
                    lanes.axes([lanes.sub(p, own), lanes.sub(q, own), lanes.sub(r, own), lanes.sub(s, own)]);
                let squared = lanes.mul_add(dx, dx, lanes.mul_add(dy, dy, lanes.mul_add(dz, dz, zero)));
                least = lanes.min(least, squared);
                let inverse = lanes.inverse_root_quad(lanes.max(squared, floor));
                let scale = lanes.neg_mul_add(lanes.quad(four.preload), inverse, lanes.quad(four.stiffness));
                x = lanes.mul_add(scale, dx, x);
                y = lanes.mul_add(scale, dy, y);
                z = lanes.mul_add(scale, dz, z);
            }
            let [x, y, z, _] = lanes.sums([x, y, z]);
            force_n[node as usize] += Vec3::new(x, y, z);
        }
        lanes.array(least).into_iter().fold(f64::MAX, f64::min)
    }
}

/// A place as four numbers, the last of them 0.
#[inline(always)]
fn quad<L: Lanes>(lanes: L, x: &Vec3) -> L::Quad {
    lanes.quad([x.x, x.y, x.z, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::crew::Alone;
    use crate::tissue::force;
    use crate::tissue::network::SpringFamily;

    /// Sums in another order and fused products: a few roundings of the largest terms.
    const ROUNDING: f64 = 4.0e-15;
    /// A few roundings of single precision of the springs' two terms, which are some four times their difference here.
    const SINGLE: f64 = 2.0e-6;

    /// Does the second piece first.
    #[derive(Debug)]
    struct Backwards;

    impl Crew for Backwards {
        fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
            second();
            first();
        }
    }

    /// Really side by side.
    #[derive(Debug)]
    struct SideBySide;

    impl Crew for SideBySide {
        fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
            std::thread::scope(|scope| {
                scope.spawn(first);
                second();
            });
        }
    }

    /// Two layers of a sheet, joined node by node: springs inside strips, between neighbours and far across.
    fn two_layers(side: u32) -> SpringNetwork {
        let layer = side * side;
        let place = |i: u32| {
            let (c, r, l) = (f64::from(i % side), f64::from(i % layer / side), f64::from(i / layer));
            Vec3::new(2e-3 * c + 1e-4 * f64::from(i).sin(), 2e-3 * r, 2e-3 * l + 2e-4 * (0.3 * f64::from(i)).cos())
        };
        let mut springs = Vec::new();
        let mut join = |a: u32, b: u32| {
            let (stiffness_n_per_m, rest_length_m) = (100.0 + f64::from(a % 7), 1.5e-3 + 1e-6 * f64::from(b % 11));
            springs.push(Spring { a, b, stiffness_n_per_m, rest_length_m, family: SpringFamily::Structural });
        };
        for i in 0..2 * layer {
            let (c, r) = (i % side, i % layer / side);
            if c + 1 < side {
                join(i, i + 1);
            }
            if r + 1 < side {
                join(i, i + side);
            }
            if i < layer {
                join(i, i + layer);
            }
        }
        let count = 2 * layer as usize;
        let rest = (0..2 * layer).map(place).collect();
        SpringNetwork::new(rest, vec![1.0; count], vec![0.0; count], vec![0; count], springs).unwrap()
    }

    fn forces(network: &SpringNetwork, precision: Precision, crew: Arc<dyn Crew>) -> (Vec<Vec3>, u32) {
        let mut force_n = vec![Vec3::repeat(9.0); network.node_count()];
        let mut sweep = SpringSweep::shared(network, precision, KernelLevel::Best, crew);
        let coincident = sweep.sweep(&network.rest_m, &mut force_n);
        (force_n, coincident)
    }

    #[test]
    fn eq3_strips_give_the_force_of_the_plain_gather_and_the_same_bits_for_any_crew() {
        let mut network = two_layers(50);
        network.read_as_relaxed(0.8, |s| s.a % 5 == 0);
        assert!(network.node_count() >= 2 * STRIP_NODES);
        let mut expected = vec![Vec3::zeros(); network.node_count()];
        force::gather(&network, &network.rest_m, &mut expected);
        let scale_n = expected.iter().map(Vec3::norm).fold(0.0, f64::max);
        for (precision, tolerance) in [(Precision::Double, ROUNDING), (Precision::Single, SINGLE)] {
            let (alone, coincident) = forces(&network, precision, Arc::new(Alone));
            assert_eq!(coincident, 0);
            for (found, expected) in alone.iter().zip(&expected) {
                assert!((found - expected).norm() < tolerance * scale_n, "{found} {expected}");
            }
            assert_eq!(forces(&network, precision, Arc::new(Backwards)).0, alone);
            assert_eq!(forces(&network, precision, Arc::new(SideBySide)).0, alone);
        }
    }

    #[test]
    fn ends_that_coincide_across_a_seam_are_counted_and_give_no_force() {
        let mut network = two_layers(50);
        let layer = 2500;
        network.rest_m[layer] = network.rest_m[0];
        let (force_n, coincident) = forces(&network, Precision::Double, Arc::new(Alone));
        assert_eq!(coincident, 1);
        assert!(force_n.iter().all(|f| f.iter().all(|c| c.is_finite())));
    }
}
