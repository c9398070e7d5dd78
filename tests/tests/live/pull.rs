//! The solver dies or stops in the middle of a pull: what the hand feels, tick by tick, from the recording.
//!
//! The limits are checked in the ticks' own terms (sequence numbers, age of the port), so that a loaded machine cannot
//! break them: no change of the force above the slew limit, no force once the port is older than the ladder reaches, and
//! stitches after the return. Measured times are printed, not asserted.

use crate::watch::{PULL_N, Watch, force_n, pulls};
use crate::{LIMIT, alone, assert_no_fault, ended, run, solver_of, stood_still, summary};
use protocol::ports::monotonic_ns;
use protocol::servo_state::ServoState;
use protocol::trace::{TraceItem, TraceReader};
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Duration;
use suture_tests::processes::Sandbox;

/// Slew limit of the safety stage, 500 N/s, over the longest tick that is not yet counted as two: 1.5 ms.
const SLEW_N_PER_TICK: f64 = 0.75;
/// Runs in which the machine stood still show nothing about the solver and are repeated, this often.
const ATTEMPTS: usize = 4;
/// A machine that misses more of its ticks than this stands still again and again: a hand that never pulls there shows
/// nothing. On one that keeps its time it is a fault of the code.
const STALLED_SHARE: f64 = 0.02;
/// Rounding of a difference of forces.
const ROUNDING_N: f64 = 1e-9;
/// The ladder's end: 250 ms frozen, 100 ms of decay, and the filter's last ticks.
const LADDER_END_NS: u64 = 380_000_000;
/// Below this a force is none: a tenth of what an Omni's friction hides.
const ZERO_N: f64 = 0.026;
/// Cycles of a solver that runs for a tenth of its time, and the two parts of each: 3 s in all.
const SLOW_CYCLES: u32 = 60;
const SLOW_STOPPED: Duration = Duration::from_millis(45);
const SLOW_RUNNING: Duration = Duration::from_millis(5);
/// Ports of such a solver are older than two of its periods for most of the time, nanoseconds.
const SLOW_AGE_NS: u64 = 10_000_000;
/// Energy that the hand may ever have been given, joules: the bound that every trace has to keep.
const GIVEN_J: f64 = 2e-3;
/// What the hand does this long after the fault is no after-effect of it, nanoseconds.
const LATER_NS: u64 = 2_000_000_000;

fn recorded(file: &Path) -> Vec<ServoState> {
    let mut reader = TraceReader::open(BufReader::new(File::open(file).expect("recorded"))).expect("MCAP");
    let mut states = Vec::new();
    while let Some((_, item)) = reader.next_item().expect("a sound message") {
        if let TraceItem::ServoState(state) = item {
            states.push(*state);
        }
    }
    states
}

/// What a run that met a fault in a pull has left.
struct Met {
    /// The recorded ticks.
    states: Vec<ServoState>,
    /// When the fault began, monotonic nanoseconds.
    fault_ns: u64,
    summary: serde_json::Value,
}

/// Runs the skin, meets its solver with `fault` in a pull, and goes on until the hand has pulled again; `None`, with a
/// printed notice, on a machine that cannot do that without standing still.
fn pull_with(fault: impl Fn(Pid)) -> Option<Met> {
    for _ in 0..ATTEMPTS {
        let sandbox = Sandbox::new();
        let file = sandbox.folder().join("pull.mcap");
        let server = run(&sandbox, &["--duration", "600", "--record", file.to_str().expect("a plain name")]);
        let solver = solver_of(&server);
        let mut watch = Watch::attach(&sandbox);
        let first = watch.until(LIMIT, pulls);
        let fault_ns = monotonic_ns();
        let again = first.and_then(|_| {
            fault(solver);
            watch.until(LIMIT, |state| pulls(state) && state.header.time_ns > fault_ns + LATER_NS)
        });
        server.signal(Signal::TERM);
        let summary = summary(&ended(server));
        if again.is_some() && !stood_still(&summary) {
            return Some(Met { states: recorded(&file), fault_ns, summary });
        }
        let pulled = if first.is_some() { "again after the fault" } else { "at all" };
        assert!(
            stalled(&summary),
            "the synthetic hand did not pull {pulled}, on a machine that keeps its time: {summary}"
        );
        println!("the machine stood still (worst wake-up {} ns); again", summary["wake_ns"]["max"]);
    }
    println!("not shown: the machine stood still in {ATTEMPTS} runs out of {ATTEMPTS}; lower its load");
    None
}

impl Met {
    /// The recorded ticks of this long from the fault on.
    fn within(&self, window: Duration) -> impl Iterator<Item = &ServoState> {
        let end_ns = self.fault_ns + window.as_nanos() as u64;
        self.states.iter().filter(move |s| (self.fault_ns..end_ns).contains(&s.header.time_ns))
    }

    fn missed_within(&self, window: Duration) -> u64 {
        let missed = || self.within(window).map(|s| s.missed);
        missed().max().unwrap_or(0) - missed().min().unwrap_or(0)
    }
}

