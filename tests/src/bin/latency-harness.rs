//! `latency-harness TRACE…`: replays recorded hands through the live processes and grades the machine.

use std::process::ExitCode;

fn main() -> ExitCode {
    suture_tests::harness::main(std::env::args_os())
}
