//! Hand recordings as MCAP: our own traces, and CSV recordings that were converted.
//!
//! A trace of a session holds the stylus in every `/servo_state` (1 kHz); those are taken. A trace
//! without them holds `/hand` poses; metadata group `hand`, key `frame`, says in which frame they are
//! (scene, jigsaws, touch; without it the scene). Times count from the trace's first used sample.
//! A trace that was cut off or damaged gives what stands before that place, and says where it is.
//! Absent: orientation; a hand wishes a position.

use crate::hand::HandRecording;
use crate::hand::csv::{HandFile, HandFileKind, MAX_ROWS};
use crate::hand::file_fault::HandFileFault;
use protocol::trace::{HandPose, Metadata, TraceEnd, TraceError, TraceItem, TraceReader, TraceWriter};
use sim_core::vector::Vec3;
use std::io::{Read, Write};

/// First bytes of every MCAP file.
pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Metadata group and key that say in which frame `/hand` is.
const FRAME_GROUP: &str = "hand";
const FRAME_KEY: &str = "frame";
const NS_PER_S: f64 = 1e9;
/// `HandPose::orientation` of a recording without one.
const NO_ROTATION: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A hand from a trace.
#[derive(Debug)]
pub struct TraceHand {
    /// The motion.
    pub file: HandFile,
    /// How reading ended.
    pub end: TraceEnd,
}

#[derive(Default)]
struct Samples {
    start_ns: Option<u64>,
    recording: HandRecording,
}

impl Samples {
    /// Takes a sample; a second one of the same nanosecond is passed over.
    fn push(&mut self, time_ns: u64, position_m: [f64; 3], buttons: u32) -> Result<(), &'static str> {
        let start_ns = *self.start_ns.get_or_insert(time_ns);
        let time_s = time_ns.checked_sub(start_ns).ok_or("its time lies before that of the first")? as f64 / NS_PER_S;
        if self.recording.times_s.last().is_some_and(|&last| time_s <= last) {
            return if self.recording.times_s.last() == Some(&time_s) { Ok(()) } else { Err("its time goes back") };
        }
        if self.recording.times_s.len() == MAX_ROWS {
            return Err("the recording is longer than a million samples; cut it into shorter ones");
        }
        self.recording.times_s.push(time_s);
        self.recording.positions_m.push(Vec3::from(position_m));
        self.recording.buttons.push(buttons);
        Ok(())
    }
}

/// Reads the hand of a trace; `name` appears in faults.
///
/// # Errors
/// [`HandFileFault::BadTrace`] when this is no trace, a message cannot be used, or it has no hand.
pub fn read(name: &str, source: impl Read) -> Result<TraceHand, HandFileFault> {
    let bad = |what: String| HandFileFault::BadTrace { path: name.to_owned(), what };
    let fault = |e: TraceError| bad(e.to_string());
    let mut reader = TraceReader::open(source).map_err(fault)?;
    let (mut servo, mut hand) = (Samples::default(), Samples::default());
    let mut count = 0_u64;
    while let Some((time_ns, item)) = reader.next_item().map_err(fault)? {
        count += 1;
        let taken = match item {
            TraceItem::ServoState(state) => match state.devices[0] {
                device if device.present != 0 => servo.push(time_ns, device.position_m, device.buttons),
                _ => Ok(()),
            },
            TraceItem::Hand(pose) => hand.push(time_ns, pose.position_m, pose.buttons),
            _ => Ok(()),
        };
        taken.map_err(|what| bad(format!("message {count} cannot be used: {what}")))?;
    }
    let (samples, kind) = if servo.recording.times_s.is_empty() {
        let frame = reader.metadata().get(FRAME_GROUP).and_then(|group| group.get(FRAME_KEY));
        let kind = match frame.map(String::as_str) {
            None | Some("scene") => HandFileKind::Scene,
            Some("jigsaws") => HandFileKind::Jigsaws,
            Some("touch") => HandFileKind::Touch,
            Some(other) => return Err(bad(format!("its hand is in the unknown frame {other:?}; convert it again"))),
        };
        (hand, kind)
    } else {
        (servo, HandFileKind::Scene)
    };
    if samples.recording.times_s.is_empty() {
        let place = match reader.end() {
            TraceEnd::Cut { byte } | TraceEnd::Damaged { byte, .. } => format!(" up to byte {byte}, where it ends"),
            TraceEnd::Complete | TraceEnd::Reading => String::new(),
        };
        return Err(bad(format!("the trace has no hand{place}; choose one with /servo_state or /hand")));
    }
    Ok(TraceHand { file: HandFile { kind, recording: samples.recording }, end: reader.end().clone() })
}

