//! `lockstep …`: from the command line to a job for [`crate::lockstep`].
//!
//! With a given time a recorded hand repeats; without, the run ends with the recording, or with the procedure when a
//! synthetic hand works, at [`LONGEST_S`] at the latest.

use super::LockstepArgs;
use super::choice::{DeviceChoice, HandChoice};
use crate::crew;
use crate::error::ServerError;
use crate::lockstep::{self, LockstepJob, RunEnd};
use crate::rig::{self, RigChoice};
use crate::servo::params::{ServoConfig, ServoParams};
use crate::servo_link::RunLength;
use crate::solver::session::SolverSession;
use crate::summary::RunSummary;
use crate::{device::DeviceLimits, scene_file};

/// A synthetic hand that has not finished by then never will, seconds.
const LONGEST_S: f64 = 900.0;

/// Runs the job.
pub(super) fn run(args: &LockstepArgs) -> Result<RunSummary, ServerError> {
    if args.frames.is_some() {
        return Err(ServerError::Unavailable(
            "this build draws no frames; leave --frames out, or use --out for tables and charts".to_owned(),
        ));
    }
    let recorded = matches!(args.hand.hand, HandChoice::File(_));
    let scenes = scene_file::chosen(&if recorded { args.scene.for_recorded_hand() } else { args.scene.clone() })?;
    let mut rig = rig::build(&RigChoice {
        device: &DeviceChoice::Simulated,
        hand: &args.hand.hand,
        side: args.hand.hand_side,
        length: if args.duration.is_some() { RunLength::Given } else { RunLength::OfTheHand },
        library: None,
        device_file: None,
    })?;
    let params = args.servo.as_deref().map_or_else(|| Ok(ServoConfig::default()), scene_file::servo_config)?;
    let params =
        ServoParams::new(&params, &DeviceLimits::OMNI).map_err(|e| ServerError::Configuration(e.to_string()))?;
    let mut session = SolverSession::new(&scenes).map_err(|e| scene_file::refused(&args.scene, &e))?;
    crew::hire(&mut session);
    lockstep::run(LockstepJob {
        scene: args.scene.label(),
        hand: args.hand.hand.to_string(),
        registration: std::mem::take(&mut rig.registration),
        session: &mut session,
        params,
        longest_s: args.duration.or(rig.ends_after_s).unwrap_or(LONGEST_S),
        ends: if args.duration.is_some() { RunEnd::AfterTime } else { RunEnd::WhenFinished },
        out: args.out.clone(),
        device: rig.device.pulled().ok_or_else(|| {
            ServerError::Unavailable("lockstep drives no device that owns its clock; use `run`".to_owned())
        })?,
    })
}
