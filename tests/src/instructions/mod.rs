//! Instructions per step, counted by callgrind: a figure that no busy machine disturbs.
//!
//! The program `count-steps` prepares a case, warms it up, and steps it inside `counted_steps`; callgrind collects in that
//! function only, so that a count is of steps and nothing else. A scene is stepped by sim-core (`full`) or by the same
//! source with every optional stage left out at compile time (`bare`): equal counts mean that an absent stage costs
//! nothing. valgrind shows a processor without AVX-512, so that the kernels take AVX2.
//! Deliberately absent: time (`Stopwatch` of the report), what a count should be (`tests/instructions`).

mod bare;
pub mod callgrind;
mod cases;
mod full;
mod proof;
mod solver_cases;
mod stages;
mod tick_cases;

pub use cases::{COARSE, Parts, SCENES, coarse, prepare};
pub use proof::{ABSENCE_TOLERANCE, Absence, absences};
pub use stages::{Stage, stages};

use sim_core::tissue::sweep::dispatch::KernelLevel;
use std::hint::black_box;
use std::process::ExitCode;

/// Name of the program that is counted.
pub const PROGRAM: &str = "count-steps";
/// Steps before the first one that counts.
const WARM_UP: u32 = 3;

/// A case, ready to be stepped.
pub type Step = Box<dyn FnMut()>;

/// What the program does: `--steps N CASE…`. Says the instruction set, then each case after its steps.
#[must_use]
pub fn main(arguments: impl Iterator<Item = String>) -> ExitCode {
    let arguments: Vec<String> = arguments.skip(1).collect();
    let [option, steps, cases @ ..] = &arguments[..] else { return usage() };
    let (Ok(steps), "--steps") = (steps.parse::<u32>(), option.as_str()) else { return usage() };
    println!("{}", KernelLevel::Best.taken());
    for case in cases {
        match prepare(case) {
            Ok(mut step) => {
                (0..WARM_UP).for_each(|_| step());
                counted_steps(&mut *step, steps);
                case_ends();
                println!("{case}");
            }
            Err(reason) => {
                eprintln!("{PROGRAM}: {case}: {reason}");
                return ExitCode::from(64);
            }
        }
    }
    ExitCode::SUCCESS
}

/// The function that is collected.
#[inline(never)]
fn counted_steps(step: &mut dyn FnMut(), steps: u32) {
    for _ in 0..black_box(steps) {
        step();
    }
}

/// The function before which a profile is written.
#[inline(never)]
fn case_ends() {
    black_box(());
}

fn usage() -> ExitCode {
    eprintln!("{PROGRAM}: give --steps N CASE…, a case such as coarse/skin/full/attachments+line or servo/silent");
    ExitCode::from(64)
}
