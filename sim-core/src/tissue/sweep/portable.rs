//! Kernels on any instruction set: wide vectors by `pulp`, quads as arrays, root and quotient by the processor.

#[cfg(not(target_arch = "x86_64"))]
use super::dispatch::Kernel;
use super::dispatch::{Lanes, Wide};
use pulp::Simd;

/// An instruction set without an estimate of the reciprocal root.
#[derive(Clone, Copy)]
pub(super) struct Exact<S>(pub(super) S);

/// A kernel on whatever `pulp` finds.
#[cfg(not(target_arch = "x86_64"))]
pub(super) struct AnySimd<K>(pub(super) K);

#[cfg(not(target_arch = "x86_64"))]
impl<K: Kernel> pulp::WithSimd for AnySimd<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> K::Output {
        self.0.run(Exact(simd))
    }
}

#[inline(always)]
fn each<T>(f: impl Fn(usize) -> T) -> [T; 4] {
    [f(0), f(1), f(2), f(3)]
}

impl<S: Simd> Lanes for Exact<S> {
    type Simd = S;
    type Quad = [f64; 4];
    type Quad32 = [f32; 4];

    #[inline(always)]
    fn simd(self) -> S {
        self.0
    }

    #[inline(always)]
    fn inverse_root(self, x: Wide<Self>) -> Wide<Self> {
        self.0.div_f64s(self.0.splat_f64s(1.0), self.0.sqrt_f64s(x))
    }

    #[inline(always)]
    fn quad(self, from: [f64; 4]) -> [f64; 4] {
        from
    }

    #[inline(always)]
    fn array(self, q: [f64; 4]) -> [f64; 4] {
        q
    }

    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul_add(self, a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> [f64; 4] {
        each(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn neg_mul_add(self, a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> [f64; 4] {
        each(|i| c[i] - a[i] * b[i])
    }

    #[inline(always)]
    fn max(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn min(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn squares(self, d: [[f64; 4]; 4]) -> [f64; 4] {
        each(|i| d[i][0] * d[i][0] + d[i][1] * d[i][1] + d[i][2] * d[i][2])
    }

    #[inline(always)]
    fn inverse_root_quad(self, x: [f64; 4]) -> [f64; 4] {
        each(|i| 1.0 / x[i].sqrt())
    }

    #[inline(always)]
    fn spread(self, q: [f64; 4]) -> [[f64; 4]; 4] {
        [[q[0]; 4], [q[1]; 4], [q[2]; 4], [q[3]; 4]]
    }

    #[inline(always)]
    fn quad32(self, from: [f32; 4]) -> [f32; 4] {
        from
    }

    #[inline(always)]
    fn array32(self, q: [f32; 4]) -> [f32; 4] {
        q
    }

    #[inline(always)]
    fn add32(self, a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        each(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub32(self, a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
        each(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul_add32(self, a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        each(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn neg_mul_add32(self, a: [f32; 4], b: [f32; 4], c: [f32; 4]) -> [f32; 4] {
        each(|i| c[i] - a[i] * b[i])
    }

    #[inline(always)]
    fn squares32(self, d: [[f32; 4]; 4], floor: f32) -> [f32; 4] {
        let squared = |i: usize| d[i][0] * d[i][0] + d[i][1] * d[i][1] + d[i][2] * d[i][2];
        each(|i| if squared(i) > floor { squared(i) } else { floor })
    }

    #[inline(always)]
    fn inverse_root_quad32(self, x: [f32; 4]) -> [f32; 4] {
        each(|i| 1.0 / x[i].sqrt())
    }

    #[inline(always)]
    fn spread32(self, q: [f32; 4]) -> [[f32; 4]; 4] {
        [[q[0]; 4], [q[1]; 4], [q[2]; 4], [q[3]; 4]]
    }
}
