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

#[inline(always)]
fn eight(f: impl Fn(usize) -> f32) -> [f32; 8] {
    [f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7)]
}

impl<S: Simd> Lanes for Exact<S> {
    type Simd = S;
    type Quad = [f64; 4];
    type Quad32 = [f32; 4];
    type Oct32 = [f32; 8];

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
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        each(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn dots(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [(a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]); 4]
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
    fn axes(self, nodes: [[f64; 4]; 4]) -> [[f64; 4]; 3] {
        [each(|i| nodes[i][0]), each(|i| nodes[i][1]), each(|i| nodes[i][2])]
    }

    #[inline(always)]
    fn sums(self, axes: [[f64; 4]; 3]) -> [f64; 4] {
        let sum = |a: [f64; 4]| (a[0] + a[2]) + (a[1] + a[3]);
        [sum(axes[0]), sum(axes[1]), sum(axes[2]), 0.0]
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

    #[inline(always)]
    fn oct32(self, from: [f32; 8]) -> [f32; 8] {
        from
    }

    #[inline(always)]
    fn pair32(self, first: [f32; 4], second: [f32; 4]) -> [f32; 8] {
        eight(|i| if i < 4 { first[i] } else { second[i - 4] })
    }

    #[inline(always)]
    fn add_oct32(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        eight(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub_oct32(self, a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        eight(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul_add_oct32(self, a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        eight(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn neg_mul_add_oct32(self, a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        eight(|i| c[i] - a[i] * b[i])
    }

    #[inline(always)]
    fn axes32(self, pairs: [[f32; 8]; 4]) -> [[f32; 8]; 3] {
        let axis = |axis: usize| eight(|i| pairs[i % 4][i / 4 * 4 + axis]);
        [axis(0), axis(1), axis(2)]
    }

    #[inline(always)]
    fn inverse_length_oct32(self, [x, y, z]: [[f32; 8]; 3], floor: f32) -> [f32; 8] {
        let squared = |i: usize| x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
        eight(|i| 1.0 / if squared(i) > floor { squared(i) } else { floor }.sqrt())
    }

    #[inline(always)]
    fn sums32(self, axes: [[f32; 8]; 3]) -> [f32; 4] {
        let sum = |a: [f32; 8]| ((a[0] + a[4]) + (a[1] + a[5])) + ((a[2] + a[6]) + (a[3] + a[7]));
        [sum(axes[0]), sum(axes[1]), sum(axes[2]), 0.0]
    }
}
