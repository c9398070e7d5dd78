//! Energy and momentum of a tissue state, for tests, settling and reports.
//!
//! `E_kin = ½ Σ m_i |v_i|²`, `E_spring = ½ Σ k (l − L)²` in joules; momentum `Σ m v` and angular
//! momentum `Σ m x × v`. Each spring counts once. Deliberately absent: what drag, attachments and
//! stitches take or give; their reactions are in the step report.

use crate::tissue::network::{Spring, SpringNetwork, TissueState};
use crate::vector::Vec3;

/// Kinetic energy, joules.
#[must_use]
pub fn kinetic_j(network: &SpringNetwork, state: &TissueState) -> f64 {
    0.5 * network.mass_kg.iter().zip(&state.velocity_m_per_s).map(|(m, v)| m * v.norm_squared()).sum::<f64>()
}

/// Energy stored in the springs, joules.
#[must_use]
pub fn spring_j(network: &SpringNetwork, position_m: &[Vec3]) -> f64 {
    let stretch = |s: &Spring| (position_m[s.b as usize] - position_m[s.a as usize]).norm() - s.rest_length_m;
    let stored = network.springs.iter().map(|s| 0.5 * s.stiffness_n_per_m * stretch(s).powi(2));
    let silent = network.pulls_only.iter().map(|&i| {
        let s = &network.springs[i as usize];
        0.5 * s.stiffness_n_per_m * stretch(s).min(0.0).powi(2)
    });
    stored.sum::<f64>() - silent.sum::<f64>()
}

/// Linear momentum, newton seconds.
#[must_use]
pub fn momentum_n_s(network: &SpringNetwork, state: &TissueState) -> Vec3 {
    let parts = network.mass_kg.iter().zip(&state.velocity_m_per_s);
    parts.fold(Vec3::zeros(), |sum, (m, v)| sum + v * *m)
}

/// Angular momentum about the origin, newton metre seconds.
#[must_use]
pub fn angular_momentum_n_m_s(network: &SpringNetwork, state: &TissueState) -> Vec3 {
    let nodes = state.position_m.iter().zip(&state.velocity_m_per_s).zip(&network.mass_kg);
    nodes.fold(Vec3::zeros(), |sum, ((x, v), m)| sum + x.cross(v) * *m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::network::SpringFamily;

    #[test]
    fn one_stretched_spring_with_one_moving_end() {
        let spring =
            Spring { a: 0, b: 1, stiffness_n_per_m: 200.0, rest_length_m: 0.01, family: SpringFamily::Structural };
        let x = vec![Vec3::zeros(), Vec3::new(0.02, 0.0, 0.0)];
        let net = SpringNetwork::new(x, vec![1.0, 2.0], vec![0.0; 2], vec![0; 2], vec![spring]).unwrap();
        let mut state = net.rest_state();
        state.velocity_m_per_s[1] = Vec3::new(0.0, 3.0, 0.0);
        assert_eq!(kinetic_j(&net, &state), 9.0);
        assert!((spring_j(&net, &state.position_m) - 0.01).abs() < 1e-16);
        assert_eq!(momentum_n_s(&net, &state), Vec3::new(0.0, 6.0, 0.0));
        assert!((angular_momentum_n_m_s(&net, &state) - Vec3::new(0.0, 0.0, 0.12)).norm() < 1e-16);
    }
}
