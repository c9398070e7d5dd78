//! The command line of `haptic-server` and `deformation-solver`.
//!
//! Names and values here are a contract with other people's scripts: add, don't rename. A wrong
//! command line ends with exit code 64 (`EX_USAGE`), which is not clap's own code, so parsing goes
//! through [`parse`]. Deliberately absent: what the commands do (see `dispatch`).

pub mod choice;
pub mod dispatch;
pub(crate) mod files;
mod frames;
mod lockstep;
pub mod side_choice;
mod values;

use crate::exit;
use choice::{ControlChoice, DeviceChoice, HandChoice, HandSide, ProcedureChoice, SceneChoice};
use clap::{Args, Parser, Subcommand, ValueEnum};
use side_choice::SideChoice;
use std::path::PathBuf;
use values::{millimetres, picture_size, seconds, slow_down};

/// How a result is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// For a person.
    Text,
    /// One JSON document.
    Json,
}

impl From<bool> for Format {
    fn from(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }
}

/// Real-time haptic suture-surgery server.
#[derive(Debug, Parser)]
#[command(name = "haptic-server", version, arg_required_else_help = true)]
pub struct ServerCli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Subcommands of `haptic-server`.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Runs device, servo and tissue live until the work is done or Ctrl-C.
    Run(RunArgs),
    /// Runs the same code in one process against a virtual clock; bit-identical results.
    Lockstep(LockstepArgs),
    /// Converts a hand recording between CSV and MCAP.
    Convert {
        /// Recording to read (.csv or .mcap).
        input: PathBuf,
        /// File to write (.mcap or .csv).
        output: PathBuf,
    },
    /// Says what a recording, scene file or mesh holds.
    Inspect {
        /// File to look at.
        file: PathBuf,
        /// One JSON document on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Scene files.
    #[command(subcommand)]
    Scene(SceneCommand),
    /// Says whether this machine is ready, and what mends it.
    Doctor(DoctorArgs),
    /// Lists the devices that are attached, what drives them, what is missing.
    Devices {
        /// One JSON document on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Removes what killed servers left behind.
    Clean,
    /// Prints a completion script.
    Completions {
        /// The shell it is for.
        shell: clap_complete::Shell,
    },
    /// Measures the force scale of an Omni on FireWire with a spring scale, question by question.
    CalibrateForce {
        /// File to write; give it to `run` with --device-file.
        #[arg(long, value_name = "FILE.toml")]
        out: PathBuf,
    },
    /// Tells a running server what the session shall do.
    Session {
        /// The command.
        #[arg(value_enum)]
        action: SessionAction,
    },
    /// The servo process; started by `run`.
    #[command(hide = true)]
    Servo,
}

/// `scene …`.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Loads a scene file with its mesh and says what would be simulated.
    Check {
        /// Scene file.
        file: PathBuf,
        /// One JSON document on stdout.
        #[arg(long)]
        json: bool,
    },
}

/// `session …`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SessionAction {
    /// Begin the procedure anew: first scene, no stitches.
    Start,
    /// Reset the current scene to its start.
    Restore,
    /// Go to the next scene of the procedure.
    Next,
    /// Go to the previous scene of the procedure.
    Previous,
    /// Tie the stitch at work now.
    Tie,
    /// Suture control on.
    ControlOn,
    /// Suture control off.
    ControlOff,
    /// Suture control as printed in the paper.
    ControlPaper,
    /// Re-arm the servo after a fault.
    Rearm,
}

/// What is simulated.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// Scene: skin, liver, vessel or a scene file.
    #[arg(long, value_name = "SCENE", default_value = "skin", conflicts_with = "procedure")]
    pub scene: SceneChoice,
    /// Several scenes in a row.
    #[arg(long, value_enum)]
    pub procedure: Option<ProcedureChoice>,
    /// Supervision of the finished stitches; without it as the scene says.
    #[arg(long, value_enum)]
    pub control: Option<ControlChoice>,
    /// A press takes a suture point within this distance, millimetres; without it as the scene says, and wider for a
    /// recorded hand.
    #[arg(long, value_name = "MM", value_parser = millimetres)]
    pub capture_radius_mm: Option<f64>,
}

impl SceneArgs {
    /// Scene or procedure for reports.
    #[must_use]
    pub fn label(&self) -> String {
        self.procedure.map_or_else(|| self.scene.to_string(), |p| p.to_string())
    }
}

/// Capture radius for a recorded hand, millimetres. The hand cannot see the wound that it works on here: the grips of a
/// life-size hand spread over ±40 mm round the wound's middle, and none shall miss every point for want of reach.
pub const RECORDED_CAPTURE_RADIUS_MM: f64 = 60.0;

impl SceneArgs {
    /// The same scenes for a hand that repeats a recording.
    #[must_use]
    pub fn for_recorded_hand(&self) -> Self {
        Self { capture_radius_mm: self.capture_radius_mm.or(Some(RECORDED_CAPTURE_RADIUS_MM)), ..self.clone() }
    }
}

/// Who moves the stylus.
#[derive(Clone, Debug, Args)]
pub struct HandArgs {
    /// Hand that moves the stylus: synthetic, or a recording (CSV or MCAP).
    #[arg(long, value_name = "synthetic|FILE", default_value = "synthetic")]
    pub hand: HandChoice,
    /// Which hand of a two-handed recording holds the needle.
    #[arg(long, value_enum, default_value = "right")]
    pub hand_side: HandSide,
}

