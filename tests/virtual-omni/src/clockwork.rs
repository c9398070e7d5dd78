//! Ticks: a thread at 1 kHz with the jitter of a real device, or a test that steps.
//!
//! Measured on a Touch: mean rate 978 to 1012 Hz, deviation 21 to 41 Hz, single intervals from 0.81 ms (1237 Hz) to 2.4 ms
//! (414 Hz); reading the device takes 0.065 ms. The model: period 1 ms ± 0.055 ms even (deviation 32 µs), one interval in
//! five thousand up to 1.4 ms longer; the chances are drawn from a fixed seed. A late tick is not caught up.
//! After `stop` has returned no callback runs any more.

use crate::abi;
use crate::codes;
use crate::world::{Timing, make_current, world};
use std::cell::Cell;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Half-width of the even jitter, seconds.
const JITTER_S: f64 = 55e-6;
/// One interval in so many is long.
const LONG_IN: u64 = 5_000;
/// The longest addition, seconds.
const LONG_S: f64 = 1.4e-3;

/// Held while callbacks run.
static TICKING: Mutex<()> = Mutex::new(());
static THREAD: Mutex<Option<JoinHandle<()>>> = Mutex::new(None);
/// Told after every tick.
static TICKED: (Mutex<u64>, Condvar) = (Mutex::new(0), Condvar::new());

thread_local! {
    static IN_TICK: Cell<bool> = const { Cell::new(false) };
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether the caller runs inside a callback.
pub(crate) fn is_in_tick() -> bool {
    IN_TICK.get()
}

/// `CLOCK_MONOTONIC`, or the virtual clock when a test steps.
pub(crate) fn now_ns() -> u64 {
    let world = world();
    match world.timing {
        Timing::Stepped => world.now_ns,
        Timing::Real => protocol::ports::monotonic_ns(),
    }
}

/// One tick: time passes, then every callback runs.
fn tick(dt_s: f64, now_ns: u64) {
    let _only_one = locked(&TICKING);
    let number = world().begin_tick(dt_s, now_ns);
    IN_TICK.set(true);
    loop {
        let next = {
            let mut world = world();
            if world.running { world.table.next(number) } else { None }
        };
        let Some((handle, callback)) = next else { break };
        if abi::call(callback) == codes::CALLBACK_DONE {
            world().table.remove(handle);
        }
    }
    IN_TICK.set(false);
    *locked(&TICKED.0) = number;
    TICKED.1.notify_all();
}

/// Steps a world whose ticks a test makes.
pub(crate) fn step(ticks: u32) {
    for _ in 0..ticks {
        let (is_running, now_ns) = {
            let world = world();
            (world.running && world.timing == Timing::Stepped, world.now_ns + 1_000_000)
        };
        if !is_running {
            return;
        }
        tick(1e-3, now_ns);
    }
}

/// Lets time pass without a tick: the scheduler stalls.
pub(crate) fn stall(milliseconds: u32) {
    for _ in 0..milliseconds {
        let mut world = world();
        let now_ns = world.now_ns + 1_000_000;
        world.pass(1e-3, now_ns);
    }
}

/// Starts the ticks; false when they run already.
pub(crate) fn start() -> bool {
    let timing = {
        let mut world = world();
        if std::mem::replace(&mut world.running, true) {
            return false;
        }
        for device in &mut world.devices {
            device.joined = device.open;
        }
        world.timing
    };
    if timing == Timing::Real {
        *locked(&THREAD) = std::thread::Builder::new().name("virtual-omni".to_owned()).spawn(run).ok();
    }
    true
}

/// Stops the ticks and waits for the running one.
pub(crate) fn stop() {
    world().running = false;
    if is_in_tick() {
        return;
    }
    let thread = locked(&THREAD).take();
    if let Some(thread) = thread {
        // A thread that panicked has ended, too.
        let _ended = thread.join();
    }
    drop(locked(&TICKING));
}

/// Waits until a tick has passed in which `is_over` has come true, or the ticks have ended.
pub(crate) fn wait_until(is_over: impl Fn() -> bool) {
    let mut seen = locked(&TICKED.0);
    while !is_over() && world().running {
        let (guard, _) = TICKED.1.wait_timeout(seen, Duration::from_millis(2)).unwrap_or_else(PoisonError::into_inner);
        seen = guard;
    }
}

fn run() {
    make_current(codes::INVALID_HANDLE);
    let mut chance = Chance(0x9E37_79B9_7F4A_7C15);
    // Wall clock: this thread is the clock of a device in real time; nothing is asserted of it.
    let mut last = Instant::now();
    let mut due = last;
    loop {
        let period_s = 1.0 / f64::from(world().rate_hz.max(1));
        due += Duration::from_secs_f64(period_s + chance.jitter_s());
        // Wall clock: as above.
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if !world().running {
            return;
        }
        // Wall clock: as above.
        let now = Instant::now();
        due = due.max(now - Duration::from_secs_f64(period_s));
        tick(now.duration_since(last).as_secs_f64(), now_ns());
        last = now;
    }
}

/// A small generator with a fixed seed.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Evenly in 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn jitter_s(&mut self) -> f64 {
        let even = (2.0 * self.share() - 1.0) * JITTER_S;
        if self.next().is_multiple_of(LONG_IN) { even + LONG_S * self.share() } else { even }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jitter_lies_in_the_measured_envelope() {
        let mut chance = Chance(1);
        let intervals: Vec<f64> = (0..100_000).map(|_| 1e-3 + chance.jitter_s()).collect();
        let rates: Vec<f64> = intervals.iter().map(|s| 1.0 / s).collect();
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        let deviation = (rates.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / rates.len() as f64).sqrt();
        assert!((978.0..1012.0).contains(&mean), "{mean} Hz");
        assert!((21.0..41.0).contains(&deviation), "{deviation} Hz");
        let slowest = rates.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        assert!((400.0..700.0).contains(&slowest), "{slowest} Hz");
    }
}