/// Writes a hand file as a trace with `/hand` poses and gives the sink back.
///
/// # Errors
/// What the writer says.
pub fn write<W: Write>(file: &HandFile, mut metadata: Metadata, sink: W) -> Result<W, TraceError> {
    let frame = match file.kind {
        HandFileKind::Scene => "scene",
        HandFileKind::Jigsaws => "jigsaws",
        HandFileKind::Touch => "touch",
    };
    metadata.entry(FRAME_GROUP.to_owned()).or_default().insert(FRAME_KEY.to_owned(), frame.to_owned());
    let mut writer = TraceWriter::create(sink, &metadata)?;
    let recording = &file.recording;
    let start_s = recording.times_s.first().copied().unwrap_or(0.0).min(0.0);
    for ((&time_s, position), &buttons) in recording.times_s.iter().zip(&recording.positions_m).zip(&recording.buttons)
    {
        let time_ns = ((time_s - start_s) * NS_PER_S).round() as u64;
        writer.hand(time_ns, &HandPose { position_m: (*position).into(), orientation: NO_ROTATION, buttons })?;
    }
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use protocol::servo_state::ServoState;
    use protocol::wire::{Field, Message};

    fn file(kind: HandFileKind) -> HandFile {
        let recording = HandRecording {
            times_s: vec![0.0, 0.033_333, 0.066_667, 1.5],
            positions_m: vec![
                Vec3::zeros(),
                Vec3::new(0.1, -0.2, 1.0 / 3.0),
                Vec3::new(1e-9, 0.0, 2.0),
                Vec3::new(0.3, 0.2, 0.1),
            ],
            buttons: vec![0, 1, 3, 0],
        };
        HandFile { kind, recording }
    }

    #[test]
    fn a_hand_comes_back_bit_for_bit_with_its_frame() {
        for kind in [HandFileKind::Scene, HandFileKind::Jigsaws, HandFileKind::Touch] {
            let bytes = write(&file(kind), Metadata::new(), Vec::new()).unwrap();
            let back = read("t.mcap", &bytes[..]).unwrap();
            assert_eq!((back.file, back.end), (file(kind), TraceEnd::Complete));
        }
    }

    #[test]
    fn servo_states_are_preferred_to_sparse_poses() {
        let mut writer = TraceWriter::create(Vec::new(), &Metadata::new()).unwrap();
        for tick in 1..=10_u32 {
            let mut state = ServoState { ticks: u64::from(tick), ..ServoState::EMPTY };
            state.devices[0].present = u32::from(tick > 2);
            state.devices[0].position_m = [f64::from(tick), 0.0, 0.0];
            state.devices[0].buttons = tick % 2;
            state.stamp(u64::from(tick), u64::from(tick) * 1_000_000);
            writer.servo_state(&state).unwrap();
        }
        writer.hand(1, &HandPose { position_m: [9.0; 3], orientation: NO_ROTATION, buttons: 0 }).unwrap();
        let back = read("t.mcap", &writer.finish().unwrap()[..]).unwrap().file.recording;
        assert_eq!(back.positions_m.iter().map(|p| p.x).collect::<Vec<_>>(), [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!(back.times_s[..2], [0.0, 0.001]);
        assert_eq!(back.buttons[..2], [1, 0]);
    }

    #[test]
    fn cut_at_every_byte_it_is_a_shorter_hand_or_a_fault_with_its_place() {
        let whole = write(&file(HandFileKind::Scene), Metadata::new(), Vec::new()).unwrap();
        for length in 0..whole.len() {
            match read("t.mcap", &whole[..length]) {
                Ok(hand) => assert!(matches!(hand.end, TraceEnd::Cut { .. })),
                Err(fault) => {
                    assert_eq!(fault.exit_code(), 65);
                    assert!(fault.to_string().contains("byte "), "{fault}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn damage_never_panics(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..10)) {
            let mut bytes = write(&file(HandFileKind::Scene), Metadata::new(), Vec::new()).unwrap();
            for (place, value) in &edits {
                let place = place.index(bytes.len());
                bytes[place] = *value;
            }
            if let Ok(hand) = read("t.mcap", &bytes[..]) {
                prop_assert!(hand.file.recording.check().is_ok());
            }
        }
    }
}
