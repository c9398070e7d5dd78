//! The real node: `/dev/fw*` with transactions, one context that receives and one that transmits.
//!
//! A file of the device can have one context, so the node opens it twice. Receiving: a ring of slots of 64 bytes in the shared
//! buffer; a slot is queued again as soon as it has been copied. Transmitting: a ring as well, one packet per call.
//! Transactions wait for their answer at most 200 ms; a bus reset gives a new generation and is followed.
//! Not tried against a real bus: the test machine has none. The talk and the driver above are tested against a fake node.

use super::event::{Event, LONGEST_EVENT, parse, payload_length};
use super::ioctl::{Cdev, ContextKind, Mapping};
use super::registers::PAYLOAD;
use super::session::{Direction, FireWireNode};
use crate::device::wire::{LONGEST, Packet, WireError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

/// Slots of either ring.
const SLOTS: usize = 128;
/// Bytes of a packet's header in an event.
const HEADER: u32 = 4;
/// Queue word: tell when this packet is through.
const INTERRUPT: u32 = 1 << 16;
/// Packets between two tellings of the transmitter.
const TELL_EVERY: usize = 32;
/// A transaction's answer is waited for so long.
const ANSWER: Duration = Duration::from_millis(200);
/// Transactions: write block, read quadlet, read block.
const WRITE_BLOCK: u32 = 1;
const READ_QUADLET: u32 = 4;
const READ_BLOCK: u32 = 5;
/// At S100 a quadlet takes 16 units of bandwidth; payload, header and checks, and the gap before a packet.
const BANDWIDTH: u32 = (PAYLOAD as u32 / 4 + 3) * 16 + 512;

fn os(error: Errno) -> WireError {
    match error {
        Errno::NODEV | Errno::NOENT | Errno::NXIO => WireError::Gone,
        other => WireError::Os(other.raw_os_error()),
    }
}

fn open(path: &Path) -> Result<Cdev, WireError> {
    rustix::fs::open(path, OFlags::RDWR | OFlags::CLOEXEC, Mode::empty()).map(Cdev::new).map_err(os)
}

struct Ring {
    handle: u32,
    buffer: Mapping,
    next: usize,
    is_started: bool,
}

/// An open node.
pub struct CdevNode {
    receiver: Cdev,
    transmitter: Cdev,
    generation: u32,
    inbound: Option<Ring>,
    outbound: Option<Ring>,
    reserved: Option<Option<u8>>,
    answer: Option<(u64, u32, Packet)>,
    packets: VecDeque<Packet>,
}

impl CdevNode {
    /// Opens a node by its path.
    ///
    /// # Errors
    /// It is gone, or the rights are missing.
    pub fn open(path: &Path) -> Result<Self, WireError> {
        let (receiver, transmitter) = (open(path)?, open(path)?);
        let generation = receiver.bus().map_err(os)?.generation;
        transmitter.bus().map_err(os)?;
        Ok(Self {
            receiver,
            transmitter,
            generation,
            inbound: None,
            outbound: None,
            reserved: None,
            answer: None,
            packets: VecDeque::with_capacity(SLOTS),
        })
    }

    /// Takes one event of the receiving file, at most `wait` from now; whether there was one.
    fn listen(&mut self, wait: Duration) -> Result<bool, WireError> {
        let mut buffer = [0; LONGEST_EVENT];
        let len = read_event(&self.receiver, &mut buffer, wait)?;
        match parse(&buffer[..len]) {
            Some(Event::BusReset(generation)) => self.generation = generation,
            Some(Event::Answer(address, result, data)) => self.answer = Some((address, result, Packet::new(data))),
            Some(Event::Reserved(channel)) => self.reserved = Some(channel),
            Some(Event::Packets(headers)) => self.collect(headers)?,
            Some(Event::Other) | None => {}
        }
        Ok(len > 0)
    }

    fn collect(&mut self, headers: &[u8]) -> Result<(), WireError> {
        let Some(ring) = &mut self.inbound else { return Ok(()) };
        for header in headers.chunks_exact(HEADER as usize) {
            let at = ring.next * PAYLOAD;
            let mut bytes = [0; PAYLOAD];
            ring.buffer.read(at, &mut bytes);
            // Full: the oldest goes, the newest counts.
            if self.packets.len() == SLOTS {
                self.packets.pop_front();
            }
            self.packets.push_back(Packet::new(&bytes[..payload_length(header).min(PAYLOAD)]));
            self.receiver.queue(ring.handle, &[receive_word()], &ring.buffer, at).map_err(os)?;
            ring.next = (ring.next + 1) % SLOTS;
        }
        Ok(())
    }

    /// A transaction with its answer.
    fn transact(&mut self, code: u32, address: u64, data: &[u8], length: u32) -> Result<Packet, WireError> {
        self.answer = None;
        self.receiver.request(code, address, data, length, self.generation).map_err(os)?;
        let until = Instant::now() + ANSWER;
        loop {
            match self.answer.take() {
                Some((of, 0, data)) if of == address => return Ok(data),
                Some((of, ..)) if of == address => return Err(WireError::Answer("a register refuses")),
                _ => {}
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(WireError::Answer("a register does not answer"));
            }
            self.listen(left)?;
        }
    }
}

/// Reads one event; 0 bytes when there is none within `wait`.
fn read_event(cdev: &Cdev, buffer: &mut [u8], wait: Duration) -> Result<usize, WireError> {
    let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(wait.min(ANSWER).subsec_nanos()) };
    let mut fds = [PollFd::new(cdev, PollFlags::IN)];
    match poll(&mut fds, Some(&wait)) {
        Ok(0) | Err(Errno::INTR) => return Ok(0),
        Ok(_) => {}
        Err(error) => return Err(os(error)),
    }
    if fds[0].revents().intersects(PollFlags::HUP | PollFlags::ERR) {
        return Err(WireError::Gone);
    }
    rustix::io::read(cdev, buffer).map_err(os)
}

