//! How the children are started, and what is checked before the first one is.
//!
//! Everything that a look at files can refuse is refused here, in the parent, before the lock is taken and
//! before a device is touched: one sentence, the right exit code, no half-started run.

use super::child::{ChildProcess, beside_this_program};
use crate::cli::choice::{DeviceChoice, SceneChoice};
use crate::cli::{RunArgs, SceneArgs};
use crate::crew;
use crate::error::ServerError;
use crate::record::origin;
use crate::scene_file;
use crate::servo::params::ServoConfig;
use crate::servo_link::{NoRtPolicy, RunLength, ServoSpec, ToServo, to_line};
use crate::standing::Standing;
use clap::ValueEnum;
use protocol::run::RunDir;
use protocol::trace::Metadata;
use sim_core::scene::procedure::SceneSource;
use sim_core::scene::step::Scene;
use std::ffi::{OsStr, OsString};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The software renderers (llvmpipe, lavapipe) draw with so many threads; without it with one per core.
const DRAWING_THREADS: &str = "LP_NUM_THREADS";

/// What the children are started with.
pub(super) struct Plan {
    servo: ServoSpec,
    scene: SceneArgs,
}

/// Refuses what cannot work and plans the rest; starts nothing.
pub(super) fn plan(args: &RunArgs) -> Result<Plan, ServerError> {
    let scene = match args.recording() {
        Some(path) => {
            std::fs::File::open(path).map_err(|e| ServerError::reading(path, &e))?;
            args.scene.for_recorded_hand()
        }
        None => args.scene.clone(),
    };
    let scenes = scene_file::chosen(&scene)?;
    if let SceneChoice::File(_) = scene.scene {
        // Presets are known to be sound; a file is built here once, so that it is refused before anything is started.
        for source in &scenes {
            Scene::new(&source.config, source.mesh.as_ref()).map_err(|e| scene_file::refused(&scene, &e))?;
        }
    }
    let servo = ServoSpec {
        run_dir: PathBuf::new(),
        guarded_by: std::process::id(),
        device: args.device.clone(),
        openhaptics_library: args.openhaptics_library.clone(),
        device_file: args.device_file.clone(),
        side_inputs: args.side_input.clone(),
        hand: args.hand.hand.clone(),
        hand_side: args.hand.hand_side,
        length: if args.duration.is_some() { RunLength::Given } else { RunLength::OfTheHand },
        scene: scene.label(),
        servo: args.servo.as_deref().map_or_else(|| Ok(ServoConfig::default()), scene_file::servo_config)?,
        no_rt: if args.device.is_hardware() && !args.allow_no_rt { NoRtPolicy::Refuse } else { NoRtPolicy::Degrade },
        processor: scenes.iter().any(|s| s.config.solver.threads > Some(1)).then(crew::servo_processor).flatten(),
        record: args.record.clone(),
        origin: Metadata::new(),
    };
    let origin = if args.record.is_some() { origin_of(&servo, args, &scenes)? } else { Metadata::new() };
    let servo = ServoSpec { origin, ..servo };
    Ok(Plan { servo, scene })
}

/// What a recording says about this run.
fn origin_of(servo: &ServoSpec, args: &RunArgs, scenes: &[SceneSource]) -> Result<Metadata, ServerError> {
    let failed = |e| ServerError::Internal(format!("cannot write the parameters into the recording: {e}"));
    let mut metadata = origin::origin();
    let run = [
        ("scene", servo.scene.clone()),
        ("device", args.device.to_string()),
        ("hand", args.hand.hand.to_string()),
        ("scenes", scenes.len().to_string()),
    ];
    metadata.insert("scene".to_owned(), run.map(|(key, value)| (key.to_owned(), value)).into());
    metadata.insert("servo".to_owned(), origin::group(&servo.servo).map_err(failed)?);
    for (i, scene) in scenes.iter().enumerate() {
        metadata.insert(format!("parameters.{i}"), origin::group(&scene.config).map_err(failed)?);
    }
    // Nothing in a run draws random numbers but the run directory's name.
    metadata.insert("seeds".to_owned(), [("random_numbers".to_owned(), "none".to_owned())].into());
    Ok(metadata)
}

/// Starts the servo process and sends it its specification.
pub(super) fn servo(plan: &Plan, run: &RunDir) -> Result<ChildProcess, ServerError> {
    let exe = std::env::current_exe()
        .map_err(|e| ServerError::Internal(format!("cannot find this program: {e}; start it by its path")))?;
    let mut command = Command::new(exe);
    if let DeviceChoice::Openhaptics(_) = plan.servo.device {
        // With a decimal comma the vendor's driver reads its configuration wrongly.
        command.env("LC_ALL", "C");
    }
    command.arg("servo").stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut servo = ChildProcess::spawn("servo", command)?;
    let spec = ServoSpec { run_dir: run.path().to_owned(), ..plan.servo.clone() };
    let unsendable = |e: std::io::Error| ServerError::Internal(format!("cannot instruct the servo process: {e}"));
    let line = to_line(&ToServo::Start(Box::new(spec))).map_err(|e| unsendable(e.into()))?;
    if let Some(stdin) = servo.inner().stdin.as_mut() {
        stdin.write_all(line.as_bytes()).map_err(unsendable)?;
    }
    Ok(servo)
}

