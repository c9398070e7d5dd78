//! Independent pieces of work on both cores; results in the order of the pieces, so that equal reports have equal rows.
//!
//! For what is not timed: two threads share caches, and a figure in nanoseconds is only worth what ran beside it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Threads that a report may use.
const THREADS: usize = 2;

/// Works on the items side by side; the order of the results is theirs.
pub(super) fn side_by_side<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    dearest_first(items, |_| 0.0, work)
}

/// The same, begun with what is expected to take longest, so that the threads end together.
pub(super) fn dearest_first<T: Sync, R: Send>(
    items: &[T],
    expected: impl Fn(&T) -> f64,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by(|a, b| expected(&items[*b]).total_cmp(&expected(&items[*a])));
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<R>>> = items.iter().map(|_| Mutex::new(None)).collect();
    crossbeam::thread::scope(|scope| {
        for _ in 0..THREADS.min(items.len()) {
            scope.spawn(|_| {
                while let Some(&index) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let result = work(&items[index]);
                    if let Ok(mut slot) = results[index].lock() {
                        *slot = Some(result);
                    }
                }
            });
        }
    })
    .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    results.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_side_by_side_keeps_its_order() {
        let expected: Vec<u64> = (0..100).map(|i| i * i).collect();
        let items: Vec<u64> = (0..100).collect();
        assert_eq!(side_by_side(&items, |i| i * i), expected);
        assert_eq!(dearest_first(&items, |i| (i % 7) as f64, |i| i * i), expected);
    }
}
