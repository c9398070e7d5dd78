//! Log lines on stderr that never block their writer.
//!
//! Lines go through a bounded queue to a thread that writes them; when stderr is not read, lines are dropped
//! and counted, and the count is written when there is room again. `RUST_LOG` chooses what is shown
//! (default: warnings), `NO_COLOR` is honoured, and colour appears on a terminal only.

use crossbeam::channel::{Receiver, Sender, bounded};
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

/// Lines that wait at most.
const QUEUE: usize = 256;

#[derive(Clone)]
struct LineSender {
    queue: Sender<Vec<u8>>,
    dropped: Arc<AtomicU64>,
}

impl Write for LineSender {
    fn write(&mut self, line: &[u8]) -> std::io::Result<usize> {
        if self.queue.try_send(line.to_vec()).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for LineSender {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

/// Installs the log of this process; a second call changes nothing.
pub fn install() {
    let (queue, lines) = bounded(QUEUE);
    let dropped = Arc::new(AtomicU64::new(0));
    let sender = LineSender { queue, dropped: dropped.clone() };
    let spawned = std::thread::Builder::new().name("log".to_owned()).spawn(move || write_lines(&lines, &dropped));
    if spawned.is_err() {
        return;
    }
    let colour = std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty()) && std::io::stderr().is_terminal();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    // An error means that a log is installed already.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(sender)
        .with_ansi(colour)
        .with_target(false)
        .without_time()
        .try_init();
}

fn write_lines(lines: &Receiver<Vec<u8>>, dropped: &AtomicU64) {
    let mut stderr = std::io::stderr();
    for line in lines {
        // A log that cannot be written has nowhere to complain.
        let _ = stderr.write_all(&line);
        let lost = dropped.swap(0, Ordering::Relaxed);
        if lost > 0 {
            let _ = writeln!(stderr, "{lost} log lines were dropped because stderr was not read");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_queue_drops_and_counts_instead_of_blocking() {
        let (queue, lines) = bounded(2);
        let mut sender = LineSender { queue, dropped: Arc::new(AtomicU64::new(0)) };
        for _ in 0..5 {
            assert_eq!(sender.write(b"line").expect("never fails"), 4);
        }
        assert_eq!(sender.dropped.load(Ordering::Relaxed), 3);
        assert_eq!(lines.len(), 2);
    }
}
