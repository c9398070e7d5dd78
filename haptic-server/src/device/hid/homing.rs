//! Where an arm with incremental encoders has its zero: a person holds it in its rest pose.
//!
//! Button down (after it has been seen up) and the joints still for half a second → the device is told the counts of the
//! rest pose, in every tick, until its reports show them; → done. When they do not show them within 100 packets, the
//! device does not understand, and the person has to let go and press again.
//! Deliberately absent: finding the pose by driving against the stops.

/// Front button.
const BUTTON: i16 = 1;
/// The joints are held still for so many packets.
const STILL_PACKETS: u32 = 500;
/// Still is within so many counts: half a millimetre at the end of the forearm.
const STILL_COUNTS: i32 = 8;
/// The device shows the counts that it was told within so many packets.
const TAKING_PACKETS: u32 = 100;
/// Counts by which it may have been moved meanwhile.
const TAKEN_COUNTS: i32 = 64;

/// What a packet has led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Nothing new.
    Nothing,
    /// The zero is there: positions so far meant nothing.
    Done,
    /// The device did not take it.
    Refused,
}

/// The way to the zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Homing {
    /// The button has not been seen up.
    #[default]
    Untrusted,
    /// It has.
    Waiting,
    /// The joints are held here, for so many packets.
    Holding([i16; 3], u32),
    /// The device is being told, for so many packets.
    Telling(u32),
    /// There is a zero.
    Done,
}

impl Homing {
    /// Whether the device must be told its counts now.
    #[must_use]
    pub fn is_telling(self) -> bool {
        matches!(self, Self::Telling(_))
    }

    /// One packet.
    pub fn tick(&mut self, joints: [i16; 3], info: i16, rest: [i16; 3]) -> Step {
        let is_down = info & BUTTON != 0;
        let (next, step) = match *self {
            Self::Untrusted => (if is_down { Self::Untrusted } else { Self::Waiting }, Step::Nothing),
            Self::Waiting | Self::Holding(..) if !is_down => (Self::Waiting, Step::Nothing),
            Self::Waiting => (Self::Holding(joints, 0), Step::Nothing),
            Self::Holding(at, _) if farthest(at, joints) > STILL_COUNTS => (Self::Holding(joints, 0), Step::Nothing),
            Self::Holding(_, held) if held >= STILL_PACKETS => (Self::Telling(0), Step::Nothing),
            Self::Holding(at, held) => (Self::Holding(at, held + 1), Step::Nothing),
            Self::Telling(_) if farthest(joints, rest) <= TAKEN_COUNTS => (Self::Done, Step::Done),
            Self::Telling(told) if told >= TAKING_PACKETS => (Self::Untrusted, Step::Refused),
            Self::Telling(told) => (Self::Telling(told + 1), Step::Nothing),
            Self::Done => (Self::Done, Step::Nothing),
        };
        *self = next;
        step
    }
}

fn farthest(a: [i16; 3], b: [i16; 3]) -> i32 {
    a.into_iter().zip(b).map(|(a, b)| (i32::from(a) - i32::from(b)).abs()).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: [i16; 3] = [0, 0, 6_000];
    const AT: [i16; 3] = [120, -40, 3];

    fn ticked(homing: &mut Homing, joints: [i16; 3], info: i16, packets: u32) -> Vec<Step> {
        (0..packets).map(|_| homing.tick(joints, info, REST)).filter(|step| *step != Step::Nothing).collect()
    }

    #[test]
    fn a_still_arm_with_the_button_down_gets_its_zero() {
        let mut homing = Homing::default();
        ticked(&mut homing, AT, 0, 3);
        ticked(&mut homing, AT, 1, STILL_PACKETS + 1);
        assert!(!homing.is_telling());
        ticked(&mut homing, AT, 1, 1);
        assert!(homing.is_telling());
        assert_eq!(ticked(&mut homing, REST, 1, 5), [Step::Done]);
        assert_eq!(homing, Homing::Done);
    }

    #[test]
    fn a_button_that_is_stuck_or_an_arm_that_moves_never_gets_there() {
        let mut homing = Homing::default();
        ticked(&mut homing, AT, 1, 5_000);
        assert_eq!(homing, Homing::Untrusted);
        ticked(&mut homing, AT, 0, 1);
        for i in 0..5_000_i16 {
            homing.tick([i * 3 % 300, 0, 0], 1, REST);
            assert!(!homing.is_telling());
        }
    }

    #[test]
    fn a_device_that_does_not_understand_is_refused_and_the_button_must_be_let_go() {
        let mut homing = Homing::default();
        ticked(&mut homing, AT, 0, 1);
        assert_eq!(ticked(&mut homing, AT, 1, 1_000), [Step::Refused]);
        assert_eq!(homing, Homing::Untrusted);
    }

    #[test]
    fn the_farthest_counts_do_not_overflow() {
        assert_eq!(farthest([i16::MIN, 0, 0], [i16::MAX, 0, 0]), 65_535);
    }
}
