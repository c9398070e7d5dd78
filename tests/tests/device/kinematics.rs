//! Kinematics through the interface: reference vectors, a recorded device, encoder steps, Jacobian.

use crate::alone;
use haptic_server::device::openhaptics::codes as driver;
use haptic_server::device::openhaptics::ffi::Hd;
use haptic_server::device::{encoder, omni};
use sim_core::vector::Vec3;
use suture_tests::shared::shared;
use virtual_omni::{Setup, codes, control, functions};

/// Reference vectors carry nine decimals of a millimetre.
const PRINTED_MM: f64 = 1e-6;
/// Half an encoder step of each joint at the largest lever of the workspace, millimetres.
const HALF_STEPS_MM: f64 = 0.08;

/// The library with its first device open, at rest where `joints` put it.
struct Opened {
    hd: Hd,
    device: u32,
    _alone: std::sync::MutexGuard<'static, ()>,
}

impl Opened {
    fn new() -> Self {
        let alone = alone();
        control::reset(&Setup::default());
        let hd = Hd::new(functions());
        let device = hd.init_device(None);
        assert_eq!(device, 0);
        hd.disable(codes::ONE_FRAME_LIMIT);
        Self { hd, device, _alone: alone }
    }

    fn at(&self, position_mm: Vec3) -> &Self {
        control::lead(self.device, position_mm);
        self.hd.begin_frame(self.device);
        self.hd.end_frame(self.device);
        assert_eq!(self.hd.pop_error(), None);
        self
    }

    fn triple(&self, parameter: u32) -> Vec3 {
        Vec3::from(self.hd.doubles::<3>(parameter))
    }
}

#[test]
fn reference_positions_hold_to_a_millionth_of_a_millimetre() {
    for (joints, expected_mm) in [
        (Vec3::zeros(), Vec3::new(0.0, -110.0, -35.0)),
        (Vec3::new(0.3, 0.7, 0.2), Vec3::new(-37.969_695_345, -21.435_449_562, -45.604_297_250)),
    ] {
        let position_mm = omni::forward(joints) * 1e3;
        assert!((position_mm - expected_mm).amax() < PRINTED_MM, "{joints} → {position_mm}");
        // Through the interface the joints are whole counts; what is left are half a step of each.
        let opened = Opened::new();
        opened.at(position_mm);
        let counted = opened.triple(codes::CURRENT_JOINT_ANGLES);
        assert!((0..3).all(|i| (counted[i] - joints[i]).abs() <= 0.5 * encoder::STEP_RAD[i] + 1e-12));
        let read_mm = opened.triple(driver::CURRENT_POSITION);
        assert!((read_mm - omni::forward(counted) * 1e3).amax() < PRINTED_MM);
        assert!((read_mm - expected_mm).norm() < HALF_STEPS_MM * 3.0_f64.sqrt());
    }
}

#[test]
fn transform_jacobian_and_position_agree_through_the_interface() {
    let opened = Opened::new();
    control::turn(0, Vec3::new(0.2, -0.4, 0.6));
    opened.at(Vec3::new(20.0, -10.0, 5.0));
    let joints = opened.triple(codes::CURRENT_JOINT_ANGLES);
    let gimbal = opened.triple(codes::CURRENT_GIMBAL_ANGLES);
    let transform: [f64; 16] = opened.hd.doubles(driver::CURRENT_TRANSFORM);
    let rotation = omni::stylus_rotation(joints, gimbal);
    for i in 0..9 {
        assert!((transform[4 * (i / 3) + i % 3] - rotation[(i % 3, i / 3)]).abs() < PRINTED_MM, "column by column");
    }
    assert_eq!(&transform[12..15], opened.triple(driver::CURRENT_POSITION).as_slice());
    let jacobian: [f64; 9] = opened.hd.doubles(codes::CURRENT_JACOBIAN);
    let step = 1e-6;
    for column in 0..3 {
        let mut moved = joints;
        moved[column] += step;
        let slope = (omni::forward(moved) - omni::forward(joints)) * (1e3 / step);
        for row in 0..3 {
            // Curvature over one step: L·step/2 = 7e-5 mm/rad.
            assert!((slope[row] - jacobian[3 * row + column]).abs() < 1e-4, "row {row} column {column}");
        }
    }
}

#[test]
fn a_slow_sweep_shows_the_published_encoder_steps() {
    let opened = Opened::new();
    let mut seen = [const { Vec::new() }; 3];
    for i in 0..2_000 {
        let along = f64::from(i) * 0.002;
        opened.at(Vec3::new(along, along, along));
        let joints = opened.triple(codes::CURRENT_JOINT_ANGLES);
        for (list, joint) in seen.iter_mut().zip(joints.iter()) {
            if list.last() != Some(joint) {
                list.push(*joint);
            }
        }
    }
    for (list, published_mrad) in seen.iter().zip([0.411_20, 0.408_03, 0.407_49]) {
        assert!(list.len() > 5, "4 mm are several counts");
        for pair in list.windows(2) {
            let step_mrad = (pair[1] - pair[0]).abs() * 1e3;
            assert!((step_mrad - published_mrad).abs() < 5e-6, "{step_mrad}, published with five decimals");
        }
    }
}

#[test]
fn a_recorded_touch_has_these_kinematics() {
    let Some(path) = shared("traces/touch_freehand_100hz.csv") else { return };
    let mut reader = csv::Reader::from_path(path).expect("a recording");
    let opened = Opened::new();
    let mut errors_mm = Vec::new();
    let mut through_mm = Vec::new();
    for row in reader.records() {
        let row = row.expect("the recording is well formed");
        let n = |i: usize| row[i].parse::<f64>().expect("a number");
        let recorded_mm = Vec3::new(n(1), n(2), n(3));
        let joints = encoder::round_joints(Vec3::new(n(4), n(5), n(6)));
        errors_mm.push((omni::forward(joints) * 1e3 - recorded_mm).norm());
        // The same pose through the virtual device: it counts to the same encoder values.
        opened.at(omni::forward(joints) * 1e3);
        through_mm.push((opened.triple(driver::CURRENT_POSITION) - recorded_mm).norm());
    }
    for (name, mut errors) in [("kinematics", errors_mm), ("virtual device", through_mm)] {
        errors.sort_by(f64::total_cmp);
        let median = errors[errors.len() / 2];
        println!("{name}: median {median:e} mm over {} samples", errors.len());
        assert!(median < 1e-5, "{name}: median {median} mm");
    }
}
