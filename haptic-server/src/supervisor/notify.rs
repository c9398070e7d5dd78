//! What systemd is told: ready when the servo loop runs, alive while its tick counter moves, stopping at the end.
//!
//! One datagram each to the socket named by `$NOTIFY_SOCKET` (`sd_notify(3)`); without it nothing is sent. A sign of life goes out
//! on a heartbeat of the servo with new ticks, at most four times per `$WATCHDOG_USEC`: a loop that stands still is not reported as
//! alive. Only the supervisor speaks; a message that cannot be sent is dropped. Deliberately absent: status texts.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::Duration;

/// Signs of life per watchdog time; systemd asks for two.
const SIGNS: u32 = 4;

/// The line to systemd, if there is one.
#[derive(Debug, Default)]
pub struct Notify {
    socket: Option<UnixDatagram>,
    /// Shortest time between two signs of life; none without a watchdog.
    every: Option<Duration>,
    last_alive: Option<Duration>,
    ticks: u64,
}

impl Notify {
    /// The line that the environment names.
    #[must_use]
    pub fn of_process() -> Self {
        let variable = |name| std::env::var(name).ok();
        let for_us = variable("WATCHDOG_PID").is_none_or(|pid| pid == std::process::id().to_string());
        let watchdog = variable("WATCHDOG_USEC").filter(|_| for_us);
        variable("NOTIFY_SOCKET").map_or_else(Self::default, |socket| Self::to(&socket, watchdog.as_deref()))
    }

    /// A line to this socket (`@` begins an abstract name) with this watchdog time in microseconds.
    #[must_use]
    pub fn to(socket: &str, watchdog_us: Option<&str>) -> Self {
        let watchdog = watchdog_us.and_then(|text| text.parse().ok()).filter(|us| *us > 0).map(Duration::from_micros);
        Self { socket: connected(socket).ok(), every: watchdog.map(|w| w / SIGNS), last_alive: None, ticks: 0 }
    }

    /// The servo loop runs.
    pub fn ready(&self) {
        self.send("READY=1");
    }

    /// The servo has done so many ticks by `now`.
    pub fn alive(&mut self, now: Duration, ticks: u64) {
        let Some(every) = self.every else { return };
        let is_due = self.last_alive.is_none_or(|last| now >= last + every);
        if is_due && ticks != self.ticks {
            (self.last_alive, self.ticks) = (Some(now), ticks);
            self.send("WATCHDOG=1");
        }
    }

    /// The run ends.
    pub fn stopping(&self) {
        self.send("STOPPING=1");
    }

    fn send(&self, message: &str) {
        if let Some(socket) = &self.socket {
            // systemd that does not read is no reason to stop, let alone to wait.
            let _unsent = socket.send(message.as_bytes());
        }
    }
}

fn connected(name: &str) -> std::io::Result<UnixDatagram> {
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    match name.strip_prefix('@') {
        Some(name) => socket.connect_addr(&SocketAddr::from_abstract_name(name)?)?,
        None => socket.connect(name)?,
    }
    Ok(socket)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(socket: &UnixDatagram) -> Vec<String> {
        let mut buffer = [0_u8; 64];
        std::iter::from_fn(|| socket.recv(&mut buffer).ok().map(|n| String::from_utf8_lossy(&buffer[..n]).into_owned()))
            .collect()
    }

    #[test]
    fn systemd_hears_ready_life_of_moving_ticks_and_the_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("notify");
        let systemd = UnixDatagram::bind(&path).expect("a socket");
        systemd.set_nonblocking(true).expect("own socket");
        let mut notify = Notify::to(path.to_str().expect("a plain name"), Some("400000"));
        let ms = Duration::from_millis;
        notify.ready();
        notify.alive(ms(0), 10);
        notify.alive(ms(50), 60);
        notify.alive(ms(100), 60);
        notify.alive(ms(200), 60);
        notify.alive(ms(210), 60);
        assert_eq!(heard(&systemd), ["READY=1", "WATCHDOG=1", "WATCHDOG=1"], "every 100 ms, and only with new ticks");
        notify.stopping();
        assert_eq!(heard(&systemd), ["STOPPING=1"]);
        drop(systemd);
        notify.alive(ms(400), 400);
    }

    #[test]
    fn without_socket_or_watchdog_nothing_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("notify");
        let systemd = UnixDatagram::bind(&path).expect("a socket");
        systemd.set_nonblocking(true).expect("own socket");
        for watchdog in [None, Some("0"), Some("soon")] {
            let mut notify = Notify::to(path.to_str().expect("a plain name"), watchdog);
            notify.alive(Duration::from_secs(1), 1);
        }
        Notify::to("/no/such/socket", Some("1")).ready();
        Notify::default().stopping();
        assert!(heard(&systemd).is_empty());
    }
}
