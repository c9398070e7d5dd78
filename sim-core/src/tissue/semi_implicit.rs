//! Semi-implicit Euler with implicit drag: Eq. (2) made stable, the default.
//!
//! `v⁺ = (v + h F/m)/(1 + c h/m)`, `x⁺ = x + h v⁺` (Zhang et al., Eqs. (2)–(3), with the drag of
//! Eq. (3) taken at the end of the step). Linearly stable for `λ h² < 4 m + 2 c h` per mode; drag
//! can only help. First order. Deliberately absent: the sub-step loop (`solver`).

use crate::tissue::integrator::NodeFactors;
use crate::vector::Vec3;

/// Factors of one node for a step of `h` seconds.
#[must_use]
pub fn factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    // (m v + h F)/(m + c h): the same as Eq. (2) with implicit drag, without dividing by a tiny mass twice.
    let heavy = mass_kg + drag_n_s_per_m * h;
    NodeFactors { keep: mass_kg / heavy, gain_s_per_kg: h / heavy }
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
    fn eq2_semi_implicit_matches_the_printed_form() {
        let (m, c, h) = (2e-3, 3.0, 1e-3);
        let (x, v, f) = (Vec3::new(1e-3, 0.0, 0.0), Vec3::new(0.1, -0.2, 0.3), Vec3::new(0.5, 0.0, -0.25));
        let (x1, v1) = eq2_step(x, v, f, m, c, h);
        let expected = (v + f * (h / m)) / (1.0 + c * h / m);
        // Two ways to round the same three operations.
        assert!((v1 - expected).norm() < 1e-15);
        assert!((x1 - (x + expected * h)).norm() < 1e-18);
    }

    #[test]
    fn eq2_first_order_on_the_damped_oscillator() {
        // x'' = −(k x + c x')/m, under-damped: x(t) = e^{−at}(cos wt + (a/w) sin wt).
        let (m, c, k, end) = (1e-3, 5e-3, 10.0_f64, 0.05_f64);
        let a: f64 = c / (2.0 * m);
        let w = (k / m - a * a).sqrt();
        let exact = (-a * end).exp() * ((w * end).cos() + a / w * (w * end).sin());
        let error = |steps: u32| {
            let h = end / f64::from(steps);
            let (mut x, mut v) = (Vec3::new(1.0, 0.0, 0.0), Vec3::zeros());
            for _ in 0..steps {
                (x, v) = eq2_step(x, v, x * -k, m, c, h);
            }
            (x.x - exact).abs()
        };
        let order = (error(4000) / error(8000)).log2();
        // Asymptotic at h ω = 1e-3: the measured order differs from 1 by less than 2 %.
        assert!((order - 1.0).abs() < 0.02, "order {order}");
    }
}
