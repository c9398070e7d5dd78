//! Kinematics of the open HID arm: motor counts ↔ joint angles ↔ stylus, force → motor currents.
//!
//! In the arm's own axes (x to the user, y right, z up), with r = L_b sin B + L_c sin C:
//! `x = r cos A − x₀, y = r sin A − y₀, z = L_n + L_b cos B − L_c cos C − z₀`; B and C are absolute, against the vertical.
//! Here (x right, y up, z to the user, as all devices): `p = (y, z, x)`. `τ = Jᵀ F`, `I = τ / (N k_t)` with the capstans'
//! reduction N. One joint turn is `N · counts_per_turn` counts. Metres, radians, newtons, milliamperes.
//! Lengths, drums, encoders and torque constant: the published build of 2015. Assumed, since not published: direction of
//! each joint, and which angles the rest pose has. Deliberately absent: joint stops, the gimbal.

use serde::{Deserialize, Serialize};
use sim_core::vector::{Mat3, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A build of the arm, from outside. Without a file: the published one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmConfig {
    /// Height of the shoulder, length of the upper link and of the forearm, metres.
    pub link_m: [f64; 3],
    /// Middle of the workspace in the arm's own axes, metres.
    pub origin_m: [f64; 3],
    /// Turns of the motor for a turn of the joint.
    pub reduction: [f64; 3],
    /// Counts of a motor turn.
    pub counts_per_turn: f64,
    /// 1 or −1: direction of each motor.
    pub direction: [f64; 3],
    /// Joint angles of the rest pose in which the arm is calibrated, radians.
    pub rest_rad: [f64; 3],
    /// Torque constant of the motors, newton metres per ampere.
    pub torque_n_m_per_a: f64,
    /// No motor gets more, milliamperes.
    pub max_milliamps: f64,
    /// Largest force, newtons.
    pub peak_force_n: f64,
    /// Force that the motors bear for ever, newtons (assumed: the build has no figure).
    pub continuous_force_n: f64,
    /// Largest stiffness, newtons per metre.
    pub stiffness_n_per_m: f64,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            link_m: [0.080, 0.205, 0.245],
            origin_m: [0.220, 0.0, 0.080],
            reduction: [16.0, 12.0, 12.0],
            counts_per_turn: 2_000.0,
            direction: [1.0; 3],
            rest_rad: [0.0, 0.0, FRAC_PI_2],
            torque_n_m_per_a: 0.0259,
            max_milliamps: 3_000.0,
            peak_force_n: 5.0,
            continuous_force_n: 1.5,
            stiffness_n_per_m: 1_000.0,
        }
    }
}

/// A value of [`ArmConfig`] that no arm has.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}, allowed are {low} to {high}; change it in the file of the device")]
pub struct ArmConfigError {
    /// Key.
    pub key: &'static str,
    /// What was given.
    pub value: f64,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
}

/// The arm's geometry and motors, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmParams {
    config: ArmConfig,
    rad_per_count: Vec3,
    milliamps_per_n_m: Vec3,
}

impl ArmParams {
    /// Checks every value.
    ///
    /// # Errors
    /// [`ArmConfigError`] names the first one that no arm has.
    pub fn new(config: &ArmConfig) -> Result<Self, ArmConfigError> {
        let c = *config;
        let three = |key, values: [f64; 3], low, high| values.map(|value| (key, value, low, high));
        let checks = [
            three("link_m", c.link_m, 0.01, 2.0),
            three("origin_m", c.origin_m, -2.0, 2.0),
            three("reduction", c.reduction, 0.5, 200.0),
            three("rest_rad", c.rest_rad, -TAU, TAU),
            // Either 1 or −1: nothing has a square of 1 beside them.
            three("direction", c.direction.map(|d| d * d), 1.0, 1.0),
            [
                ("counts_per_turn", c.counts_per_turn, 16.0, 1e6),
                ("torque_n_m_per_a", c.torque_n_m_per_a, 1e-4, 10.0),
                ("max_milliamps", c.max_milliamps, 0.0, f64::from(i16::MAX)),
            ],
            [
                ("peak_force_n", c.peak_force_n, 0.0, 40.0),
                ("continuous_force_n", c.continuous_force_n, 0.0, c.peak_force_n),
                ("stiffness_n_per_m", c.stiffness_n_per_m, 1.0, 10_000.0),
            ],
        ];
        for (key, value, low, high) in checks.into_iter().flatten() {
            if !(value >= low && value <= high) {
                return Err(ArmConfigError { key, value, low, high });
            }
        }
        let per_axis = |f: fn(&ArmConfig, usize) -> f64| Vec3::from_fn(|i, _| f(&c, i));
        let rad_per_count = per_axis(|c, i| c.direction[i] * TAU / (c.reduction[i] * c.counts_per_turn));
        let milliamps_per_n_m = per_axis(|c, i| c.direction[i] * 1e3 / (c.reduction[i] * c.torque_n_m_per_a));
        Ok(Self { config: c, rad_per_count, milliamps_per_n_m })
    }

