//! A made-up machine for tests: a folder with the files that the checks read.

use crate::machine::Machine;
use tempfile::TempDir;

/// User of the made-up machine.
pub(crate) const USER: u32 = 1001;

/// The folder; it goes with the value.
pub(crate) struct Tree(TempDir);

impl Tree {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    /// With this file in it.
    pub(crate) fn with(self, path: &str, text: &str) -> Self {
        self.with_bytes(path, text.as_bytes())
    }

    /// With this file, which is no text, in it.
    pub(crate) fn with_bytes(self, path: &str, bytes: &[u8]) -> Self {
        let place = self.0.path().join(path);
        std::fs::create_dir_all(place.parent().expect("below the root")).expect("own folder");
        std::fs::write(place, bytes).expect("own file");
        self
    }

    /// An ordinary user who may use every node.
    pub(crate) fn machine(&self) -> Machine {
        Machine::below(self.0.path(), USER, &[USER], |_| true)
    }

    /// The same user, to whom no node is open.
    pub(crate) fn locked(&self) -> Machine {
        Machine::below(self.0.path(), USER, &[USER], |_| false)
    }
}
