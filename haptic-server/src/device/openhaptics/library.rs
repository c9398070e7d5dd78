//! Finding the vendor's library, and saying why it cannot be used.
//!
//! Tried in order: the given path alone, or else `libHD.so`, `libHD.so.3.4`, `libHD.so.3.0` by the loader's own search,
//! then the folders in which the vendor's installers put them. The loader's message is passed on with its whole chain of causes, and
//! the well-known ones get their remedy: a missing dependency is by far the most frequent. A library is loaded once per
//! process and path. Deliberately absent: the unsafe call (`ffi.rs`).

use super::ffi::{self, Hd};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Names and places that are tried.
pub const CANDIDATES: [&str; 6] = [
    "libHD.so",
    "libHD.so.3.4",
    "libHD.so.3.0",
    "/usr/lib/libHD.so.3.4",
    "/usr/lib64/libHD.so.3.0",
    "/usr/lib64/libHD.so",
];

/// Why there is no library.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LibraryError {
    /// None could be loaded.
    #[error("the OpenHaptics library cannot be loaded ({tried}); {remedy}")]
    NotLoaded {
        /// Every name with what the loader said.
        tried: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A function is missing.
    #[error("the OpenHaptics library {library} has no {symbol} ({cause}); use OpenHaptics 3.0 or 3.4")]
    NoSymbol {
        /// The library.
        library: String,
        /// The function.
        symbol: &'static str,
        /// What the loader said.
        cause: String,
    },
}

/// Signs in the loader's message, and what to do; the first that fits counts.
const SIGNATURES: [(&str, &str); 9] = [
    (
        "libncurses.so.5",
        "install the old curses library: apt install libncurses5 libtinfo5, or a package of your distribution with libncurses.so.5",
    ),
    ("libtinfo.so.5", "install the old terminal library: apt install libtinfo5 libncurses5"),
    ("libPhantomIOLib42", "install the vendor's Touch device driver, which brings libPhantomIOLib42.so"),
    ("libPHANToMIO", "install the FireWire device driver of OpenHaptics AE 3.0, which brings libPHANToMIO.so.4"),
    ("libraw1394", "install the FireWire library: apt install libraw1394-11"),
    ("libusb-1.0", "install the USB library: apt install libusb-1.0-0"),
    ("GLIBC", "the vendor's driver needs a newer C library than this system has; use a newer distribution"),
    ("wrong ELF class", "install the 64-bit library; this one is for another kind of processor"),
    ("invalid ELF header", "the file is no library; give the file that the name leads to"),
];

/// For a library that is simply not there.
const NOT_THERE: &str = "install OpenHaptics for Linux, or give the library with --openhaptics-library FILE";

/// The remedy for what a loader has said.
#[must_use]
pub fn remedy(said: &str) -> &'static str {
    SIGNATURES.iter().find(|(sign, _)| said.contains(sign)).map_or(NOT_THERE, |(_, remedy)| remedy)
}

/// Loads the library for good.
///
/// # Errors
/// What was tried, what the loader said, what to do.
pub fn load(given: Option<&Path>) -> Result<(Hd, PathBuf), LibraryError> {
    let candidates = given.map_or_else(|| CANDIDATES.map(PathBuf::from).to_vec(), |path| vec![path.to_owned()]);
    let mut tried = Vec::new();
    for path in candidates {
        match ffi::load(&path) {
            Ok(functions) => return Ok((Hd::new(functions), path)),
            Err((Some(symbol), error)) => {
                return Err(LibraryError::NoSymbol {
                    library: path.display().to_string(),
                    symbol,
                    cause: chain(&error),
                });
            }
            Err((None, error)) => {
                let (name, said) = (path.display().to_string(), chain(&error));
                // The loader names what is not there itself.
                tried.push(if said.starts_with(&name) { said } else { format!("{name}: {said}") });
            }
        }
    }
    let tried = tried.join("; ");
    Err(LibraryError::NotLoaded { remedy: remedy(&tried), tried })
}

/// An error with all its causes.
fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let inner_text = inner.to_string();
        if !text.contains(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        cause = inner.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_that_is_not_there_is_named_with_the_loader_s_words_and_the_remedy() {
        let error = load(Some(Path::new("no/such/libHD.so"))).err().expect("nobody has such a file").to_string();
        assert!(error.contains("no/such/libHD.so"), "{error}");
        assert!(error.contains("No such file") && error.contains("--openhaptics-library"), "{error}");
    }

    #[test]
    fn a_file_that_is_no_library_is_told_apart() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), "this is text, not a library, and long enough for a header of sixty-four bytes")
            .expect("written");
        let error = load(Some(file.path())).err().expect("text cannot be loaded").to_string();
        assert!(error.contains("invalid ELF header") && error.contains("is no library"), "{error}");
    }

    #[test]
    fn a_library_without_the_functions_names_the_first_that_is_missing() {
        let error = load(Some(Path::new("libc.so.6"))).err().expect("the C library is no haptic one");
        assert!(matches!(&error, LibraryError::NoSymbol { symbol: "hdInitDevice", .. }), "{error}");
    }

    #[test]
    fn the_known_signatures_lead_to_their_remedies() {
        for (said, expected) in [
            ("libncurses.so.5: cannot open shared object file", "libncurses5"),
            ("libPhantomIOLib42.so: cannot open shared object file", "Touch device driver"),
            ("version `GLIBC_2.29' not found", "newer distribution"),
            ("libHD.so: cannot open shared object file", "--openhaptics-library"),
        ] {
            assert!(remedy(said).contains(expected), "{said}");
        }
    }
}
