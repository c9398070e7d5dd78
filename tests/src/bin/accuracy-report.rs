//! `accuracy-report`: error against run time, stability, extreme cases and validation in one document.

use std::process::ExitCode;

fn main() -> ExitCode {
    suture_tests::accuracy::main(std::env::args_os())
}
