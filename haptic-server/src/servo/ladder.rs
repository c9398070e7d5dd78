//! What to make of a tissue port by its age: one ladder, taken rung by rung.
//!
//! | age of the newest port | rung |
//! |---|---|
//! | ≤ 2 solver periods | affine: the port as it is |
//! | ≤ 50 ms | one ring: S → K_one-ring, coupling damping doubled |
//! | ≤ 250 ms | frozen: the handles stand still, the hand feels the coupling to a fixed point |
//! | then | decay: force → 0 in 100 ms, then no rung at all |
//!
//! age = now − publish time of the port; the period is measured from the ports' own cadence. A known death starts the
//! decay at once. A decay that has begun runs to its end even when a new port arrives, so that coming back always
//! passes the ramp. Times in nanoseconds of `CLOCK_MONOTONIC`. Over-estimating the local stiffness of a late port is
//! safe, under-estimating it is not: hence the one-ring stiffness. When the clock steps back, the port in use is of unknown
//! age: it decays at once, and only a port stamped by the clock as it is now is taken again. Deliberately absent: forces,
//! and extrapolation.

use crate::servo::params::{LadderParams, to_ns};
use protocol::tissue_port::TissuePort;
use protocol::wire::Message;

/// A gap between ports beyond this is a stall, not a cadence, nanoseconds.
const LONGEST_CADENCE_NS: u64 = 25_000_000;
/// Weight of a new gap in the measured cadence: 1/8 forgets a hiccup within twenty ports.
const CADENCE_SHIFT: u32 = 3;
/// A port may seem this much newer than now (two cores read the clock), nanoseconds.
const CLOCK_SLACK_NS: u64 = 1_000_000;

/// How the newest port is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rung {
    /// As it is.
    Affine,
    /// With the one-ring stiffness and more damping.
    OneRing,
    /// Handles stand still.
    Frozen,
    /// Force on its way to zero.
    Decay,
    /// No usable port.
    None,
}

impl Rung {
    /// Code on the wire.
    #[must_use]
    pub fn code(self) -> u32 {
        self as u32
    }
}

/// The ladder in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Rung now.
    pub rung: Rung,
    /// Share of the force that is left, 0 to 1.
    pub gain: f64,
    /// Age of the newest port, nanoseconds; 0 without a port.
    pub age_ns: u64,
}

/// Why a port was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum PortRefusal {
    /// Header, range or a number that is not finite.
    Invalid = 1,
    /// Older than the one in use.
    Older = 2,
    /// Published in the future.
    FromTheFuture = 3,
}

/// Stamp of the port in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    sequence: u64,
    publish_ns: u64,
}

/// Age, cadence, decay and deaths.
#[derive(Clone, Copy, Debug)]
pub struct Ladder {
    params: LadderParams,
    newest: Option<Stamp>,
    cadence_ns: u64,
    decay_since_ns: Option<u64>,
    deaths_seen: u32,
    last_now_ns: u64,
    /// Ports published up to this moment belong to a solver that is dead, or to a clock that has stepped back since.
    dead_until_ns: Option<u64>,
}

impl Ladder {
    /// Without a port.
    #[must_use]
    pub fn new(params: LadderParams) -> Self {
        Self {
            params,
            newest: None,
            cadence_ns: to_ns(params.solver_period_s),
            decay_since_ns: None,
            deaths_seen: 0,
            last_now_ns: 0,
            dead_until_ns: None,
        }
    }

    /// Checks a private copy of a port and makes it the newest.
    ///
    /// # Errors
    /// [`PortRefusal`]; the port in use stays.
    pub fn accept(&mut self, port: &TissuePort, now_ns: u64) -> Result<(), PortRefusal> {
        if port.validate().is_err() {
            return Err(PortRefusal::Invalid);
        }
        if port.publish_ns > now_ns.saturating_add(CLOCK_SLACK_NS) {
            return Err(PortRefusal::FromTheFuture);
        }
        let stamp = Stamp { sequence: port.header.sequence, publish_ns: port.publish_ns };
        if let Some(last) = self.newest {
            if stamp.publish_ns <= last.publish_ns {
                return Err(PortRefusal::Older);
            }
            self.measure_cadence(last, stamp);
        }
        self.newest = Some(stamp);
        if self.dead_until_ns.is_some_and(|death| stamp.publish_ns > death) {
            self.dead_until_ns = None;
        }
        Ok(())
    }

