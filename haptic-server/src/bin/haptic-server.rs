//! `haptic-server`: supervisor, servo process, lockstep and tools; see the library.

fn main() -> std::process::ExitCode {
    haptic_server::cli::dispatch::haptic_server()
}
