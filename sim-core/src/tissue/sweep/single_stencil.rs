//! The sweep along diagonals in single precision: two numbers per coordinate, as in `single`.
//!
//! Per place: `d = (h_{i+o} − h_i) + (l_{i+o} − l_i)`, `f = (k − k L/|d|) d`, `F_i += f`, `F_{i+o} −= f`. Half the bytes per
//! spring of double precision, twice as many springs side by side. The far ends are served in a second loop, as in
//! `stencil`.

use super::aligned::Aligned;
use super::diagonals::{BLOCK, Diagonals, Stretch};
use super::dispatch::{Kernel, Lanes, Wide32};
use super::single::{FLOOR, halves};
use crate::vector::Vec3;
use pulp::Simd;

/// Places beyond the last node: as many as the widest vector has.
const MARGIN: usize = 16;
/// Arrays begin this many values after a page.
const PAGE_SKEW: usize = 176;
/// Values of a page.
const PAGE: usize = 1024;

/// A regular network part in single precision.
#[derive(Clone, Debug)]
pub(super) struct SingleStencil {
    stretches: Vec<Stretch>,
    /// By place: stiffness, `k L`.
    springs: [Aligned<f32>; 2],
    nodes: usize,
    stride: usize,
    /// x, y, z of positions, of what these leave, of forces.
    arrays: Aligned<f32>,
    pull: Aligned<f32>,
}

impl SingleStencil {
    pub(super) fn new(diagonals: &Diagonals, nodes: usize) -> Self {
        let single = |from: &Aligned<f64>| {
            let mut to = Aligned::new(from.get().len());
            to.get_mut().iter_mut().zip(from.get()).for_each(|(to, from)| *to = *from as f32);
            to
        };
        let stride = (nodes + MARGIN).next_multiple_of(PAGE) + PAGE_SKEW;
        Self {
            stretches: diagonals.stretches.clone(),
            springs: [single(&diagonals.stiffness), single(&diagonals.preload)],
            nodes,
            stride,
            arrays: Aligned::new(9 * stride),
            pull: Aligned::new(3 * BLOCK),
        }
    }

    /// The kernel of one sweep.
    pub(super) fn sweep<'a>(&'a mut self, position_m: &'a [Vec3], force_n: &'a mut [Vec3]) -> SingleStencilSweep<'a> {
        SingleStencilSweep { stencil: self, position_m, force_n }
    }
}

/// One sweep; writes all forces.
pub(super) struct SingleStencilSweep<'a> {
    stencil: &'a mut SingleStencil,
    position_m: &'a [Vec3],
    force_n: &'a mut [Vec3],
}

impl Kernel for SingleStencilSweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { stencil, position_m, force_n } = self;
        let SingleStencil { stretches, springs, nodes, stride, arrays, pull } = stencil;
        let (position, force) = arrays.get_mut().split_at_mut(6 * *stride);
        let (position, left) = position.split_at_mut(3 * *stride);
        let [x, y, z] = thirds(position, *stride);
        let [lx, ly, lz] = thirds(left, *stride);
        let [fx, fy, fz] = thirds(force, *stride);
        for (i, p) in position_m[..*nodes].iter().enumerate() {
            ((x[i], lx[i]), (y[i], ly[i]), (z[i], lz[i])) = (halves(p.x), halves(p.y), halves(p.z));
        }
        for f in [&mut *fx, &mut *fy, &mut *fz] {
            f[..*nodes + MARGIN].fill(0.0);
        }
        let [px, py, pz] = thirds(pull.get_mut(), BLOCK);
        for s in &*stretches {
            let (low, places) = (s.start..s.start + s.len, s.place..s.place + s.len);
            let high = s.start + s.offset..s.start + s.offset + s.len;
            let of = Places {
                stiffness: &springs[0].get()[places.clone()],
                preload: &springs[1].get()[places],
                low: [&x[low.clone()], &y[low.clone()], &z[low.clone()]],
                high: [&x[high.clone()], &y[high.clone()], &z[high.clone()]],
                low_left: [&lx[low.clone()], &ly[low.clone()], &lz[low.clone()]],
                high_left: [&lx[high.clone()], &ly[high.clone()], &lz[high.clone()]],
            };
            let own = [&mut fx[low.clone()], &mut fy[low.clone()], &mut fz[low]];
            near(lanes, &of, own, [&mut px[..s.len], &mut py[..s.len], &mut pz[..s.len]]);
            for (force, pull) in [(&mut *fx, &*px), (&mut *fy, &*py), (&mut *fz, &*pz)] {
                let (force, tail) = L::Simd::as_mut_simd_f32s(&mut force[high.clone()]);
                let (pull, rest) = L::Simd::as_simd_f32s(&pull[..s.len]);
                for (f, p) in force.iter_mut().zip(pull) {
                    *f = lanes.simd().sub_f32s(*f, *p);
                }
                tail.iter_mut().zip(rest).for_each(|(f, p)| *f -= p);
            }
        }
        for (((f, x), y), z) in force_n.iter_mut().zip(&*fx).zip(&*fy).zip(&*fz).take(*nodes) {
            *f = Vec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
        }
    }
}

