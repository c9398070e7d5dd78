//! The thread of a wire: reads, keeps the newest sound packet, writes what the servo wants, opens again what was lost.
//!
//! One round: wait at most 2 ms for a packet, take all that have queued up, hand the newest over, send the servo's newest.
//! The first packet sent has no force (it starts the stream of some devices), and so have the last, in whatever way the servo
//! ends, and the one that is sent when the servo has put nothing for 20 ms. The thread is made by the servo thread and inherits
//! its scheduling. Cells are triple buffers: neither side ever waits for the other.
//! After a loss the wire is opened again with pauses of 0.5 s, doubled up to 8 s.

use super::notice::WireNotice;
use super::{Arrival, LONGEST, Link, Opener, Packet, WireError, WirePort};
use crate::device::notice::NoticeRing;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use triple_buffer::{Input, Output, triple_buffer};

/// Longest wait for a packet.
const WAIT: Duration = Duration::from_millis(2);
/// The servo puts a packet each millisecond: after so long without a new one the force goes off.
const STALE: Duration = Duration::from_millis(20);
/// Packets taken in one go: a device that never stops talking must not keep the thread.
const MOST_AT_ONCE: u32 = 128;
/// How often the thread looks while the device is gone.
const LOOK: Duration = Duration::from_millis(2);
/// First pause before the device is opened again.
const FIRST_PAUSE: Duration = Duration::from_millis(500);
/// Longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(8);

/// The newest packet and what is known of the wire.
#[derive(Clone, Copy, Debug)]
struct Inbound {
    packet: Packet,
    sound: u64,
    refused: u64,
    generation: u32,
    broken: Option<WireError>,
}

/// The servo's end.
pub struct CellLink {
    inbound: Output<Inbound>,
    outbound: Input<Packet>,
    seen: u64,
    stop: Arc<AtomicBool>,
}

/// The thread's end.
pub struct PumpEnds {
    inbound: Input<Inbound>,
    outbound: Output<Packet>,
    rest: Packet,
    state: Inbound,
    stop: Arc<AtomicBool>,
}

/// Tells the pump to send the last packet and to end.
pub struct StopAtTheEnd(Arc<AtomicBool>);

impl Drop for StopAtTheEnd {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// Both ends of the cells; `rest` is sent first and last, and while the servo puts nothing.
#[must_use]
pub fn cells(rest: Packet) -> (CellLink, PumpEnds) {
    let state = Inbound { packet: Packet::new(&[]), sound: 0, refused: 0, generation: 0, broken: None };
    let (inbound_in, inbound_out) = triple_buffer(&state);
    let (outbound_in, outbound_out) = triple_buffer(&rest);
    let stop = Arc::new(AtomicBool::new(false));
    let link = CellLink { inbound: inbound_out, outbound: outbound_in, seen: 0, stop: stop.clone() };
    (link, PumpEnds { inbound: inbound_in, outbound: outbound_out, rest, state, stop })
}

impl CellLink {
    /// Ends the pump when it is dropped, in whatever way the loop ends.
    #[must_use]
    pub fn stop_at_the_end(&self) -> StopAtTheEnd {
        StopAtTheEnd(self.stop.clone())
    }
}

impl Link for CellLink {
    fn take(&mut self) -> Arrival {
        let inbound = *self.inbound.read();
        let is_new = inbound.sound != self.seen;
        self.seen = inbound.sound;
        Arrival {
            generation: inbound.generation,
            broken: inbound.broken,
            newest: is_new.then_some(inbound.packet),
            sound: inbound.sound,
            refused: inbound.refused,
        }
    }

    fn put(&mut self, packet: &Packet) {
        self.outbound.write(*packet);
    }
}

/// What one look at the wire has brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// The newest sound packet.
    pub newest: Option<Packet>,
    /// Sound packets.
    pub sound: u64,
    /// Packets that were none.
    pub refused: u64,
}

/// Takes all packets that have queued up, after waiting for the first one at most `wait`.
///
/// # Errors
/// The wire is broken.
pub fn drain(port: &mut dyn WirePort, is_sound: fn(&[u8]) -> bool, wait: Duration) -> Result<Drained, WireError> {
    let mut drained = Drained::default();
    let mut wait = wait;
    for _ in 0..MOST_AT_ONCE {
        let mut buffer = [0; LONGEST];
        let len = port.receive(&mut buffer, wait)?.min(LONGEST);
        wait = Duration::ZERO;
        match &buffer[..len] {
            [] => break,
            bytes if is_sound(bytes) => {
                drained.newest = Some(Packet::new(bytes));
                drained.sound += 1;
            }
            _ => drained.refused += 1,
        }
    }
    Ok(drained)
}

/// The thread's work.
pub struct Pump<'a, O: Opener> {
    /// Opens the wire again.
    pub opener: &'a mut O,
    /// The wire, if it is open.
    pub port: Option<O::Port>,
    /// Cells.
    pub ends: PumpEnds,
    /// For what the user is told.
    pub ring: &'a NoticeRing,
    /// Which bytes can be a packet.
    pub is_sound: fn(&[u8]) -> bool,
}

