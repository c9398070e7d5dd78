//! One source, several instruction sets: a kernel is written once over [`Lanes`] and compiled for AVX-512, AVX2 (with
//! FMA), NEON and plain code; the best one that the processor has is taken at run time, by `pulp`.
//!
//! Equal inputs give equal bits on one instruction set. Between them the last bits differ: plain code has no fused
//! multiply-add, and AVX-512 starts the reciprocal root from its 14-bit estimate (two Newton steps,
//! `y ← y + y/2 (1 − x y²)`, relative error 1.5·(1.5·2⁻²⁸)² < 2⁻⁵³) where the others take a root and a quotient.
//! [`KernelLevel`] caps the choice, so that a run can be repeated, or watched by a tool that knows no AVX-512.

use pulp::{Simd, WithSimd};

/// Upper limit of the instruction sets to take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelLevel {
    /// The best that the processor has.
    #[default]
    Best,
    /// On x86-64 at most AVX2 with FMA; elsewhere as `Best`.
    Avx2,
    /// No vectors beyond those that every processor of the target has.
    Portable,
}

/// `f64` vectors of an instruction set.
pub(in crate::tissue) type Wide<L> = <<L as Lanes>::Simd as Simd>::f64s;

/// `f32` vectors of an instruction set.
pub(in crate::tissue) type Wide32<L> = <<L as Lanes>::Simd as Simd>::f32s;

/// What a kernel asks of an instruction set.
pub(in crate::tissue) trait Lanes: Copy {
    /// Vectors of the full width.
    type Simd: Simd;
    /// Four numbers side by side.
    type Quad: Copy;
    /// Four numbers of single precision.
    type Quad32: Copy;
    /// Eight numbers of single precision.
    type Oct32: Copy;

    /// Vectors of the full width.
    fn simd(self) -> Self::Simd;
    /// `1/√x`, to rounding; `x` in 1e-300..1e300.
    fn inverse_root(self, x: Wide<Self>) -> Wide<Self>;

    /// `1/√x` in single precision, to two roundings; `x` in 1e-30..1e30.
    #[inline(always)]
    fn inverse_root32(self, x: Wide32<Self>) -> Wide32<Self> {
        let s = self.simd();
        s.div_f32s(s.splat_f32s(1.0), s.sqrt_f32s(x))
    }

