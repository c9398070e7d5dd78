//! An Omni on FireWire that does not exist: its registers, its two channels, its packets.
//!
//! A packet per millisecond while the control register says so. The hand is the test: it sets joints, gimbals, buttons and
//! dock. What the motors get is read back as counts; the scale that makes a torque of them is the test's own.

use crate::wire_rig::Peer;
use haptic_server::device::encoder::STEP_RAD;
use haptic_server::device::firewire::arm::DOCK_RAD;
use haptic_server::device::firewire::packet::{Motors, OmniPacket, motors_of};
use haptic_server::device::firewire::session::{Direction, FireWireNode, Session};
use haptic_server::device::omni;
use haptic_server::device::wire::{LONGEST, WireError, WirePort};
use sim_core::vector::Vec3;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Serial number quadlet of "51231700321".
pub(crate) const SERIAL: u32 = 0x8000_0001 | 5 << 23 | 12 << 19 | 31 << 14 | 7 << 11 | 321 << 1;
/// Newton metres per count of the device's motors.
pub(crate) const TRUE_SCALE: [f64; 3] = [2e-4, -1e-4, 1e-4];
/// What the encoders show in the dock: just below their wrap.
const DOCK_COUNTS: [u16; 3] = [65_530, 12, 32_767];

/// What becomes of packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trouble {
    None,
    /// Not one arrives.
    Silent,
    /// Every second one is lost.
    HalfLost,
    /// Every second one arrives two milliseconds late, behind the one after it.
    Swapped,
    /// The same one again and again.
    Repeated,
    /// A bit of the head is wrong.
    Garbage,
    /// The encoders are elsewhere.
    Jump,
    /// Every access fails.
    Unplugged,
}

pub(crate) struct Omni {
    pub(crate) registers: BTreeMap<u64, u8>,
    pub(crate) quadlets: BTreeMap<u64, u32>,
    pub(crate) keeps_writes: bool,
    pub(crate) free_channels: Vec<u8>,
    pub(crate) joints: Vec3,
    pub(crate) shares: [f64; 3],
    pub(crate) buttons: u32,
    pub(crate) is_docked: bool,
    pub(crate) trouble: Trouble,
    pub(crate) motors: Motors,
    pub(crate) sent: u32,
    queue: VecDeque<Vec<u8>>,
    counter: u8,
    held_back: Option<Vec<u8>>,
}

impl Omni {
    fn packet(&mut self) -> OmniPacket {
        let dock = Vec3::from(DOCK_RAD);
        let encoders = std::array::from_fn(|i| {
            let counts = ((self.joints[i] - dock[i]) / STEP_RAD[i]).round() as i16;
            DOCK_COUNTS[i].wrapping_add_signed(counts + if self.trouble == Trouble::Jump { 500 } else { 0 })
        });
        let gimbal = self.shares.map(|x| {
            let a = (x * 60_000.0) as u16;
            (a, 60_000 - a)
        });
        if self.trouble != Trouble::Repeated {
            self.counter = self.counter.wrapping_add(1);
        }
        OmniPacket { encoders, gimbal, counter: self.counter, buttons: self.buttons, is_docked: self.is_docked }
    }

    fn pass(&mut self) {
        if self.registers.get(&0x1087).is_none_or(|control| control & 0x08 == 0) {
            return;
        }
        let mut bytes = self.packet().encode().bytes().to_vec();
        match self.trouble {
            Trouble::Silent => {}
            Trouble::HalfLost if self.counter.is_multiple_of(2) => {}
            Trouble::Swapped if self.counter.is_multiple_of(2) => self.queue.extend(self.held_back.replace(bytes)),
            Trouble::Garbage => {
                bytes[2] ^= 1;
                self.queue.push_back(bytes);
            }
            _ => self.queue.push_back(bytes),
        }
    }

    /// Torques of the motors, newton metres.
    fn torque(&self) -> Vec3 {
        match self.motors {
            Motors::Off => Vec3::zeros(),
            Motors::On(counts) => Vec3::from_fn(|i, _| f64::from(counts[i]) * TRUE_SCALE[i]),
        }
    }

    /// Force at the gimbal, newtons, device frame.
    pub(crate) fn force(&self) -> Vec3 {
        let inverse = omni::jacobian(self.joints).transpose().try_inverse();
        inverse.expect("the test stays away from singular poses") * self.torque()
    }
}

/// The node: test and driver hold the same one.
#[derive(Clone)]
pub(crate) struct FakeNode(Arc<Mutex<Omni>>);

impl FakeNode {
    /// An Omni in its dock.
    pub(crate) fn new() -> Self {
        Self(Arc::new(Mutex::new(Omni {
            registers: BTreeMap::from([(0x1082, 0), (0x1083, 0xc0)]),
            quadlets: BTreeMap::from([(0x1006_000c, 0x000b_9900), (0x1006_0010, SERIAL)]),
            keeps_writes: true,
            free_channels: vec![9, 4],
            joints: Vec3::from(DOCK_RAD),
            shares: [0.5; 3],
            buttons: 0,
            is_docked: true,
            trouble: Trouble::None,
            motors: Motors::Off,
            sent: 0,
            queue: VecDeque::new(),
            counter: 250,
            held_back: None,
        })))
    }

    pub(crate) fn omni(&self) -> MutexGuard<'_, Omni> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn attached(&self) -> Result<MutexGuard<'_, Omni>, WireError> {
        Some(self.omni()).filter(|omni| omni.trouble != Trouble::Unplugged).ok_or(WireError::Gone)
    }
}

impl FireWireNode for FakeNode {
    fn read_quadlet(&mut self, address: u64) -> Result<u32, WireError> {
        Ok(self.attached()?.quadlets.get(&address).copied().unwrap_or(0))
    }

    fn read_byte(&mut self, address: u64) -> Result<u8, WireError> {
        Ok(self.attached()?.registers.get(&address).copied().unwrap_or(0))
    }

    fn write_byte(&mut self, address: u64, value: u8) -> Result<(), WireError> {
        let mut omni = self.attached()?;
        if omni.keeps_writes {
            omni.registers.insert(address, value);
        }
        Ok(())
    }

    fn open_channel(&mut self, _direction: Direction) -> Result<u8, WireError> {
        self.attached()?.free_channels.pop().ok_or(WireError::Answer("the bus has no channel left"))
    }

    fn receive(&mut self, buffer: &mut [u8; LONGEST], _wait: Duration) -> Result<usize, WireError> {
        let Some(bytes) = self.attached()?.queue.pop_front() else { return Ok(0) };
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok(bytes.len())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        let mut omni = self.attached()?;
        omni.motors = motors_of(bytes).expect("sixteen bytes within the converter's range");
        omni.sent += 1;
        Ok(())
    }
}

/// Session and node: what the rig steps.
pub(crate) struct SessionPeer {
    pub(crate) node: FakeNode,
    session: Session<FakeNode>,
}

impl SessionPeer {
    pub(crate) fn open(node: FakeNode, rest: &[u8]) -> Result<Self, WireError> {
        Ok(Self { session: Session::open(node.clone(), rest)?, node })
    }

    pub(crate) fn serial(&self) -> &str {
        self.session.serial()
    }
}

impl WirePort for SessionPeer {
    fn receive(&mut self, buffer: &mut [u8; LONGEST], wait: Duration) -> Result<usize, WireError> {
        self.session.receive(buffer, wait)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
        self.session.send(bytes)
    }
}

impl Peer for SessionPeer {
    fn pass(&mut self) {
        self.node.omni().pass();
    }

    fn arrived_n(&self) -> f64 {
        self.node.omni().force().norm()
    }
}
