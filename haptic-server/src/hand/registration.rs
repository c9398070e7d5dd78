//! Where a recorded hand works: the similarity transform from the recording onto the wound.
//!
//! `p_scene = σ R p + t`. R turns the surgeon's right, away and up onto across, along and outward of the wound
//! (fixed per file kind; along is taken in whichever sense keeps R a rotation). t puts the centroid of the grips (the
//! positions where button 1 goes down) on the wound's middle, a little above the surface; without grips all positions
//! count. σ = min(1, min over the axes of workspace / range): life size, for the recorded hand held a master as ours
//! holds a stylus, unless the 1–99 % range of the motion exceeds the Omni's workspace of 160 × 120 × 70 mm (width,
//! height, depth). Recordings that are already in the scene frame stay as they are. SI units. Deliberately absent: a
//! fit of the grips to the suture points; a wound of 30 mm would shrink the motion to millimetres.

use crate::hand::HandRecording;
use crate::hand::csv::HandFileKind;
use sim_core::vector::{Mat3, Vec3};

/// Usable workspace of the Omni in scene axes: width, depth, height, metres.
const WORKSPACE_M: [f64; 3] = [0.160, 0.070, 0.120];
/// Height of the grips' centroid above the surface, metres.
const LIFT_M: f64 = 0.002;

/// The wound as a hand's place of work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoundPlace {
    /// Middle of the suture points, on the surface, metres.
    pub centre_m: Vec3,
    /// Along the wound.
    pub along: Vec3,
    /// Across the wound, left to right.
    pub across: Vec3,
    /// Out of the tissue.
    pub outward: Vec3,
}

/// What decided the scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleRule {
    /// The device's workspace is the limit.
    Workspace,
    /// Life size fits.
    LifeSize,
}

/// The transform from a recording to the scene, for reports too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// σ.
    pub scale: f64,
    /// R.
    pub rotation: Mat3,
    /// t, metres.
    pub translation_m: Vec3,
    /// What decided σ.
    pub rule: ScaleRule,
    /// Grips that were counted.
    pub grips: usize,
    /// Middle of the 1–99 % range in the scene: put the middle of the device's workspace here, metres.
    pub workspace_centre_m: Vec3,
}

impl Registration {
    /// The transform that lays a recording of this kind onto the wound.
    #[must_use]
    pub fn new(kind: HandFileKind, recording: &HandRecording, wound: &WoundPlace) -> Self {
        let grip_points: Vec<Vec3> = recording.grips().map(|i| recording.positions_m[i]).collect();
        let grips = grip_points.len();
        let counted = if grips == 0 { recording.positions_m.as_slice() } else { grip_points.as_slice() };
        let centroid = mean(counted);
        if kind == HandFileKind::Scene {
            let rotation = Mat3::identity();
            let workspace_centre_m = inner_range(&recording.positions_m, &rotation).0;
            let translation_m = Vec3::zeros();
            let rule = ScaleRule::LifeSize;
            return Self { scale: 1.0, rotation, translation_m, rule, grips, workspace_centre_m };
        }
        let (outward, rotation) = wound_from_recording(kind, wound);
        let (middle_m, range_m) = inner_range(&recording.positions_m, &rotation);
        let cap = (0..3).map(|i| WORKSPACE_M[i] / range_m[i].max(1e-9)).fold(f64::INFINITY, f64::min);
        let (scale, rule) = if cap < 1.0 { (cap, ScaleRule::Workspace) } else { (1.0, ScaleRule::LifeSize) };
        let translation_m = wound.centre_m + outward * LIFT_M - rotation * centroid * scale;
        let workspace_centre_m = middle_m * scale + translation_m;
        Self { scale, rotation, translation_m, rule, grips, workspace_centre_m }
    }

    /// One point of the recording in the scene, metres.
    #[must_use]
    pub fn point(&self, recorded_m: Vec3) -> Vec3 {
        self.rotation * recorded_m * self.scale + self.translation_m
    }

    /// The whole recording in the scene.
    #[must_use]
    pub fn apply(&self, mut recording: HandRecording) -> HandRecording {
        for position in &mut recording.positions_m {
            *position = self.point(*position);
        }
        recording
    }
}

