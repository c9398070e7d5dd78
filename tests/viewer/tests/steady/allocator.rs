//! An allocator that counts, for each thread, its calls and the bytes that live; on request it notes who called.
//!
//! Who called is the crate whose frame is the innermost one among those named in [`CRATES`]: what a container or a smaller
//! library takes counts for the crate that uses it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

/// Crates among which the caller is found.
const CRATES: [&str; 12] = [
    "viewer_client",
    "protocol",
    "wgpu",
    "wgpu_core",
    "wgpu_hal",
    "wgpu_types",
    "egui",
    "egui_wgpu",
    "epaint",
    "emath",
    "ecolor",
    "steady",
];

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
    static LIVE: Cell<i64> = const { Cell::new(0) };
    /// Whether calls are noted with their stack.
    static NOTED: Cell<bool> = const { Cell::new(false) };
    static STACKS: RefCell<Vec<Backtrace>> = const { RefCell::new(Vec::new()) };
}

/// Calls of the allocator on this thread so far: allocations, reallocations and releases.
pub(crate) fn calls() -> u64 {
    CALLS.get()
}

/// Bytes that this thread has taken and not given back.
pub(crate) fn live_bytes() -> i64 {
    LIVE.get()
}

/// Allocations and reallocations of this work by the crate that asked for them, with one stack each for a person.
pub(crate) fn callers(work: impl FnOnce()) -> BTreeMap<&'static str, (u64, String)> {
    STACKS.with_borrow_mut(|stacks| stacks.reserve(100_000));
    NOTED.set(true);
    work();
    NOTED.set(false);
    let stacks = STACKS.take();
    let mut callers = BTreeMap::new();
    for stack in stacks {
        let text = stack.to_string();
        let entry = callers.entry(caller(&text)).or_insert_with(|| (0, text));
        entry.0 += 1;
    }
    callers
}

/// The crate that a stack is counted for. A frame is a symbol and, where the compiler left it, a file; without full debug
/// information the symbol of a crate of this workspace lacks its path, and the file has it.
fn caller(stack: &str) -> &'static str {
    let mut names: Vec<&str> = Vec::new();
    for line in stack.lines().map(str::trim_start) {
        match (line.strip_prefix("at "), line.split_once(": ")) {
            (Some(file), _) => {
                if let Some(name) = names.last_mut() {
                    *name = crate_of_file(file).unwrap_or(name);
                }
            }
            (None, Some((_, symbol))) => names.push(crate_of_symbol(symbol)),
            (None, None) => {}
        }
    }
    // The first frames are those of this file, which belongs to the test.
    let mut outer = names.into_iter().skip_while(|name| *name != "steady").skip_while(|name| *name == "steady");
    let known = |name: &str| CRATES.into_iter().find(|known| known.replace('_', "-") == name.replace('_', "-"));
    outer.find_map(known).unwrap_or("unknown")
}

/// `wgpu_core` of `<wgpu_core::track::Tracker as core::ops::Drop>::drop`.
fn crate_of_symbol(symbol: &str) -> &str {
    let mut rest = symbol.trim_start_matches(|c: char| !c.is_alphanumeric() && c != '_');
    for word in ["mut ", "dyn ", "const "] {
        rest = rest.strip_prefix(word).unwrap_or(rest);
    }
    rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default()
}

/// `wgpu` of `…/wgpu-30.0.1/src/api/queue.rs:1:2`; `steady` of this folder.
fn crate_of_file(file: &str) -> Option<&str> {
    let Some((folder, _)) = file.rsplit_once("/src/") else { return file.contains("/steady/").then_some("steady") };
    let name = folder.rsplit('/').next()?;
    let is_version = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    Some(name.rsplit_once('-').filter(|(_, version)| is_version(version)).map_or(name, |(name, _)| name))
}

struct Counting;

/// Counts a call that changes what lives by so many bytes.
fn count(bytes: i64) {
    // A thread that is being torn down has no counters left; nobody asks it.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
    let _ = LIVE.try_with(|live| live.set(live.get() + bytes));
}

/// Notes the stack of an allocation; taking it allocates itself, which is not noted.
fn note() {
    if NOTED.try_with(|noted| noted.replace(false)).unwrap_or(false) {
        let (calls, live) = (CALLS.get(), LIVE.get());
        let stack = Backtrace::force_capture();
        STACKS.with_borrow_mut(|stacks| stacks.push(stack));
        CALLS.set(calls);
        LIVE.set(live);
        NOTED.set(true);
    }
}

fn size(layout: Layout) -> i64 {
    i64::try_from(layout.size()).unwrap_or(i64::MAX)
}

#[expect(unsafe_code, reason = "an allocator cannot be written without")]
// SAFETY: every call goes to the system's allocator unchanged; counting touches thread locals that are made without
// allocating, and noting a stack is guarded against itself.
unsafe impl GlobalAlloc for Counting {
    // SAFETY: the caller keeps the contract of `System::alloc`.
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(size(layout));
        note();
        // SAFETY: passed on as it came.
        unsafe { System.alloc(layout) }
    }

    // SAFETY: the caller keeps the contract of `System::dealloc`.
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-size(layout));
        // SAFETY: passed on as it came.
        unsafe { System.dealloc(pointer, layout) }
    }

    // SAFETY: the caller keeps the contract of `System::alloc_zeroed`.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(size(layout));
        note();
        // SAFETY: passed on as it came.
        unsafe { System.alloc_zeroed(layout) }
    }

    // SAFETY: the caller keeps the contract of `System::realloc`.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(i64::try_from(new_size).unwrap_or(i64::MAX) - size(layout));
        note();
        // SAFETY: passed on as it came.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn calls_and_live_bytes_are_those_of_this_thread() {
    let before = (calls(), live_bytes());
    let kept = std::hint::black_box(vec![1_u8; 100]);
    assert_eq!((calls() - before.0, live_bytes() - before.1), (1, 100));
    drop(kept);
    assert_eq!((calls() - before.0, live_bytes() - before.1), (2, 0));
}

#[test]
fn a_caller_is_the_innermost_crate_that_is_named() {
    let own = "   0: note\n             at ./tests/steady/allocator.rs:9:2\n   1: steady::allocator::f\n";
    let vector = "   3: alloc::raw_vec::RawVecInner::grow\n             at library/alloc/src/a.rs:1:2\n   4: <alloc::vec::Vec<wgpu::A> as B>::push\n";
    let outside = "  5: hashbrown::map::insert\n   6: <wgpu_core::track::T as core::C>::f\n";
    let ours = "   7: lay\n             at ./viewer-client/src/render/props/mod.rs:50:9\n";
    let inlined = "   5: write\n             at registry/src/index-1/wgpu-hal-30.0.1/src/vulkan/a.rs:1:2\n";
    assert_eq!(caller(&[own, vector, outside, ours].concat()), "wgpu_core");
    assert_eq!(caller(&[own, vector, ours, outside].concat()), "viewer_client");
    assert_eq!(caller(&[own, vector, inlined, outside].concat()), "wgpu_hal");
    assert_eq!(caller(&[own, vector].concat()), "unknown");
    let seen = callers(|| drop(std::hint::black_box(vec![1_u8; 100])));
    assert_eq!(seen.into_iter().map(|(name, (count, _))| (name, count)).collect::<Vec<_>>(), [("steady", 1)]);
}
