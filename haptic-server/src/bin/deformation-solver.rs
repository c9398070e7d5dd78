//! `deformation-solver`: the tissue process; see the library.

fn main() -> std::process::ExitCode {
    haptic_server::cli::dispatch::deformation_solver()
}
