//! Why a hand file cannot be used: what, where (file:line:column), and the remedy.
//!
//! Exit codes follow sysexits: a file that is not there or cannot be opened is 66 (no input), a file
//! with wrong contents is 65 (bad data).

/// A hand file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum HandFileFault {
    /// No such file.
    #[error("{path}: the hand file does not exist; check the path")]
    NotFound {
        /// The file.
        path: String,
    },
    /// It cannot be read.
    #[error("{path}: the hand file cannot be read ({source}); check that it is a file and may be read")]
    Unreadable {
        /// The file.
        path: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// More bytes than any hand recording needs.
    #[error("{path}: the hand file is larger than {limit_bytes} bytes; split the recording")]
    TooLarge {
        /// The file.
        path: String,
        /// The limit.
        limit_bytes: u64,
    },
    /// Wrong contents.
    #[error("{path}:{line}:{column}: {what}; {remedy}")]
    BadData {
        /// The file.
        path: String,
        /// Line, from 1.
        line: u64,
        /// Column in bytes, from 1.
        column: u64,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A trace that cannot be used.
    #[error("{path}: {what}")]
    BadTrace {
        /// The file.
        path: String,
        /// What is wrong, at which byte, and the remedy.
        what: String,
    },
}

impl HandFileFault {
    /// Exit code of a program that needed the file.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NotFound { .. } | Self::Unreadable { .. } => 66,
            Self::TooLarge { .. } | Self::BadData { .. } | Self::BadTrace { .. } => 65,
        }
    }

    pub(super) fn bad(path: &str, line: u64, column: u64, what: &str, remedy: &'static str) -> Self {
        Self::BadData { path: path.into(), line, column, what: what.into(), remedy }
    }

    pub(super) fn from_io(path: &str, source: std::io::Error) -> Self {
        if source.kind() == std::io::ErrorKind::NotFound {
            Self::NotFound { path: path.into() }
        } else {
            Self::Unreadable { path: path.into(), source }
        }
    }
}
