//! An allocator that counts the calls of each thread.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

/// Calls of the allocator on this thread so far: allocations, reallocations and releases.
pub(crate) fn calls() -> u64 {
    CALLS.get()
}

struct Counting;

fn count() {
    // A thread that is being torn down has no counter left; nobody asks it.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

#[expect(unsafe_code, reason = "an allocator cannot be written without")]
// SAFETY: every call goes to the system's allocator unchanged; counting touches a constant-initialised thread local, which
// neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    // SAFETY: the caller keeps the contract of `System::alloc`.
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on as it came.
        unsafe { System.alloc(layout) }
    }

    // SAFETY: the caller keeps the contract of `System::dealloc`.
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: passed on as it came.
        unsafe { System.dealloc(pointer, layout) }
    }

    // SAFETY: the caller keeps the contract of `System::alloc_zeroed`.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on as it came.
        unsafe { System.alloc_zeroed(layout) }
    }

    // SAFETY: the caller keeps the contract of `System::realloc`.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count();
        // SAFETY: passed on as it came.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn the_counter_counts_this_thread_only() {
    let before = calls();
    let kept = std::hint::black_box(vec![1_u8; 100]);
    assert_eq!(calls() - before, 1);
    drop(kept);
    assert_eq!(calls() - before, 2);
    std::thread::scope(|scope| {
        let counted = calls();
        let other = scope.spawn(|| std::hint::black_box(vec![1_u8; 100]).len());
        assert!(other.join().is_ok());
        // Starting and joining a thread costs this one a handful; the other's own allocations are not among them.
        assert!(calls() - counted < 50);
    });
}
