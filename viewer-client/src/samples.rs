//! Sample points: nodes that a person picked, with their force against their deformation (Zhang et al., Fig. 6).
//!
//! Deformation d = |x − x₀| with x₀ the position when the point was picked, or at the first frame after a restore.
//! Force: the largest spring force at the node and the reaction of its attachments, as the frame carries them, and for a suture
//! point in the hand the force of hand and line on it (`F_hand + F_link`, Eq. (3)), which is the external force of Fig. 6; metres, newtons.
//! Curves never grow: a full one is thinned to every second point. Deliberately absent: smoothing.

use crate::feed::View;
use protocol::servo_state::HandleState;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{Error, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// Points that may be watched at once.
pub const MAX_SAMPLES: usize = 4;
/// Measurements that a curve keeps before it is thinned.
const CAPACITY: usize = 4096;
/// Names that are tried before a folder counts as full.
const MAX_NAMES: u32 = 10_000;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Simulated seconds.
    pub time_s: f64,
    /// Distance from the reference position, metres.
    pub deformation_m: f64,
    /// Largest spring force at the node, newtons.
    pub spring_force_n: f64,
    /// Reaction of the attachments, newtons.
    pub attachment_force_n: f64,
    /// Force of hand and line on a suture point, newtons; 0 for every other node.
    pub hand_force_n: f64,
}

/// One picked node.
#[derive(Clone, Debug)]
pub struct Sample {
    node: u32,
    reference_m: [f32; 3],
    is_suture_point: bool,
    curve: Vec<Measured>,
    /// Every this many-th frame is kept.
    stride: u32,
    passed: u32,
}

impl Sample {
    /// Which node.
    #[must_use]
    pub fn node(&self) -> u32 {
        self.node
    }

    /// The force that its curve shows: that of the hand at a suture point, else that of the springs, newtons.
    #[must_use]
    pub fn force_n(&self, measured: &Measured) -> f64 {
        if self.is_suture_point { measured.hand_force_n } else { measured.spring_force_n }
    }

    /// Whether the hand can take it.
    #[must_use]
    pub fn is_suture_point(&self) -> bool {
        self.is_suture_point
    }

    /// What was measured, oldest first.
    #[must_use]
    pub fn curve(&self) -> &[Measured] {
        &self.curve
    }

    fn begin(view: &View, node: u32, at_m: [f32; 3]) -> Self {
        let is_suture_point = view.outline_of_frame().is_some_and(|parts| parts.pairs.contains(&node));
        let curve = Vec::with_capacity(CAPACITY);
        Self { node, reference_m: at_m, is_suture_point, curve, stride: 1, passed: 0 }
    }

    fn take(&mut self, measured: Measured) {
        self.passed += 1;
        if self.passed < self.stride {
            return;
        }
        self.passed = 0;
        if self.curve.len() == CAPACITY {
            let mut index = 0;
            self.curve.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
        self.curve.push(measured);
    }
}

/// All picked nodes.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    all: Vec<Sample>,
    generation: u32,
    kind: u32,
    node_count: u32,
    frames: u64,
}

impl Samples {
    /// The picked nodes, oldest first.
    #[must_use]
    pub fn all(&self) -> &[Sample] {
        &self.all
    }

    /// Watches a node of the newest frame; one that is watched already begins anew; the oldest makes room.
    /// `false` when the frame has no such node.
    pub fn pick(&mut self, view: &View, node: u32) -> bool {
        self.take(view);
        let Some(place) = view.frame.elements.get(node as usize) else { return false };
        self.all.retain(|sample| sample.node != node);
        if self.all.len() == MAX_SAMPLES {
            self.all.remove(0);
        }
        self.all.push(Sample::begin(view, node, place.position_m));
        true
    }

