//! The lines between supervisor and servo process: one JSON object per line on the servo's stdin and stdout.
//!
//! The supervisor speaks [`ToServo`], first of all the [`ServoSpec`]; the servo process answers with
//! [`FromServo`]. End of file on stdin means that the supervisor is gone: the servo then ramps the force to
//! zero and ends. Nothing here goes through shared memory, so it works when that is damaged.

use crate::cli::choice::{DeviceChoice, HandChoice, HandSide};
use crate::cli::side_choice::SideChoice;
use crate::servo::params::ServoConfig;
use crate::standing::Standing;
use crate::summary::RunSummary;
use protocol::trace::Metadata;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Longest line that is accepted, bytes.
pub const LONGEST_LINE: usize = 1 << 20;

/// All that the servo process is told at its start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoSpec {
    /// Run directory with the prefix of the services.
    pub run_dir: PathBuf,
    /// Process id of the supervisor.
    pub guarded_by: u32,
    /// Device to drive.
    pub device: DeviceChoice,
    /// The OpenHaptics library, if it is not the system's.
    pub openhaptics_library: Option<PathBuf>,
    /// What the rig knows of its device.
    pub device_file: Option<PathBuf>,
    /// Foot switches and 3D mice.
    pub side_inputs: Vec<SideChoice>,
    /// Who moves a simulated stylus.
    pub hand: HandChoice,
    /// Which hand of a recording holds the needle.
    pub hand_side: HandSide,
    /// Whether a recorded hand repeats or ends the run.
    pub length: RunLength,
    /// Scene or procedure.
    pub scene: String,
    /// Constants of the servo.
    pub servo: ServoConfig,
    /// What to do when real-time rights are missing.
    pub no_rt: NoRtPolicy,
    /// The processor of the servo thread, where it needs one that nobody else of ours uses.
    #[serde(default)]
    pub processor: Option<usize>,
    /// File to record to.
    pub record: Option<PathBuf>,
    /// What a recording says about its origin.
    pub origin: Metadata,
}

impl ServoSpec {
    /// Who moves the stylus, for reports: a replay is its own hand.
    #[must_use]
    pub fn hand_label(&self) -> String {
        match &self.device {
            DeviceChoice::Replay(path) => path.display().to_string(),
            DeviceChoice::Pointer => "pointer".to_owned(),
            DeviceChoice::Openhaptics(_) | DeviceChoice::Hid(_) | DeviceChoice::Firewire => "operator".to_owned(),
            _ => self.hand.to_string(),
        }
    }
}

/// What to do when real-time rights are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoRtPolicy {
    /// Go on, marked degraded.
    Degrade,
    /// Refuse to drive the device.
    Refuse,
}

/// How the end of the run is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunLength {
    /// By a duration or by a person: a recorded hand repeats.
    Given,
    /// By the recorded hand, if there is one.
    OfTheHand,
}

/// Supervisor to servo process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToServo {
    /// Start with this.
    Start(Box<ServoSpec>),
    /// The solver process is dead: do not wait for the ladder.
    SolverDied,
    /// A solver process was started.
    SolverUp,
    /// Leave a latched fault.
    Rearm,
    /// Ramp the force to zero, report, end.
    Stop,
}

/// Servo process to supervisor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FromServo {
    /// The loop runs and `servo_state` can be read.
    Ready,
    /// Alive; the tick counter moves while the loop does.
    Heartbeat {
        /// Ticks executed so far.
        ticks: u64,
    },
    /// The session stands somewhere else than before.
    Standing(Standing),
    /// The servo latched a fault.
    Fault {
        /// What happened.
        what: String,
    },
    /// The end.
    Summary(Box<RunSummary>),
}

/// One message as a line with its end.
///
/// # Errors
/// None in practice: paths that are not Unicode are the one thing JSON cannot hold.
pub fn to_line<T: Serialize>(message: &T) -> Result<String, serde_json::Error> {
    serde_json::to_string(message).map(|mut line| {
        line.push('\n');
        line
    })
}

/// Collects bytes into lines; a line beyond [`LONGEST_LINE`] is dropped whole.
#[derive(Debug, Default)]
pub struct LineBuffer {
    bytes: Vec<u8>,
    overlong: bool,
}

impl LineBuffer {
    /// Takes bytes in and hands each complete line to `line`.
    pub fn feed(&mut self, bytes: &[u8], mut line: impl FnMut(&str)) {
        for piece in bytes.split_inclusive(|&b| b == b'\n') {
            if self.bytes.len() + piece.len() > LONGEST_LINE {
                self.bytes.clear();
                self.overlong = true;
            }
            if !self.overlong {
                self.bytes.extend_from_slice(piece);
            }
            if piece.ends_with(b"\n") {
                if !std::mem::take(&mut self.overlong) {
                    line(String::from_utf8_lossy(&self.bytes).trim_end());
                }
                self.bytes.clear();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn messages_survive_the_way_through_a_line() {
        let start = ToServo::Start(Box::new(ServoSpec {
            run_dir: "r".into(),
            guarded_by: 7,
            device: DeviceChoice::Replay("a b.csv".into()),
            openhaptics_library: Some("lib.so".into()),
            device_file: None,
            side_inputs: vec![SideChoice::Pedal(None)],
            hand: HandChoice::Synthetic,
            hand_side: HandSide::Left,
            length: RunLength::OfTheHand,
            servo: ServoConfig::default(),
            no_rt: NoRtPolicy::Refuse,
            processor: Some(3),
            record: None,
            origin: Metadata::from([("scene".to_owned(), [("name".to_owned(), "skin".to_owned())].into())]),
            scene: "skin".into(),
        }));
        let line = to_line(&start).expect("representable");
        assert_eq!(line.matches('\n').count(), 1);
        assert_eq!(serde_json::from_str::<ToServo>(&line).expect("own line"), start);
        let end = FromServo::Summary(Box::default());
        let line = to_line(&end).expect("representable");
        assert_eq!(serde_json::from_str::<FromServo>(&line).expect("own line"), end);
    }

    #[test]
    fn an_overlong_line_is_dropped_and_the_next_is_whole() {
        let mut buffer = LineBuffer::default();
        let mut lines = Vec::new();
        for _ in 0..=LONGEST_LINE / 1000 {
            buffer.feed(&[b'x'; 1000], |l| lines.push(l.to_owned()));
        }
        buffer.feed(b"\nnext\n", |l| lines.push(l.to_owned()));
        assert_eq!(lines, ["next"]);
    }

    proptest! {
        #[test]
        fn any_split_gives_the_same_lines(text in "[a-c\n]{0,60}", cut in 0usize..60) {
            let cut = cut.min(text.len());
            let mut buffer = LineBuffer::default();
            let mut lines = Vec::new();
            buffer.feed(&text.as_bytes()[..cut], |l| lines.push(l.to_owned()));
            buffer.feed(&text.as_bytes()[cut..], |l| lines.push(l.to_owned()));
            let end = text.rfind('\n').map_or(0, |i| i + 1);
            prop_assert_eq!(lines, text[..end].lines().map(str::to_owned).collect::<Vec<_>>());
        }
    }
}
