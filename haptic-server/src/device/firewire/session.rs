//! The talk with an Omni on the bus: is it one, is it well, which channels; then packets; at the end they are stopped.
//!
//! Order: maker → signs of health → sign of life (a value written and read back) → serial number → two channels → channel
//! numbers into the registers → packets flow. Every step that fails says which. The bus's node is behind [`FireWireNode`]: the
//! real one is a `/dev/fw*` (`node.rs`), a test's speaks the same registers.
//! Deliberately absent: what a packet means (`packet.rs`).

use super::registers;
use crate::device::wire::{LONGEST, WireError, WirePort};
use std::time::Duration;

/// Direction of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// We talk.
    ToDevice,
    /// We listen.
    FromDevice,
}

/// A node of the bus.
pub trait FireWireNode: Send {
    /// A quadlet of its address space, as a number.
    ///
    /// # Errors
    /// The node does not answer.
    fn read_quadlet(&mut self, address: u64) -> Result<u32, WireError>;
    /// A byte of it.
    ///
    /// # Errors
    /// The node does not answer.
    fn read_byte(&mut self, address: u64) -> Result<u8, WireError>;
    /// Writes a byte.
    ///
    /// # Errors
    /// The node does not answer.
    fn write_byte(&mut self, address: u64, value: u8) -> Result<(), WireError>;
    /// Reserves a channel for packets of [`registers::PAYLOAD`] bytes and makes it ready.
    ///
    /// # Errors
    /// The bus has none left.
    fn open_channel(&mut self, direction: Direction) -> Result<u8, WireError>;
    /// The next packet of the device; its length, 0 when there is none within `wait`.
    ///
    /// # Errors
    /// The node or the bus is gone.
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError>;
    /// Sends a packet to the device.
    ///
    /// # Errors
    /// The node or the bus is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError>;
}

/// An Omni whose packets flow.
pub struct Session<N: FireWireNode> {
    node: N,
    serial: String,
}

impl<N: FireWireNode> Session<N> {
    /// Starts the talk; `rest` is sent before anything flows back.
    ///
    /// # Errors
    /// Which step failed.
    pub fn open(mut node: N, rest: &[u8]) -> Result<Self, WireError> {
        if !registers::is_maker(node.read_quadlet(registers::MAKER)?) {
            return Err(WireError::Answer("another maker"));
        }
        for (address, sign) in registers::SIGNS {
            if node.read_byte(address)? != sign {
                return Err(WireError::Answer("its health registers are wrong"));
            }
        }
        node.write_byte(registers::CHANNEL_FROM_DEVICE, registers::ALIVE)?;
        if node.read_byte(registers::CHANNEL_FROM_DEVICE)? != registers::ALIVE {
            return Err(WireError::Answer("it does not keep what is written"));
        }
        let serial = registers::serial_number(node.read_quadlet(registers::SERIAL)?);
        let serial = serial.ok_or(WireError::Answer("its serial number is none"))?;
        let mut session = Self { node, serial };
        // What flowed for a program that was killed.
        session.node.write_byte(registers::CONTROL, 0)?;
        for (direction, register) in [
            (Direction::ToDevice, registers::CHANNEL_TO_DEVICE),
            (Direction::FromDevice, registers::CHANNEL_FROM_DEVICE),
        ] {
            let channel = session.node.open_channel(direction)?;
            if channel >= registers::CHANNELS {
                return Err(WireError::Answer("the bus gave no channel"));
            }
            session.node.write_byte(register, channel)?;
        }
        session.node.send(rest)?;
        session.node.write_byte(registers::CONTROL, registers::CONTROL_RUN)?;
        Ok(session)
    }

    /// The serial number as it is printed on the device.
    #[must_use]
    pub fn serial(&self) -> &str {
        &self.serial
    }
}

impl<N: FireWireNode> Drop for Session<N> {
    fn drop(&mut self) {
        // A device that is gone needs no stop.
        let _ = self.node.write_byte(registers::CONTROL, 0);
    }
}

impl<N: FireWireNode> WirePort for Session<N> {
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
        self.node.receive(buffer, wait)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        self.node.send(bytes)
    }
}