    /// The rung of this tick. `deaths` counts the solver's deaths as the supervisor reported them.
    pub fn tick(&mut self, now_ns: u64, deaths: u32) -> Step {
        if now_ns < self.last_now_ns {
            self.forget_times(now_ns);
        }
        self.last_now_ns = now_ns;
        if deaths != self.deaths_seen {
            self.deaths_seen = deaths;
            self.dead_until_ns = Some(now_ns);
        }
        let Some(newest) = self.newest else {
            return Step { rung: Rung::None, gain: 0.0, age_ns: 0 };
        };
        let age_ns = now_ns.saturating_sub(newest.publish_ns);
        if self.decay_since_ns.is_none() && self.is_run_out(age_ns) {
            self.decay_since_ns = Some(now_ns);
        }
        let Some(since) = self.decay_since_ns else {
            return Step { rung: self.rung_by_age(age_ns), gain: 1.0, age_ns };
        };
        let decayed = now_ns.saturating_sub(since) as f64 * 1e-9 / self.params.decay_s;
        if decayed < 1.0 {
            return Step { rung: Rung::Decay, gain: 1.0 - decayed, age_ns };
        }
        // The end of a decay is told once, whatever has arrived meanwhile; then the port must be fresh again.
        if !self.is_run_out(age_ns) {
            self.decay_since_ns = None;
        }
        Step { rung: Rung::None, gain: 0.0, age_ns }
    }

    /// Measured solver period, nanoseconds.
    #[must_use]
    pub fn cadence_ns(&self) -> u64 {
        self.cadence_ns
    }

    fn is_run_out(&self, age_ns: u64) -> bool {
        self.dead_until_ns.is_some() || age_ns > to_ns(self.params.frozen_until_s)
    }

    fn rung_by_age(&self, age_ns: u64) -> Rung {
        let one_ring_until = to_ns(self.params.one_ring_until_s);
        let affine_until = ((self.cadence_ns as f64 * self.params.affine_periods) as u64).min(one_ring_until);
        if age_ns <= affine_until {
            Rung::Affine
        } else if age_ns <= one_ring_until {
            Rung::OneRing
        } else {
            Rung::Frozen
        }
    }

    /// The clock has stepped back to `now_ns`: no earlier stamp can be compared with it.
    fn forget_times(&mut self, now_ns: u64) {
        self.decay_since_ns = self.newest.map(|_| now_ns);
        self.dead_until_ns = self.newest.map(|_| now_ns);
        if let Some(newest) = &mut self.newest {
            newest.publish_ns = 0;
        }
    }

    /// Ports that were overwritten unseen count by their sequence; a restarted solver begins a new count.
    fn measure_cadence(&mut self, last: Stamp, new: Stamp) {
        let Some(ports) = new.sequence.checked_sub(last.sequence).filter(|n| *n > 0) else { return };
        let gap = (new.publish_ns - last.publish_ns) / ports;
        if gap <= LONGEST_CADENCE_NS {
            self.cadence_ns = self.cadence_ns - (self.cadence_ns >> CADENCE_SHIFT) + (gap >> CADENCE_SHIFT);
        }
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_types, reason = "a test runs outside the room")]
mod tests {
    use super::*;
    use protocol::wire::Field;

    const MS: u64 = 1_000_000;

    fn port(sequence: u64, publish_ms: u64) -> TissuePort {
        let mut port = TissuePort::EMPTY;
        port.publish_ns = publish_ms * MS;
        port.stamp(sequence, port.publish_ns);
        port
    }

    /// A ladder that got a port every 5 ms up to `last_ms`.
    fn fed_until(last_ms: u64) -> Ladder {
        let mut ladder = Ladder::new(LadderParams::default());
        for (sequence, at) in (1..).zip((5..=last_ms).step_by(5)) {
            ladder.accept(&port(sequence, at), at * MS).expect("fresh port");
        }
        ladder
    }

    #[test]
    fn a_stopped_solver_is_followed_rung_by_rung() {
        let mut ladder = fed_until(1_000);
        let mut rungs = Vec::new();
        for ms in 1_000..1_500 {
            let step = ladder.tick(ms * MS, 0);
            if rungs.last().is_none_or(|(_, rung)| *rung != step.rung) {
                rungs.push((ms - 1_000, step.rung));
            }
        }
        assert_eq!(
            rungs,
            [(0, Rung::Affine), (11, Rung::OneRing), (51, Rung::Frozen), (251, Rung::Decay), (351, Rung::None)]
        );
    }