/// What a stretch reads.
struct Places<'a> {
    stiffness: &'a [f32],
    preload: &'a [f32],
    low: [&'a [f32]; 3],
    high: [&'a [f32]; 3],
    low_left: [&'a [f32]; 3],
    high_left: [&'a [f32]; 3],
}

/// Three arrays out of one.
#[inline(always)]
fn thirds(all: &mut [f32], stride: usize) -> [&mut [f32]; 3] {
    let (x, rest) = all.split_at_mut(stride);
    let (y, z) = rest.split_at_mut(stride);
    [x, y, &mut z[..stride]]
}

/// The whole vectors of three slices, and what is left.
type Split<'a, L> = ([&'a [Wide32<L>]; 3], [&'a [f32]; 3]);

#[inline(always)]
fn whole<'a, L: Lanes>(of: [&'a [f32]; 3]) -> Split<'a, L> {
    let (x, y, z) = (L::Simd::as_simd_f32s(of[0]), L::Simd::as_simd_f32s(of[1]), L::Simd::as_simd_f32s(of[2]));
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

/// Own forces of a stretch, and the pull on its far ends. Half a vector may be left at the end: one by one.
#[inline(always)]
fn near<L: Lanes>(lanes: L, of: &Places<'_>, own: [&mut [f32]; 3], pull: [&mut [f32]; 3]) {
    let s = lanes.simd();
    let [ox, oy, oz] = own;
    let [px, py, pz] = pull;
    let ((ox, tx), (oy, ty), (oz, tz)) =
        (L::Simd::as_mut_simd_f32s(ox), L::Simd::as_mut_simd_f32s(oy), L::Simd::as_mut_simd_f32s(oz));
    let ((px, ux), (py, uy), (pz, uz)) =
        (L::Simd::as_mut_simd_f32s(px), L::Simd::as_mut_simd_f32s(py), L::Simd::as_mut_simd_f32s(pz));
    let ((low, low_tail), (high, high_tail)) = (whole::<L>(of.low), whole::<L>(of.high));
    let ((low_left, low_left_tail), (high_left, high_left_tail)) = (whole::<L>(of.low_left), whole::<L>(of.high_left));
    let (stiffness, stiffness_tail) = L::Simd::as_simd_f32s(of.stiffness);
    let (preload, preload_tail) = L::Simd::as_simd_f32s(of.preload);
    let count = stiffness.len();
    let (low, high) = (low.map(|x| &x[..count]), high.map(|x| &x[..count]));
    let (low_left, high_left) = (low_left.map(|x| &x[..count]), high_left.map(|x| &x[..count]));
    let preload = &preload[..count];
    let (ox, oy, oz) = (&mut ox[..count], &mut oy[..count], &mut oz[..count]);
    let (px, py, pz) = (&mut px[..count], &mut py[..count], &mut pz[..count]);
    for i in 0..count {
        let x = s.add_f32s(s.sub_f32s(high[0][i], low[0][i]), s.sub_f32s(high_left[0][i], low_left[0][i]));
        let y = s.add_f32s(s.sub_f32s(high[1][i], low[1][i]), s.sub_f32s(high_left[1][i], low_left[1][i]));
        let z = s.add_f32s(s.sub_f32s(high[2][i], low[2][i]), s.sub_f32s(high_left[2][i], low_left[2][i]));
        let squared = s.mul_add_e_f32s(x, x, s.mul_add_e_f32s(y, y, s.mul_f32s(z, z)));
        let inverse = lanes.inverse_root32(s.max_f32s(squared, s.splat_f32s(FLOOR)));
        let scale = s.negate_mul_add_e_f32s(preload[i], inverse, stiffness[i]);
        (px[i], py[i], pz[i]) = (s.mul_f32s(scale, x), s.mul_f32s(scale, y), s.mul_f32s(scale, z));
        ox[i] = s.add_f32s(ox[i], px[i]);
        oy[i] = s.add_f32s(oy[i], py[i]);
        oz[i] = s.add_f32s(oz[i], pz[i]);
    }
    for i in 0..stiffness_tail.len() {
        let d =
            |axis: usize| (high_tail[axis][i] - low_tail[axis][i]) + (high_left_tail[axis][i] - low_left_tail[axis][i]);
        let (x, y, z) = (d(0), d(1), d(2));
        let scale = stiffness_tail[i] - preload_tail[i] / (x * x + y * y + z * z).max(FLOOR).sqrt();
        (ux[i], uy[i], uz[i]) = (scale * x, scale * y, scale * z);
        tx[i] += ux[i];
        ty[i] += uy[i];
        tz[i] += uz[i];
    }
}