/// Starts the deformation solver on the run; one that follows a dead one is told where that stood.
pub(super) fn solver(plan: &Plan, run: &RunDir, standing: Option<&Standing>) -> Result<ChildProcess, ServerError> {
    let mut command = Command::new(beside_this_program("deformation-solver")?);
    command.args(scene_arguments(&plan.scene)).arg("--run-dir").arg(run.path());
    command.arg("--guarded-by").arg(std::process::id().to_string());
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let Some(standing) = standing else { return ChildProcess::spawn("deformation-solver", command) };
    command.arg("--resume").stdin(Stdio::piped());
    let mut solver = ChildProcess::spawn("deformation-solver", command)?;
    let untold = |e: std::io::Error| ServerError::Internal(format!("cannot tell the solver where it stands: {e}"));
    let line = to_line(standing).map_err(|e| untold(e.into()))?;
    // Dropped after that: end of file. The line is far shorter than a pipe is deep.
    if let Some(mut stdin) = solver.inner().stdin.take() {
        stdin.write_all(line.as_bytes()).map_err(untold)?;
    }
    Ok(solver)
}

/// Starts a viewer on the run, if it is built.
pub(super) fn viewer(run: &RunDir) -> Result<ChildProcess, ServerError> {
    let program = beside_this_program("viewer-client")?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let is_set = std::env::var_os(DRAWING_THREADS);
    ChildProcess::spawn("viewer-client", viewer_command(&program, run.path(), is_set.as_deref(), cores))
}

/// How a viewer is started; what a person has set for the drawing threads is inherited.
fn viewer_command(program: &Path, run: &Path, drawing: Option<&OsStr>, cores: usize) -> Command {
    let mut command = Command::new(program);
    command.arg("--run-dir").arg(run);
    if drawing.is_none() {
        command.env(DRAWING_THREADS, drawing_threads(cores).to_string());
    }
    command.stdin(Stdio::null()).stdout(Stdio::null());
    command
}

/// Threads with which a processor may draw: one core is left to the servo, which may have no real-time rights.
fn drawing_threads(cores: usize) -> usize {
    cores.saturating_sub(1).max(1)
}

/// The scene options as the solver's command line has them.
fn scene_arguments(scene: &SceneArgs) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = match (&scene.procedure, &scene.scene) {
        (Some(procedure), _) => vec!["--procedure".into(), procedure.to_string().into()],
        (None, SceneChoice::File(path)) => vec!["--scene".into(), path.into()],
        (None, preset) => vec!["--scene".into(), preset.to_string().into()],
    };
    if let Some(value) = scene.control.and_then(|c| c.to_possible_value()) {
        arguments.extend(["--control".into(), value.get_name().to_owned().into()]);
    }
    if let Some(radius_mm) = scene.capture_radius_mm {
        arguments.extend(["--capture-radius-mm".into(), radius_mm.to_string().into()]);
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{SolverCli, parse};

    #[test]
    fn the_solver_understands_what_it_is_started_with() {
        for line in [
            "--scene vessel --control paper",
            "--procedure liver-surgery",
            "--scene skin",
            "--scene a/b.toml --control off --capture-radius-mm 7.5",
        ] {
            let of = |words: Vec<OsString>| {
                parse::<SolverCli>(std::iter::once("deformation-solver".into()).chain(words)).expect(line).scene
            };
            let first = of(line.split(' ').map(OsString::from).collect());
            let second = of(scene_arguments(&first));
            assert_eq!(format!("{first:?}"), format!("{second:?}"), "{line}");
        }
    }

    #[test]
    fn a_viewer_is_told_its_run_and_how_many_threads_may_draw_unless_a_person_said_so() {
        let environment = |drawing: Option<&str>, cores| {
            let command =
                viewer_command(Path::new("viewer-client"), Path::new("/r/run-1"), drawing.map(OsStr::new), cores);
            assert_eq!(command.get_args().collect::<Vec<_>>(), ["--run-dir", "/r/run-1"]);
            let set: Vec<_> =
                command.get_envs().map(|(key, value)| (key.to_owned(), value.map(OsStr::to_owned))).collect();
            set
        };
        for (cores, threads) in [(1, "1"), (2, "1"), (4, "3")] {
            assert_eq!(environment(None, cores), [("LP_NUM_THREADS".into(), Some(threads.into()))]);
        }
        assert!(
            environment(Some("7"), 4).is_empty() && environment(Some(""), 4).is_empty(),
            "it is inherited as it is"
        );
    }

    #[test]
    fn a_processor_that_draws_leaves_a_core_to_the_servo() {
        assert_eq!([1, 2, 8].map(drawing_threads), [1, 1, 7]);
    }
}
