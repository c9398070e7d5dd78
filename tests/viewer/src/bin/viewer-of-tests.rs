//! The viewer as a program of this package: cargo builds it with the tests that open its window, with the same graphics crates.

fn main() -> std::process::ExitCode {
    viewer_client::app::main()
}
