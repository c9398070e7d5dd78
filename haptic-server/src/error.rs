//! The one error type of the programs: a sentence for a person and an exit code for a script.
//!
//! Each variant is one class of `sysexits`; its text says what, where (file:line:column for files) and
//! the remedy. Errors of the libraries are turned into it where the class is known, that is in the
//! module that opened the file or the device.

use crate::exit;

/// Why a program ends without success.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServerError {
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// An input file is malformed.
    #[error("{0}")]
    BadData(String),
    /// An input file is missing or unreadable.
    #[error("{0}")]
    NoInput(String),
    /// A device, service or resource is not there.
    #[error("{0}")]
    Unavailable(String),
    /// A fault of the program itself, or of one of its processes.
    #[error("{0}")]
    Internal(String),
    /// Another server runs.
    #[error("{0}")]
    TryAgain(String),
    /// A right is missing.
    #[error("{0}")]
    Permission(String),
    /// A value is out of range.
    #[error("{0}")]
    Configuration(String),
    /// A second interrupt asked for an immediate end.
    #[error("interrupted twice: ended at once, without the ramp to zero force; interrupt once for an orderly end")]
    Interrupted,
    /// A child process has said on stderr why it ended; there is nothing to add.
    #[error("a process of this run ended with exit code {0}; the reason stands above")]
    Reported(u8),
}

impl ServerError {
    /// The exit code of this class.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => exit::USAGE,
            Self::BadData(_) => exit::BAD_DATA,
            Self::NoInput(_) => exit::NO_INPUT,
            Self::Unavailable(_) => exit::UNAVAILABLE,
            Self::Internal(_) => exit::INTERNAL,
            Self::TryAgain(_) => exit::TRY_AGAIN,
            Self::Permission(_) => exit::PERMISSION,
            Self::Configuration(_) => exit::CONFIGURATION,
            Self::Interrupted => exit::INTERRUPTED,
            Self::Reported(code) => *code,
        }
    }

    /// Class of a failure to read an input file: missing is 66, everything else too, with the reason.
    #[must_use]
    pub fn reading(path: &std::path::Path, error: &std::io::Error) -> Self {
        let remedy = match error.kind() {
            std::io::ErrorKind::NotFound => "check the path",
            std::io::ErrorKind::PermissionDenied => "give this user read permission",
            _ => "check the file and the disk",
        };
        Self::NoInput(format!("{}: cannot read: {error}; {remedy}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_no_input() {
        let error = std::io::Error::from(std::io::ErrorKind::NotFound);
        assert_eq!(ServerError::reading(std::path::Path::new("a.csv"), &error).exit_code(), exit::NO_INPUT);
    }
}