    /// The four numbers of a node.
    fn quad(self, from: [f64; 4]) -> Self::Quad;
    /// The way back.
    fn array(self, q: Self::Quad) -> [f64; 4];
    /// `a − b`.
    fn sub(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// `a + b`.
    fn add(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// `a b`.
    fn mul(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// `Σ a b` over the four, in all lanes.
    fn dots(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// `a b + c`.
    fn mul_add(self, a: Self::Quad, b: Self::Quad, c: Self::Quad) -> Self::Quad;
    /// `c − a b`.
    fn neg_mul_add(self, a: Self::Quad, b: Self::Quad, c: Self::Quad) -> Self::Quad;
    /// The larger, lane by lane.
    fn max(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// The smaller, lane by lane.
    fn min(self, a: Self::Quad, b: Self::Quad) -> Self::Quad;
    /// Sum of the squares of each of four.
    fn squares(self, d: [Self::Quad; 4]) -> Self::Quad;
    /// `1/√x`, to rounding.
    fn inverse_root_quad(self, x: Self::Quad) -> Self::Quad;
    /// Each lane in all four lanes.
    fn spread(self, q: Self::Quad) -> [Self::Quad; 4];
    /// Four nodes as their first, second and third numbers.
    fn axes(self, nodes: [Self::Quad; 4]) -> [Self::Quad; 3];
    /// Each sum of four, and 0.
    fn sums(self, axes: [Self::Quad; 3]) -> [f64; 4];

    /// The four numbers of a node.
    fn quad32(self, from: [f32; 4]) -> Self::Quad32;
    /// The way back.
    fn array32(self, q: Self::Quad32) -> [f32; 4];
    /// `a + b`.
    fn add32(self, a: Self::Quad32, b: Self::Quad32) -> Self::Quad32;
    /// `a − b`.
    fn sub32(self, a: Self::Quad32, b: Self::Quad32) -> Self::Quad32;
    /// `a b + c`.
    fn mul_add32(self, a: Self::Quad32, b: Self::Quad32, c: Self::Quad32) -> Self::Quad32;
    /// `c − a b`.
    fn neg_mul_add32(self, a: Self::Quad32, b: Self::Quad32, c: Self::Quad32) -> Self::Quad32;
    /// Sum of the squares of each of four, at least `floor`.
    fn squares32(self, d: [Self::Quad32; 4], floor: f32) -> Self::Quad32;
    /// `1/√x`, to rounding.
    fn inverse_root_quad32(self, x: Self::Quad32) -> Self::Quad32;
    /// Each lane in all four lanes.
    fn spread32(self, q: Self::Quad32) -> [Self::Quad32; 4];

    /// Eight numbers.
    fn oct32(self, from: [f32; 8]) -> Self::Oct32;
    /// The numbers of two nodes.
    fn pair32(self, first: [f32; 4], second: [f32; 4]) -> Self::Oct32;
    /// `a + b`.
    fn add_oct32(self, a: Self::Oct32, b: Self::Oct32) -> Self::Oct32;
    /// `a − b`.
    fn sub_oct32(self, a: Self::Oct32, b: Self::Oct32) -> Self::Oct32;
    /// `a b + c`.
    fn mul_add_oct32(self, a: Self::Oct32, b: Self::Oct32, c: Self::Oct32) -> Self::Oct32;
    /// `c − a b`.
    fn neg_mul_add_oct32(self, a: Self::Oct32, b: Self::Oct32, c: Self::Oct32) -> Self::Oct32;
    /// Eight nodes, pair by pair (0 and 4, 1 and 5, …), as their first, second and third numbers (0 to 7).
    fn axes32(self, pairs: [Self::Oct32; 4]) -> [Self::Oct32; 3];
    /// `1/√max(x² + y² + z², floor)`, to two roundings.
    fn inverse_length_oct32(self, axes: [Self::Oct32; 3], floor: f32) -> Self::Oct32;
    /// Each sum of eight, and 0.
    fn sums32(self, axes: [Self::Oct32; 3]) -> [f32; 4];
}

/// A computation over [`Lanes`].
pub(in crate::tissue) trait Kernel {
    /// What it returns.
    type Output;
    /// Runs it; to be inlined into the code of the instruction set.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// A kernel with its instruction set.
struct On<K, L>(K, L);

impl<K: Kernel, L: Lanes> WithSimd for On<K, L> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run(self.1)
    }
}

impl KernelLevel {
    /// Runs a kernel on the best instruction set within the limit.
    #[cfg(target_arch = "x86_64")]
    pub(in crate::tissue) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        use super::portable::Exact;
        use pulp::x86::{V3, V4};
        if self == Self::Best
            && let Some(v4) = V4::try_new()
        {
            return Simd::vectorize(v4, On(kernel, v4));
        }
        if self != Self::Portable
            && let Some(v3) = V3::try_new()
        {
            return Simd::vectorize(v3, On(kernel, v3));
        }
        kernel.run(Exact(pulp::Scalar::new()))
    }

    /// Runs a kernel on the best instruction set within the limit.
    #[cfg(not(target_arch = "x86_64"))]
    pub(in crate::tissue) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        use super::portable::{AnySimd, Exact};
        match self {
            Self::Portable => kernel.run(Exact(pulp::Scalar::new())),
            Self::Best | Self::Avx2 => pulp::Arch::new().dispatch(AnySimd(kernel)),
        }
    }

    /// The limit for kernels that use no more than 256 bits: compiled for AVX-512 they are slower by a tenth to a quarter.
    pub(in crate::tissue) fn for_quads(self) -> Self {
        if self == Self::Portable { Self::Portable } else { Self::Avx2 }
    }

    /// Name of the instruction set that is taken, for reports.
    #[must_use]
    pub fn taken(self) -> &'static str {
        self.run(NameOf)
    }
}

struct NameOf;

impl Kernel for NameOf {
    type Output = &'static str;

    fn run<L: Lanes>(self, _: L) -> &'static str {
        match L::Simd::F64_LANES {
            8 => "AVX-512",
            4 => "AVX2",
            2 => "128 bit",
            _ => "portable",
        }
    }
}
