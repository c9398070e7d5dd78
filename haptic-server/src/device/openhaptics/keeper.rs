//! Who runs when: the library's thread ticks, a keeper starts and stops it, the servo thread steps in when it is silent.
//!
//! | thread | work |
//! |---|---|
//! | library's scheduler | [`FrameLoop::tick`], 1 kHz, while the phase is Running |
//! | keeper | scheduler on; in phase Lost: scheduler off, device closed, opened again with growing pauses |
//! | servo | watches; silent for `stall_limit`, or Lost: ticks the servo by its own clock with lost samples |
//!
//! Loop and room lie behind one mutex that is only ever tried, never waited for by the library's thread. When a call of the library hangs
//! inside a tick, nobody can tick: the supervisor sees the loop stand still and ends the process.
//! Clean stop: last frame without force → scheduler off → callback off → devices closed.

use super::codes;
use super::ffi::{HandedOver, Hd, Next};
use super::frame_loop::{FrameLoop, MOST, Ticked};
use super::notice::{HdNotice, Teller};
use crate::device::ServoRoom;
use std::ffi::CString;
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// How often the threads that do not tick look.
const LOOK: Duration = Duration::from_millis(2);
/// A scheduler that starts is given this long before its silence counts.
const START_PATIENCE: Duration = Duration::from_secs(2);

/// Times of the keeper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeeperParams {
    /// Silence of the library that counts as a loss.
    pub stall_limit: Duration,
    /// First pause before the device is opened again; each further one is twice as long, up to 16 times.
    pub reopen_pause: Duration,
}

impl Default for KeeperParams {
    fn default() -> Self {
        Self { stall_limit: Duration::from_millis(50), reopen_pause: Duration::from_millis(500) }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Phase {
    Running,
    Lost,
    Stopping,
}

/// What the three threads share.
struct Shared<'a> {
    turn: Mutex<HandedOver<Turn<'a>>>,
    phase: AtomicU8,
    beats: AtomicU64,
    /// Handles after a reopening; read by the loop when the phase is Running again.
    handles: [AtomicU32; MOST],
    generation: AtomicU32,
}

struct Turn<'a> {
    work: &'a mut FrameLoop,
    room: &'a mut dyn ServoRoom,
    generation: u32,
}

