//! Recorded data beside the repository (`../shared`): traces, meshes, networks of other people, never copied into the
//! project. A test that needs them passes without them and says so.

use std::path::{Path, PathBuf};

/// A file or folder under `../shared`, or `None` with a printed notice when it is not there.
#[must_use]
pub fn shared(relative: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(relative);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared/{relative} is not here; the rest of this test did not run");
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_none() {
        assert_eq!(shared("no-such-folder/no-such-file"), None);
    }
}
