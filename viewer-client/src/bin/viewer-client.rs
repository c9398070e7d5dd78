//! `viewer-client`: looks at a running server; see the library.

fn main() -> std::process::ExitCode {
    viewer_client::app::main()
}