/// Rows: the surgeon's right, away and up in the frame of the file.
fn surgeon_from_recording(kind: HandFileKind) -> Mat3 {
    match kind {
        // Masters: x left, y up in the view, z into the view, and the view looks down onto the wound.
        HandFileKind::Jigsaws => Mat3::new(-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0),
        HandFileKind::Touch => Mat3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
        HandFileKind::Scene => Mat3::identity(),
    }
}

/// The unit outward normal and R; a degenerate wound falls back to the scene's axes.
fn wound_from_recording(kind: HandFileKind, wound: &WoundPlace) -> (Vec3, Mat3) {
    let outward = wound.outward.try_normalize(1e-9).unwrap_or_else(Vec3::z);
    let flat = |v: Vec3| (v - outward * v.dot(&outward)).try_normalize(1e-9);
    let across = flat(wound.across)
        .or_else(|| flat(wound.along).map(|along| along.cross(&outward)))
        .or_else(|| flat(Vec3::x()))
        .unwrap_or_else(|| Vec3::y().cross(&outward).normalize());
    let along = outward.cross(&across);
    (outward, Mat3::from_columns(&[across, along, outward]) * surgeon_from_recording(kind))
}

fn mean(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len().max(1) as f64
}

/// Middle and width of the 1–99 % range of the turned positions, per scene axis.
fn inner_range(positions_m: &[Vec3], rotation: &Mat3) -> (Vec3, Vec3) {
    let mut middle = Vec3::zeros();
    let mut width = Vec3::zeros();
    for axis in 0..3 {
        let mut values: Vec<f64> = positions_m.iter().map(|p| (rotation * p)[axis]).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = values.len().saturating_sub(1) as f64;
            values.get((share * last).round() as usize).copied().unwrap_or_default()
        };
        middle[axis] = 0.5 * (at(0.01) + at(0.99));
        width[axis] = at(0.99) - at(0.01);
    }
    (middle, width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand::csv::{HandSide, read_path};
    use std::path::Path;

    fn wound() -> WoundPlace {
        WoundPlace { centre_m: Vec3::new(0.01, 0.02, 0.03), along: Vec3::y(), across: Vec3::x(), outward: Vec3::z() }
    }

    /// Grips at the given places, each reached from 1 mm beside it.
    fn gripping(places: &[Vec3]) -> HandRecording {
        let mut recording = HandRecording::default();
        for (i, &place) in places.iter().enumerate() {
            for down in 0..2_u32 {
                recording.times_s.push(i as f64 + f64::from(down) * 0.5);
                recording.positions_m.push(if down == 1 { place } else { place + Vec3::x() * 1e-3 });
                recording.buttons.push(down);
            }
        }
        recording
    }

    fn grip_mean(recording: &HandRecording) -> Vec3 {
        mean(&recording.grips().map(|i| recording.positions_m[i]).collect::<Vec<_>>())
    }

    #[test]
    fn a_motion_that_fits_keeps_life_size_with_its_grips_round_the_middle() {
        let places: Vec<Vec3> = (0..6).map(|i| Vec3::new(0.1, 0.016 * f64::from(i), 0.3)).collect();
        // Up in the view is along the wound, the workspace's depth of 70 mm: 80 mm are too many, 64 mm are not.
        let registration = Registration::new(HandFileKind::Jigsaws, &gripping(&places), &wound());
        assert_eq!((registration.rule, registration.scale), (ScaleRule::Workspace, WORKSPACE_M[1] / 0.08));
        let recording = gripping(&places[..5]);
        let registration = Registration::new(HandFileKind::Jigsaws, &recording, &wound());
        assert_eq!((registration.rule, registration.scale, registration.grips), (ScaleRule::LifeSize, 1.0, 5));
        let placed = registration.apply(recording);
        assert!((grip_mean(&placed) - Vec3::new(0.01, 0.02, 0.03 + LIFT_M)).amax() < 1e-12);
        let grips: Vec<Vec3> = placed.grips().map(|i| placed.positions_m[i]).collect();
        assert!(grips.windows(2).all(|pair| (pair[1].y - pair[0].y - 0.016).abs() < 1e-12));
    }

    #[test]
    fn a_wide_motion_is_scaled_into_the_workspace() {
        let mut recording = gripping(&[Vec3::zeros(), Vec3::new(0.001, 0.0, 0.0)]);
        for i in 0..1000_u32 {
            recording.times_s.push(10.0 + f64::from(i));
            recording.positions_m.push(Vec3::new(0.0, 0.0, 0.5e-3 * f64::from(i)));
            recording.buttons.push(0);
        }
        let registration = Registration::new(HandFileKind::Touch, &recording, &wound());
        assert_eq!(registration.rule, ScaleRule::Workspace);
        let (_, width) = inner_range(&registration.apply(recording).positions_m, &Mat3::identity());
        assert!((width.y - WORKSPACE_M[1]).abs() < 1e-12, "the Touch's z is the depth: {width}");
    }

    #[test]
    fn any_wound_gives_a_rotation() {
        let recording = gripping(&[Vec3::zeros(), Vec3::new(0.0, 0.02, 0.0)]);
        let zero = Vec3::zeros();
        let cases = [
            (Vec3::x(), Vec3::y(), Vec3::z()),
            (Vec3::z(), Vec3::y(), Vec3::x()),
            (Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.3, 1.0, 2.0), Vec3::new(-1.0, 1.0, 5.0)),
            (Vec3::y(), zero, Vec3::z()),
            (zero, zero, zero),
            (zero, zero, Vec3::x()),
        ];
        for (along, across, outward) in cases {
            let place = WoundPlace { along, across, outward, ..wound() };
            for kind in [HandFileKind::Jigsaws, HandFileKind::Touch] {
                let r = Registration::new(kind, &recording, &place).rotation;
                assert!((r * r.transpose() - Mat3::identity()).amax() < 1e-12, "{along} {across} {outward}");
                assert!((r.determinant() - 1.0).abs() < 1e-12, "no mirror image: {along} {across} {outward}");
            }
        }
    }

    #[test]
    fn without_grips_all_positions_count_and_scene_files_stay() {
        let mut recording = gripping(&[Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.0, 0.05, 0.0)]);
        let scene = Registration::new(HandFileKind::Scene, &recording, &wound());
        assert_eq!(scene.apply(recording.clone()), recording);
        recording.buttons.fill(0);
        let touch = Registration::new(HandFileKind::Touch, &recording, &wound());
        assert_eq!((touch.rule, touch.scale, touch.grips), (ScaleRule::LifeSize, 1.0, 0));
        let expected = wound().centre_m + Vec3::z() * LIFT_M;
        assert!((mean(&touch.apply(recording).positions_m) - expected).amax() < 1e-12);
    }

    #[test]
    fn recorded_surgeons_fit_the_workspace_around_the_wound() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/traces/");
        for name in ["Suturing_B001", "Suturing_C002", "Suturing_E003"] {
            let path = format!("{folder}{name}.csv");
            if !Path::new(&path).exists() {
                println!("skipped: {path} is missing");
                continue;
            }
            for side in [HandSide::Left, HandSide::Right] {
                let file = read_path(Path::new(&path), side).expect("a good recording");
                let registration = Registration::new(file.kind, &file.recording, &wound());
                let placed = registration.apply(file.recording);
                let expected = wound().centre_m + Vec3::z() * LIFT_M;
                assert!((grip_mean(&placed) - expected).amax() < 1e-9);
                assert!(
                    registration.scale > 0.0 && registration.scale <= 1.0,
                    "{name} {side:?}: {}",
                    registration.scale
                );
                let (middle, width) = inner_range(&placed.positions_m, &Mat3::identity());
                assert!((0..3).all(|i| width[i] <= WORKSPACE_M[i] * (1.0 + 1e-9)), "{name} {side:?}: {width}");
                assert!((middle - registration.workspace_centre_m).amax() < 1e-9);
                println!("{name} {side:?}: {registration:?}");
            }
        }
    }
}