/// Whether the machine kept the servo from its ticks.
fn stalled(summary: &serde_json::Value) -> bool {
    let count = |key: &str| summary[key].as_f64().unwrap_or_else(|| panic!("{key} in {summary}"));
    stood_still(summary) || count("missed") > STALLED_SHARE * (count("ticks") + count("missed"))
}

/// What holds whatever happens to the solver.
fn check(Met { states, fault_ns, summary }: &Met) {
    let fault_ns = *fault_ns;
    assert!(states.len() > 1000, "only {} ticks were recorded", states.len());
    for pair in states.windows(2) {
        let ticks = pair[1].header.sequence - pair[0].header.sequence + (pair[1].missed - pair[0].missed);
        let change =
            (0..3).map(|d| (pair[1].devices[0].force_n[d] - pair[0].devices[0].force_n[d]).powi(2)).sum::<f64>();
        let limit = SLEW_N_PER_TICK * ticks as f64 + ROUNDING_N;
        assert!(change.sqrt() <= limit, "force jumps by {} N at tick {}", change.sqrt(), pair[1].header.sequence);
    }
    let stale = states.iter().filter(|s| s.port_sequence > 0 && s.port_age_ns > LADDER_END_NS);
    for state in stale {
        assert!(force_n(state) < ZERO_N, "{} N from a port {} ms old", force_n(state), state.port_age_ns / 1_000_000);
    }
    let zero = states.iter().find(|s| s.header.time_ns > fault_ns && force_n(s) < ZERO_N);
    let zero_ms = zero.map(|s| (s.header.time_ns - fault_ns) as f64 / 1e6);
    let around = |s: &&ServoState| s.header.time_ns.abs_diff(fault_ns) < LATER_NS;
    let missed = states.iter().filter(around).map(|s| s.missed);
    let (least, most) = (missed.clone().min().unwrap_or(0), missed.max().unwrap_or(0));
    println!("no force {zero_ms:?} ms after the fault; {} ticks missed within 2 s of it", most - least);
    assert_no_fault(summary);
    let later = states.iter().filter(|s| s.header.time_ns > fault_ns + LATER_NS).map(force_n).fold(0.0, f64::max);
    assert!(later > PULL_N, "the hand does not pull again after the fault");
}

#[test]
fn a_solver_killed_in_a_pull_lets_the_force_fade_and_the_work_go_on() {
    let _alone = alone();
    let shown = pull_with(|solver| kill_process(solver, Signal::KILL).expect("the solver is there"));
    let Some(met) = shown else { return };
    check(&met);
    assert_eq!(met.summary["solver_restarts"], 1, "{}", met.summary);
    assert!(met.states.iter().any(|s| s.header.time_ns > met.fault_ns && force_n(s) < ZERO_N), "the force never faded");
}

#[test]
fn a_solver_stopped_in_a_pull_is_followed_down_the_ladder_and_back() {
    let _alone = alone();
    let shown = pull_with(|solver| {
        kill_process(solver, Signal::STOP).expect("the solver is there");
        std::thread::sleep(Duration::from_millis(700));
        kill_process(solver, Signal::CONT).expect("the solver is there");
    });
    let Some(met) = shown else { return };
    check(&met);
    let deepest = met.states.iter().map(|s| s.port_age_ns).max().unwrap_or(0);
    assert!(deepest > LADDER_END_NS, "the port never grew old: {deepest} ns");
}

#[test]
fn a_solver_ten_times_too_slow_costs_no_tick_no_fault_and_gives_the_hand_nothing() {
    let _alone = alone();
    let window = (SLOW_STOPPED + SLOW_RUNNING) * SLOW_CYCLES;
    let slow = |solver| {
        for _ in 0..SLOW_CYCLES {
            kill_process(solver, Signal::STOP).expect("the solver is there");
            std::thread::sleep(SLOW_STOPPED);
            kill_process(solver, Signal::CONT).expect("the solver is there");
            std::thread::sleep(SLOW_RUNNING);
        }
    };
    let mut fewest = u64::MAX;
    for _ in 0..ATTEMPTS {
        let Some(met) = pull_with(slow) else { return };
        check(&met);
        assert_eq!(met.summary["solver_restarts"], 0, "{}", met.summary);
        let (ticks, old) =
            (met.within(window).count(), met.within(window).filter(|s| s.port_age_ns > SLOW_AGE_NS).count());
        assert!(2 * old > ticks, "the solver was never slow: {old} of {ticks} ticks had an old port");
        let given = met.states.iter().map(|s| s.energy_to_hand_j).fold(f64::NEG_INFINITY, f64::max);
        assert!(given < GIVEN_J, "{given} J given to the hand");
        // The same run with a solver that keeps its time: what the machine costs by itself.
        let Some(paired) = pull_with(|_| std::thread::sleep(window)) else { return };
        let (missed, machine) = (met.missed_within(window), paired.missed_within(window));
        println!(
            "{missed} of {ticks} ticks missed beside a slow solver, {machine} beside a sound one; {given} J at most"
        );
        fewest = fewest.min(missed.saturating_sub(machine));
        // A port that cost a tick would cost one in each cycle.
        if fewest < u64::from(SLOW_CYCLES / 4) {
            return;
        }
    }
    panic!("a slow solver costs at least {fewest} ticks in {SLOW_CYCLES} cycles");
}
