//! `tissue_port`: the tissue as each handle feels it until the next solver step.
//!
//! Per handle the affine port `F = f* − S (x − x*)` with `S` the condensed step stiffness
//! (symmetric, 6 numbers xx, xy, xz, yy, yz, zz), the one-ring stiffness as the safe fallback,
//! and a trust radius. SI units, scene frame.

use crate::servo_state::MAX_HANDLES;
use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// `HandlePort::mode`: the handle is not in use.
pub const HANDLE_FREE: u32 = 0;
/// `HandlePort::mode`: the needle holds the suture point (two-sided virtual coupling).
pub const HANDLE_HELD: u32 = 1;
/// `HandlePort::mode`: the suture point at which the hand pulls the line.
pub const HANDLE_PULLED: u32 = 2;
/// `HandlePort::mode`: the partner across the wound, pulled by the line below the tissue.
pub const HANDLE_LINKED: u32 = 3;

/// `TissuePort::kinematics`: stiffness and drag at the end of the tick.
pub const KINEMATICS_IMPLICIT_DRAG: u32 = 0;
/// `TissuePort::kinematics`: every force at time t, as printed.
pub const KINEMATICS_LITERAL: u32 = 1;

pod! {
    /// Affine port of one handle.
    pub struct HandlePort as "suture.v4.HandlePort" {
        /// Expansion point `x*`, metres.
        pub position_m: [f64; 3],
        /// Velocity at `x*`, metres per second.
        pub velocity_m_per_s: [f64; 3],
        /// Tissue force at `x*`: springs, LRA, stitches; newtons.
        pub force_n: [f64; 3],
        /// Condensed step stiffness `S`, newtons per metre (xx, xy, xz, yy, yz, zz).
        pub stiffness_n_per_m: [f64; 6],
        /// One-ring stiffness (all neighbours held), newtons per metre.
        pub one_ring_n_per_m: [f64; 6],
        /// The affine law is trusted for `|x − x*|` up to this, metres.
        pub trust_radius_m: f64,
        /// Mass of the suture point with its patch, kilograms.
        pub mass_kg: f64,
        /// Drag of the suture point, newton seconds per metre.
        pub drag_n_s_per_m: f64,
        /// One of the `HANDLE_…` codes.
        pub mode: u32,
        /// Suture pair.
        pub pair: u32,
    }
}

pod! {
    /// Newest tissue state for the servo.
    pub struct TissuePort as "suture.v4.TissuePort" {
        /// Header.
        pub header: Header,
        /// Changes with topology, stitch set or handle assignment.
        pub epoch: u32,
        /// Suturing stage: 0 idle, 1 left held, 2 left taken, 3 line held (pulling), 4 line free, 5 all done.
        pub stage: u32,
        /// Simulated time of the port, nanoseconds of the servo's clock.
        pub valid_ns: u64,
        /// When it was published, `CLOCK_MONOTONIC` nanoseconds.
        pub publish_ns: u64,
        /// `servo_state` sequence that this port answers.
        pub servo_sequence: u64,
        /// Suture pair at work, and pairs in the scene.
        pub pair: u32,
        /// Pairs in the scene.
        pub pair_count: u32,
        /// Stitches tied in this scene.
        pub stitches: u32,
        /// Handles in use.
        pub handle_count: u32,
        /// Scene counter: changes when a scene is loaded or restored.
        pub scene_generation: u32,
        /// Kind of the scene: 0 skin, 1 liver, 2 vessel.
        pub scene_kind: u32,
        /// Distance of the pair at work, metres.
        pub gap_m: f64,
        /// A release at or below this distance ties the stitch, metres.
        pub closed_gap_m: f64,
        /// Where the hand should go next (the suture point to take), metres.
        pub target_m: [f64; 3],
        /// Outward surface normal there, unit.
        pub target_normal: [f64; 3],
        /// Direction across the wound, from left to right, unit.
        pub across: [f64; 3],
        /// Rest length of the suture line between stylus and partner while pulling, metres.
        pub line_rest_length_m: f64,
        /// Friction μ of the line in a suture point; 0 is the paper's case.
        pub line_friction: f64,
        /// How the servo steps the suture points, one of the `KINEMATICS_…` codes.
        pub kinematics: u32,
        /// Padding, zero.
        pub reserved: u32,
        /// Handles.
        pub handles: [HandlePort; MAX_HANDLES],
    }
}

message!(TissuePort, "tissue_port", parts: [HandlePort], check: |m| {
    if m.handle_count as usize > MAX_HANDLES {
        return Some("handle_count");
    }
    if m.stage > 5 {
        return Some("stage");
    }
    if m.handles.iter().any(|h| h.mode > HANDLE_LINKED) {
        return Some("handles.mode");
    }
    if m.handles.iter().any(|h| h.mode != HANDLE_FREE && !(h.mass_kg > 0.0 && h.drag_n_s_per_m >= 0.0)) {
        return Some("handles.mass_kg");
    }
    if m.kinematics > KINEMATICS_LITERAL {
        return Some("kinematics");
    }
    (!(m.line_friction >= 0.0 && m.line_friction.is_finite())).then_some("line_friction")
});