impl Shared<'_> {
    fn phase(&self) -> Phase {
        match self.phase.load(Ordering::Acquire) {
            0 => Phase::Running,
            1 => Phase::Lost,
            _ => Phase::Stopping,
        }
    }

    fn go(&self, phase: Phase) {
        self.phase.store(phase as u8, Ordering::Release);
    }

    /// From one phase to another, unless a third has come between.
    fn change(&self, from: Phase, to: Phase) -> bool {
        self.phase.compare_exchange(from as u8, to as u8, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// The callback.
    fn tick(&self) -> Next {
        if self.phase() != Phase::Running {
            return Next::End;
        }
        let mut guard = match self.turn.try_lock() {
            Ok(guard) => guard,
            Err(TryLockError::WouldBlock) => return Next::GoOn,
            Err(TryLockError::Poisoned(_)) => return Next::End,
        };
        let Turn { work, room, generation } = &mut guard.0;
        let newest = self.generation.load(Ordering::Acquire);
        if *generation != newest {
            *generation = newest;
            for (arm, handle) in work.arms.iter_mut().zip(&self.handles) {
                arm.reopened(handle.load(Ordering::Acquire));
            }
        }
        let ticked = work.tick(&mut **room);
        self.beats.fetch_add(1, Ordering::Release);
        match ticked {
            Ticked::Well => return Next::GoOn,
            Ticked::Stopped => self.go(Phase::Stopping),
            Ticked::Lost => {
                self.change(Phase::Running, Phase::Lost);
            }
        }
        Next::End
    }
}

/// Runs the loop until the room wants to end.
pub(super) fn run(work: &mut FrameLoop, names: &[Option<CString>], params: &KeeperParams, room: &mut dyn ServoRoom) {
    let hd = work.hd;
    let ring = work.ring.clone();
    let handles = std::array::from_fn(|i| {
        AtomicU32::new(work.arms.get(i).map_or(codes::INVALID_HANDLE, super::arm::Arm::handle))
    });
    let shared = Shared {
        turn: Mutex::new(HandedOver(Turn { work, room, generation: 0 })),
        phase: AtomicU8::new(Phase::Running as u8),
        beats: AtomicU64::new(0),
        handles,
        generation: AtomicU32::new(0),
    };
    let teller = Teller { ring: &ring, device: 0 };
    std::thread::scope(|scope| {
        scope.spawn(|| keep(&shared, &hd, names, params, teller));
        watch(&shared, params, teller);
    });
}

/// The keeper's life.
fn keep(shared: &Shared<'_>, hd: &Hd, names: &[Option<CString>], params: &KeeperParams, teller: Teller<'_>) {
    loop {
        let work = || shared.tick();
        hd.while_scheduled(&work, |job| {
            while shared.phase() == Phase::Running {
                if job.is_broken() {
                    teller.tell(HdNotice::Panicked);
                    shared.change(Phase::Running, Phase::Lost);
                }
                std::thread::sleep(LOOK);
            }
        });
        close_all(shared, hd);
        if shared.phase() == Phase::Stopping || !reopen(shared, hd, names, params, teller) {
            // What was opened again while the run ended.
            close_all(shared, hd);
            return;
        }
    }
}

/// Closes every device that is open.
fn close_all(shared: &Shared<'_>, hd: &Hd) {
    for handle in &shared.handles {
        let handle = handle.swap(codes::INVALID_HANDLE, Ordering::AcqRel);
        if handle != codes::INVALID_HANDLE {
            hd.disable_device(handle);
        }
    }
}

/// Opens the devices again, with growing pauses; false when the run ends before.
fn reopen(shared: &Shared<'_>, hd: &Hd, names: &[Option<CString>], params: &KeeperParams, teller: Teller<'_>) -> bool {
    let mut pause = params.reopen_pause;
    loop {
        let mut waited = Duration::ZERO;
        while waited < pause {
            if shared.phase() == Phase::Stopping {
                return false;
            }
            std::thread::sleep(LOOK);
            waited += LOOK;
        }
        while hd.pop_error().is_some() {}
        let opened = open_all(hd, names);
        match opened {
            Ok(handles) => {
                for (slot, handle) in shared.handles.iter().zip(handles) {
                    slot.store(handle, Ordering::Release);
                }
                shared.generation.fetch_add(1, Ordering::Release);
                teller.tell(HdNotice::Reopened);
                return shared.change(Phase::Lost, Phase::Running);
            }
            Err(code) => teller.tell(HdNotice::NotReopened(code)),
        }
        pause = (2 * pause).min(16 * params.reopen_pause);
    }
}

/// Opens every device or none; the error's code otherwise.
fn open_all(hd: &Hd, names: &[Option<CString>]) -> Result<Vec<u32>, u32> {
    let mut handles = Vec::new();
    for name in names {
        let handle = hd.init_device(name.as_deref());
        let error = hd.pop_error();
        if handle == codes::INVALID_HANDLE {
            for open in handles {
                hd.disable_device(open);
            }
            return Err(error.map_or(codes::SUCCESS, |e| e.code));
        }
        super::prepare(hd, handle);
        handles.push(handle);
    }
    Ok(handles)
}

/// The servo thread: watches the beats, ticks when the library does not.
fn watch(shared: &Shared<'_>, params: &KeeperParams, teller: Teller<'_>) {
    let mut seen = 0;
    let mut silent = Duration::ZERO;
    let mut patience = START_PATIENCE.max(params.stall_limit);
    loop {
        std::thread::sleep(LOOK);
        let beats = shared.beats.load(Ordering::Acquire);
        if beats != seen {
            (seen, silent, patience) = (beats, Duration::ZERO, params.stall_limit);
        } else {
            silent += LOOK;
        }
        match shared.phase() {
            Phase::Stopping => return,
            Phase::Running if silent > patience => {
                // A tick that is being done is no silence, however long it takes: then the library has us.
                if let Some(guard) = taken(shared) {
                    drop(guard);
                    if shared.change(Phase::Running, Phase::Lost) {
                        teller.tell(HdNotice::Stalled(u64::try_from(silent.as_millis()).unwrap_or(u64::MAX)));
                    }
                }
            }
            Phase::Running => {}
            Phase::Lost => {
                if tick_lost(shared) == Ticked::Stopped {
                    shared.go(Phase::Stopping);
                    return;
                }
                (silent, patience) = (Duration::ZERO, START_PATIENCE.max(params.stall_limit));
            }
        }
    }
}

fn taken<'s, 'a>(shared: &'s Shared<'a>) -> Option<MutexGuard<'s, HandedOver<Turn<'a>>>> {
    match shared.turn.try_lock() {
        Ok(guard) => Some(guard),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

/// Ticks by the room's own clock until the library is back.
fn tick_lost(shared: &Shared<'_>) -> Ticked {
    let mut guard = shared.turn.lock().unwrap_or_else(PoisonError::into_inner);
    shared.turn.clear_poison();
    let Turn { work, room, .. } = &mut guard.0;
    while shared.phase() == Phase::Lost {
        let Some(time) = room.wait() else { return Ticked::Stopped };
        work.tick_lost(&mut **room, time);
    }
    Ticked::Well
}
