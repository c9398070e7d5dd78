//! An open HID arm that does not exist: its reports, its motors, its watchdog.
//!
//! A report per millisecond; the amplifiers are off 0.5 s after the last report from the host. The hand is the test.

use crate::wire_rig::Peer;
use haptic_server::device::hid::arm::FIRMWARE_WATCHDOG_S;
use haptic_server::device::hid::arm_kinematics::{ArmConfig, ArmParams};
use haptic_server::device::wire::{LONGEST, WireError, WirePort};
use std::collections::VecDeque;
use std::time::Duration;

/// What a report becomes on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trouble {
    None,
    /// Not one arrives.
    Silent,
    /// It has another length.
    Garbage,
    /// The encoders are elsewhere by so many counts.
    Jump(i16),
    /// The next read fails.
    Unplugged,
    /// The next write fails.
    WriteFails,
    /// The firmware does not know the command that sets the encoders.
    Deaf,
}

pub(crate) struct ArmPeer {
    pub(crate) counts: [i16; 3],
    pub(crate) info: i16,
    pub(crate) trouble: Trouble,
    pub(crate) writes: u32,
    queue: VecDeque<Vec<u8>>,
    currents: [i16; 3],
    since_write_ms: u32,
    params: ArmParams,
}

impl ArmPeer {
    pub(crate) fn new(counts: [i16; 3]) -> Self {
        Self {
            counts,
            info: 0,
            trouble: Trouble::None,
            writes: 0,
            queue: VecDeque::new(),
            currents: [0; 3],
            since_write_ms: u32::MAX,
            params: ArmParams::new(&ArmConfig::default()).expect("the published build"),
        }
    }

    fn amplifiers_are_on(&self) -> bool {
        f64::from(self.since_write_ms) * 1e-3 < FIRMWARE_WATCHDOG_S
    }

    pub(crate) fn force(&self) -> [f64; 3] {
        let currents = if self.amplifiers_are_on() { self.currents } else { [0; 3] };
        if currents == [0; 3] {
            return [0.0; 3];
        }
        let force = self.params.force(self.params.joints(self.counts), currents);
        force.expect("the test stays away from singular poses").into()
    }
}

impl Peer for ArmPeer {
    fn pass(&mut self) {
        self.since_write_ms = self.since_write_ms.saturating_add(1);
        let [a, b, c] = self.counts;
        let jump = if let Trouble::Jump(by) = self.trouble { by } else { 0 };
        let numbers = [a, b, c.wrapping_add(jump), 0, 0, 0, self.info];
        let mut bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        bytes.resize(64, 0);
        match self.trouble {
            Trouble::Silent => return,
            Trouble::Garbage => bytes.truncate(17),
            _ => {}
        }
        self.queue.push_back(bytes);
    }

    fn arrived_n(&self) -> f64 {
        self.force().iter().map(|f| f * f).sum::<f64>().sqrt()
    }
}

impl WirePort for ArmPeer {
    fn receive(&mut self, buffer: &mut [u8; LONGEST], _wait: Duration) -> Result<usize, WireError> {
        if self.trouble == Trouble::Unplugged {
            return Err(WireError::Gone);
        }
        let Some(bytes) = self.queue.pop_front() else { return Ok(0) };
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok(bytes.len())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        if self.trouble == Trouble::WriteFails {
            return Err(WireError::Short { taken: 0, sent: bytes.len() });
        }
        assert_eq!((bytes.len(), bytes[0]), (65, 0), "a report of 64 bytes behind its number");
        let number = |i: usize| i16::from_le_bytes([bytes[1 + 2 * i], bytes[2 + 2 * i]]);
        self.writes += 1;
        self.since_write_ms = 0;
        self.currents = [number(0), number(1), number(2)];
        if number(3) == 1 {
            self.currents = [0; 3];
            if self.trouble != Trouble::Deaf {
                self.counts = [number(4), number(5), number(6)];
            }
        }
        Ok(())
    }
}