    /// Watches nothing.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// Measures at the newest frame, once per frame. A restored scene begins the curves anew; another scene ends them.
    pub fn take(&mut self, view: &View) {
        if view.frames == self.frames || view.frames == 0 {
            return;
        }
        self.frames = view.frames;
        let header = &view.frame.header;
        let scene = (view.outline.header.scene_kind, header.node_count);
        if scene != (self.kind, self.node_count) {
            self.all.clear();
            (self.kind, self.node_count) = scene;
        }
        let restored = header.scene_generation != self.generation;
        self.generation = header.scene_generation;
        for sample in &mut self.all {
            let Some(node) = view.frame.elements.get(sample.node as usize) else { continue };
            if restored {
                *sample = Sample::begin(view, sample.node, node.position_m);
            }
            let squared: f64 = (0..3).map(|k| f64::from(node.position_m[k] - sample.reference_m[k]).powi(2)).sum();
            sample.take(Measured {
                time_s: header.sim_time_s,
                deformation_m: squared.sqrt(),
                spring_force_n: f64::from(node.spring_force_n),
                attachment_force_n: f64::from(node.attachment_force_n),
                hand_force_n: hand_force_n(view, sample.node, node.position_m),
            });
        }
    }

    /// All curves as comma-separated values.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("node,time_s,deformation_m,spring_force_n,attachment_force_n,hand_force_n\n");
        for sample in &self.all {
            for m in &sample.curve {
                // Writing into a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},{:.6},{:.9},{:.6},{:.6},{:.6}",
                    sample.node, m.time_s, m.deformation_m, m.spring_force_n, m.attachment_force_n, m.hand_force_n
                );
            }
        }
        text
    }

    /// Saves the curves as `samples-N.csv` in this folder, never over a file that is there; says which file.
    ///
    /// # Errors
    /// What the file system said; [`ErrorKind::NotFound`] when nothing is picked.
    pub fn save(&self, folder: &Path) -> Result<PathBuf, Error> {
        if self.all.is_empty() {
            return Err(Error::new(ErrorKind::NotFound, "no sample point is picked; Ctrl-click the tissue first"));
        }
        let (path, mut file) = new_file(folder, "samples", "csv")?;
        file.write_all(self.csv().as_bytes())?;
        Ok(path)
    }
}

/// Force of hand and line on a suture point: of the handle of its pair that is nearest to it.
fn hand_force_n(view: &View, node: u32, at_m: [f32; 3]) -> f64 {
    let (Some(servo), Some(parts)) = (&view.servo, view.outline_of_frame()) else { return 0.0 };
    let Some(place) = parts.pairs.iter().position(|point| *point == node) else { return 0.0 };
    let away = |handle: &HandleState| (0..3).map(|k| (handle.position_m[k] - f64::from(at_m[k])).powi(2)).sum::<f64>();
    let partner = parts.pairs.get(place ^ 1).and_then(|other| view.frame.elements.get(*other as usize));
    let nearer_to_partner = |handle: &HandleState| {
        partner.is_some_and(|other| {
            let far: f64 = (0..3).map(|k| (handle.position_m[k] - f64::from(other.position_m[k])).powi(2)).sum();
            far < away(handle)
        })
    };
    let of_pair = servo.handles.iter().filter(|h| h.mode != 0 && h.pair as usize == place / 2);
    let own = of_pair.filter(|h| !nearer_to_partner(h)).min_by(|a, b| away(a).total_cmp(&away(b)));
    own.map_or(0.0, |handle| handle.applied_force_n.iter().map(|f| f * f).sum::<f64>().sqrt())
}

/// Makes `STEM-N.EXTENSION` with the first number that is free.
///
/// # Errors
/// What the file system said.
pub fn new_file(folder: &Path, stem: &str, extension: &str) -> Result<(PathBuf, File), Error> {
    for number in 1..=MAX_NAMES {
        let path = folder.join(format!("{stem}-{number}.{extension}"));
        match File::create_new(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            other => return other.map(|file| (path, file)),
        }
    }
    Err(Error::new(ErrorKind::AlreadyExists, format!("{MAX_NAMES} files {stem}-N.{extension} are there already")))
}

#[cfg(test)]
mod tests {
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
        assert_eq!(samples.csv().lines().count(), 2);
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
}