    #[test]
    fn a_known_death_starts_the_decay_at_once() {
        let mut ladder = fed_until(1_000);
        assert_eq!(ladder.tick(1_002 * MS, 0).rung, Rung::Affine);
        assert_eq!(ladder.tick(1_003 * MS, 1).rung, Rung::Decay);
        let half = ladder.tick(1_053 * MS, 1);
        assert!((half.gain - 0.5).abs() < 1e-9);
        assert_eq!(ladder.tick(1_103 * MS, 1).rung, Rung::None);
        // A port that was under way when the solver died changes nothing; one of its successor does.
        assert_eq!(ladder.accept(&port(300, 1_003), 1_104 * MS), Ok(()));
        assert_eq!(ladder.tick(1_104 * MS, 1).rung, Rung::None);
        assert_eq!(ladder.accept(&port(1, 1_104), 1_104 * MS), Ok(()));
        assert_eq!(ladder.tick(1_105 * MS, 1).rung, Rung::None);
        assert_eq!(ladder.tick(1_106 * MS, 1).rung, Rung::Affine);
    }

    #[test]
    fn a_decay_that_has_begun_ends_at_zero_although_ports_come_again() {
        let mut ladder = fed_until(1_000);
        assert_eq!(ladder.tick(1_251 * MS, 0).rung, Rung::Decay);
        let mut seen_none = false;
        for ms in 1_252..1_400 {
            ladder.accept(&port(ms, ms), ms * MS).expect("fresh port");
            let step = ladder.tick(ms * MS, 0);
            seen_none |= step.rung == Rung::None;
            assert!(seen_none || step.rung == Rung::Decay);
        }
        assert_eq!(ladder.tick(1_400 * MS, 0).rung, Rung::Affine);
    }

    #[test]
    fn a_clock_that_steps_back_ends_the_port_in_use_and_takes_ports_of_the_new_clock() {
        for (before, after) in [(10_000, 4_000), (1_000, 2)] {
            let mut ladder = fed_until(before);
            assert_eq!(ladder.tick(before * MS, 0).rung, Rung::Affine);
            assert_eq!(ladder.tick(after * MS, 0).rung, Rung::Decay);
            assert!((ladder.tick((after + 50) * MS, 0).gain - 0.5).abs() < 1e-9);
            for ms in after + 51..after + 100 {
                assert_eq!(ladder.accept(&port(ms, ms), ms * MS), Ok(()), "{ms}");
                assert_eq!(ladder.tick(ms * MS, 0).rung, Rung::Decay, "{ms}");
            }
            assert_eq!(ladder.tick((after + 100) * MS, 0).rung, Rung::None);
            assert_eq!(ladder.tick((after + 101) * MS, 0).rung, Rung::Affine);
        }
    }

    #[test]
    fn without_a_port_of_the_new_clock_the_decay_stays_at_zero() {
        let mut ladder = fed_until(10_000);
        ladder.tick(10_000 * MS, 0);
        for ms in 5..10_500 {
            let step = ladder.tick(ms * MS, 0);
            assert_eq!(step.gain > 0.0, ms < 105, "{ms}: {step:?}");
        }
    }

    #[test]
    fn old_future_and_broken_ports_are_refused() {
        let mut ladder = fed_until(1_000);
        assert_eq!(ladder.accept(&port(900, 1_000), 1_001 * MS), Err(PortRefusal::Older));
        assert_eq!(ladder.accept(&port(901, 1_010), 1_001 * MS), Err(PortRefusal::FromTheFuture));
        let mut broken = port(901, 1_001);
        broken.gap_m = f64::NAN;
        assert_eq!(ladder.accept(&broken, 1_001 * MS), Err(PortRefusal::Invalid));
        assert_eq!(ladder.tick(1_001 * MS, 0).age_ns, MS);
    }

    #[test]
    fn the_cadence_is_measured_and_a_stall_is_no_cadence() {
        let mut ladder = Ladder::new(LadderParams::default());
        for (sequence, at) in (1..).zip((10..=2_000).step_by(10)) {
            ladder.accept(&port(sequence, at), at * MS).expect("fresh port");
        }
        assert!(ladder.cadence_ns().abs_diff(10 * MS) < 100_000, "{}", ladder.cadence_ns());
        ladder.accept(&port(201, 2_100), 2_100 * MS).expect("late port");
        assert!(ladder.cadence_ns().abs_diff(10 * MS) < 100_000);
    }
}