/// `run …`.
#[derive(Clone, Debug, Args)]
pub struct RunArgs {
    /// What is simulated.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Device: simulated, replay:FILE, pointer (the mouse of a viewer), openhaptics[:NAME], hid[:PATH], firewire.
    #[arg(long, value_name = "DEVICE", default_value = "simulated")]
    pub device: DeviceChoice,
    /// The OpenHaptics library, if it is not where the vendor's installer puts it.
    #[arg(long, value_name = "FILE")]
    pub openhaptics_library: Option<PathBuf>,
    /// What the rig knows of its device: the build of a HID arm, or the force scale of an Omni on FireWire.
    #[arg(long, value_name = "FILE.toml")]
    pub device_file: Option<PathBuf>,
    /// Beside the device: pedal[:PATH] (force only while it is down) or space-mouse[:PATH]; may be given twice.
    #[arg(long, value_name = "INPUT")]
    pub side_input: Vec<SideChoice>,
    /// Who moves the stylus.
    #[command(flatten)]
    pub hand: HandArgs,
    /// Start a viewer.
    #[arg(long)]
    pub viewer: bool,
    /// Record to an MCAP file.
    #[arg(long, value_name = "FILE.mcap")]
    pub record: Option<PathBuf>,
    /// End after this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub duration: Option<f64>,
    /// Drive a real device even without real-time rights.
    #[arg(long)]
    pub allow_no_rt: bool,
    /// Servo constants: a TOML file with the tables coupling, safety, ladder, sample, rhythm.
    #[arg(long, value_name = "FILE.toml")]
    pub servo: Option<PathBuf>,
    /// Print one JSON document on stdout and nothing else.
    #[arg(long)]
    pub json: bool,
}

impl RunArgs {
    /// The recording that moves the stylus, if one does.
    #[must_use]
    pub fn recording(&self) -> Option<&std::path::Path> {
        match (&self.device, &self.hand.hand) {
            (DeviceChoice::Replay(path), _) => Some(path),
            (DeviceChoice::Simulated, HandChoice::File(path)) => Some(path),
            _ => None,
        }
    }
}

/// `lockstep …`.
#[derive(Clone, Debug, Args)]
pub struct LockstepArgs {
    /// What is simulated.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Who moves the stylus.
    #[command(flatten)]
    pub hand: HandArgs,
    /// Simulated seconds; without it until the hand has finished.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub duration: Option<f64>,
    /// Folder for ticks.csv, ledger.csv, radar.svg, force.svg, summary.json.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Record to an MCAP file, as `run` does.
    #[arg(long, value_name = "FILE.mcap")]
    pub record: Option<PathBuf>,
    /// Folder for pictures of the run, drawn by the viewer beside this program.
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
    /// Pictures per simulated second.
    #[arg(long, value_name = "N", default_value = "25", requires = "frames", value_parser = clap::value_parser!(u32).range(1..=240))]
    pub fps: u32,
    /// Size of the pictures; without it the viewer's own.
    #[arg(long, value_name = "WxH", requires = "frames", value_parser = picture_size)]
    pub size: Option<String>,
    /// Servo constants: a TOML file with the tables coupling, safety, ladder, sample, rhythm.
    #[arg(long, value_name = "FILE.toml")]
    pub servo: Option<PathBuf>,
    /// Print one JSON document on stdout and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// `doctor …`.
#[derive(Clone, Debug, Args)]
pub struct DoctorArgs {
    /// Print one JSON document on stdout and nothing else.
    #[arg(long)]
    pub json: bool,
    /// Measure a timer at 1 kHz for this long and grade the machine.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub latency: Option<f64>,
    /// Keep every processor busy meanwhile.
    #[arg(long, requires = "latency")]
    pub load: bool,
    /// The OpenHaptics library, if it is not where the vendor's installer puts it.
    #[arg(long, value_name = "FILE")]
    pub openhaptics_library: Option<PathBuf>,
    /// A scene file to check.
    #[arg(long, value_name = "FILE.toml")]
    pub scene: Option<PathBuf>,
    /// A file of servo constants to check.
    #[arg(long, value_name = "FILE.toml")]
    pub servo: Option<PathBuf>,
}

/// The tissue process of the suture-surgery server.
#[derive(Debug, Parser)]
#[command(name = "deformation-solver", version)]
pub struct SolverCli {
    /// What is simulated.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Run directory of the server; without it the one of the running server.
    #[arg(long, value_name = "DIR")]
    pub run_dir: Option<PathBuf>,
    /// Solver period, seconds; without it the scene's own.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub period: Option<f64>,
    /// Every step takes this many periods (fault tests).
    #[arg(long, value_name = "FACTOR", value_parser = slow_down, default_value = "1", hide = true)]
    pub slow_down: f64,
    /// Follow a solver that died: standard input says where the session stood (JSON).
    #[arg(long, hide = true)]
    pub resume: bool,
    /// Process id of the server that started this one; it ends with that process.
    #[arg(long, value_name = "PID", hide = true)]
    pub guarded_by: Option<u32>,
}

/// Parses the command line; on failure (or for `--help`) prints and gives the exit code.
///
/// # Errors
/// The exit code to end with: 0 after help or version, 64 after a wrong command line.
pub fn parse<C: Parser>(arguments: impl IntoIterator<Item = std::ffi::OsString>) -> Result<C, u8> {
    C::try_parse_from(arguments).map_err(|error| {
        // Nothing can be done when even the message cannot be written.
        let _ = error.print();
        if error.use_stderr() { exit::USAGE } else { exit::OK }
    })
}

#[cfg(test)]
mod tests;
