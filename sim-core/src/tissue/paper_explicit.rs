//! The paper's explicit form, as printed.
//!
//! `v⁺ = v + h (F − c v)/m`, `x⁺ = x + h v⁺` (Zhang et al., Eqs. (2)–(3), drag at the start of the
//! step). Linearly stable only for `λ h² + 2 c h < 4 m`: with the drag of Table 2 a node must weigh
//! grams at 1 ms, so this form is refused at construction where it must blow up (`stability`).
//! Deliberately absent: any repair of it; `semi_implicit` is the repair.

use crate::tissue::integrator::NodeFactors;
use crate::vector::Vec3;

/// Factors of one node for a step of `h` seconds.
#[must_use]
pub fn factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    NodeFactors { keep: 1.0 - drag_n_s_per_m * h / mass_kg, gain_s_per_kg: h / mass_kg }
}

/// One step of one node under force `force_n`: new position and velocity.
#[must_use]
pub fn eq2_step(
    position_m: Vec3,
    velocity_m_per_s: Vec3,
    force_n: Vec3,
    mass_kg: f64,
    drag_n_s_per_m: f64,
    h: f64,
) -> (Vec3, Vec3) {
    let f = factors(mass_kg, drag_n_s_per_m, h);
    let v = velocity_m_per_s * f.keep + force_n * f.gain_s_per_kg;
    (position_m + v * h, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eq2_literal_matches_the_printed_form() {
        let (m, c, h) = (2e-3, 3.0, 1e-3);
        let (x, v, f) = (Vec3::new(1e-3, 0.0, 0.0), Vec3::new(0.1, -0.2, 0.3), Vec3::new(0.5, 0.0, -0.25));
        let (x1, v1) = eq2_step(x, v, f, m, c, h);
        let expected = v + (f - v * c) * (h / m);
        // Two ways to round the same three operations.
        assert!((v1 - expected).norm() < 1e-15);
        assert!((x1 - (x + expected * h)).norm() < 1e-18);
    }

    #[test]
    fn eq2_literal_and_implicit_drag_agree_without_drag() {
        let (x, v, f) = (Vec3::zeros(), Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.0, 0.2, 0.0));
        assert_eq!(
            eq2_step(x, v, f, 1e-3, 0.0, 1e-3),
            crate::tissue::semi_implicit::eq2_step(x, v, f, 1e-3, 0.0, 1e-3)
        );
    }
}
