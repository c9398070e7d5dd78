//! Kernels on AVX2 with FMA and on AVX-512. Quads are one 256-bit register on both. No closure, and no function of the
//! standard library that takes one, may hold a vector: it would be compiled for plain code, each operation a call.
//!
//! AVX-512 takes the wide `1/√x` from its estimate of 2⁻¹⁴ and two Newton steps; AVX2 has no estimate for `f64`, and its
//! root and quotient are faster than a start in `f32` with a third-order step. Quads take root and quotient on both: they
//! wait for memory, not for the divider.

use super::dispatch::{Lanes, Wide, Wide32};
use pulp::x86::{V3, V4};
use pulp::{Simd, cast, f32x4, f32x8, f64x4};

/// Steps from the estimate of 2⁻¹⁴ to rounding.
const NEWTON_STEPS: u32 = 2;
/// Beyond it the estimate would be 0, and a Newton step of it not a number.
const LARGEST: f64 = 1.0e300;

/// The quad functions, which both levels share.
macro_rules! quads {
    () => {
        type Quad = f64x4;
        type Quad32 = f32x4;
        type Oct32 = f32x8;

        #[inline(always)]
        fn simd(self) -> Self {
            self
        }

        #[inline(always)]
        fn quad(self, from: [f64; 4]) -> f64x4 {
            cast(from)
        }

        #[inline(always)]
        fn array(self, q: f64x4) -> [f64; 4] {
            cast(q)
        }

        #[inline(always)]
        fn sub(self, a: f64x4, b: f64x4) -> f64x4 {
            cast(self.avx._mm256_sub_pd(cast(a), cast(b)))
        }

        #[inline(always)]
        fn add(self, a: f64x4, b: f64x4) -> f64x4 {
            cast(self.avx._mm256_add_pd(cast(a), cast(b)))
        }

        #[inline(always)]
        fn mul(self, a: f64x4, b: f64x4) -> f64x4 {
            cast(self.avx._mm256_mul_pd(cast(a), cast(b)))
        }

        #[inline(always)]
        fn dots(self, a: f64x4, b: f64x4) -> f64x4 {
            let products = self.avx._mm256_mul_pd(cast(a), cast(b));
            let halves = self.avx._mm256_hadd_pd(products, products);
            cast(self.avx._mm256_add_pd(halves, self.avx._mm256_permute2f128_pd::<0x01>(halves, halves)))
        }

        #[inline(always)]
        fn mul_add(self, a: f64x4, b: f64x4, c: f64x4) -> f64x4 {
            cast(self.fma._mm256_fmadd_pd(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn neg_mul_add(self, a: f64x4, b: f64x4, c: f64x4) -> f64x4 {
            cast(self.fma._mm256_fnmadd_pd(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn max(self, a: f64x4, b: f64x4) -> f64x4 {
            cast(self.avx._mm256_max_pd(cast(a), cast(b)))
        }

        #[inline(always)]
        fn min(self, a: f64x4, b: f64x4) -> f64x4 {
            cast(self.avx._mm256_min_pd(cast(a), cast(b)))
        }

        #[inline(always)]
        fn squares(self, d: [f64x4; 4]) -> f64x4 {
            let avx = self.avx;
            let [p, q, r, s] = [cast(d[0]), cast(d[1]), cast(d[2]), cast(d[3])];
            // Lanes (0, 1) and (2, 3) of two vectors summed, in turn.
            let first = avx._mm256_hadd_pd(avx._mm256_mul_pd(p, p), avx._mm256_mul_pd(q, q));
            let second = avx._mm256_hadd_pd(avx._mm256_mul_pd(r, r), avx._mm256_mul_pd(s, s));
            let crossed = avx._mm256_permute2f128_pd::<0x21>(first, second);
            let straight = avx._mm256_blend_pd::<0b1100>(first, second);
            cast(avx._mm256_add_pd(crossed, straight))
        }

        #[inline(always)]
        fn inverse_root_quad(self, x: f64x4) -> f64x4 {
            cast(self.avx._mm256_div_pd(self.avx._mm256_set1_pd(1.0), self.avx._mm256_sqrt_pd(cast(x))))
        }

        #[inline(always)]
        fn spread(self, q: f64x4) -> [f64x4; 4] {
            let avx2 = self.avx2;
            [
                cast(avx2._mm256_permute4x64_pd::<0x00>(cast(q))),
                cast(avx2._mm256_permute4x64_pd::<0x55>(cast(q))),
                cast(avx2._mm256_permute4x64_pd::<0xaa>(cast(q))),
                cast(avx2._mm256_permute4x64_pd::<0xff>(cast(q))),
            ]
        }

        #[inline(always)]
        fn axes(self, [p, q, r, s]: [f64x4; 4]) -> [f64x4; 3] {
            let avx = self.avx;
            let (p, q, r, s) = (cast(p), cast(q), cast(r), cast(s));
            // x0 x1 z0 z1 and x2 x3 z2 z3, then y0 y1 and y2 y3.
            let (even, even_next) = (avx._mm256_unpacklo_pd(p, q), avx._mm256_unpacklo_pd(r, s));
            let (odd, odd_next) = (avx._mm256_unpackhi_pd(p, q), avx._mm256_unpackhi_pd(r, s));
            [
                cast(avx._mm256_permute2f128_pd::<0x20>(even, even_next)),
                cast(avx._mm256_permute2f128_pd::<0x20>(odd, odd_next)),
                cast(avx._mm256_permute2f128_pd::<0x31>(even, even_next)),
            ]
        }

        #[inline(always)]
        fn sums(self, [x, y, z]: [f64x4; 3]) -> [f64; 4] {
            let avx = self.avx;
            let first = avx._mm256_hadd_pd(cast(x), cast(y));
            let second = avx._mm256_hadd_pd(cast(z), avx._mm256_setzero_pd());
            let crossed = avx._mm256_permute2f128_pd::<0x21>(first, second);
            let straight = avx._mm256_blend_pd::<0b1100>(first, second);
            cast(avx._mm256_add_pd(crossed, straight))
        }

        #[inline(always)]
        fn quad32(self, from: [f32; 4]) -> f32x4 {
            cast(from)
        }

        #[inline(always)]
        fn array32(self, q: f32x4) -> [f32; 4] {
            cast(q)
        }

        #[inline(always)]
        fn add32(self, a: f32x4, b: f32x4) -> f32x4 {
            cast(self.sse._mm_add_ps(cast(a), cast(b)))
        }

        #[inline(always)]
        fn sub32(self, a: f32x4, b: f32x4) -> f32x4 {
            cast(self.sse._mm_sub_ps(cast(a), cast(b)))
        }

        #[inline(always)]
        fn mul_add32(self, a: f32x4, b: f32x4, c: f32x4) -> f32x4 {
            cast(self.fma._mm_fmadd_ps(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn neg_mul_add32(self, a: f32x4, b: f32x4, c: f32x4) -> f32x4 {
            cast(self.fma._mm_fnmadd_ps(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn squares32(self, d: [f32x4; 4], floor: f32) -> f32x4 {
            let (sse, sse3) = (self.sse, self.sse3);
            let [p, q, r, s] = [cast(d[0]), cast(d[1]), cast(d[2]), cast(d[3])];
            let first = sse3._mm_hadd_ps(sse._mm_mul_ps(p, p), sse._mm_mul_ps(q, q));
            let second = sse3._mm_hadd_ps(sse._mm_mul_ps(r, r), sse._mm_mul_ps(s, s));
            cast(sse._mm_max_ps(sse3._mm_hadd_ps(first, second), sse._mm_set1_ps(floor)))
        }

        #[inline(always)]
        fn inverse_root_quad32(self, x: f32x4) -> f32x4 {
            cast(self.sse._mm_div_ps(self.sse._mm_set1_ps(1.0), self.sse._mm_sqrt_ps(cast(x))))
        }

        #[inline(always)]
        fn spread32(self, q: f32x4) -> [f32x4; 4] {
            let (sse, q) = (self.sse, cast(q));
            [
                cast(sse._mm_shuffle_ps::<0x00>(q, q)),
                cast(sse._mm_shuffle_ps::<0x55>(q, q)),
                cast(sse._mm_shuffle_ps::<0xaa>(q, q)),
                cast(sse._mm_shuffle_ps::<0xff>(q, q)),
            ]
        }

        #[inline(always)]
        fn oct32(self, from: [f32; 8]) -> f32x8 {
            cast(from)
        }

        #[inline(always)]
        fn pair32(self, first: [f32; 4], second: [f32; 4]) -> f32x8 {
            let avx = self.avx;
            cast(avx._mm256_insertf128_ps::<1>(avx._mm256_castps128_ps256(cast(first)), cast(second)))
        }

        #[inline(always)]
        fn add_oct32(self, a: f32x8, b: f32x8) -> f32x8 {
            cast(self.avx._mm256_add_ps(cast(a), cast(b)))
        }

        #[inline(always)]
        fn sub_oct32(self, a: f32x8, b: f32x8) -> f32x8 {
            cast(self.avx._mm256_sub_ps(cast(a), cast(b)))
        }

        #[inline(always)]
        fn mul_add_oct32(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8 {
            cast(self.fma._mm256_fmadd_ps(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn neg_mul_add_oct32(self, a: f32x8, b: f32x8, c: f32x8) -> f32x8 {
            cast(self.fma._mm256_fnmadd_ps(cast(a), cast(b), cast(c)))
        }

        #[inline(always)]
        fn axes32(self, [p, q, r, s]: [f32x8; 4]) -> [f32x8; 3] {
            let avx = self.avx;
            let (p, q, r, s) = (cast(p), cast(q), cast(r), cast(s));
            // x0 x1 y0 y1 and x2 x3 y2 y3, then z0 z1 and z2 z3, in each half.
            let (first, second) = (avx._mm256_unpacklo_ps(p, q), avx._mm256_unpacklo_ps(r, s));
            let (third, fourth) = (avx._mm256_unpackhi_ps(p, q), avx._mm256_unpackhi_ps(r, s));
            [
                cast(avx._mm256_shuffle_ps::<0x44>(first, second)),
                cast(avx._mm256_shuffle_ps::<0xee>(first, second)),
                cast(avx._mm256_shuffle_ps::<0x44>(third, fourth)),
            ]
        }

        #[inline(always)]
        fn inverse_length_oct32(self, [x, y, z]: [f32x8; 3], floor: f32) -> f32x8 {
            let (avx, fma) = (self.avx, self.fma);
            let (x, y, z) = (cast(x), cast(y), cast(z));
            let squared = fma._mm256_fmadd_ps(x, x, fma._mm256_fmadd_ps(y, y, avx._mm256_mul_ps(z, z)));
            let squared = avx._mm256_max_ps(squared, avx._mm256_set1_ps(floor));
            let start = avx._mm256_rsqrt_ps(squared);
            let rest = fma._mm256_fnmadd_ps(avx._mm256_mul_ps(squared, start), start, avx._mm256_set1_ps(1.0));
            cast(fma._mm256_fmadd_ps(avx._mm256_mul_ps(start, avx._mm256_set1_ps(0.5)), rest, start))
        }

        #[inline(always)]
        fn sums32(self, [x, y, z]: [f32x8; 3]) -> [f32; 4] {
            let (avx, sse) = (self.avx, self.sse);
            let zero = avx._mm256_setzero_ps();
            let sums = avx._mm256_hadd_ps(avx._mm256_hadd_ps(cast(x), cast(y)), avx._mm256_hadd_ps(cast(z), zero));
            cast(sse._mm_add_ps(avx._mm256_castps256_ps128(sums), avx._mm256_extractf128_ps::<1>(sums)))
        }
    };
}

impl Lanes for V3 {
    type Simd = Self;
    quads!();

    #[inline(always)]
    fn inverse_root32(self, x: Wide32<Self>) -> Wide32<Self> {
        let y: Wide32<Self> = cast(self.avx._mm256_rsqrt_ps(cast(x)));
        let rest = self.negate_mul_add_f32s(self.mul_f32s(x, y), y, self.splat_f32s(1.0));
        self.mul_add_f32s(self.mul_f32s(y, self.splat_f32s(0.5)), rest, y)
    }

    #[inline(always)]
    fn inverse_root(self, x: Wide<Self>) -> Wide<Self> {
        self.div_f64s(self.splat_f64s(1.0), self.sqrt_f64s(x))
    }
}

impl Lanes for V4 {
    type Simd = Self;
    quads!();

    #[inline(always)]
    fn inverse_root(self, x: Wide<Self>) -> Wide<Self> {
        let (one, half) = (self.splat_f64s(1.0), self.splat_f64s(0.5));
        let x = self.min_f64s(x, self.splat_f64s(LARGEST));
        let mut y = cast(self.avx512f._mm512_rsqrt14_pd(cast(x)));
        for _ in 0..NEWTON_STEPS {
            let rest = self.negate_mul_add_f64s(self.mul_f64s(x, y), y, one);
            y = self.mul_add_f64s(self.mul_f64s(y, half), rest, y);
        }
        y
    }

    #[inline(always)]
    fn inverse_root32(self, x: Wide32<Self>) -> Wide32<Self> {
        let y: Wide32<Self> = cast(self.avx512f._mm512_rsqrt14_ps(cast(x)));
        let rest = self.negate_mul_add_f32s(self.mul_f32s(x, y), y, self.splat_f32s(1.0));
        self.mul_add_f32s(self.mul_f32s(y, self.splat_f32s(0.5)), rest, y)
    }
}
