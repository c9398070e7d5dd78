//! Hands for big meshes: who does two pieces of work side by side.
//!
//! sim-core starts no OS thread; a [`Crew`] is handed in. Work is halved until one piece is left, so that `n` pieces take
//! `n − 1` joins whoever does them, and no piece sees another: the result is the same for any number of hands.
//! Deliberately absent: how many hands there are, where they run, how they wait.

use std::fmt::Debug;

/// Someone who does two pieces of work, side by side or one after the other, and returns when both are done.
pub trait Crew: Debug + Send + Sync {
    /// Does both.
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send));
}

/// One pair of hands: one piece after the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Crew for Alone {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        first();
        second();
    }
}
