//! `lockstep …`: from the command line to a job for [`crate::lockstep`].
//!
//! With a given time a recorded hand repeats; without, the run ends with the recording, or with the procedure when a
//! synthetic hand works, at [`LONGEST_S`] at the latest. A recording is made when one is asked for, or when pictures are.

use super::LockstepArgs;
use super::choice::{DeviceChoice, HandChoice};
use super::frames::{Frames, Trace};
use crate::crew;
use crate::error::ServerError;
use crate::lockstep::{self, Kept, LockstepJob, RunEnd};
use crate::record::origin;
use crate::rig::{self, RigChoice};
use crate::servo::params::{ServoConfig, ServoParams};
use crate::servo_link::RunLength;
use crate::solver::session::SolverSession;
use crate::summary::RunSummary;
use crate::{device::DeviceLimits, scene_file};
use sim_core::scene::procedure::SceneSource;

/// A synthetic hand that has not finished by then never will, seconds.
const LONGEST_S: f64 = 900.0;

/// Runs the job.
pub(super) fn run(args: &LockstepArgs) -> Result<RunSummary, ServerError> {
    let frames = Frames::asked(args)?;
    let trace = Trace::of(args, frames.as_ref());
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
    let servo = args.servo.as_deref().map_or_else(|| Ok(ServoConfig::default()), scene_file::servo_config)?;
    let kept = trace.as_ref().map(|trace| kept(trace, args, &servo, &scenes)).transpose()?;
    let params =
        ServoParams::new(&servo, &DeviceLimits::OMNI).map_err(|e| ServerError::Configuration(e.to_string()))?;
    let mut session = SolverSession::new(&scenes).map_err(|e| scene_file::refused(&args.scene, &e))?;
    crew::hire(&mut session);
    let summary = lockstep::run(LockstepJob {
        scene: args.scene.label(),
        hand: args.hand.hand.to_string(),
        registration: std::mem::take(&mut rig.registration),
        session: &mut session,
        params,
        longest_s: args.duration.or(rig.ends_after_s).unwrap_or(LONGEST_S),
        ends: if args.duration.is_some() { RunEnd::AfterTime } else { RunEnd::WhenFinished },
        out: args.out.clone(),
        kept,
        device: rig.device.pulled().ok_or_else(|| {
            ServerError::Unavailable("lockstep drives no device that owns its clock; use `run`".to_owned())
        })?,
    })?;
    let Some(trace) = trace else { return Ok(summary) };
    if let Some(reason) = summary.recording.as_ref().and_then(|r| r.stopped.as_ref()) {
        return Err(ServerError::Unavailable(format!(
            "{}: the recording stopped: {reason}; check the free space",
            trace.path().display()
        )));
    }
    frames.iter().try_for_each(|frames| frames.draw(&trace))?;
    Ok(summary)
}

/// What a recording says about this run: what decides its bytes, and nothing else.
fn kept(trace: &Trace, args: &LockstepArgs, servo: &ServoConfig, scenes: &[SceneSource]) -> Result<Kept, ServerError> {
    let failed = |e| ServerError::Internal(format!("cannot write the parameters into the recording: {e}"));
    let mut origin = origin::timeless_origin();
    let run = [("scene", args.scene.label()), ("device", "simulated".to_owned()), ("hand", args.hand.hand.to_string())];
    origin.insert("scene".to_owned(), run.map(|(key, value)| (key.to_owned(), value)).into());
    origin.insert("servo".to_owned(), origin::group(servo).map_err(failed)?);
    for (i, scene) in scenes.iter().enumerate() {
        origin.insert(format!("parameters.{i}"), origin::group(&scene.config).map_err(failed)?);
    }
    Ok(Kept { path: trace.path().to_owned(), origin, view_period: trace.view_period() })
}