    /// What was given.
    #[must_use]
    pub fn config(&self) -> &ArmConfig {
        &self.config
    }

    /// Joint angles of encoder counts.
    #[must_use]
    pub fn joints(&self, counts: [i16; 3]) -> Vec3 {
        Vec3::from_fn(|i, _| f64::from(counts[i]) * self.rad_per_count[i])
    }

    /// Counts of joint angles, rounded; angles beyond the counter's range end at it.
    #[must_use]
    pub fn counts(&self, joints: Vec3) -> [i16; 3] {
        std::array::from_fn(|i| (joints[i] / self.rad_per_count[i]).round() as i16)
    }

    /// Counts of the rest pose.
    #[must_use]
    pub fn rest_counts(&self) -> [i16; 3] {
        self.counts(Vec3::from(self.config.rest_rad))
    }

    /// The stylus for joint angles (A, B, C).
    #[must_use]
    pub fn forward(&self, joints: Vec3) -> Vec3 {
        let [ln, lb, lc] = self.config.link_m;
        let [x0, y0, z0] = self.config.origin_m;
        let r = lb * joints.y.sin() + lc * joints.z.sin();
        let own =
            [r * joints.x.cos() - x0, r * joints.x.sin() - y0, ln + lb * joints.y.cos() - lc * joints.z.cos() - z0];
        Vec3::new(own[1], own[2], own[0])
    }

    /// `∂p/∂(A, B, C)`, metres per radian.
    #[must_use]
    pub fn jacobian(&self, joints: Vec3) -> Mat3 {
        let [_, lb, lc] = self.config.link_m;
        let (sa, ca) = joints.x.sin_cos();
        let (sb, cb) = joints.y.sin_cos();
        let (sc, cc) = joints.z.sin_cos();
        let r = lb * sb + lc * sc;
        Mat3::new(ca * r, sa * lb * cb, sa * lc * cc, 0.0, -lb * sb, lc * sc, -sa * r, ca * lb * cb, ca * lc * cc)
    }

    /// Currents that render a force, milliamperes: its direction, at most the force's and the motors' peak, nothing if it
    /// is not finite.
    #[must_use]
    pub fn currents(&self, joints: Vec3, force_n: Vec3) -> [i16; 3] {
        let size = force_n.norm();
        let share = if size > self.config.peak_force_n { self.config.peak_force_n / size } else { 1.0 };
        let torque = self.jacobian(joints).transpose() * (force_n * share);
        let milliamps = torque.component_mul(&self.milliamps_per_n_m);
        if !milliamps.iter().all(|i| i.is_finite()) {
            return [0; 3];
        }
        let most = milliamps.amax();
        let share = if most > self.config.max_milliamps { self.config.max_milliamps / most } else { 1.0 };
        // Towards zero: never more than was asked for.
        std::array::from_fn(|i| (milliamps[i] * share).trunc() as i16)
    }

