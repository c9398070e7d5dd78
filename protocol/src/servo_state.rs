//! `servo_state`: what the servo knows after each tick (1 kHz, latest value wins).
//!
//! Device `d` owns handles `2d` and `2d + 1`: the suture point that the hand pulls, and its
//! partner across the wound. SI units, scene frame.

use crate::tissue_port::HANDLE_LINKED;
use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Devices that one server drives.
pub const MAX_DEVICES: usize = 2;
/// Suture points that the servo integrates at 1 kHz.
pub const MAX_HANDLES: usize = 4;

/// Bit of [`ServoState::flags`]: no real-time rights.
pub const FLAG_DEGRADED: u32 = 1;
/// Bit of [`ServoState::flags`]: a stop order is being followed.
pub const FLAG_STOPPING: u32 = 2;
/// Bit of [`ServoState::flags`]: the first device follows the pointer of a viewer (`pointer_hand`).
pub const FLAG_POINTER: u32 = 4;

pod! {
    /// One haptic device after the tick.
    #[derive(Serialize, Deserialize)]
    pub struct DeviceState as "suture.v4.DeviceState" {
        /// Stylus position, metres, scene frame.
        pub position_m: [f64; 3],
        /// Filtered stylus velocity, metres per second.
        pub velocity_m_per_s: [f64; 3],
        /// Orientation `scene_from_stylus` as quaternion (x, y, z, w), unit length.
        pub orientation: [f64; 4],
        /// Force sent to the device, newtons (after safety).
        pub force_n: [f64; 3],
        /// Force before the safety stage, newtons.
        pub unclipped_force_n: [f64; 3],
        /// Bit 0 front button, bit 1 back button.
        pub buttons: u32,
        /// Not zero when the device delivered a valid sample this tick.
        pub present: u32,
        /// Rising edges of each button since start (a short press is never lost).
        pub press_count: [u32; 2],
        /// Falling edges of each button since start.
        pub release_count: [u32; 2],
    }
}

pod! {
    /// One suture point integrated at 1 kHz (Zhang et al., Eq. (2)).
    #[derive(Serialize, Deserialize)]
    pub struct HandleState as "suture.v4.HandleState" {
        /// Position of the suture point, metres.
        pub position_m: [f64; 3],
        /// Velocity, metres per second.
        pub velocity_m_per_s: [f64; 3],
        /// Force of hand and suture line on the point (`F_hand + F_link`), newtons.
        pub applied_force_n: [f64; 3],
        /// Tension of the suture line above the tissue, newtons.
        pub line_tension_n: f64,
        /// A `HandleMode` code as in `tissue_port`.
        pub mode: u32,
        /// Suture pair this handle belongs to.
        pub pair: u32,
    }
}

pod! {
    /// The whole servo after one tick.
    pub struct ServoState as "suture.v4.ServoState" {
        /// Header; `sequence` is the tick number from 1.
        pub header: Header,
        /// Epoch of the tissue port that was used.
        pub port_epoch: u32,
        /// Servo state machine: 0 init, 1 monitor, 2 armed, 3 ramp, 4 active, 5 fault.
        pub mode: u32,
        /// Fault code, 0 none.
        pub fault: u32,
        /// [`FLAG_DEGRADED`], [`FLAG_STOPPING`], [`FLAG_POINTER`].
        pub flags: u32,
        /// Period of the tick, nanoseconds; 0 when it is not told.
        pub period_ns: u64,
        /// Ticks executed.
        pub ticks: u64,
        /// Ticks missed (skipped, never caught up).
        pub missed: u64,
        /// Sequence of the tissue port that was used, 0 none.
        pub port_sequence: u64,
        /// Age of that port at use, nanoseconds.
        pub port_age_ns: u64,
        /// Rung of the late-solver ladder: 0 affine, 1 one-ring, 2 frozen, 3 decay, 4 none.
        pub port_rung: u32,
        /// Handles in use.
        pub handle_count: u32,
        /// Process id of the viewer that is the hand of a pointer device, 0 nobody.
        pub hand_sender: u32,
        /// Counts who was the hand, from 1; 0 nobody yet.
        pub hand_turn: u32,
        /// Energy given to the hand so far, joules (positive: injected).
        pub energy_to_hand_j: f64,
        /// Devices.
        pub devices: [DeviceState; MAX_DEVICES],
        /// Handles; device `d` owns `2d` and `2d + 1`.
        pub handles: [HandleState; MAX_HANDLES],
    }
}

message!(ServoState, "servo_state", parts: [DeviceState, HandleState], check: |m| {
    if m.handle_count as usize > MAX_HANDLES {
        return Some("handle_count");
    }
    if m.mode > 5 {
        return Some("mode");
    }
    if m.handles.iter().any(|h| h.mode > HANDLE_LINKED) {
        return Some("handles.mode");
    }
    (m.port_rung > 4).then_some("port_rung")
});
