//! The motors of an Omni under calibration: a thread that keeps its packets going, and a watch that switches off by itself.
//!
//! The thread sends a packet a millisecond: the motor that was asked for, or all off; after ten seconds, or when the bench is
//! dropped, all off. It keeps the newest encoders. Order, state and encoders are one atomic word each. Deliberately absent: the questions (`calibrate.rs`).

use super::calibrate::{Bench, Held};
use super::packet::{DockLight, Motors, OmniPacket, encode};
use crate::device::wire::pump::{Drained, drain};
use crate::device::wire::{WireError, WirePort};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// A motor is on for so many packets at most: ten seconds.
const MOST_PACKETS: u32 = 10_000;
/// Between two packets.
const PACE: Duration = Duration::from_millis(1);
/// A packet without force has surely gone out after this.
const SETTLE: Duration = Duration::from_millis(20);

/// What has become of an order.
const RESTING: u8 = 0;
const HOLDING: u8 = 1;
const TOO_LONG: u8 = 2;
const GONE: u8 = 3;

/// There has been a packet.
const SEEN: u64 = 1 << 48;

#[derive(Default)]
struct Shared {
    /// Joint in the upper half, counts in the lower.
    order: AtomicU32,
    /// Encoders of the newest packet, 16 bits each, and [`SEEN`].
    encoders: AtomicU64,
    state: AtomicU8,
    stop: AtomicBool,
}

/// An Omni on the bench.
pub(super) struct FireWireBench {
    serial: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl FireWireBench {
    /// Takes an open device.
    ///
    /// # Errors
    /// No thread can be started.
    pub(super) fn new<P: WirePort + Send + 'static>(serial: &str, port: P) -> std::io::Result<Self> {
        Self::limited(serial, port, MOST_PACKETS)
    }

    fn limited<P: WirePort + Send + 'static>(serial: &str, port: P, most: u32) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let own = shared.clone();
        let thread = std::thread::Builder::new().name("bench".to_owned()).spawn(move || run(port, &own, most))?;
        Ok(Self { serial: serial.to_owned(), shared, thread: Some(thread) })
    }

    fn require(&self) -> Result<u8, String> {
        match self.shared.state.load(Ordering::Acquire) {
            GONE => Err(WireError::Gone.to_string()),
            state => Ok(state),
        }
    }
}

impl Bench for FireWireBench {
    fn serial(&self) -> &str {
        &self.serial
    }

    fn hold(&mut self, joint: usize, counts: i16) -> Result<(), String> {
        self.require()?;
        let joint = u32::try_from(joint).map_err(|_| "there are three joints".to_owned())?;
        self.shared.order.store(joint << 16 | u32::from(counts.cast_unsigned()), Ordering::Release);
        // Only from rest: a device that has just gone stays gone.
        let began = self.shared.state.compare_exchange(RESTING, HOLDING, Ordering::AcqRel, Ordering::Acquire);
        began.map(|_| ()).map_err(|_| WireError::Gone.to_string())
    }

    fn release(&mut self) -> Result<Held, String> {
        let state = self.require()?;
        let _gone = self.shared.state.compare_exchange(state, RESTING, Ordering::AcqRel, Ordering::Acquire);
        std::thread::sleep(SETTLE);
        self.require().map(|_| if state == TOO_LONG { Held::TooLong } else { Held::Throughout })
    }

    fn encoders(&mut self) -> Result<[u16; 3], String> {
        self.require()?;
        let word = self.shared.encoders.load(Ordering::Acquire);
        if word & SEEN == 0 {
            return Err(WireError::Answer("no packet has come").to_string());
        }
        Ok([0, 16, 32].map(|shift| (word >> shift) as u16))
    }
}

impl Drop for FireWireBench {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A panic has been printed by the thread itself.
            let _ = thread.join();
        }
    }
}

