//! Side inputs beside any haptic device: a foot switch as deadman switch, a 3D mouse's buttons as buttons.
//!
//! A thread per input, without real-time rights, writes its levels into one atomic word; the servo reads it in every tick.
//! Foot switch up, or gone: the samples are "unready" and the command is zero, so the force is gone in the same tick and
//! comes back by way of monitor, armed and ramp. Buttons of the mouse are added to the device's own (1 front, 2 back); the
//! servo's edge counters take it from there. The mouse's axes are read and stand in [`MouseState`]; no message
//! carries them to a viewer yet. [`WithSideInputs`] goes round any device, whoever owns the clock.

use super::known::HidRole;
use super::port::{self, HidOpener};
use super::side_report::{MouseReport, MouseState, pedal_is_down};
use crate::cli::side_choice::SideChoice;
use crate::device::notice::{NOTICES, NoticeRing};
use crate::device::wire::notice::WireNotice;
use crate::device::wire::{LONGEST, Opener, WirePort};
use crate::device::{Device, DeviceCommand, DeviceLimits, DeviceSample, HandView, SampleQuality, ServoRoom, TickTime};
use crate::error::ServerError;
use sim_core::vector::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Bits of the word: buttons, then the foot switch.
const BUTTONS: u32 = 0b11;
const PEDAL_WANTED: u32 = 1 << 8;
const PEDAL_DOWN: u32 = 1 << 9;
/// Longest wait for a report; the thread looks at its end in between.
const WAIT: Duration = Duration::from_millis(50);
/// Pause before a lost input is opened again.
const AGAIN: Duration = Duration::from_secs(1);

/// Levels of all side inputs.
#[derive(Clone, Debug, Default)]
pub struct SideLevels(Arc<AtomicU32>);

impl SideLevels {
    /// From now on there is force only while a foot switch is down.
    pub fn want_pedal(&self) {
        self.0.fetch_or(PEDAL_WANTED, Ordering::Release);
    }

    fn set(&self, mask: u32, bits: u32) {
        // One writer per mask: two inputs never write the same bits.
        self.0.fetch_and(!mask | bits, Ordering::AcqRel);
        self.0.fetch_or(bits & mask, Ordering::AcqRel);
    }

    /// Takes a report of an input.
    pub fn take(&self, role: HidRole, mouse: &mut MouseState, bytes: &[u8]) {
        match role {
            HidRole::Pedal => {
                if let Some(is_down) = pedal_is_down(bytes) {
                    self.set(PEDAL_DOWN, if is_down { PEDAL_DOWN } else { 0 });
                }
            }
            _ => {
                if let Some(report) = MouseReport::parse(bytes) {
                    mouse.take(report);
                    self.set(BUTTONS, mouse.buttons & BUTTONS);
                }
            }
        }
    }

    /// An input is gone: what it said no longer holds.
    pub fn lose(&self, role: HidRole) {
        self.set(if role == HidRole::Pedal { PEDAL_DOWN } else { BUTTONS }, 0);
    }

    fn read(&self) -> u32 {
        self.0.load(Ordering::Acquire)
    }
}

/// Whether the levels allow force.
fn allows_force(levels: u32) -> bool {
    levels & PEDAL_WANTED == 0 || levels & PEDAL_DOWN != 0
}

/// The threads that read; they end with this.
#[derive(Debug, Default)]
pub struct SideReaders {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl SideReaders {
    /// Reads one more input.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn add<O: Opener + 'static>(
        &mut self,
        role: HidRole,
        opener: O,
        port: O::Port,
        levels: SideLevels,
        ring: Arc<NoticeRing>,
    ) -> std::io::Result<()>
    where
        O::Port: 'static,
    {
        let stop = self.stop.clone();
        let thread = std::thread::Builder::new().name("side-input".to_owned());
        self.threads.push(thread.spawn(move || read(role, opener, port, &levels, &ring, &stop))?);
        Ok(())
    }
}

impl Drop for SideReaders {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        for thread in self.threads.drain(..) {
            // A panic has been printed by the thread itself.
            let _ = thread.join();
        }
    }
}

