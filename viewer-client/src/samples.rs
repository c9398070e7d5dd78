//! Sample points: nodes that a person picked, with their force against their deformation (Zhang et al., Fig. 6).
//!
//! Deformation d = |x − x₀| with x₀ the position in the first frame of this scene generation, where that frame was seen, else
//! where the node was seen first: when it was picked, or after a restore. A frame from the past takes away what lies after it.
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
/// A new generation within this time of the last frame, or of the start of all, was seen from its first frame on, seconds.
const CLOSE_S: f64 = 0.25;
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

/// From where the deformation of a node counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// From the first frame of its scene generation.
    FirstFrame,
    /// From where it was when it was picked, or seen first after a restore.
    SeenFirst,
}

/// What a sample belongs to: kind and node count of a scene, generation.
type Belongs = ((u32, u32), u32);

/// One picked node.
#[derive(Clone, Debug)]
pub struct Sample {
    node: u32,
    belongs: Belongs,
    reference: Reference,
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

    /// The force that its curve shows: that of the hand at a suture point, else the largest of a spring at the node, newtons.
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

    fn begin(view: &View, first: Option<&FirstFrame>, node: u32, at_m: [f32; 3]) -> Self {
        let belongs = belongs(view);
        let is_suture_point = view.outline_of_frame().is_some_and(|parts| parts.pairs.contains(&node));
        let rest_m = first.filter(|f| f.belongs == belongs).and_then(|f| f.places_m.get(node as usize).copied());
        let reference = if rest_m.is_some() { Reference::FirstFrame } else { Reference::SeenFirst };
        let reference_m = rest_m.unwrap_or(at_m);
        let curve = Vec::with_capacity(CAPACITY);
        Self { node, belongs, reference, reference_m, is_suture_point, curve, stride: 1, passed: 0 }
    }

    fn take(&mut self, measured: Measured) {
        if self.curve.last().is_some_and(|last| measured.time_s <= last.time_s) {
            // A recording that was wound back.
            self.curve.retain(|before| before.time_s < measured.time_s);
            self.passed = self.stride;
        }
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

/// Places of all nodes in the first frame of a scene generation.
#[derive(Clone, Debug)]
struct FirstFrame {
    belongs: Belongs,
    places_m: Vec<[f32; 3]>,
}

/// All picked nodes.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    all: Vec<Sample>,
    first: Option<FirstFrame>,
    /// What the last frame belonged to, and its simulated time.
    last: Option<(Belongs, f64)>,
    frames: u64,
}

impl Samples {
    /// The picked nodes, oldest first.
    #[must_use]
    pub fn all(&self) -> &[Sample] {
        &self.all
    }

    /// Watches a node of this view, which may be held and old: nothing is measured in it. One that is watched already begins anew; the oldest makes room.
    /// `false` when the frame has no such node.
    pub fn pick(&mut self, view: &View, node: u32) -> bool {
        let Some(place) = view.frame.elements.get(node as usize) else { return false };
        self.all.retain(|sample| sample.node != node);
        if self.all.len() == MAX_SAMPLES {
            self.all.remove(0);
        }
        self.all.push(Sample::begin(view, self.first.as_ref(), node, place.position_m));
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
        let belongs = belongs(view);
        self.all.retain(|sample| sample.belongs.0 == belongs.0);
        self.keep_first(view, belongs);
        for sample in &mut self.all {
            let Some(node) = view.frame.elements.get(sample.node as usize) else { continue };
            if sample.belongs != belongs {
                *sample = Sample::begin(view, self.first.as_ref(), sample.node, node.position_m);
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

    /// Keeps the places of the first frame of a generation, if this is one.
    fn keep_first(&mut self, view: &View, belongs: Belongs) {
        let now_s = view.frame.header.sim_time_s;
        let (before, before_s) = self.last.replace((belongs, now_s)).map_or((None, 0.0), |(b, s)| (Some(b), s));
        if before != Some(belongs) && (before_s..=before_s + CLOSE_S).contains(&now_s) {
            let places_m = view.frame.elements.iter().map(|node| node.position_m).collect();
            self.first = Some(FirstFrame { belongs, places_m });
        }
    }

    /// All curves as comma-separated values; lines that begin with # say from where each deformation counts.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::new();
        for sample in &self.all {
            let from = match sample.reference {
                Reference::FirstFrame => "its place in the first frame of the scene",
                Reference::SeenFirst => "where it was when it was picked or first seen after a restore",
            };
            // Writing into a string cannot fail.
            let _ = writeln!(text, "# node {}: deformation from {from}", sample.node);
        }
        text.push_str("node,time_s,deformation_m,largest_spring_force_n,attachment_force_n,hand_force_n\n");
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

fn belongs(view: &View) -> Belongs {
    let header = &view.frame.header;
    ((view.outline.header.scene_kind, header.node_count), header.scene_generation)
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
mod tests;
