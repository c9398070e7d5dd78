//! Preconditioned conjugate gradients on an implicit step's matrix, without a matrix.
//!
//! Solves `A δ = r` for the springs and resistances of `step_matrix` and the attachments and pairs of `couplings`. Ends
//! when `rᵀ M⁻¹ r` is at most the goal (the preconditioned norm weighs light and heavy nodes alike), after the most
//! iterations, or when a number ceases to be finite; what it has by then is the answer. Every vector is kept between
//! solves. Deliberately absent: the choice of the goal (`newton`), a restart.

use crate::tissue::couplings::Couplings;
use crate::tissue::node::Node;
use crate::tissue::step_matrix::StepMatrix;
use crate::tissue::sweep::dispatch::{Kernel, KernelLevel, Lanes};

/// The vectors of the method.
#[derive(Clone, Debug)]
pub(crate) struct Pcg {
    /// Right-hand side on entry, what is left of it on return.
    pub(crate) residual: Vec<Node>,
    /// The solution.
    pub(crate) solution: Vec<Node>,
    /// Free between solves.
    pub(crate) search: Vec<Node>,
    preconditioned: Vec<Node>,
    image: Vec<Node>,
}

impl Pcg {
    pub(crate) fn new(nodes: usize) -> Self {
        let zeros = || vec![Node::default(); nodes];
        Self { residual: zeros(), solution: zeros(), search: zeros(), preconditioned: zeros(), image: zeros() }
    }

    /// `(r + A s)ᵀ M⁻¹ (r + A s)` for the residual `r` and `s` in `search`: the size of the right-hand side if the solve
    /// had started `s` earlier.
    pub(crate) fn size_before(&mut self, matrix: &StepMatrix, couplings: &Couplings<'_>) -> f64 {
        multiply(matrix, couplings, &self.search, &mut self.image);
        self.image.iter_mut().zip(&self.residual).for_each(|(image, r)| *image += r.vector());
        matrix.precondition(&self.image, &mut self.preconditioned)
    }

    /// `rᵀ M⁻¹ r`.
    pub(crate) fn size(&mut self, matrix: &StepMatrix) -> f64 {
        matrix.precondition(&self.residual, &mut self.preconditioned)
    }

    /// Solves from `solution = 0`; returns the iterations.
    pub(crate) fn solve(
        &mut self,
        matrix: &StepMatrix,
        couplings: &Couplings<'_>,
        goal: f64,
        max_iterations: u32,
    ) -> u32 {
        let level = KernelLevel::Best.for_quads();
        self.solution.fill(Node::default());
        let mut energy = matrix.precondition(&self.residual, &mut self.preconditioned);
        self.search.copy_from_slice(&self.preconditioned);
        for iteration in 0..max_iterations {
            if energy.is_nan() || energy <= goal {
                return iteration;
            }
            multiply(matrix, couplings, &self.search, &mut self.image);
            let curvature = level.run(Dot { a: &self.search, b: &self.image });
            let step = energy / curvature;
            if curvature <= 0.0 || !step.is_finite() {
                return iteration;
            }
            level.run(Add { to: &mut self.solution, share: step, of: &self.search });
            level.run(Add { to: &mut self.residual, share: -step, of: &self.image });
            let next = matrix.precondition(&self.residual, &mut self.preconditioned);
            let keep = next / energy;
            energy = next;
            level.run(Turn { search: &mut self.search, keep, toward: &self.preconditioned });
        }
        max_iterations
    }
}

fn multiply(matrix: &StepMatrix, couplings: &Couplings<'_>, v: &[Node], image: &mut [Node]) {
    matrix.multiply(v, image);
    couplings.multiply(v, image);
}

/// `Σ a · b`.
struct Dot<'a> {
    a: &'a [Node],
    b: &'a [Node],
}

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> f64 {
        let mut sum = lanes.quad([0.0; 4]);
        for (a, b) in self.a.iter().zip(self.b) {
            sum = lanes.mul_add(lanes.quad(a.0), lanes.quad(b.0), sum);
        }
        let [x, y, z, _] = lanes.array(sum);
        x + y + z
    }
}

/// `to += share · of`.
struct Add<'a> {
    to: &'a mut [Node],
    share: f64,
    of: &'a [Node],
}

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let share = lanes.quad([self.share; 4]);
        for (to, of) in self.to.iter_mut().zip(self.of) {
            to.0 = lanes.array(lanes.mul_add(lanes.quad(of.0), share, lanes.quad(to.0)));
        }
    }
}

/// `search = toward + keep · search`.
struct Turn<'a> {
    search: &'a mut [Node],
    keep: f64,
    toward: &'a [Node],
}

impl Kernel for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let keep = lanes.quad([self.keep; 4]);
        for (p, z) in self.search.iter_mut().zip(self.toward) {
            p.0 = lanes.array(lanes.mul_add(lanes.quad(p.0), keep, lanes.quad(z.0)));
        }
    }
}
