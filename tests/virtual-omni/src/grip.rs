//! Who moves the stylus: a test that leads it, or a hand with mass and spring.
//!
//! A led stylus is where the test puts it, whatever the force. A held one obeys the mechanics of the server's simulated
//! stylus (mass, Coulomb friction, hand spring) under the force that has arrived, in sub-steps of 50 µs; the hand begins
//! in the inkwell and leaves it 0.3 s after the device is calibrated. Metres, device frame; the hand itself works in the
//! scene's frame, as the server's own hands do. Deliberately absent: gravity, inertia of the arm.

use crate::arm;
use crate::device::Calibration;
use crate::eyes::Eyes;
use haptic_server::device::frame::SceneFromDevice;
use haptic_server::device::stylus::{StylusParams, StylusState};
use haptic_server::hand::{Hand, HandTarget};
use sim_core::vector::Vec3;

/// Length of a sub-step, seconds.
const SUBSTEP_S: f64 = 50e-6;
/// Sub-steps in one tick at most: after a longer stall the model stands still instead of jumping.
const MAX_SUBSTEPS: f64 = 400.0;
/// A hand leaves the inkwell so long after the calibration, seconds.
const LEAVE_S: f64 = 0.3;

/// Who holds the stylus.
pub(crate) enum Grip {
    /// A test.
    Led,
    /// A hand.
    Held(Box<HeldBy>),
}

/// A hand at the stylus.
pub(crate) struct HeldBy {
    /// The hand.
    pub(crate) hand: Box<dyn Hand>,
    /// What it sees.
    pub(crate) eyes: Eyes,
    /// Where the device stands.
    pub(crate) frame: SceneFromDevice,
}

/// The stylus.
pub(crate) struct Stylus {
    pub(crate) state: StylusState,
    pub(crate) gimbal: Vec3,
    pub(crate) buttons: u32,
    grip: Grip,
    params: StylusParams,
    wish_m: Vec3,
    calibrated_s: f64,
    hand_s: f64,
}

impl Stylus {
    /// In the inkwell.
    pub(crate) fn new(grip: Grip) -> Self {
        let place = arm::inkwell_m();
        Self {
            state: StylusState { position_m: place, velocity_m_per_s: Vec3::zeros() },
            gimbal: Vec3::from(arm::HELD_GIMBAL_RAD),
            buttons: 0,
            grip,
            params: StylusParams::default(),
            wish_m: place,
            calibrated_s: 0.0,
            hand_s: 0.0,
        }
    }

    /// A test puts the stylus here.
    pub(crate) fn lead(&mut self, position_m: Vec3) {
        self.state = StylusState { position_m, velocity_m_per_s: Vec3::zeros() };
        self.wish_m = position_m;
    }

    /// Time passes.
    pub(crate) fn pass(&mut self, dt_s: f64, force_n: Vec3, calibration: Calibration) {
        let Grip::Held(held) = &mut self.grip else { return };
        self.calibrated_s = match calibration {
            Calibration::Kept => self.calibrated_s + dt_s,
            Calibration::Missing => 0.0,
        };
        let count = (dt_s / SUBSTEP_S).round().clamp(0.0, MAX_SUBSTEPS);
        let elapsed_s = count * SUBSTEP_S;
        let from = self.wish_m;
        if self.calibrated_s > LEAVE_S {
            self.hand_s += elapsed_s;
            let HandTarget { position_m, buttons } = held.hand.target(self.hand_s, &held.eyes.view());
            let wish = held.frame.inverse_point(position_m);
            if wish.iter().all(|c| c.is_finite()) {
                (self.wish_m, self.buttons) = (wish, buttons);
            }
        }
        if elapsed_s <= 0.0 {
            return;
        }
        let velocity = (self.wish_m - from) / elapsed_s;
        for i in 0..count as u32 {
            let wish = from + (self.wish_m - from) * (f64::from(i) / count);
            self.state.step(&self.params, wish, velocity, force_n, SUBSTEP_S);
        }
    }
}
