//! The sweep along diagonals in single precision: displacements from the built shape, as in `single`.
//!
//! Per place: `d = D + u_{i+o} − u_i`, `f = (k − k L/|d|) d`, `F_i += f`, `F_{i+o} −= f`. Five numbers of four bytes per
//! spring against two of eight in double, twice as many springs side by side. The far ends are served in a second loop,
//! as in `stencil`.

use super::aligned::Aligned;
use super::diagonals::{BLOCK, Diagonals, Stretch};
use super::dispatch::{Kernel, Lanes, Wide32};
use crate::tissue::force::COINCIDENT_M;
use crate::vector::Vec3;
use pulp::Simd;

/// Places beyond the last node: as many as the widest vector has.
const MARGIN: usize = 16;
/// Arrays begin this many values after a page.
const PAGE_SKEW: usize = 176;
/// Values of a page.
const PAGE: usize = 1024;
/// Least squared length.
const FLOOR: f32 = (COINCIDENT_M * COINCIDENT_M) as f32;

/// A regular network part in single precision.
#[derive(Clone, Debug)]
pub(super) struct SingleStencil {
    stretches: Vec<Stretch>,
    /// By place: vector at rest x, y, z, stiffness, `k L`.
    springs: [Aligned<f32>; 5],
    built_m: Vec<Vec3>,
    stride: usize,
    /// x, y, z of displacements, then of forces.
    arrays: Aligned<f32>,
    pull: Aligned<f32>,
}

impl SingleStencil {
    pub(super) fn new(diagonals: &Diagonals, built_m: &[Vec3]) -> Self {
        let places = diagonals.stiffness.get().len();
        let mut springs: [Aligned<f32>; 5] = std::array::from_fn(|_| Aligned::new(places));
        for s in &diagonals.stretches {
            for i in 0..s.len {
                let place = s.place + i;
                let ends = (built_m.get(s.start + i), built_m.get(s.start + i + s.offset));
                let d = if let (Some(a), Some(b)) = ends { b - a } else { Vec3::repeat(1.0) };
                for axis in 0..3 {
                    springs[axis].get_mut()[place] = d[axis] as f32;
                }
                springs[3].get_mut()[place] = diagonals.stiffness.get()[place] as f32;
                springs[4].get_mut()[place] = diagonals.preload.get()[place] as f32;
            }
        }
        let stride = (built_m.len() + MARGIN).next_multiple_of(PAGE) + PAGE_SKEW;
        Self {
            stretches: diagonals.stretches.clone(),
            springs,
            built_m: built_m.to_vec(),
            stride,
            arrays: Aligned::new(6 * stride),
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
        let SingleStencil { stretches, springs, built_m, stride, arrays, pull } = stencil;
        let (shift, force) = arrays.get_mut().split_at_mut(3 * *stride);
        let [x, y, z] = thirds(shift, *stride);
        let [fx, fy, fz] = thirds(force, *stride);
        for ((((p, built), x), y), z) in position_m.iter().zip(&*built_m).zip(&mut *x).zip(&mut *y).zip(&mut *z) {
            (*x, *y, *z) = ((p.x - built.x) as f32, (p.y - built.y) as f32, (p.z - built.z) as f32);
        }
        for f in [&mut *fx, &mut *fy, &mut *fz] {
            f[..built_m.len() + MARGIN].fill(0.0);
        }
        let [px, py, pz] = thirds(pull.get_mut(), BLOCK);
        for s in &*stretches {
            let (low, places) = (s.start..s.start + s.len, s.place..s.place + s.len);
            let high = s.start + s.offset..s.start + s.offset + s.len;
            let of = Places {
                rest: [
                    &springs[0].get()[places.clone()],
                    &springs[1].get()[places.clone()],
                    &springs[2].get()[places.clone()],
                ],
                stiffness: &springs[3].get()[places.clone()],
                preload: &springs[4].get()[places],
                low: [&x[low.clone()], &y[low.clone()], &z[low.clone()]],
                high: [&x[high.clone()], &y[high.clone()], &z[high.clone()]],
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
        for (((f, x), y), z) in force_n.iter_mut().zip(&*fx).zip(&*fy).zip(&*fz).take(built_m.len()) {
            *f = Vec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
        }
    }
}

/// What a stretch reads.
struct Places<'a> {
    rest: [&'a [f32]; 3],
    stiffness: &'a [f32],
    preload: &'a [f32],
    low: [&'a [f32]; 3],
    high: [&'a [f32]; 3],
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
    let ((low, low_tail), (high, high_tail), (rest, rest_tail)) =
        (whole::<L>(of.low), whole::<L>(of.high), whole::<L>(of.rest));
    let (stiffness, stiffness_tail) = L::Simd::as_simd_f32s(of.stiffness);
    let (preload, preload_tail) = L::Simd::as_simd_f32s(of.preload);
    let count = stiffness.len();
    let (low, high) = (
        [&low[0][..count], &low[1][..count], &low[2][..count]],
        [&high[0][..count], &high[1][..count], &high[2][..count]],
    );
    let (rest, preload) = ([&rest[0][..count], &rest[1][..count], &rest[2][..count]], &preload[..count]);
    let (ox, oy, oz) = (&mut ox[..count], &mut oy[..count], &mut oz[..count]);
    let (px, py, pz) = (&mut px[..count], &mut py[..count], &mut pz[..count]);
    for i in 0..count {
        let x = s.add_f32s(rest[0][i], s.sub_f32s(high[0][i], low[0][i]));
        let y = s.add_f32s(rest[1][i], s.sub_f32s(high[1][i], low[1][i]));
        let z = s.add_f32s(rest[2][i], s.sub_f32s(high[2][i], low[2][i]));
        let squared = s.mul_add_e_f32s(x, x, s.mul_add_e_f32s(y, y, s.mul_f32s(z, z)));
        let inverse = lanes.inverse_root32(s.max_f32s(squared, s.splat_f32s(FLOOR)));
        let scale = s.negate_mul_add_e_f32s(preload[i], inverse, stiffness[i]);
        (px[i], py[i], pz[i]) = (s.mul_f32s(scale, x), s.mul_f32s(scale, y), s.mul_f32s(scale, z));
        ox[i] = s.add_f32s(ox[i], px[i]);
        oy[i] = s.add_f32s(oy[i], py[i]);
        oz[i] = s.add_f32s(oz[i], pz[i]);
    }
    for i in 0..stiffness_tail.len() {
        let d = |axis: usize| rest_tail[axis][i] + (high_tail[axis][i] - low_tail[axis][i]);
        let (x, y, z) = (d(0), d(1), d(2));
        let scale = stiffness_tail[i] - preload_tail[i] / (x * x + y * y + z * z).max(FLOOR).sqrt();
        (ux[i], uy[i], uz[i]) = (scale * x, scale * y, scale * z);
        tx[i] += ux[i];
        ty[i] += uy[i];
        tz[i] += uz[i];
    }
}