impl<O: Opener> Pump<'_, O> {
    /// Until the servo's end is dropped.
    pub fn run(mut self) {
        let mut port = self.port.take();
        while !self.is_stopped() {
            if let Some(open) = &mut port
                && let Err(error) = self.serve(open)
            {
                self.tell(|state| state.broken = Some(error));
            }
            if self.is_stopped() {
                break;
            }
            // Closed before it is opened again.
            drop(port.take());
            port = self.reopen();
        }
    }

    fn is_stopped(&self) -> bool {
        self.ends.stop.load(Ordering::Acquire)
    }

    fn tell(&mut self, change: impl FnOnce(&mut Inbound)) {
        change(&mut self.ends.state);
        self.ends.inbound.write(self.ends.state);
    }

    /// Works until the wire breaks or the servo ends; then the packet without force has been sent.
    fn serve(&mut self, port: &mut O::Port) -> Result<(), WireError> {
        // Nobody knows how old a packet is that was put while the wire was broken.
        let _left_over = self.ends.outbound.update();
        port.send(self.ends.rest.bytes())?;
        let mut put = None;
        while !self.is_stopped() {
            let drained = drain(port, self.is_sound, WAIT)?;
            if drained != Drained::default() {
                self.tell(|state| {
                    state.refused += drained.refused;
                    if let Some(packet) = drained.newest {
                        (state.packet, state.sound) = (packet, state.sound + drained.sound);
                    }
                });
            }
            if self.ends.outbound.update() {
                port.send(self.ends.outbound.output_buffer().bytes())?;
                put = Some(Instant::now());
            } else if put.is_some_and(|at: Instant| at.elapsed() >= STALE) {
                port.send(self.ends.rest.bytes())?;
                put = None;
            }
        }
        port.send(self.ends.rest.bytes())
    }

    /// Opens it again, with growing pauses; `None` when the servo ends before.
    fn reopen(&mut self) -> Option<O::Port> {
        let mut pause = FIRST_PAUSE;
        loop {
            let mut waited = Duration::ZERO;
            while waited < pause {
                if self.is_stopped() {
                    return None;
                }
                std::thread::sleep(LOOK);
                waited += LOOK;
            }
            match self.opener.open() {
                Ok(port) => {
                    self.tell(|state| (state.generation, state.broken) = (state.generation + 1, None));
                    WireNotice::Reopened.tell(self.ring);
                    return Some(port);
                }
                Err(error) => WireNotice::NotReopened(error).tell(self.ring),
            }
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
    use std::sync::{Mutex, PoisonError};

    const REST: u8 = 0;

    /// What was sent, a byte each.
    #[derive(Clone, Default)]
    struct Port(Arc<Mutex<Vec<u8>>>);

    impl Port {
        fn sent(&self) -> Vec<u8> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
        }

        /// Patience with a loaded machine, not a measurement.
        fn until(&self, is_so: impl Fn(&[u8]) -> bool) {
            for _ in 0..60_000 {
                if is_so(&self.sent()) {
                    return;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
            panic!("the thread of the wire has sent {:?}", self.sent());
        }
    }

    impl WirePort for Port {
        fn receive(&mut self, _buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
            std::thread::sleep(wait);
            Ok(0)
        }

        fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(bytes);
            Ok(())
        }
    }

    impl Opener for Port {
        type Port = Self;

        fn open(&mut self) -> Result<Self, WireError> {
            Err(WireError::Gone)
        }
    }

    /// Runs the thread while `servo` works on the other end.
    fn beside(port: &Port, servo: impl FnOnce(&mut CellLink)) {
        let (mut link, ends) = cells(Packet::new(&[REST]));
        let (mut opener, ring) = (port.clone(), NoticeRing::new(4));
        let pump = Pump { opener: &mut opener, port: Some(port.clone()), ends, ring: &ring, is_sound: |_| true };
        std::thread::scope(|scope| {
            let stop = link.stop_at_the_end();
            scope.spawn(move || pump.run());
            port.until(|sent| sent == [REST]);
            servo(&mut link);
            drop(stop);
        });
    }

    #[test]
    fn a_servo_that_puts_nothing_more_leaves_no_force() {
        let port = Port::default();
        beside(&port, |link| {
            link.put(&Packet::new(&[7]));
            port.until(|sent| sent == [REST, 7, REST]);
            link.put(&Packet::new(&[8]));
            port.until(|sent| sent.starts_with(&[REST, 7, REST, 8]));
        });
    }

    #[test]
    fn after_a_panic_of_the_servo_the_last_packet_has_no_force() {
        let port = Port::default();
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            beside(&port, |link| {
                link.put(&Packet::new(&[7]));
                port.until(|sent| sent.contains(&7));
                link.put(&Packet::new(&[9]));
                resume_unwind(Box::new("the servo"));
            });
        }));
        assert!(outcome.is_err());
        assert_eq!(port.sent().last(), Some(&REST), "{:?}", port.sent());
    }
}
