//! The scheduler's table: who is called in a tick, in which order, until when.
//!
//! Every callback runs once per tick, high priority first, equal ones in the order of their scheduling; one that
//! answers "done" is taken off. A tick walks the table by asking for the next one, because a callback may change it.
//! Deliberately absent: the thread and the clock (`clockwork.rs`), and the call itself (`abi`, the unsafe edge).

/// Callbacks at most.
const ROOM: usize = 64;

/// A client's function with its argument, as numbers: only the unsafe edge makes calls of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Callback {
    pub(crate) function: usize,
    pub(crate) argument: usize,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    handle: u64,
    priority: u16,
    callback: Callback,
    ran_in: Option<u64>,
}

/// The table.
#[derive(Debug, Default)]
pub(crate) struct Table {
    entries: Vec<Entry>,
    last_handle: u64,
}

impl Table {
    /// Adds a callback; `None` when there is no room.
    pub(crate) fn add(&mut self, callback: Callback, priority: u16) -> Option<u64> {
        if self.entries.len() == ROOM {
            return None;
        }
        self.last_handle += 1;
        self.entries.push(Entry { handle: self.last_handle, priority, callback, ran_in: None });
        Some(self.last_handle)
    }

    /// Takes one off; false when it is not there.
    pub(crate) fn remove(&mut self, handle: u64) -> bool {
        let before = self.entries.len();
        self.entries.retain(|entry| entry.handle != handle);
        self.entries.len() < before
    }

    /// Whether it is still scheduled.
    pub(crate) fn holds(&self, handle: u64) -> bool {
        self.entries.iter().any(|entry| entry.handle == handle)
    }

    /// The next callback of this tick.
    pub(crate) fn next(&mut self, tick: u64) -> Option<(u64, Callback)> {
        let due = self.entries.iter_mut().filter(|entry| entry.ran_in != Some(tick));
        // `max_by_key` prefers the last of equals; the first scheduled shall come first.
        let entry = due.rev().max_by_key(|entry| entry.priority)?;
        entry.ran_in = Some(tick);
        Some((entry.handle, entry.callback))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(function: usize) -> Callback {
        Callback { function, argument: 0 }
    }

    #[test]
    fn high_priority_runs_first_and_each_once_per_tick() {
        let mut table = Table::default();
        for (name, priority) in [(1, 10), (2, 65_535), (3, 10), (4, 0)] {
            table.add(named(name), priority).expect("room");
        }
        for tick in 1..3 {
            let order: Vec<usize> = std::iter::from_fn(|| table.next(tick)).map(|(_, c)| c.function).collect();
            assert_eq!(order, [2, 1, 3, 4]);
        }
    }

    #[test]
    fn one_that_is_added_in_a_tick_still_runs_in_it() {
        let mut table = Table::default();
        table.add(named(1), 5);
        assert!(table.next(1).is_some());
        let added = table.add(named(2), 9).expect("room");
        assert_eq!(table.next(1), Some((added, named(2))));
        assert!(table.remove(added) && !table.remove(added) && !table.holds(added));
    }

    #[test]
    fn a_full_table_takes_no_more() {
        let mut table = Table::default();
        assert!((0..ROOM).all(|i| table.add(named(i), 0).is_some()));
        assert_eq!(table.add(named(99), 0), None);
    }
}
