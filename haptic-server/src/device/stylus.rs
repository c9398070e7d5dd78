//! A stylus with friction on a hand's spring: the mechanics of the simulated device.
//!
//! One step of length h, implicit in damper, spring and friction, so that neither step length nor
//! friction can create energy: `(m + h b + h² k) v⁺ = m v + h (k (x_t + h v_t − x) + b_h v_t + F) − h f_c d`, where d
//! is the direction of v⁺, or whatever |d| ≤ 1 holds the stylus still: Coulomb friction with true sticking,
//! solved exactly by shrinking the impulse. m = stylus + hand, b = viscous + hand damper, k = hand spring,
//! x_t and v_t = the hand's wish, F = the motors' force. SI units.
//! Deliberately absent: direction-dependent inertia, gravity, Stribeck friction.

use sim_core::vector::Vec3;

/// How a hand holds the stylus: mass, damper and spring between stylus and wish (model parameters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandImpedance {
    /// Mass that moves with the stylus, kilograms.
    pub mass_kg: f64,
    /// Damping against the wished motion, newton seconds per metre.
    pub damping_n_s_per_m: f64,
    /// Stiffness towards the wished position, newtons per metre.
    pub stiffness_n_per_m: f64,
}

/// Masses, dampers and friction that act on the stylus (model parameters).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StylusParams {
    /// Apparent mass at the stylus, kilograms (from the data sheet's 45 g).
    pub mass_kg: f64,
    /// Coulomb friction when driven back, newtons (quoted 0.26 N).
    pub coulomb_friction_n: f64,
    /// Viscous friction, newton seconds per metre (assumed).
    pub viscous_friction_n_s_per_m: f64,
    /// The hand's grip; `None`: nobody holds the stylus.
    pub grip: Option<HandImpedance>,
}

impl Default for StylusParams {
    fn default() -> Self {
        Self {
            mass_kg: 0.045,
            coulomb_friction_n: 0.26,
            viscous_friction_n_s_per_m: 0.75,
            grip: Some(HandImpedance { mass_kg: 0.1, damping_n_s_per_m: 4.0, stiffness_n_per_m: 300.0 }),
        }
    }
}

/// Motion of the stylus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StylusState {
    /// Position, metres.
    pub position_m: Vec3,
    /// Velocity, metres per second.
    pub velocity_m_per_s: Vec3,
}

impl StylusState {
    /// One step of `dt_s` under the motors' force, with the hand's wish at the start of the step.
    pub fn step(&mut self, params: &StylusParams, wish_m: Vec3, wish_m_per_s: Vec3, force_n: Vec3, dt_s: f64) {
        let (hand_kg, hand_damping, stiffness) =
            params.grip.map_or((0.0, 0.0, 0.0), |g| (g.mass_kg, g.damping_n_s_per_m, g.stiffness_n_per_m));
        let mass = params.mass_kg + hand_kg;
        let force =
            (wish_m + wish_m_per_s * dt_s - self.position_m) * stiffness + wish_m_per_s * hand_damping + force_n;
        let resistance = mass + dt_s * (params.viscous_friction_n_s_per_m + hand_damping) + dt_s * dt_s * stiffness;
        let impulse = self.velocity_m_per_s * mass + force * dt_s;
        let friction = dt_s * params.coulomb_friction_n;
        let size = impulse.norm();
        self.velocity_m_per_s =
            if size <= friction { Vec3::zeros() } else { impulse * ((1.0 - friction / size) / resistance) };
        self.position_m += self.velocity_m_per_s * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STEP_S: f64 = 50e-6;

    fn released() -> StylusParams {
        StylusParams { grip: None, ..StylusParams::default() }
    }

    fn pushed(params: &StylusParams, from: StylusState, force_n: Vec3, steps: usize) -> StylusState {
        let mut state = from;
        for _ in 0..steps {
            state.step(params, Vec3::zeros(), Vec3::zeros(), force_n, STEP_S);
        }
        state
    }

    fn resting() -> StylusState {
        StylusState { position_m: Vec3::zeros(), velocity_m_per_s: Vec3::zeros() }
    }

    #[test]
    fn friction_holds_below_its_limit_and_terminal_speed_is_the_excess_over_drag() {
        let held = pushed(&released(), resting(), Vec3::new(0.0, 0.25, 0.0), 20_000);
        assert_eq!(held, resting(), "0.25 N do not move 0.26 N of friction by one bit");
        // Sixteen time constants of 45 g / 0.75 N·s/m.
        let slid = pushed(&released(), held, Vec3::new(0.0, 0.29, 0.0), 20_000);
        let expected = (0.29 - 0.26) / 0.75;
        assert!((slid.velocity_m_per_s.y - expected).abs() < 1e-6, "{}", slid.velocity_m_per_s);
    }

    #[test]
    fn a_sliding_stylus_stops_where_constant_deceleration_stops_it() {
        let params = StylusParams { viscous_friction_n_s_per_m: 0.0, ..released() };
        let moving = StylusState { velocity_m_per_s: Vec3::new(0.2, 0.0, 0.0), ..resting() };
        let stopped = pushed(&params, moving, Vec3::zeros(), 2_000);
        let expected = 0.2 * 0.2 * 0.045 / (2.0 * 0.26);
        assert_eq!(stopped.velocity_m_per_s, Vec3::zeros());
        // First order in the step: half a step at the starting speed.
        assert!((stopped.position_m.x - expected).abs() < 0.5 * STEP_S * 0.2, "{}", stopped.position_m.x);
    }

    #[test]
    fn a_pushed_stylus_follows_the_exponential_of_its_drag() {
        let params = StylusParams { coulomb_friction_n: 0.0, ..released() };
        let (t, tau) = (0.06_f64, 0.045 / 0.75);
        let state = pushed(&params, resting(), Vec3::new(0.1, 0.0, 0.0), 1_200);
        let expected = 0.1 / 0.75 * (t - tau * (1.0 - (-t / tau).exp()));
        // First order in the step: half a step at the speed reached.
        assert!((state.position_m.x - expected).abs() < 0.5 * STEP_S * 0.1, "{}", state.position_m.x);
    }

    proptest! {
        #[test]
        fn without_force_energy_never_grows(x in -0.05..0.05, y in -0.03..0.03, vx in -0.5..0.5, vz in -0.5..0.5,
                                            losses in 0.0..1.0, held: bool, dt_s in 50e-6..5e-3) {
            let grip = StylusParams::default().grip.filter(|_| held);
            let (m, k) = grip.map_or((0.045, 0.0), |g| (0.045 + g.mass_kg, g.stiffness_n_per_m));
            // Below a half nothing but the implicit step takes energy out.
            let losses: f64 = f64::max(losses - 0.5, 0.0);
            let params = StylusParams {
                coulomb_friction_n: 0.5 * losses,
                viscous_friction_n_s_per_m: losses,
                grip: grip.map(|g| HandImpedance { damping_n_s_per_m: 8.0 * losses, ..g }),
                ..StylusParams::default()
            };
            let energy = |s: &StylusState| {
                0.5 * m * s.velocity_m_per_s.norm_squared() + 0.5 * k * s.position_m.norm_squared()
            };
            let mut state =
                StylusState { position_m: Vec3::new(x, y, 0.0), velocity_m_per_s: Vec3::new(vx, 0.0, vz) };
            let mut last = energy(&state);
            for _ in 0..2000 {
                state.step(&params, Vec3::zeros(), Vec3::zeros(), Vec3::zeros(), dt_s);
                let now = energy(&state);
                prop_assert!(now <= last * (1.0 + 1e-12), "{last} J became {now} J");
                last = now;
            }
        }
    }
}
