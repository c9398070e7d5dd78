//! The error stack: one for the process, last in, first out.
//!
//! An error carries its code, an internal code and the device it belongs to; taking one from an empty stack gives
//! success. The stack holds the last 256 errors: a client that never asks must not fill the memory.

use crate::codes::{ERRORS, INVALID_HANDLE, SUCCESS};
use std::collections::VecDeque;
use std::ffi::CStr;

/// Errors kept at most.
const DEPTH: usize = 256;

/// An error as the interface gives it, by value: 12 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorInfo {
    /// Code.
    pub code: u32,
    /// Internal code.
    pub internal: i32,
    /// Device it belongs to.
    pub device: u32,
}

const _: () = assert!(size_of::<ErrorInfo>() == 12 && align_of::<ErrorInfo>() == 4);

/// The stack.
#[derive(Debug, Default)]
pub(crate) struct ErrorStack {
    entries: VecDeque<ErrorInfo>,
}

impl ErrorStack {
    /// Room for all errors from the start.
    pub(crate) fn new() -> Self {
        Self { entries: VecDeque::with_capacity(DEPTH) }
    }

    /// An error of a device.
    pub(crate) fn push(&mut self, code: u32, internal: i32, device: u32) {
        if self.entries.len() == DEPTH {
            self.entries.pop_front();
        }
        self.entries.push_back(ErrorInfo { code, internal, device });
    }

    /// The newest error, taken off; success when there is none.
    pub(crate) fn pop(&mut self) -> ErrorInfo {
        self.entries.pop_back().unwrap_or(ErrorInfo { code: SUCCESS, internal: 0, device: INVALID_HANDLE })
    }
}

/// What a code means.
pub(crate) fn text(code: u32) -> &'static CStr {
    ERRORS.iter().find(|(other, _)| *other == code).map_or(c"unknown error", |(_, text)| text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_error_comes_first_and_an_empty_stack_gives_success() {
        let mut stack = ErrorStack::new();
        stack.push(0x0200, 1, 0);
        stack.push(0x0302, -28, 1);
        assert_eq!(stack.pop(), ErrorInfo { code: 0x0302, internal: -28, device: 1 });
        assert_eq!(stack.pop().code, 0x0200);
        assert_eq!(stack.pop().code, SUCCESS);
    }

    #[test]
    fn a_client_that_never_asks_keeps_the_newest_errors() {
        let mut stack = ErrorStack::new();
        for i in 0..1_000 {
            stack.push(0x0400, i, 0);
        }
        assert_eq!((stack.entries.len(), stack.pop().internal), (DEPTH, 999));
        assert_eq!(text(0x0402), c"call outside a frame");
        assert_eq!(text(7), c"unknown error");
    }
}
