//! `count-steps --steps N CASE…`: steps cases one after the other, so that a profiler can count the steps alone.

use std::process::ExitCode;

fn main() -> ExitCode {
    suture_tests::instructions::main(std::env::args())
}
