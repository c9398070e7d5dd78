//! A stage that a build leaves out has no values: its type is [`Absent`], and the compiler drops every path to it.
//!
//! Each optional stage is a feature of this crate, all on by default. With a feature off, `Option<Stage<T, false>>` is
//! `None` by its type: no memory, no branch, no code. Such a build is the measure for a scene without the stage
//! (`tests/bare-core` is this crate with every stage left out; `tests/src/instructions` counts both).
//! Deliberately absent: `cfg` at the places where stages are used.

use std::convert::Infallible;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// `T` where `BUILT`, else [`Absent`].
pub type Stage<T, const BUILT: bool> = <Switch<BUILT> as Choose<T>>::Chosen;

/// Whether attachments (Algorithm 1) are in this build.
pub const ATTACHMENTS: bool = cfg!(feature = "attachments");
/// Whether the suture line and its stitches are in this build.
pub const SUTURE_LINE: bool = cfg!(feature = "suture-line");
/// Whether the suture control (Algorithm 2) is in this build.
pub const SUTURE_CONTROL: bool = cfg!(feature = "suture-control");
/// Whether nodes at rest may sleep in this build.
pub const SLEEP: bool = cfg!(feature = "sleep");
/// Whether tissues with an inner shell or several layers are in this build.
pub const INNER_LAYERS: bool = cfg!(feature = "inner-layers");

/// A `T` that this build leaves out. It has no values.
#[derive(Debug)]
pub struct Absent<T>(Infallible, PhantomData<T>);

/// Whether a stage is built.
#[derive(Clone, Copy, Debug)]
pub struct Switch<const BUILT: bool>;

/// The type that stands for a stage.
pub trait Choose<T> {
    /// `T` or [`Absent`].
    type Chosen: Keep<T>;
}

impl<T> Choose<T> for Switch<true> {
    type Chosen = T;
}

impl<T> Choose<T> for Switch<false> {
    type Chosen = Absent<T>;
}

/// Puts a value where a stage is expected.
pub trait Keep<T>: Sized {
    /// The value, or `None` where the build leaves the stage out.
    fn keep(value: T) -> Option<Self>;
}

impl<T> Keep<T> for T {
    fn keep(value: T) -> Option<T> {
        Some(value)
    }
}

impl<T> Keep<T> for Absent<T> {
    fn keep(_: T) -> Option<Self> {
        None
    }
}

impl<T> Deref for Absent<T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self.0 {}
    }
}

impl<T> DerefMut for Absent<T> {
    fn deref_mut(&mut self) -> &mut T {
        match self.0 {}
    }
}

impl<T> Clone for Absent<T> {
    fn clone(&self) -> Self {
        match self.0 {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absent_stage_takes_no_memory_and_keeps_no_value() {
        assert_eq!(size_of::<Option<Stage<[u64; 9], false>>>(), 0);
        assert_eq!(size_of::<Option<Stage<[u64; 9], true>>>(), 80);
        let none: Option<Stage<u32, false>> = Keep::keep(7);
        assert!(none.is_none());
        let some: Option<Stage<u32, true>> = Keep::keep(7);
        assert_eq!(some, Some(7));
    }
}
