//! `haptic-server doctor`: is this machine ready for a hand, and if not, what mends it.
//!
//! | file | rows |
//! |---|---|
//! | `kernel` | kernel, hypervisor, clock, timer_slack |
//! | `rights`, `budget` | rtprio_limit, memlock_limit, real_time_trial; real_time_throttle, real_time_budget |
//! | `processors` | processors, governor, c_states |
//! | `space` | shared_memory, open_files, run_directory, stale_runs, programs |
//! | `locale`, `openhaptics`, `nodes`, `gpu` | locale; openhaptics_library, openhaptics_config; device; gpu |
//! | this file, `latency` | scene_file, servo_file; latency |
//!
//! Each check is a function of what was read; tests put a made-up machine in its place. Deliberately absent: changing anything.

mod budget;
mod check;
#[cfg(test)]
pub(crate) mod fixture;
mod gpu;
mod kernel;
pub mod latency;
mod locale;
mod nodes;
mod openhaptics;
mod processors;
mod rights;
mod space;

pub use check::{Check, Report, Status};
pub(crate) use openhaptics::configured;

use crate::cli::DoctorArgs;
use crate::device::openhaptics::library;
use crate::error::ServerError;
use crate::machine::Machine;
use crate::realtime::{RealtimeConfig, RealtimeRights, Right, acquire};
use crate::supervisor::child::beside_this_program;
use crate::{cli, devices, scene_file};
use latency::Load;
use protocol::run::Environment;
use rustix::time::{ClockId, clock_getres};

/// Looks at this machine.
///
/// # Errors
/// The measurement was asked for and no thread could be started; everything else is a row of the report.
pub fn run(args: &DoctorArgs) -> Result<Report, ServerError> {
    let machine = Machine::of_process();
    let asked = ask_for_rights();
    let library = library::load(args.openhaptics_library.as_deref()).map(|(_, path)| path);
    let slack_kept = asked.missing.iter().find(|m| m.right == Right::TimerSlack).map(|m| m.cause.as_str());
    let mut checks = kernel::checks(&machine, resolution_ns(), slack_kept);
    checks.extend(rights::checks(&machine, &asked));
    checks.extend(budget::checks(&machine));
    checks.extend(processors::checks(&machine));
    checks.push(space::shared_memory(space::space_of("/dev/shm")));
    checks.push(space::open_files(&machine));
    checks.extend(space::runs(&Environment::of_process()));
    let program = |name| match beside_this_program(name) {
        Ok(path) if path.is_file() => Ok(path),
        Ok(path) => Err(format!("{} is not there", path.display())),
        Err(error) => Err(error.to_string()),
    };
    checks.push(space::programs(program("deformation-solver"), program("viewer-client")));
    checks.push(locale::check(&machine));
    checks.push(openhaptics::library(args.openhaptics_library.as_deref(), &library));
    checks.push(openhaptics::config(&machine, library.is_ok()));
    checks.extend(nodes::checks(&devices::list(&machine, library.is_ok())));
    checks.push(gpu::check(&machine));
    checks.extend(files(args));
    let measured =
        args.latency.map(|seconds| latency::measure(seconds, if args.load { Load::Cpu } else { Load::None }));
    let measured = measured.transpose()?;
    checks.extend(measured.as_ref().map(latency::check));
    Ok(Report::new(checks, measured))
}

/// What the kernel says to a thread that asks for everything that the servo asks for; afterwards nothing stays locked.
fn ask_for_rights() -> RealtimeRights {
    let config = RealtimeConfig::default();
    let asked = std::thread::Builder::new().name("rights".to_owned()).spawn(move || acquire(&config));
    let asked = asked.ok().and_then(|thread| thread.join().ok());
    // Locked memory is for the whole process; a refusal means that none was locked.
    let _unlocked = rustix::mm::munlockall();
    asked.unwrap_or_else(|| {
        let missing =
            crate::realtime::MissingRight { right: Right::Scheduling, cause: "no thread could be started".to_owned() };
        RealtimeRights { priority: config.priority, missing: vec![missing], rtprio_limit: None, memlock_limit: None }
    })
}

fn resolution_ns() -> u64 {
    let step = clock_getres(ClockId::Monotonic);
    step.tv_sec.unsigned_abs().saturating_mul(1_000_000_000).saturating_add(step.tv_nsec.unsigned_abs())
}

/// Configuration files that were named: loaded as a run would load them.
fn files(args: &DoctorArgs) -> Vec<Check> {
    let row = |name, loaded: Result<String, ServerError>| match loaded {
        Ok(found) => Check::ok(name, found),
        Err(error) => Check::fail(name, error.to_string(), "mend the file at the place named", error.exit_code()),
    };
    let scene = args.scene.as_deref().map(|file| row("scene_file", cli::files::scene_check(file, cli::Format::Text)));
    let servo = args.servo.as_deref().map(|file| {
        let loaded = scene_file::servo_config(file).map(|_| format!("{}: servo constants are sound", file.display()));
        row("servo_file", loaded)
    });
    scene.into_iter().chain(servo).collect()
}

/// The report for stdout, and the exit code.
///
/// # Errors
/// As [`run`], or the report cannot be written as JSON.
pub fn report(args: &DoctorArgs) -> Result<(String, u8), ServerError> {
    let report = run(args)?;
    let text = if args.json {
        let json = serde_json::to_string(&report);
        json.map_err(|e| ServerError::Internal(format!("cannot write the report as JSON: {e}")))?
    } else {
        report.to_string()
    };
    Ok((text + "\n", report.exit_code()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit;
    use std::path::PathBuf;

    fn args() -> DoctorArgs {
        DoctorArgs { json: true, latency: None, load: false, openhaptics_library: None, scene: None, servo: None }
    }

    #[test]
    fn the_json_has_its_keys_and_every_row_its_four() {
        let (text, code) = report(&args()).expect("a report");
        let value: serde_json::Value = serde_json::from_str(&text).expect("one document");
        let rows = value["checks"].as_array().expect("rows");
        assert!(rows.len() >= 20, "{} rows", rows.len());
        for row in rows {
            let keys: Vec<&str> = row.as_object().expect("an object").keys().map(String::as_str).collect();
            assert_eq!(keys.len(), 4, "{row}");
            assert!(["ok", "warn", "fail"].contains(&row["status"].as_str().unwrap_or_default()), "{row}");
            assert_eq!(row["status"] == "ok", row["remedy"].is_null(), "{row}");
        }
        assert_eq!(code == exit::OK, rows.iter().all(|r| r["status"] != "fail"));
        assert!(["unmeasured", "unfit"].contains(&value["grade"].as_str().unwrap_or_default()));
        assert!(value["latency"].is_null());
    }

    #[test]
    fn a_file_that_was_named_and_is_wrong_has_its_own_exit_code() {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("scene.toml");
        let asked = DoctorArgs { scene: Some(scene.clone()), servo: Some(PathBuf::from("no/such.toml")), ..args() };
        let codes =
            || files(&asked).iter().map(|row| Report::new(vec![row.clone()], None).exit_code()).collect::<Vec<_>>();
        assert_eq!(codes(), [exit::NO_INPUT, exit::NO_INPUT]);
        std::fs::write(&scene, "name = 3").expect("own folder");
        assert_eq!(codes()[0], exit::BAD_DATA, "{:?}", files(&asked));
    }
}
