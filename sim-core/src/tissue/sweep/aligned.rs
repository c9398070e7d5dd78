//! Numbers from a cache line's start on: a vector that crosses a line costs two accesses.

/// Bytes of a cache line, and of the widest vector.
const LINE_BYTES: usize = 64;

/// A fixed number of values, aligned. A copy is aligned anew.
#[derive(Debug)]
pub(super) struct Aligned<T> {
    raw: Vec<T>,
    at: usize,
    len: usize,
}

impl<T: Copy + Default> Aligned<T> {
    /// As many defaults.
    pub(super) fn new(len: usize) -> Self {
        let raw = vec![T::default(); len + LINE_BYTES / size_of::<T>()];
        let at = raw.as_ptr().align_offset(LINE_BYTES).min(raw.len() - len);
        Self { raw, at, len }
    }

    /// The values.
    pub(super) fn get(&self) -> &[T] {
        &self.raw[self.at..self.at + self.len]
    }

    /// The values.
    pub(super) fn get_mut(&mut self) -> &mut [T] {
        &mut self.raw[self.at..self.at + self.len]
    }
}

impl<T: Copy + Default> Clone for Aligned<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::new(self.len);
        copy.get_mut().copy_from_slice(self.get());
        copy
    }
}
