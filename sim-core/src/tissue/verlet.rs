//! Verlet with Crank–Nicolson drag, staggered: velocities live half a step before the positions.
//!
//! `v½⁺ = ((m − c h/2) v½⁻ + h F(x))/(m + c h/2)`, `x⁺ = x + h v½⁺`. Second order; without drag the energy swings but
//! does not drift. Stable for `λ h² < 4 m`: drag does not help. It starts, and starts again after an event, from the
//! velocity `v` of the full step by half a kick, `v½ = (m v + h F/2)/(m + c h/2)`; the drag of the half kick is
//! implicit, so that heavy drag cannot throw a node (an error of `h²`, once). The same two factors, on `v½` and the
//! force at the end, give the velocity of the full step for output: `v = (v½⁻ + v½⁺)/2`.
//! Deliberately absent: the loop over the nodes (`integrator::advance`).

use crate::tissue::integrator::NodeFactors;

/// Factors of one node for a whole kick of `h` seconds.
#[must_use]
pub fn factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    let half_drag = 0.5 * drag_n_s_per_m * h;
    let heavy = mass_kg + half_drag;
    NodeFactors { keep: (mass_kg - half_drag) / heavy, gain_s_per_kg: h / heavy }
}

/// Factors of one node for the half kick that leads from full to half steps and back.
#[must_use]
pub fn half_factors(mass_kg: f64, drag_n_s_per_m: f64, h: f64) -> NodeFactors {
    let heavy = mass_kg + 0.5 * drag_n_s_per_m * h;
    NodeFactors { keep: mass_kg / heavy, gain_s_per_kg: 0.5 * h / heavy }
}
