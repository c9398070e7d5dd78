//! A tied stitch: the loop of suture line between two suture points.
//!
//! `T = min(k·max(0, D − L), T_hold)`, `T_hold = T_knot·e^{μθ}`: elastic in tension only, and limited by the
//! knot, whose hold grows with the friction of the line over the wrap θ (capstan). Above the limit the knot slips:
//! `L` grows until `T = T_hold`, and never shrinks again. Metres, newtons, radians.
//!
//! Zhang et al. tie without a knot model; slip is what makes a stitch open under later pulls and gives their
//! Algorithm 2 something to do. Deliberately absent: rupture of the line, relaxation of the tissue over minutes.

use crate::vector::Vec3;

/// Material of the stitches of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchParams {
    /// Stiffness of the tied loop, newtons per metre, above 0.
    pub stiffness_n_per_m: f64,
    /// Force at which the bare knot slips, newtons, at least 0.
    pub knot_hold_n: f64,
    /// Friction of line on tissue, at least 0 (0: the paper).
    pub friction: f64,
    /// Angle by which the loop wraps tissue on its way to the knot, radians, at least 0.
    pub wrap_rad: f64,
}

impl StitchParams {
    /// `T_hold = T_knot·e^{μθ}`, newtons.
    #[must_use]
    pub fn holding_force_n(&self) -> f64 {
        self.knot_hold_n * (self.friction * self.wrap_rad).exp()
    }
}

/// One tied stitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    rest_length_m: f64,
    slipped_m: f64,
}

/// What a stitch does in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchStep {
    /// Tension, newtons.
    pub tension_n: f64,
    /// Length that slipped through the knot in this step, metres.
    pub slipped_m: f64,
}

impl Stitch {
    /// Ties a stitch at the present distance of its points, without tension.
    #[must_use]
    pub fn tie(distance_m: f64) -> Self {
        Self { rest_length_m: distance_m, slipped_m: 0.0 }
    }

    /// A stitch as it was: its loop's rest length, and what of that has slipped through the knot.
    #[must_use]
    pub fn resume(rest_length_m: f64, slipped_m: f64) -> Self {
        Self { rest_length_m, slipped_m }
    }

    /// Rest length of the loop, metres.
    #[must_use]
    pub fn rest_length_m(&self) -> f64 {
        self.rest_length_m
    }

    /// Length that has slipped through the knot since tying, metres.
    #[must_use]
    pub fn slipped_m(&self) -> f64 {
        self.slipped_m
    }

    /// Tension at a distance, without slip: `k·max(0, D − L)`, newtons.
    #[must_use]
    pub fn tension_n(&self, params: &StitchParams, distance_m: f64) -> f64 {
        params.stiffness_n_per_m * (distance_m - self.rest_length_m).max(0.0)
    }

    /// Measures the tension at a distance and lets the knot slip where it exceeds the holding force.
    pub fn step(&mut self, params: &StitchParams, distance_m: f64) -> StitchStep {
        let elastic_n = self.tension_n(params, distance_m);
        let hold_n = params.holding_force_n();
        if elastic_n <= hold_n {
            return StitchStep { tension_n: elastic_n, slipped_m: 0.0 };
        }
        let slipped_m = (elastic_n - hold_n) / params.stiffness_n_per_m;
        self.rest_length_m += slipped_m;
        self.slipped_m += slipped_m;
        StitchStep { tension_n: hold_n, slipped_m }
    }
}

/// Force of a tension on the left point (the right one gets the opposite): towards the right point, none where the
/// points coincide.
#[must_use]
pub fn force_on_left(tension_n: f64, left_m: Vec3, right_m: Vec3) -> Vec3 {
    let across = right_m - left_m;
    let distance = across.norm();
    if distance == 0.0 { Vec3::zeros() } else { across * (tension_n / distance) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PARAMS: StitchParams =
        StitchParams { stiffness_n_per_m: 2000.0, knot_hold_n: 0.5, friction: 0.2, wrap_rad: std::f64::consts::PI };

    #[test]
    fn pulls_only_and_only_when_longer_than_tied() {
        let mut stitch = Stitch::tie(0.003);
        assert_eq!(stitch.step(&PARAMS, 0.001), StitchStep { tension_n: 0.0, slipped_m: 0.0 });
        let taut = stitch.step(&PARAMS, 0.0032);
        assert!((taut.tension_n - 0.4).abs() < 1e-12 && taut.slipped_m == 0.0);
    }

    #[test]
    fn knot_hold_grows_with_the_capstan() {
        assert!((PARAMS.holding_force_n() - 0.5 * (0.2 * std::f64::consts::PI).exp()).abs() < 1e-15);
        assert_eq!(StitchParams { friction: 0.0, ..PARAMS }.holding_force_n(), 0.5);
    }

    #[test]
    fn slip_lengthens_the_loop_until_the_tension_is_what_the_knot_holds() {
        let mut stitch = Stitch::tie(0.003);
        let slip = stitch.step(&PARAMS, 0.005);
        let hold = PARAMS.holding_force_n();
        assert_eq!(slip.tension_n, hold);
        // Work: 4 N elastic at 2 mm; the loop gives way by the excess over the stiffness.
        assert!((slip.slipped_m - (4.0 - hold) / 2000.0).abs() < 1e-15);
        assert!((stitch.tension_n(&PARAMS, 0.005) - hold).abs() < 1e-12);
        // Back at the tied distance the loop is slack now, and a second pull to the same distance slips no more.
        assert_eq!(stitch.step(&PARAMS, 0.003).tension_n, 0.0);
        assert!(stitch.step(&PARAMS, 0.005).slipped_m < 1e-15);
    }

    #[test]
    fn force_pulls_the_points_together() {
        let f = force_on_left(0.5, Vec3::zeros(), Vec3::new(0.0, 0.004, 0.003));
        assert!((f - Vec3::new(0.0, 0.4, 0.3)).norm() < 1e-15);
        assert_eq!(force_on_left(0.5, Vec3::zeros(), Vec3::zeros()), Vec3::zeros());
    }

    proptest! {
        #[test]
        fn a_stitch_stores_or_burns_all_the_work_it_gets(path in prop::collection::vec(0.0..0.02_f64, 2..20)) {
            const MOVES: usize = 2000;
            let mut stitch = Stitch::tie(0.003);
            let (mut distance, mut tension, mut work) = (0.003, 0.0, 0.0);
            for target in &path {
                let fine = (target - distance) / MOVES as f64;
                for _ in 0..MOVES {
                    distance += fine;
                    let next = stitch.step(&PARAMS, distance).tension_n;
                    work += 0.5 * (tension + next) * fine;
                    tension = next;
                }
            }
            let stored = tension * tension / (2.0 * PARAMS.stiffness_n_per_m);
            let heat = PARAMS.holding_force_n() * stitch.slipped_m();
            // Trapezoids are exact but where slip or slack begins: there by less than k δ² with moves δ of at most 10 µm,
            // twice per leg of the path.
            let corners = 2.0 * path.len() as f64 * PARAMS.stiffness_n_per_m * 1e-5_f64.powi(2);
            prop_assert!((work - stored - heat).abs() <= corners, "work {work} stored {stored} heat {heat}");
        }
    }
}