fn run(mut port: impl WirePort, shared: &Shared, most: u32) {
    let mut held = 0_u32;
    while !shared.stop.load(Ordering::Acquire) {
        let is_holding = shared.state.load(Ordering::Acquire) == HOLDING;
        held = if is_holding { held.saturating_add(1) } else { 0 };
        let motors = if is_holding { ordered(shared.order.load(Ordering::Acquire)) } else { Motors::Off };
        let drained = drain(&mut port, |bytes| OmniPacket::parse(bytes).is_some(), PACE);
        if let Ok(Drained { newest: Some(bytes), .. }) = drained
            && let Some(packet) = OmniPacket::parse(bytes.bytes())
        {
            let [a, b, c] = packet.encoders.map(u64::from);
            shared.encoders.store(SEEN | c << 32 | b << 16 | a, Ordering::Release);
        }
        let is_well = drained.is_ok() && port.send(encode(motors, DockLight::Dark).bytes()).is_ok();
        if !is_well {
            shared.state.store(GONE, Ordering::Release);
            return;
        }
        if held >= most {
            let _released = shared.state.compare_exchange(HOLDING, TOO_LONG, Ordering::AcqRel, Ordering::Acquire);
        }
    }
    // A device that is gone needs no rest.
    let _ = port.send(encode(Motors::Off, DockLight::Dark).bytes());
}

fn ordered(order: u32) -> Motors {
    let mut counts = [0; 3];
    if let Some(slot) = counts.get_mut((order >> 16) as usize) {
        *slot = (order as u16).cast_signed();
    }
    Motors::On(counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::firewire::packet::motors_of;
    use crate::device::wire::LONGEST;
    use std::sync::{Mutex, MutexGuard, PoisonError};

    #[derive(Default)]
    struct Log {
        sent: Vec<Motors>,
        next: Option<OmniPacket>,
        is_gone: bool,
    }

    #[derive(Clone, Default)]
    struct Port(Arc<Mutex<Log>>);

    impl Port {
        fn log(&self) -> MutexGuard<'_, Log> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner)
        }
    }

    impl WirePort for Port {
        fn receive(&mut self, buffer: &mut [u8; LONGEST], _wait: Duration) -> Result<usize, WireError> {
            if self.log().is_gone {
                return Err(WireError::Gone);
            }
            let Some(packet) = self.log().next.take().map(|packet| packet.encode()) else { return Ok(0) };
            buffer[..packet.bytes().len()].copy_from_slice(packet.bytes());
            Ok(packet.bytes().len())
        }

        fn send(&mut self, bytes: &[u8]) -> Result<(), WireError> {
            self.log().sent.push(motors_of(bytes).expect("a packet"));
            Ok(())
        }
    }

    /// Waits for the thread; a minute is patience with a loaded machine, not a measurement.
    fn until(mut is_so: impl FnMut() -> bool) {
        for _ in 0..60_000 {
            if is_so() {
                return;
            }
            std::thread::sleep(PACE);
        }
        panic!("the thread of the bench does nothing");
    }

    #[test]
    fn one_motor_goes_on_and_off_and_not_for_longer_than_its_time() {
        let port = Port::default();
        let mut bench = FireWireBench::limited("1", port.clone(), u32::MAX).expect("a thread");
        bench.hold(1, -80).expect("attached");
        until(|| port.log().sent.last() == Some(&Motors::On([0, -80, 0])));
        assert_eq!(bench.release(), Ok(Held::Throughout));
        until(|| port.log().sent.last() == Some(&Motors::Off));
        drop(bench);
        let mut bench = FireWireBench::limited("1", port.clone(), 10).expect("a thread");
        bench.hold(0, 80).expect("attached");
        until(|| bench.shared.state.load(Ordering::Acquire) == TOO_LONG);
        assert_eq!(bench.release(), Ok(Held::TooLong));
        drop(bench);
        assert_eq!(port.log().sent.last(), Some(&Motors::Off));
    }

    #[test]
    fn the_newest_encoders_are_kept() {
        let port = Port::default();
        let mut bench = FireWireBench::new("1", port.clone()).expect("a thread");
        assert!(bench.encoders().expect_err("none yet").contains("no packet"));
        for encoders in [[1, 0x8000, 0xffff], [2, 3, 4]] {
            let gimbal = [(1, 1); 3];
            let packet = OmniPacket { encoders, gimbal, counter: 0, buttons: 0, is_docked: false };
            port.log().next = Some(packet);
            until(|| bench.encoders() == Ok(encoders));
        }
    }

    #[test]
    fn a_device_that_is_gone_is_told() {
        let port = Port::default();
        let mut bench = FireWireBench::new("1", port.clone()).expect("a thread");
        port.log().is_gone = true;
        until(|| bench.hold(0, 80).is_err());
        assert!(bench.release().expect_err("gone").contains("cable"));
    }

    #[test]
    fn an_order_for_a_joint_that_does_not_exist_moves_nothing() {
        assert_eq!(ordered(7 << 16 | 80), Motors::On([0; 3]));
    }
}
