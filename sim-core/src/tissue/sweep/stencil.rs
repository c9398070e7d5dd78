//! The force sweep along diagonals: consecutive nodes, consecutive springs, no index.
//!
//! Per place `i` of a stretch: `d = x_{i+o} − x_i`, `f = (k − k L/|d|) d`, `F_i += f`, `F_{i+o} −= f` (Zhang et al.,
//! Eq. (3), second line). Coordinates lie in one array each. A load that overlaps a store still on its way waits for it,
//! so near diagonals keep `f` in a small buffer and subtract it in a second loop; diagonals farther than a block do both at
//! once. The order of the sums at a node is that of the stretches, whatever the width of the vectors.

use super::aligned::Aligned;
use super::diagonals::{BLOCK, Diagonals, GRAIN, Stretch};
use super::dispatch::{Kernel, Lanes, Wide};
use crate::tissue::force::COINCIDENT_M;
use crate::vector::Vec3;
use pulp::Simd;

/// Arrays of one size begin this many values after a page: a store to one then never looks like a load from another.
const PAGE_SKEW: usize = 88;
/// Values of a page.
const PAGE: usize = 512;
/// Where places beyond the last node lie: far from all nodes and from each other, so that they never coincide.
const BEYOND_M: f64 = 1.0e6;

/// A regular network part with its working arrays.
#[derive(Clone, Debug)]
pub(super) struct Stencil {
    diagonals: Diagonals,
    nodes: usize,
    stride: usize,
    /// x, y, z of positions, then of forces, `stride` values each.
    arrays: Aligned<f64>,
    pull: Aligned<f64>,
}

impl Stencil {
    pub(super) fn new(diagonals: Diagonals, nodes: usize) -> Self {
        let stride = (nodes + 2 * GRAIN).next_multiple_of(PAGE) + PAGE_SKEW;
        let mut arrays = Aligned::new(6 * stride);
        for (i, x) in arrays.get_mut()[..stride].iter_mut().enumerate().skip(nodes) {
            *x = BEYOND_M * (i - nodes + 1) as f64;
        }
        Self { diagonals, nodes, stride, arrays, pull: Aligned::new(3 * BLOCK) }
    }

    /// The kernel of one sweep.
    pub(super) fn sweep<'a>(&'a mut self, position_m: &'a [Vec3], force_n: &'a mut [Vec3]) -> StencilSweep<'a> {
        StencilSweep { stencil: self, position_m, force_n }
    }
}

/// One sweep: writes all forces and returns the least squared distance it met.
pub(super) struct StencilSweep<'a> {
    stencil: &'a mut Stencil,
    position_m: &'a [Vec3],
    force_n: &'a mut [Vec3],
}

impl Kernel for StencilSweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let Self { stencil: Stencil { diagonals, nodes, stride, arrays, pull }, position_m, force_n } = self;
        let (position, force) = arrays.get_mut().split_at_mut(3 * *stride);
        let [x, y, z] = split(position, *stride);
        let [fx, fy, fz] = split(force, *stride);
        let from = position_m[..*nodes].iter().zip(&mut *x).zip(&mut *y).zip(&mut *z);
        for (((p, x), y), z) in from {
            (*x, *y, *z) = (p.x, p.y, p.z);
        }
        for f in [&mut *fx, &mut *fy, &mut *fz] {
            f[..*nodes + 2 * GRAIN].fill(0.0);
        }
        let [px, py, pz] = split(pull.get_mut(), BLOCK);
        let mut least = lanes.simd().splat_f64s(f64::MAX);
        for stretch in &diagonals.stretches {
            let places = stretch.place..stretch.place + stretch.len;
            let springs = Springs {
                stiffness: &diagonals.stiffness.get()[places.clone()],
                preload: &diagonals.preload.get()[places],
            };
            let position = [&*x, &*y, &*z];
            if stretch.offset >= BLOCK {
                let [ax, bx] = ends(fx, stretch);
                let [ay, by] = ends(fy, stretch);
                let [az, bz] = ends(fz, stretch);
                far(lanes, stretch, springs, position, [ax, ay, az], [bx, by, bz], &mut least);
            } else {
                let low = stretch.start..stretch.start + stretch.len;
                let own = [&mut fx[low.clone()], &mut fy[low.clone()], &mut fz[low]];
                let pull = [&mut px[..stretch.len], &mut py[..stretch.len], &mut pz[..stretch.len]];
                near(lanes, stretch, springs, position, own, pull, &mut least);
                let high = stretch.start + stretch.offset..stretch.start + stretch.offset + stretch.len;
                for (force, pull) in [(&mut *fx, &*px), (&mut *fy, &*py), (&mut *fz, &*pz)] {
                    let force = L::Simd::as_mut_simd_f64s(&mut force[high.clone()]).0;
                    for (f, p) in force.iter_mut().zip(L::Simd::as_simd_f64s(&pull[..stretch.len]).0) {
                        *f = lanes.simd().sub_f64s(*f, *p);
                    }
                }
            }
        }
        let to = force_n[..*nodes].iter_mut().zip(&*fx).zip(&*fy).zip(&*fz);
        for (((f, x), y), z) in to {
            *f = Vec3::new(*x, *y, *z);
        }
        lanes.simd().reduce_min_f64s(least)
    }
}

/// Stiffness and preload of a stretch.
#[derive(Clone, Copy)]
struct Springs<'a> {
    stiffness: &'a [f64],
    preload: &'a [f64],
}

/// Three arrays out of one.
#[inline(always)]
fn split(all: &mut [f64], stride: usize) -> [&mut [f64]; 3] {
    let (x, rest) = all.split_at_mut(stride);
    let (y, z) = rest.split_at_mut(stride);
    [x, y, &mut z[..stride]]
}

