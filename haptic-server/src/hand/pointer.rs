//! A hand that follows the wishes of a viewer's pointer, and trusts none of them.
//!
//! Another thread puts each wish into a cell (triple buffer); the newest counts. A wish that is not finite is ignored, a place
//! outside the workspace is brought to its border. The hand goes there by `v = min(v_max, √(a d), d/Δt)` along the way d that is
//! left, and changes its velocity by no more than `a Δt`: whatever is sent, `|v| ≤ v_max` and `|Δv| ≤ a Δt`; half of `a` is kept
//! for the turn of a way. After [`HOLD_AFTER_S`] of silence it stops where it is. After [`LET_GO_AFTER_S`] of silence, or when
//! another turn begins (`place.rs`), every button is let go and counts again once it has been seen up.
//! Metres, seconds, scene frame; no heap, lock, log or system call. Deliberately absent: shared memory and its clock.

use crate::device::HandView;
use crate::hand::{Hand, HandTarget};
use sim_core::vector::Vec3;
use triple_buffer::Output;

/// Fastest motion, metres per second: across the workspace in two thirds of a second, a fifth of what the servo's gate takes for
/// a glitch.
pub const SPEED_M_PER_S: f64 = 0.25;
/// Strongest acceleration, metres per second squared: moving stylus and hand (145 g) then takes 0.73 N at most, less than what an
/// Omni gives for ever (0.88 N), so that a jerk of the mouse is no blow to the tissue.
pub const ACCELERATION_M_PER_S2: f64 = 5.0;
/// Half the workspace of an Omni (160 × 70 × 120 mm: across, away from the user, up), metres.
pub const HALF_WORKSPACE_M: [f64; 3] = [0.08, 0.035, 0.06];
/// A sender that is silent for this long has stopped: the hand stays where it is. Fifteen frames of a viewer at 60 Hz.
pub const HOLD_AFTER_S: f64 = 0.25;
/// A sender that is silent for this long is gone: what the hand holds is let go.
pub const LET_GO_AFTER_S: f64 = 1.0;
/// The two buttons of a stylus.
const BUTTONS: u32 = 3;

/// What a viewer wants of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointerWish {
    /// Where to, metres.
    pub position_m: Vec3,
    /// Bit 0 front button, bit 1 back button.
    pub buttons: u32,
    /// Number of the sender's turn, from 1.
    pub turn: u32,
}

impl PointerWish {
    /// What stands in a cell before the first wish.
    #[must_use]
    pub fn none() -> Self {
        Self { position_m: Vec3::zeros(), buttons: 0, turn: 0 }
    }
}

/// The hand of `--device pointer`.
#[derive(Debug)]
pub struct PointerHand {
    wishes: Output<PointerWish>,
    home_m: Vec3,
    position_m: Vec3,
    velocity_m_per_s: Vec3,
    goal_m: Vec3,
    last_s: Option<f64>,
    /// When the newest wish came; `None` before the first.
    heard_s: Option<f64>,
    turn: u32,
    buttons: u32,
    /// Buttons that have been seen up in this turn.
    seen_up: u32,
}

impl PointerHand {
    /// A hand that waits in the middle of its workspace.
    #[must_use]
    pub fn new(wishes: Output<PointerWish>, home_m: Vec3) -> Self {
        Self {
            wishes,
            home_m,
            position_m: home_m,
            velocity_m_per_s: Vec3::zeros(),
            goal_m: home_m,
            last_s: None,
            heard_s: None,
            turn: 0,
            buttons: 0,
            seen_up: 0,
        }
    }

    /// Takes the newest wish, if one has come since the last tick and can be used.
    fn listen(&mut self, time_s: f64) {
        if !self.wishes.update() {
            return;
        }
        let wish = *self.wishes.output_buffer();
        if !wish.position_m.iter().all(|c| c.is_finite()) {
            return;
        }
        if wish.turn != self.turn {
            self.let_go();
            self.turn = wish.turn;
        }
        self.heard_s = Some(time_s);
        self.seen_up |= !wish.buttons;
        self.buttons = wish.buttons & self.seen_up & BUTTONS;
        let half_m = Vec3::from(HALF_WORKSPACE_M);
        let from_home_m = wish.position_m - self.home_m;
        self.goal_m = self.home_m + from_home_m.zip_map(&half_m, |way, half| way.clamp(-half, half));
    }

    fn let_go(&mut self) {
        (self.buttons, self.seen_up) = (0, 0);
    }

    /// One tick towards the goal; without one towards a standstill.
    fn go(&mut self, goal_m: Option<Vec3>, dt_s: f64) {
        if dt_s <= 0.0 {
            return;
        }
        let way_m = goal_m.map_or_else(Vec3::zeros, |goal_m| goal_m - self.position_m);
        let left_m = way_m.norm();
        let speed = SPEED_M_PER_S.min((ACCELERATION_M_PER_S2 * left_m).sqrt()).min(left_m / dt_s);
        let wanted = if left_m > 0.0 { way_m * (speed / left_m) } else { Vec3::zeros() };
        let change = wanted - self.velocity_m_per_s;
        let most = ACCELERATION_M_PER_S2 * dt_s;
        let size = change.norm();
        self.velocity_m_per_s += if size > most { change * (most / size) } else { change };
        self.position_m += self.velocity_m_per_s * dt_s;
    }
}

impl Hand for PointerHand {
    fn target(&mut self, time_s: f64, _view: &HandView) -> HandTarget {
        let dt_s = time_s - self.last_s.replace(time_s).unwrap_or(time_s);
        self.listen(time_s);
        let silent_s = self.heard_s.map_or(f64::INFINITY, |heard_s| time_s - heard_s);
        if silent_s >= LET_GO_AFTER_S {
            self.let_go();
        }
        self.go((silent_s < HOLD_AFTER_S).then_some(self.goal_m), dt_s);
        HandTarget { position_m: self.position_m, buttons: self.buttons }
    }
}

#[cfg(test)]
#[path = "pointer_tests.rs"]
mod tests;