fn read<O: Opener>(
    role: HidRole,
    mut opener: O,
    port: O::Port,
    levels: &SideLevels,
    ring: &NoticeRing,
    stop: &AtomicBool,
) {
    let mut port = Some(port);
    let mut mouse = MouseState::default();
    while !stop.load(Ordering::Acquire) {
        let mut buffer = [0; LONGEST];
        match port.as_mut().map(|port| port.receive(&mut buffer, WAIT)) {
            Some(Ok(0)) => {}
            Some(Ok(len)) => levels.take(role, &mut mouse, &buffer[..len.min(LONGEST)]),
            Some(Err(_)) => {
                levels.lose(role);
                WireNotice::SideInputGone.tell(ring);
                (port, mouse) = (None, MouseState::default());
            }
            None => {
                let mut waited = Duration::ZERO;
                while waited < AGAIN && !stop.load(Ordering::Acquire) {
                    std::thread::sleep(WAIT);
                    waited += WAIT;
                }
                port = opener.open().ok();
            }
        }
    }
}

/// A device with side inputs.
pub struct WithSideInputs {
    device: Box<dyn Device>,
    levels: SideLevels,
    ring: Arc<NoticeRing>,
    _readers: SideReaders,
}

impl WithSideInputs {
    /// Round this device; notices go into `ring`, which is the device's own if it has one.
    #[must_use]
    pub fn new(device: Box<dyn Device>, levels: SideLevels, ring: Arc<NoticeRing>, readers: SideReaders) -> Self {
        Self { device, levels, ring, _readers: readers }
    }

    /// The ring of a device, or a new one.
    #[must_use]
    pub fn ring_of(device: &dyn Device) -> Arc<NoticeRing> {
        device.notices().unwrap_or_else(|| Arc::new(NoticeRing::new(NOTICES)))
    }
}

impl Device for WithSideInputs {
    fn name(&self) -> &str {
        self.device.name()
    }

    fn limits(&self) -> DeviceLimits {
        self.device.limits()
    }

    fn run(&mut self, room: &mut dyn ServoRoom) {
        let mut side = SideRoom { room, levels: &self.levels, ring: &self.ring, told: None, is_allowed: false };
        self.device.run(&mut side);
    }

    fn notices(&self) -> Option<Arc<NoticeRing>> {
        Some(self.ring.clone())
    }
}

/// Puts the chosen side inputs round a device; without any the device is as it was.
///
/// # Errors
/// 69 for one that is not there, 77 without rights on its node.
pub fn attach(device: Box<dyn Device>, choices: &[SideChoice]) -> Result<Box<dyn Device>, ServerError> {
    if choices.is_empty() {
        return Ok(device);
    }
    let (levels, ring) = (SideLevels::default(), WithSideInputs::ring_of(device.as_ref()));
    let mut readers = SideReaders::default();
    let listed = port::list()?;
    for choice in choices {
        let (role, node) = choice.wanted();
        let found = port::choose(&listed, role, node)?;
        tracing::info!("side input: {} ({:?}) at {}", role.name(), found.name, found.path.display());
        let opener = HidOpener::new(found)?;
        let wire = opener.open_first()?;
        if role == HidRole::Pedal {
            levels.want_pedal();
        }
        readers.add(role, opener, wire, levels.clone(), ring.clone()).map_err(|e| {
            ServerError::Unavailable(format!("cannot start a thread: {e}; raise the limit of processes"))
        })?;
    }
    Ok(Box::new(WithSideInputs::new(device, levels, ring, readers)))
}

/// The servo as the device sees it, with the side inputs in between.
struct SideRoom<'a> {
    room: &'a mut dyn ServoRoom,
    levels: &'a SideLevels,
    ring: &'a NoticeRing,
    told: Option<bool>,
    /// Of this tick: a second device follows the first.
    is_allowed: bool,
}

impl ServoRoom for SideRoom<'_> {
    fn wait(&mut self) -> Option<TickTime> {
        self.room.wait()
    }

    fn begin(&mut self, late_ns: u64) -> Option<TickTime> {
        self.room.begin(late_ns)
    }

    fn view(&self) -> HandView {
        self.room.view()
    }

    fn is_latched(&self) -> bool {
        self.room.is_latched()
    }

    fn tick(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        let levels = self.levels.read();
        self.is_allowed = allows_force(levels);
        if levels & PEDAL_WANTED != 0 && self.told != Some(self.is_allowed) {
            self.told = Some(self.is_allowed);
            if self.is_allowed { WireNotice::DeadmanHeld } else { WireNotice::DeadmanReleased }.tell(self.ring);
        }
        let sample = DeviceSample { buttons: sample.buttons | levels & BUTTONS, ..self.gated(sample) };
        let command = self.room.tick(time, &sample);
        self.within(command)
    }

    fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
        let sample = self.gated(sample);
        let command = self.room.tick_second(time, &sample);
        self.within(command)
    }
}