/// The lower and the upper nodes of a stretch that reaches farther than it is long.
#[inline(always)]
fn ends<'a>(force: &'a mut [f64], stretch: &Stretch) -> [&'a mut [f64]; 2] {
    let (low, high) = force.split_at_mut(stretch.start + stretch.offset);
    [&mut low[stretch.start..stretch.start + stretch.len], &mut high[..stretch.len]]
}

/// The positions of a stretch's lower or upper nodes as vectors.
#[inline(always)]
fn vectors<L: Lanes>(position: [&[f64]; 3], start: usize, len: usize) -> [&[Wide<L>]; 3] {
    [
        L::Simd::as_simd_f64s(&position[0][start..start + len]).0,
        L::Simd::as_simd_f64s(&position[1][start..start + len]).0,
        L::Simd::as_simd_f64s(&position[2][start..start + len]).0,
    ]
}

/// Force along one vector of springs.
#[inline(always)]
fn forces<L: Lanes>(
    lanes: L,
    low: [Wide<L>; 3],
    high: [Wide<L>; 3],
    stiffness: Wide<L>,
    preload: Wide<L>,
    least: &mut Wide<L>,
) -> [Wide<L>; 3] {
    let s = lanes.simd();
    let d = [s.sub_f64s(high[0], low[0]), s.sub_f64s(high[1], low[1]), s.sub_f64s(high[2], low[2])];
    let squared = s.mul_add_e_f64s(d[0], d[0], s.mul_add_e_f64s(d[1], d[1], s.mul_f64s(d[2], d[2])));
    *least = s.min_f64s(*least, squared);
    let floored = s.max_f64s(squared, s.splat_f64s(COINCIDENT_M * COINCIDENT_M));
    let scale = s.negate_mul_add_e_f64s(preload, lanes.inverse_root(floored), stiffness);
    [s.mul_f64s(scale, d[0]), s.mul_f64s(scale, d[1]), s.mul_f64s(scale, d[2])]
}

/// A stretch whose ends lie in one block: own forces, and the pull for the second loop.
#[inline(always)]
fn near<L: Lanes>(
    lanes: L,
    stretch: &Stretch,
    springs: Springs<'_>,
    position: [&[f64]; 3],
    own: [&mut [f64]; 3],
    pull: [&mut [f64]; 3],
    least: &mut Wide<L>,
) {
    let s = lanes.simd();
    let low = vectors::<L>(position, stretch.start, stretch.len);
    let high = vectors::<L>(position, stretch.start + stretch.offset, stretch.len);
    let stiffness = L::Simd::as_simd_f64s(springs.stiffness).0;
    let preload = L::Simd::as_simd_f64s(springs.preload).0;
    let own = own.map(|f| L::Simd::as_mut_simd_f64s(f).0);
    let pull = pull.map(|f| L::Simd::as_mut_simd_f64s(f).0);
    let count = stiffness.len();
    let (low, high) = (low.map(|x| &x[..count]), high.map(|x| &x[..count]));
    let (own, pull, preload) = (own.map(|f| &mut f[..count]), pull.map(|f| &mut f[..count]), &preload[..count]);
    for i in 0..count {
        let (from, to) = ([low[0][i], low[1][i], low[2][i]], [high[0][i], high[1][i], high[2][i]]);
        let force = forces(lanes, from, to, stiffness[i], preload[i], least);
        own[0][i] = s.add_f64s(own[0][i], force[0]);
        own[1][i] = s.add_f64s(own[1][i], force[1]);
        own[2][i] = s.add_f64s(own[2][i], force[2]);
        pull[0][i] = force[0];
        pull[1][i] = force[1];
        pull[2][i] = force[2];
    }
}

/// A stretch whose ends lie in different blocks: both forces at once.
#[inline(always)]
fn far<L: Lanes>(
    lanes: L,
    stretch: &Stretch,
    springs: Springs<'_>,
    position: [&[f64]; 3],
    own: [&mut [f64]; 3],
    other: [&mut [f64]; 3],
    least: &mut Wide<L>,
) {
    let s = lanes.simd();
    let low = vectors::<L>(position, stretch.start, stretch.len);
    let high = vectors::<L>(position, stretch.start + stretch.offset, stretch.len);
    let stiffness = L::Simd::as_simd_f64s(springs.stiffness).0;
    let preload = L::Simd::as_simd_f64s(springs.preload).0;
    let own = own.map(|f| L::Simd::as_mut_simd_f64s(f).0);
    let other = other.map(|f| L::Simd::as_mut_simd_f64s(f).0);
    let count = stiffness.len();
    let (low, high) = (low.map(|x| &x[..count]), high.map(|x| &x[..count]));
    let (own, other, preload) = (own.map(|f| &mut f[..count]), other.map(|f| &mut f[..count]), &preload[..count]);
    for i in 0..count {
        let (from, to) = ([low[0][i], low[1][i], low[2][i]], [high[0][i], high[1][i], high[2][i]]);
        let force = forces(lanes, from, to, stiffness[i], preload[i], least);
        own[0][i] = s.add_f64s(own[0][i], force[0]);
        own[1][i] = s.add_f64s(own[1][i], force[1]);
        own[2][i] = s.add_f64s(own[2][i], force[2]);
        other[0][i] = s.sub_f64s(other[0][i], force[0]);
        other[1][i] = s.sub_f64s(other[1][i], force[1]);
        other[2][i] = s.sub_f64s(other[2][i], force[2]);
    }
}