fn receive_word() -> u32 {
    PAYLOAD as u32 | INTERRUPT | HEADER << 24
}

impl FireWireNode for CdevNode {
    fn read_quadlet(&mut self, address: u64) -> Result<u32, WireError> {
        let data = self.transact(READ_QUADLET, address, &[], 4)?;
        let quadlet = data.bytes().try_into().map_err(|_| WireError::Answer("a short quadlet"))?;
        Ok(u32::from_be_bytes(quadlet))
    }

    fn read_byte(&mut self, address: u64) -> Result<u8, WireError> {
        let data = self.transact(READ_BLOCK, address, &[], 1)?;
        data.bytes().first().copied().ok_or(WireError::Answer("an empty register"))
    }

    fn write_byte(&mut self, address: u64, value: u8) -> Result<(), WireError> {
        self.transact(WRITE_BLOCK, address, &[value], 1).map(|_| ())
    }

    fn open_channel(&mut self, direction: Direction) -> Result<u8, WireError> {
        self.reserved = None;
        self.receiver.reserve(BANDWIDTH).map_err(os)?;
        let until = Instant::now() + ANSWER;
        while self.reserved.is_none() && Instant::now() < until {
            self.listen(until.saturating_duration_since(Instant::now()))?;
        }
        let channel = self.reserved.take().flatten().ok_or(WireError::Answer("the bus has no channel left"))?;
        let kind = if direction == Direction::ToDevice { ContextKind::Transmit } else { ContextKind::Receive };
        let header = if direction == Direction::ToDevice { 0 } else { HEADER };
        let cdev = if direction == Direction::ToDevice { &self.transmitter } else { &self.receiver };
        let handle = cdev.context(kind, channel, header).map_err(os)?;
        let ring = Ring { handle, buffer: cdev.map(SLOTS * PAYLOAD).map_err(os)?, next: 0, is_started: false };
        if direction == Direction::ToDevice {
            self.outbound = Some(ring);
        } else {
            for slot in 0..SLOTS {
                cdev.queue(handle, &[receive_word()], &ring.buffer, slot * PAYLOAD).map_err(os)?;
            }
            cdev.start(handle).map_err(os)?;
            self.inbound = Some(ring);
        }
        Ok(channel)
    }

    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
        // What has queued up is taken before anybody waits.
        while self.listen(Duration::ZERO)? {}
        if self.packets.is_empty() && !wait.is_zero() {
            self.listen(wait)?;
        }
        let Some(packet) = self.packets.pop_front() else { return Ok(0) };
        let bytes = packet.bytes();
        buffer[..bytes.len()].copy_from_slice(bytes);
        Ok(bytes.len())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        let mut events = [0; LONGEST_EVENT];
        while read_event(&self.transmitter, &mut events, Duration::ZERO)? > 0 {}
        let ring = self.outbound.as_mut().ok_or(WireError::Answer("no channel is open"))?;
        let at = ring.next * PAYLOAD;
        ring.buffer.write(at, bytes);
        let told = if ring.next.is_multiple_of(TELL_EVERY) { INTERRUPT } else { 0 };
        let word = u32::try_from(bytes.len().min(PAYLOAD)).unwrap_or(0) | told;
        self.transmitter.queue(ring.handle, &[word], &ring.buffer, at).map_err(os)?;
        ring.next = (ring.next + 1) % SLOTS;
        if !ring.is_started {
            // With its first packet: a context without any would end at once.
            self.transmitter.start(ring.handle).map_err(os)?;
            ring.is_started = true;
        }
        Ok(())
    }
}

impl Drop for CdevNode {
    fn drop(&mut self) {
        for (cdev, ring) in [(&self.receiver, &self.inbound), (&self.transmitter, &self.outbound)] {
            if let Some(ring) = ring {
                // The kernel stops what is left when the file is closed.
                let _stopped = cdev.stop(ring.handle);
            }
        }
    }
}