impl SideRoom<'_> {
    fn gated(&self, sample: &DeviceSample) -> DeviceSample {
        match sample.quality {
            SampleQuality::Fresh | SampleQuality::Stale if !self.is_allowed => {
                DeviceSample { quality: SampleQuality::Unready, ..*sample }
            }
            _ => *sample,
        }
    }

    fn within(&self, command: DeviceCommand) -> DeviceCommand {
        if self.is_allowed { command } else { DeviceCommand { force_n: Vec3::zeros() } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::params::SafetyParams;
    use crate::servo::safety::ForceStage;

    /// A servo that always gives one newton and keeps what it was shown.
    struct Pushing {
        ticks: u32,
        seen: Vec<DeviceSample>,
    }

    impl ServoRoom for Pushing {
        fn wait(&mut self) -> Option<TickTime> {
            self.ticks += 1;
            Some(TickTime { scheduled_ns: 0, now_ns: 0, dt_s: 1e-3 })
        }

        fn begin(&mut self, _late_ns: u64) -> Option<TickTime> {
            self.wait()
        }

        fn view(&self) -> HandView {
            HandView::unseen()
        }

        fn is_latched(&self) -> bool {
            false
        }

        fn tick(&mut self, _time: TickTime, sample: &DeviceSample) -> DeviceCommand {
            self.seen.push(*sample);
            ForceStage::new(SafetyParams::default(), 1e-3).release(Vec3::x(), 1.0).command
        }

        fn tick_second(&mut self, time: TickTime, sample: &DeviceSample) -> DeviceCommand {
            self.tick(time, sample)
        }
    }

    #[test]
    fn without_the_foot_there_is_no_force_and_buttons_are_added() {
        let (levels, ring) = (SideLevels::default(), NoticeRing::new(NOTICES));
        let mut room = Pushing { ticks: 0, seen: Vec::new() };
        let mut side = SideRoom { room: &mut room, levels: &levels, ring: &ring, told: None, is_allowed: false };
        let time = side.wait().expect("always");
        let sample = DeviceSample { buttons: 1, quality: SampleQuality::Fresh, ..DeviceSample::resting(Vec3::x()) };
        let mut mouse = MouseState::default();
        assert!(side.tick(time, &sample).force_n.x > 0.0, "nobody wants a foot switch");
        levels.take(HidRole::SpaceMouse, &mut mouse, &[3, 0b10]);
        levels.want_pedal();
        assert_eq!(side.tick(time, &sample).force_n, Vec3::zeros(), "at once");
        assert_eq!(side.tick_second(time, &sample).force_n, Vec3::zeros(), "for both hands");
        levels.take(HidRole::Pedal, &mut mouse, &[0, 0, 4, 0, 0, 0, 0, 0]);
        assert!(side.tick(time, &sample).force_n.x > 0.0);
        levels.lose(HidRole::Pedal);
        assert_eq!(side.tick(time, &sample).force_n, Vec3::zeros());
        levels.lose(HidRole::SpaceMouse);
        let lost = DeviceSample { quality: SampleQuality::Lost, ..sample };
        side.tick(time, &lost);
        let seen: Vec<_> = room.seen.iter().map(|s| (s.buttons, s.quality)).collect();
        let (fresh, unready) = (SampleQuality::Fresh, SampleQuality::Unready);
        assert_eq!(seen, [(1, fresh), (3, unready), (1, unready), (3, fresh), (3, unready), (1, SampleQuality::Lost)]);
        let told: Vec<String> = std::iter::from_fn(|| ring.pop()).map(|n| n.what.to_string()).collect();
        assert_eq!(told.len(), 3, "{told:?}");
        assert!(told[0].contains("is up: no force"));
    }
}
