//! Whose command is next: senders take turns, each with its own oldest command.
//!
//! A transport hands over the commands of one sender before those of the next, so that one who sends without end would
//! keep everybody else waiting for ever. Here each sender has a lane of [`LANE`] commands; what finds its lane full is lost and
//! counted. With n senders that wait, a command at the head of its lane is among the next n. A flood is told when it
//! begins and when its last command has had its turn, however many commands it had.

use super::WriterId;
use crate::session_command::SessionCommand;
use std::collections::VecDeque;

/// Commands of one sender that wait.
pub(super) const LANE: usize = 16;
/// Senders that wait; as many as may send at a time, and as many that have left meanwhile.
pub(super) const MOST_LANES: usize = 80;

/// A sender sends faster than its commands are obeyed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandFlood {
    /// From now on commands of this sender are lost.
    Began {
        /// What it says it is (process id).
        sender: u32,
    },
    /// The last of its commands had its turn.
    Ended {
        /// What it says it is (process id).
        sender: u32,
        /// Commands that were lost meanwhile.
        lost: u64,
    },
}

/// Commands that wait, sender by sender; the first lane is next.
#[derive(Debug, Default)]
pub(super) struct Turns {
    lanes: VecDeque<Lane>,
    news: VecDeque<CommandFlood>,
}

#[derive(Debug)]
struct Lane {
    writer: WriterId,
    waiting: VecDeque<SessionCommand>,
    last_sequence: u64,
    lost: u64,
}

impl Turns {
    /// Puts a command into its sender's lane.
    pub(super) fn add(&mut self, writer: WriterId, command: SessionCommand) {
        let (sequence, sender) = (command.header.sequence, command.sender);
        let Some(lane) = self.lanes.iter_mut().find(|lane| lane.writer == writer) else {
            if self.lanes.len() < MOST_LANES {
                let waiting = VecDeque::from([command]);
                self.lanes.push_back(Lane { writer, waiting, last_sequence: sequence, lost: 0 });
            }
            return;
        };
        let is_first_loss = lane.lost == 0;
        // Lost on the way, because the sender's queue was full.
        lane.lost += sequence.saturating_sub(lane.last_sequence.saturating_add(1)).min(u64::from(u32::MAX));
        lane.last_sequence = sequence;
        if lane.waiting.len() < LANE {
            lane.waiting.push_back(command);
        } else {
            lane.lost += 1;
        }
        if is_first_loss && lane.lost > 0 {
            self.tell(CommandFlood::Began { sender });
        }
    }

    /// The command whose turn it is.
    pub(super) fn next(&mut self) -> Option<SessionCommand> {
        let mut lane = self.lanes.pop_front()?;
        let command = lane.waiting.pop_front()?;
        if !lane.waiting.is_empty() {
            self.lanes.push_back(lane);
        } else if lane.lost > 0 {
            self.tell(CommandFlood::Ended { sender: command.sender, lost: lane.lost });
        }
        Some(command)
    }

    /// The next thing to tell about floods.
    pub(super) fn flood(&mut self) -> Option<CommandFlood> {
        self.news.pop_front()
    }

    /// Where nobody asks, the oldest news are forgotten.
    fn tell(&mut self, flood: CommandFlood) {
        if self.news.len() >= 2 * MOST_LANES {
            self.news.pop_front();
        }
        self.news.push_back(flood);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Field, Message};
    use proptest::prelude::*;

    fn command(sender: u32, sequence: u64) -> SessionCommand {
        let mut command = SessionCommand { command: 1, sender, ..SessionCommand::EMPTY };
        command.stamp(sequence, 1);
        command
    }

    #[test]
    fn a_flood_delays_another_sender_by_one_turn_and_is_told_twice() {
        let mut turns = Turns::default();
        for sequence in 1..=100_000 {
            turns.add(1, command(11, sequence));
        }
        turns.add(2, command(22, 1));
        assert_eq!(turns.flood(), Some(CommandFlood::Began { sender: 11 }));
        let order: Vec<u32> = std::iter::from_fn(|| turns.next()).map(|c| c.sender).collect();
        assert_eq!((order[0], order[1]), (11, 22));
        assert_eq!(order.len(), LANE + 1);
        assert_eq!(turns.flood(), Some(CommandFlood::Ended { sender: 11, lost: 100_000 - LANE as u64 }));
        assert_eq!(turns.flood(), None);
    }

    #[test]
    fn what_was_lost_on_the_way_is_counted_and_a_hostile_sequence_does_no_harm() {
        let mut turns = Turns::default();
        for sequence in [5, 6, 9, u64::MAX, 3] {
            turns.add(1, command(11, sequence));
        }
        assert_eq!(std::iter::from_fn(|| turns.next()).count(), 5);
        assert_eq!(turns.flood(), Some(CommandFlood::Began { sender: 11 }));
        let lost = 2 + u64::from(u32::MAX);
        assert_eq!(turns.flood(), Some(CommandFlood::Ended { sender: 11, lost }));
    }

    #[test]
    fn the_room_has_an_end() {
        let mut turns = Turns::default();
        for writer in 0..10 * MOST_LANES as u128 {
            for sequence in 1..40 {
                turns.add(writer, command(1, sequence));
            }
        }
        assert_eq!(turns.lanes.len(), MOST_LANES);
        assert!(turns.lanes.iter().all(|lane| lane.waiting.len() == LANE));
        assert!(turns.news.len() <= 2 * MOST_LANES);
    }

    proptest! {
        #[test]
        fn nobody_is_passed_over_twice_by_the_same_sender_and_each_lane_keeps_its_order(
            acts in proptest::collection::vec((0..6_u32, prop::bool::weighted(0.4)), 1..400),
        ) {
            let mut turns = Turns::default();
            let mut sent = [0_u64; 6];
            let mut got = [0_u64; 6];
            // How often each of the others was served while this one waited.
            let mut passed = [[0_u32; 6]; 6];
            for (who, is_sent) in acts {
                if is_sent {
                    sent[who as usize] += 1;
                    turns.add(u128::from(who), command(who, sent[who as usize]));
                    continue;
                }
                let Some(served) = turns.next() else {
                    prop_assert!(turns.lanes.is_empty());
                    continue;
                };
                let served_by = served.sender as usize;
                prop_assert!(served.header.sequence > got[served_by]);
                got[served_by] = served.header.sequence;
                passed[served_by] = [0; 6];
                for lane in &turns.lanes {
                    let waiting = &mut passed[lane.writer as usize][served_by];
                    *waiting += u32::from(lane.writer != u128::from(served.sender));
                    prop_assert!(*waiting <= 1, "{} waits", lane.writer);
                }
                for (who, passed) in passed.iter_mut().enumerate() {
                    if turns.lanes.iter().all(|lane| lane.writer != who as u128) {
                        *passed = [0; 6];
                    }
                }
            }
        }
    }
}
