//! What leaves the system when garbage comes in: ports, reports, frames, recordings and report files hold finite numbers.

use super::nets::is_sound;
use super::rig::{SessionRig, params, small_skin};
use super::{Ending, Named, Outcome};
use haptic_server::device::{DeviceCommand, DeviceSample, HandView, PulledDevice, SampleQuality, TickTime};
use haptic_server::lockstep::{LockstepJob, RunEnd, run};
use haptic_server::record::Recording;
use haptic_server::solver::session::SolverSession;
use protocol::servo_state::ServoState;
use protocol::trace::{Metadata, TraceItem, TraceReader};
use protocol::wire::Message;
use sim_core::scene::procedure::SceneSource;
use sim_core::vector::Vec3;
use std::path::{Path, PathBuf};

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("a servo_state of NaN handed to the solver", poisoned_solver),
    ("a servo_state of NaN handed to the recorder", poisoned_recording),
    ("files of a run whose device reports NaN", files_of_a_bad_device),
    ("frames while a handle is led far away", frames_under_strain),
];

/// A held point, then twenty steps by a servo state whose device and handles are not finite.
fn poisoned_solver() -> Outcome {
    let mut rig = SessionRig::new(&small_skin()).expect("the small skin scene loads");
    rig.hold_left();
    let mut bad: ServoState = *rig.servo.state();
    let (mut unsound, mut clock) = (0_u32, rig.now_ns);
    let mut nodes = Vec::new();
    for step in 0..20 {
        let value = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308][step % 4];
        bad.devices[0].position_m = [value; 3];
        bad.handles[0].position_m = [value; 3];
        clock += 5_000_000;
        rig.session.step(Some(&bad), None, clock);
        let mut port = *rig.session.port();
        port.stamp(1, clock);
        let mut report = *rig.session.report();
        report.stamp(1, clock);
        rig.session.frame(&mut nodes);
        let state = rig.session.procedure().scene().solver().state();
        let sound = is_sound(&state.position_m)
            && is_sound(&state.velocity_m_per_s)
            && nodes.iter().all(|n| n.position_m.iter().all(|x| x.is_finite()))
            && port.validate().is_ok()
            && report.validate().is_ok();
        unsound += u32::from(!sound);
    }
    let note = "of 20 steps, those with a tissue, port, frame or report that is not finite";
    Outcome::measured(Ending::Clamped, note, f64::from(unsound), 0.0, "steps")
}

fn poisoned_recording() -> Outcome {
    let mut rig = SessionRig::new(&small_skin()).expect("the small skin scene loads");
    let mut bytes = Vec::new();
    let mut recording = Recording::create(&mut bytes, &Metadata::new()).expect("memory takes a trace");
    for tick in 0..100 {
        rig.tick();
        let mut state = *rig.servo.state();
        if tick % 10 == 3 {
            state.devices[0].force_n = [f64::NAN; 3];
        }
        recording.tick(&state);
    }
    let outcome = recording.finish();
    let mut read = 0_u32;
    let mut bad = 0_u32;
    if let Ok(mut reader) = TraceReader::open(&bytes[..]) {
        while let Ok(Some((_, item))) = reader.next_item() {
            if let TraceItem::ServoState(state) = item {
                read += 1;
                bad += u32::from(state.validate().is_err());
            }
        }
    }
    let note = format!(
        "{} states refused and counted, {read} read back; states in the file that are not finite",
        outcome.refused
    );
    Outcome::measured(Ending::Clamped, note, f64::from(bad), 0.0, "states")
        .require(outcome.refused == 10 && read == 90 && outcome.stopped.is_none(), "the rest is recorded")
}

/// Reports a still stylus, and now and then one that is not finite.
struct BadDevice {
    ticks: u64,
    sound: bool,
}

impl PulledDevice for BadDevice {
    fn sample(&mut self, time: TickTime, _view: &HandView) -> DeviceSample {
        self.ticks += 1;
        let mut sample = DeviceSample::resting(Vec3::new(0.0, 0.0, 0.02));
        (sample.time_ns, sample.quality) = (time.now_ns, SampleQuality::Fresh);
        if self.ticks % 50 < 3 {
            sample.position_m.x = [f64::NAN, f64::INFINITY, -1e308][(self.ticks % 3) as usize];
        }
        sample
    }

    fn command(&mut self, command: DeviceCommand) {
        self.sound &= command.force_n.iter().all(|f| f.is_finite());
    }
}

/// A folder of this process that is removed with the value.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("suture-extremes-{}-{name}", std::process::id()));
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed is the system's to clean.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Words of a text that name a number which is not one.
fn bad_words(folder: &Path) -> std::io::Result<(usize, usize)> {
    let (mut files, mut bad) = (0, 0);
    for entry in std::fs::read_dir(folder)? {
        let text = String::from_utf8_lossy(&std::fs::read(entry?.path())?).to_lowercase();
        files += 1;
        let words = text.split(|c: char| !c.is_ascii_alphanumeric());
        bad += words.filter(|w| matches!(*w, "nan" | "inf" | "infinity")).count();
    }
    Ok((files, bad))
}

fn files_of_a_bad_device() -> Outcome {
    let folder = Folder::new("bad-device");
    let mut device = BadDevice { ticks: 0, sound: true };
    let mut session = SolverSession::new(&[SceneSource { config: small_skin(), mesh: None }]).expect("the scene loads");
    let summary = run(LockstepJob {
        scene: "skin".to_owned(),
        hand: "none".to_owned(),
        registration: String::new(),
        session: &mut session,
        device: &mut device,
        params: params(),
        longest_s: 1.0,
        ends: RunEnd::AfterTime,
        out: Some(folder.0.clone()),
        kept: None,
    });
    let found = bad_words(&folder.0);
    let (files, bad) = found.as_ref().map_or((0, usize::MAX), |f| *f);
    let note = format!("{files} files of a run with 60 bad samples; words nan, inf, infinity in them");
    Outcome::measured(Ending::Clamped, note, bad as f64, 0.0, "words")
        .require(summary.is_ok() && files == 5, "the run ends and writes its five files")
        .require(device.sound, "every command is finite")
}

/// Frames are f32: positions far out must stay finite there too.
fn frames_under_strain() -> Outcome {
    let mut rig = SessionRig::new(&small_skin()).expect("the small skin scene loads");
    rig.hold_left();
    let mut state: ServoState = *rig.servo.state();
    let mut clock = rig.now_ns;
    let (mut nodes, mut worst) = (Vec::new(), 0.0_f32);
    let mut cut = 0;
    for _ in 0..100 {
        state.handles[0].position_m = [1e9, -1e9, 1e9];
        clock += 5_000_000;
        rig.session.step(Some(&state), None, clock);
        rig.session.frame(&mut nodes);
        cut += rig.session.procedure().scene().last_report().handles_cut;
        for x in nodes.iter().flat_map(|n| n.position_m) {
            worst = if x.abs() <= worst { worst } else { x.abs() };
        }
    }
    let note = format!("handle asked to 1e9 m: {cut} ways cut; largest coordinate in a frame after 0.5 s");
    // Two spacings of 2 mm per step of 5 ms, over 100 steps, from about 12 mm.
    Outcome::measured(Ending::Clamped, note, f64::from(worst), 0.42, "m").require(cut > 90, "they are counted")
}
