//! Signals as bytes in sockets, so that the supervisor waits for them and for its children in one `poll`.
//!
//! SIGINT is counted (the second means at once); SIGTERM and SIGHUP ask for an orderly end; SIGCHLD wakes.
//! SIGPIPE is ignored by the Rust runtime. Deliberately absent: reloading configuration on SIGHUP, which here
//! means that the terminal was closed.

use crate::error::ServerError;
use signal_hook::consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM};
use std::io::Read;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// One socket per kind of signal.
#[derive(Debug)]
pub struct Signals {
    /// A byte per SIGINT.
    pub interrupt: UnixStream,
    /// A byte per SIGTERM or SIGHUP.
    pub stop: UnixStream,
    /// A byte per SIGCHLD.
    pub child: UnixStream,
}

impl Signals {
    /// Takes the signals over from now on.
    ///
    /// # Errors
    /// [`ServerError::Internal`] when the kernel gives no socket.
    pub fn take_over() -> Result<Self, ServerError> {
        Ok(Self {
            interrupt: registered(&[SIGINT])?,
            stop: registered(&[SIGTERM, SIGHUP])?,
            child: registered(&[SIGCHLD])?,
        })
    }
}

fn registered(signals: &[i32]) -> Result<UnixStream, ServerError> {
    let fail =
        |e: std::io::Error| ServerError::Internal(format!("cannot watch signals: {e}; raise the limit of open files"));
    let (read, write) = UnixStream::pair().map_err(fail)?;
    read.set_nonblocking(true).map_err(fail)?;
    for signal in signals {
        signal_hook::low_level::pipe::register(*signal, write.try_clone().map_err(fail)?).map_err(fail)?;
    }
    Ok(read)
}

/// Bytes that wait in a signal's socket; they are taken out.
pub fn take_count(mut stream: &UnixStream) -> usize {
    let mut bytes = [0_u8; 64];
    // Nothing waits, or the socket is gone: no signal to count either way.
    stream.read(&mut bytes).unwrap_or_default()
}

/// A flag that SIGTERM and SIGINT raise; for the children, which end at the next look.
///
/// # Errors
/// [`ServerError::Internal`] when the kernel refuses.
pub fn stop_flag() -> Result<Arc<AtomicBool>, ServerError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        signal_hook::flag::register(signal, stop.clone())
            .map_err(|e| ServerError::Internal(format!("cannot watch signals: {e}; check the process limits")))?;
    }
    Ok(stop)
}
