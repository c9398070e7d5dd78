//! Preconditioned conjugate gradients on an implicit step's matrix, without a matrix.
//!
//! Solves `A δ = r` for the springs and resistances of `step_matrix` and the attachments and pairs of `couplings`. Ends
//! when `rᵀ M⁻¹ r` is at most the goal (the preconditioned norm weighs light and heavy nodes alike), after the most
//! iterations, or when a number ceases to be finite; what it has by then is the answer. Every vector is kept between
//! solves. Deliberately absent: the choice of the goal (`newton`), a restart.

use crate::tissue::couplings::Couplings;
use crate::tissue::step_matrix::StepMatrix;
use crate::vector::Vec3;

/// The vectors of the method.
#[derive(Clone, Debug)]
pub(crate) struct Pcg {
    /// Right-hand side on entry, what is left of it on return.
    pub(crate) residual: Vec<Vec3>,
    /// The solution.
    pub(crate) solution: Vec<Vec3>,
    /// Free between solves.
    pub(crate) search: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    image: Vec<Vec3>,
}

impl Pcg {
    pub(crate) fn new(nodes: usize) -> Self {
        let zeros = || vec![Vec3::zeros(); nodes];
        Self { residual: zeros(), solution: zeros(), search: zeros(), preconditioned: zeros(), image: zeros() }
    }

    /// `(r + A s)ᵀ M⁻¹ (r + A s)` for the residual `r` and `s` in `search`: the size of the right-hand side if the solve
    /// had started `s` earlier.
    pub(crate) fn size_before(&mut self, matrix: &StepMatrix, couplings: &Couplings<'_>) -> f64 {
        multiply(matrix, couplings, &self.search, &mut self.image);
        self.image.iter_mut().zip(&self.residual).for_each(|(image, r)| *image += r);
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
        self.solution.fill(Vec3::zeros());
        let mut energy = matrix.precondition(&self.residual, &mut self.preconditioned);
        self.search.copy_from_slice(&self.preconditioned);
        for iteration in 0..max_iterations {
            if energy.is_nan() || energy <= goal {
                return iteration;
            }
            multiply(matrix, couplings, &self.search, &mut self.image);
            let curvature = dot(&self.search, &self.image);
            let step = energy / curvature;
            if curvature <= 0.0 || !step.is_finite() {
                return iteration;
            }
            for ((x, r), (p, image)) in
                self.solution.iter_mut().zip(&mut self.residual).zip(self.search.iter().zip(&self.image))
            {
                *x += p * step;
                *r -= image * step;
            }
            let next = matrix.precondition(&self.residual, &mut self.preconditioned);
            let keep = next / energy;
            energy = next;
            for (p, z) in self.search.iter_mut().zip(&self.preconditioned) {
                *p = z + *p * keep;
            }
        }
        max_iterations
    }
}

fn multiply(matrix: &StepMatrix, couplings: &Couplings<'_>, v: &[Vec3], image: &mut [Vec3]) {
    matrix.multiply(v, image);
    couplings.multiply(v, image);
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
