//! Curves of picked nodes: reference, restore, rewind, held pictures, thinning, files.

use super::*;
use crate::overlay::example;
use protocol::scene_frame::FrameNode;
use protocol::wire::Field;

fn view(frame: u64, generation: u32, x_m: f32) -> View {
    let mut view = View { frames: frame, ..View::default() };
    let node = FrameNode { position_m: [x_m, 0.0, 0.0], spring_force_n: 0.5, ..FrameNode::EMPTY };
    view.frame.elements = vec![node; 3];
    view.frame.header.node_count = 3;
    view.frame.header.scene_generation = generation;
    view.frame.header.sim_time_s = frame as f64 * 0.01;
    view
}

#[test]
fn the_deformation_is_the_way_since_the_pick_and_a_frame_counts_once() {
    let mut samples = Samples::default();
    assert!(samples.pick(&view(1, 1, 0.010), 2));
    assert!(!samples.pick(&view(1, 1, 0.010), 3));
    for _ in 0..3 {
        samples.take(&view(2, 1, 0.013));
    }
    let curve = samples.all()[0].curve();
    assert_eq!(curve.len(), 1);
    // Single precision of a position of some centimetres.
    assert!((curve[0].deformation_m - 0.003).abs() < 1e-8 && curve[0].spring_force_n == 0.5);
    assert_eq!(samples.csv().lines().count(), 3);
    assert!(samples.csv().starts_with("# node 2: deformation from where it was when it was picked"));
    assert!(samples.csv().ends_with("2,0.020000,0.003000000,0.500000,0.000000,0.000000\n"), "{}", samples.csv());
}

#[test]
fn fig6_a_suture_point_shows_the_force_of_the_hand_that_holds_it() {
    let mut view = example::view();
    let mut samples = Samples::default();
    // Pair 1: left node 2, right node 3, 10 mm apart.
    samples.pick(&view, 2);
    samples.pick(&view, 3);
    if let Some(servo) = &mut view.servo {
        let at_m = view.frame.elements[3].position_m.map(f64::from);
        let near_m = [at_m[0] - 0.001, at_m[1], at_m[2]];
        servo.handles[0] = HandleState {
            mode: 2,
            pair: 1,
            position_m: near_m,
            applied_force_n: [0.0, 0.6, 0.8],
            ..HandleState::EMPTY
        };
    }
    view.frames += 1;
    samples.take(&view);
    let forces: Vec<f64> = samples.all().iter().map(|s| s.force_n(&s.curve()[0])).collect();
    assert_eq!(forces, [0.0, 1.0]);
}

#[test]
fn a_restore_begins_anew_and_another_scene_ends_it() {
    let mut samples = Samples::default();
    samples.pick(&view(1, 1, 0.0), 0);
    samples.take(&view(2, 1, 0.1));
    samples.take(&view(3, 2, 0.1));
    assert_eq!(samples.all()[0].curve().iter().map(|m| m.deformation_m).collect::<Vec<_>>(), [0.0]);
    let mut other = view(4, 3, 0.0);
    other.frame.header.node_count = 2;
    samples.take(&other);
    assert!(samples.all().is_empty());
}

fn times(samples: &Samples) -> Vec<f64> {
    samples.all()[0].curve().iter().map(|m| (m.time_s * 100.0).round()).collect()
}

#[test]
fn a_recording_that_is_wound_back_takes_away_what_lies_after_it() {
    let mut samples = Samples::default();
    samples.pick(&view(1, 1, 0.0), 0);
    for frame in [2, 3, 4, 5] {
        samples.take(&view(frame, 1, 0.0));
    }
    let mut back = view(6, 1, 0.0);
    back.frame.header.sim_time_s = 0.03;
    samples.take(&back);
    assert_eq!(times(&samples), [2.0, 3.0]);
}

#[test]
fn a_pick_in_a_held_picture_measures_nothing_and_leaves_the_other_curves() {
    let mut samples = Samples::default();
    let held = view(1, 1, 0.010);
    samples.take(&held);
    samples.pick(&held, 0);
    for frame in [2, 3] {
        samples.take(&view(frame, 2, 0.020));
    }
    samples.pick(&held, 1);
    assert_eq!(times(&samples), [2.0, 3.0]);
    assert!(samples.all()[1].curve().is_empty());
    samples.take(&view(4, 2, 0.021));
    assert_eq!(times(&samples), [2.0, 3.0, 4.0]);
    let own = samples.all()[1].curve()[0].deformation_m;
    // The first frame of generation 2 had it at 20 mm; single precision.
    assert!((own - 0.001).abs() < 1e-8, "{own}");
}

#[test]
fn the_deformation_counts_from_the_first_frame_of_the_generation_where_that_was_seen() {
    let mut samples = Samples::default();
    samples.take(&view(1, 1, 0.0));
    samples.pick(&view(2, 1, 0.004), 0);
    samples.take(&view(3, 1, 0.005));
    assert!((samples.all()[0].curve()[0].deformation_m - 0.005).abs() < 1e-8);
    assert!(samples.csv().starts_with("# node 0: deformation from its place in the first frame"));
    let mut late = Samples::default();
    late.take(&view(1_000, 1, 0.0));
    late.pick(&view(1_001, 1, 0.004), 0);
    assert!(late.csv().starts_with("# node 0: deformation from where it was"));
}

#[test]
fn the_oldest_makes_room_and_a_full_curve_is_thinned() {
    let mut samples = Samples::default();
    for node in [0, 1, 2, 0] {
        samples.pick(&view(1, 1, 0.0), node);
    }
    assert_eq!(samples.all().iter().map(Sample::node).collect::<Vec<_>>(), [1, 2, 0]);
    for frame in 2..(2 + 3 * CAPACITY as u64) {
        samples.take(&view(frame, 1, frame as f32));
    }
    let curve = samples.all()[0].curve();
    assert!(curve.len() <= CAPACITY && curve.len() > CAPACITY / 2);
    assert!(curve.windows(2).all(|w| w[0].time_s < w[1].time_s));
    assert_eq!(samples.all()[0].curve.capacity(), CAPACITY);
}

#[test]
fn a_file_is_never_written_over() {
    let folder = std::env::temp_dir().join(format!("viewer-samples-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    assert!(Samples::default().save(&folder).is_err());
    let mut samples = Samples::default();
    samples.pick(&view(1, 1, 0.0), 1);
    let (first, second) = (samples.save(&folder).expect("one"), samples.save(&folder).expect("two"));
    assert!(first.ends_with("samples-1.csv") && second.ends_with("samples-2.csv"));
    std::fs::remove_dir_all(&folder).expect("removed");
}
