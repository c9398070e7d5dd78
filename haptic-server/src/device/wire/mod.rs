//! What devices on a wire have in common: packets in, packets out, one loop, one thread for the wire.
//!
//! | file | work |
//! |---|---|
//! | `pump` | the thread that reads, writes and opens again; the cells between it and the servo |
//! | `arm` | state, ramp and sample of an arm, whatever its packets |
//! | `watch` | silence, broken wire, garbage: what each means for the device |
//! | `notice` | what the user is told |
//!
//! A write to hidraw ends when the transfer has gone through (about one frame of the bus) or, with a device that hangs, after
//! seconds: the servo thread must not do it. So it takes the newest packet from a triple buffer and puts its own into
//! another one; [`drive`] is that loop, the same against a thread or, in tests, against a scripted peer.
//! Deliberately absent: what a packet means (`hid`, `firewire`).

pub mod arm;
pub mod notice;
pub mod pump;
pub mod watch;

use crate::device::notice::NoticeRing;
use crate::device::openhaptics::state::Latch;
use crate::device::{Device, DeviceLimits, DeviceSample, ServoRoom, TickTime};
use sim_core::vector::Vec3;
use std::sync::Arc;
use std::time::Duration;

/// Longest packet of any device here, bytes.
pub const LONGEST: usize = 65;

/// One packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    bytes: [u8; LONGEST],
    len: usize,
}

impl Packet {
    /// Of these bytes; what is longer than any packet is cut.
    #[must_use]
    pub fn new(from: &[u8]) -> Self {
        let len = from.len().min(LONGEST);
        let mut bytes = [0; LONGEST];
        bytes[..len].copy_from_slice(&from[..len]);
        Self { bytes, len }
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

/// Why a wire does not work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The device has left.
    #[error("the device is gone; check its cable and power")]
    Gone,
    /// The operating system refuses.
    #[error("the operating system refuses the device (error {0}); check its cable and the rights on its node")]
    Os(i32),
    /// Another device of the same kind has come in its place.
    #[error("another device than at the start is attached; plug in the first one, or start anew for this one")]
    Another,
    /// It takes fewer bytes than a packet has.
    #[error("the device takes {taken} of {sent} bytes; check its firmware")]
    Short {
        /// Bytes taken.
        taken: usize,
        /// Bytes sent.
        sent: usize,
    },
    /// The device answers, but not as it should.
    #[error("the device does not answer as it should ({0}); switch it off and on")]
    Answer(&'static str),
}

/// A wire as the pump sees it: the real one is hidraw or an isochronous channel, a test's is scripted.
pub trait WirePort {
    /// The next packet, at most `wait` from now; its length, 0 when there is none.
    ///
    /// # Errors
    /// The wire is broken.
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError>;

    /// Sends a packet.
    ///
    /// # Errors
    /// The wire is broken.
    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError>;
}

/// Opens the wire, again and again if it must be.
pub trait Opener: Send {
    /// What is opened.
    type Port: WirePort + Send;

    /// Opens it.
    ///
    /// # Errors
    /// It is not there or cannot be used.
    fn open(&mut self) -> Result<Self::Port, WireError>;
}

/// What has arrived since the last tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// Times that the wire has been opened again.
    pub generation: u32,
    /// Why it is broken now, if it is.
    pub broken: Option<WireError>,
    /// The newest packet since the last tick.
    pub newest: Option<Packet>,
    /// Sound packets since start.
    pub sound: u64,
    /// Packets refused since start.
    pub refused: u64,
}

/// The wire as the servo's loop sees it; never waits.
pub trait Link {
    /// What has arrived.
    fn take(&mut self) -> Arrival;
    /// What shall be sent.
    fn put(&mut self, packet: &Packet);
}

/// What a packet means, and what is sent.
pub trait WireDriver: Send {
    /// Whether bytes can be a packet of this device.
    fn is_sound(bytes: &[u8]) -> bool;
    /// The sample of this tick.
    fn sample(&mut self, time: TickTime, arrival: &Arrival, latch: Latch, ring: &NoticeRing) -> DeviceSample;
    /// The packet for a force in the scene's frame, newtons.
    fn packet(&mut self, force_n: Vec3) -> Packet;
    /// The packet without force.
    fn rest(&self) -> Packet;
}

/// The servo's loop over a wire. The last packet has no force.
pub fn drive<D: WireDriver>(driver: &mut D, link: &mut dyn Link, room: &mut dyn ServoRoom, ring: &NoticeRing) {
    while let Some(time) = room.wait() {
        turn(driver, link, room, ring, time);
    }
    link.put(&driver.rest());
}

/// One tick of [`drive`].
pub fn turn<D: WireDriver>(
    driver: &mut D,
    link: &mut dyn Link,
    room: &mut dyn ServoRoom,
    ring: &NoticeRing,
    time: TickTime,
) {
    let arrival = link.take();
    let latch = if room.is_latched() { Latch::Closed } else { Latch::Open };
    let sample = driver.sample(time, &arrival, latch, ring);
    let command = room.tick(time, &sample);
    link.put(&driver.packet(command.force_n));
}

/// A device on a wire.
pub struct WireDevice<D, O: Opener> {
    name: &'static str,
    limits: DeviceLimits,
    driver: D,
    opener: O,
    port: Option<O::Port>,
    ring: Arc<NoticeRing>,
}

impl<D: WireDriver, O: Opener> WireDevice<D, O> {
    /// The device behind an open port; `opener` opens it again when it is lost.
    pub fn new(name: &'static str, limits: DeviceLimits, driver: D, opener: O, port: O::Port) -> Self {
        let ring = Arc::new(NoticeRing::new(crate::device::notice::NOTICES));
        Self { name, limits, driver, opener, port: Some(port), ring }
    }
}

impl<D: WireDriver, O: Opener> Device for WireDevice<D, O> {
    fn name(&self) -> &str {
        self.name
    }

    fn limits(&self) -> DeviceLimits {
        self.limits
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        let Self { driver, opener, port, ring, .. } = self;
        let (mut link, ends) = pump::cells(driver.rest());
        let reader = pump::Pump { opener, port: port.take(), ends, ring, is_sound: D::is_sound };
        std::thread::scope(|scope| {
            let stop = link.stop_at_the_end();
            scope.spawn(move || reader.run());
            drive(driver, &mut link, room, ring);
            drop(stop);
        });
    }

    fn notices(&self) -> Option<Arc<NoticeRing>> {
        Some(self.ring.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_never_grows_past_its_room() {
        assert_eq!(Packet::new(&[1, 2, 3]).bytes(), &[1, 2, 3]);
        assert_eq!(Packet::new(&[7; 500]).bytes(), &[7; LONGEST]);
        assert!(Packet::new(&[]).bytes().is_empty());
    }
}
