//! The thread of a wire: reads, keeps the newest sound packet, writes what the servo wants, opens again what was lost.
//!
//! One round: wait at most 2 ms for a packet, take all that have queued up, hand the newest over, send the servo's newest.
//! The first packet sent has no force (it starts the stream of some devices), and so has the last. The thread is made by
//! the servo thread and inherits its scheduling. Cells are triple buffers: neither side ever waits for the other.
//! After a loss the wire is opened again with pauses of 0.5 s, doubled up to 8 s.

use super::notice::WireNotice;
use super::{Arrival, LONGEST, Link, Opener, Packet, WireError, WirePort};
use crate::device::notice::NoticeRing;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use triple_buffer::{Input, Output, triple_buffer};

/// Longest wait for a packet.
const WAIT: Duration = Duration::from_millis(2);
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

/// Both ends of the cells; `rest` is sent first.
#[must_use]
pub fn cells(rest: Packet) -> (CellLink, PumpEnds) {
    let state = Inbound { packet: Packet::new(&[]), sound: 0, refused: 0, generation: 0, broken: None };
    let (inbound_in, inbound_out) = triple_buffer(&state);
    let (outbound_in, outbound_out) = triple_buffer(&rest);
    let stop = Arc::new(AtomicBool::new(false));
    let link = CellLink { inbound: inbound_out, outbound: outbound_in, seen: 0, stop: stop.clone() };
    (link, PumpEnds { inbound: inbound_in, outbound: outbound_out, state, stop })
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

    /// Works until the wire breaks or the servo ends; then the newest packet (the one without force) has been sent.
    fn serve(&mut self, port: &mut O::Port) -> Result<(), WireError> {
        port.send(self.ends.outbound.read().bytes())?;
        loop {
            let is_last = self.is_stopped();
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
            }
            if is_last {
                return Ok(());
            }
        }
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