    /// The force of these currents, newtons; `None` where the arm is singular.
    #[must_use]
    pub fn force(&self, joints: Vec3, currents: [i16; 3]) -> Option<Vec3> {
        let torque = Vec3::from_fn(|i, _| f64::from(currents[i]) / self.milliamps_per_n_m[i]);
        Some(self.jacobian(joints).transpose().try_inverse()? * torque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A milliampere in each motor is a torque of 0.4 mN·m at the joint; over 0.1 m that is 4 mN, and three motors add up.
    const MILLIAMP_N: f64 = 0.02;

    fn arm() -> ArmParams {
        ArmParams::new(&ArmConfig::default()).expect("the published build")
    }

    #[test]
    fn the_published_formula_at_three_poses() {
        // Upright and level: x = L_c − x₀ = 25 mm, z = L_n + L_b − z₀ = 205 mm.
        let rest = arm().forward(Vec3::new(0.0, 0.0, FRAC_PI_2));
        assert!((rest - Vec3::new(0.0, 0.205, 0.025)).amax() < 1e-15, "{rest}");
        // Turned by 90°: what was to the user is right.
        let turned = arm().forward(Vec3::new(FRAC_PI_2, 0.0, FRAC_PI_2));
        assert!((turned - Vec3::new(0.245, 0.205, -0.220)).amax() < 1e-15, "{turned}");
        // B = C = 90°: stretched, z = 0.
        let far = arm().forward(Vec3::new(0.0, FRAC_PI_2, FRAC_PI_2));
        assert!((far - Vec3::new(0.0, 0.0, 0.230)).amax() < 1e-15, "{far}");
        assert_eq!(arm().rest_counts(), [0, 0, 6_000], "a quarter of 12 · 2000 counts");
    }

    #[test]
    fn currents_are_those_of_the_torques_and_end_at_the_limits() {
        let arm = arm();
        let joints = Vec3::new(0.0, 0.0, FRAC_PI_2);
        // Upwards at the end of the level forearm: C alone, 0.245 m · 1 N / (12 · 0.0259 N·m/A) = 788.3 mA.
        assert_eq!(arm.currents(joints, Vec3::y()), [0, 0, 788]);
        // Far beyond: 5 N are 3941 mA, more than the motor gets.
        assert_eq!(arm.currents(joints, Vec3::y() * 100.0), [0, 0, 3_000]);
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(arm.currents(joints, Vec3::new(bad, 0.0, 0.0)), [0; 3]);
        }
    }

    #[test]
    fn a_build_that_cannot_be_is_refused_by_name() {
        let broken = ArmConfig { direction: [1.0, 0.5, 1.0], ..ArmConfig::default() };
        assert_eq!(ArmParams::new(&broken).map_err(|e| e.key), Err("direction"));
        let broken = ArmConfig { max_milliamps: f64::NAN, ..ArmConfig::default() };
        assert_eq!(ArmParams::new(&broken).map_err(|e| e.key), Err("max_milliamps"));
        assert!(toml::from_str::<ArmConfig>("link = [1, 2, 3]\n").is_err());
        let partial: ArmConfig = toml::from_str("max_milliamps = 500.0\n").expect("the rest is the published build");
        assert_eq!(partial.reduction, ArmConfig::default().reduction);
    }

    proptest! {
        #[test]
        fn the_jacobian_matches_finite_differences(a in -1.0..1.0, b in -0.5..1.2, c in 0.2..2.2) {
            let (arm, joints, step) = (arm(), Vec3::new(a, b, c), 1e-6);
            for axis in 0..3 {
                let (mut up, mut down) = (joints, joints);
                up[axis] += step;
                down[axis] -= step;
                let column = (arm.forward(up) - arm.forward(down)) / (2.0 * step);
                prop_assert!((column - arm.jacobian(joints).column(axis)).amax() < 1e-9);
            }
        }

        #[test]
        fn counts_and_angles_go_there_and_back(a: i16, b: i16, c: i16) {
            prop_assert_eq!(arm().counts(arm().joints([a, b, c])), [a, b, c]);
        }

        #[test]
        fn currents_give_the_force_and_never_more(a in -0.8..0.8, b in -0.3..0.6, c in 1.2..2.0,
                                                  x in -9.0..9.0, y in -9.0..9.0, z in -9.0..9.0) {
            let (arm, joints, asked) = (arm(), Vec3::new(a, b, c), Vec3::new(x, y, z));
            let currents = arm.currents(joints, asked);
            prop_assert!(currents.iter().all(|i| f64::from(*i).abs() <= arm.config().max_milliamps));
            let given = arm.force(joints, currents).expect("far from singular");
            prop_assert!(given.norm() <= arm.config().peak_force_n.min(asked.norm()) + MILLIAMP_N);
            let along = if asked.norm() > 0.1 { given.dot(&asked.normalize()) } else { given.norm() };
            prop_assert!((given - asked.normalize() * along).norm() < MILLIAMP_N || asked.norm() <= 0.1);
        }
    }
}
