//! Files and directories that belong to the user alone.
//!
//! Every directory is opened with `O_NOFOLLOW` and its descriptor is checked (owner = effective
//! user, `mode & 077 = 0`), so that neither a symlink nor a directory squatted by somebody else is
//! used. The directory above must belong to us or to root and, when others may write to it, must
//! be sticky: else they could exchange ours after the check.

use super::RunError;
use rustix::fs::{
    AtFlags, FlockOperation, Mode, OFlags, flock, fstat, mkdir, open, openat, renameat, statat, unlinkat,
};
use rustix::io::Errno;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

/// Descriptions of runs are far smaller; a longer file is not ours.
const MAX_TEXT_BYTES: u64 = 4096;
const GROUP_AND_OTHERS: u32 = 0o077;
const WRITE_BY_OTHERS: u32 = 0o022;
const STICKY: u32 = 0o1000;

/// An open, checked directory.
#[derive(Debug)]
pub(super) struct PrivateDir {
    path: PathBuf,
    fd: OwnedFd,
}

impl PrivateDir {
    /// Opens an existing directory and checks that it is ours alone.
    pub(super) fn open(path: &Path) -> Result<Self, RunError> {
        let refuse = |reason| RunError::Unsafe { path: path.to_owned(), reason };
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let fd = match open(path, flags, Mode::empty()) {
            Ok(fd) => fd,
            Err(Errno::LOOP | Errno::NOTDIR) => return Err(refuse("is a symbolic link or no directory")),
            Err(e) => return Err(RunError::io("open directory", path, e)),
        };
        let stat = fstat(&fd).map_err(|e| RunError::io("inspect", path, e))?;
        if stat.st_uid != rustix::process::geteuid().as_raw() {
            return Err(refuse("belongs to another user"));
        }
        if stat.st_mode & GROUP_AND_OTHERS != 0 {
            return Err(refuse("is open to other users (its mode is not 0700)"));
        }
        Ok(Self { path: path.to_owned(), fd })
    }

    /// Creates the directory with mode 0700 unless it exists, then opens and checks it.
    pub(super) fn create(path: &Path) -> Result<Self, RunError> {
        match mkdir(path, Mode::RWXU) {
            Ok(()) | Err(Errno::EXIST) => Self::open(path),
            Err(e) => Err(RunError::io("create directory", path, e)),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Opens or creates a file (0600) to be locked.
    pub(super) fn lock_file(&self, name: &str) -> Result<File, RunError> {
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let fd = openat(&self.fd, name, flags, Mode::RUSR | Mode::WUSR)
            .map_err(|e| RunError::io("open", &self.file(name), e))?;
        Ok(File::from(fd))
    }

    /// Opens a file of this directory for locking, if it is there.
    pub(super) fn existing_lock_file(&self, name: &str) -> Result<Option<File>, RunError> {
        match openat(&self.fd, name, OFlags::RDWR | OFlags::NOFOLLOW | OFlags::CLOEXEC, Mode::empty()) {
            Ok(fd) => Ok(Some(File::from(fd))),
            Err(Errno::NOENT) => Ok(None),
            Err(e) => Err(RunError::io("open", &self.file(name), e)),
        }
    }

    /// Whether `file`, opened earlier, is still the one that `name` names.
    pub(super) fn still_names(&self, name: &str, file: &File) -> Result<bool, RunError> {
        let open_one = fstat(file).map_err(|e| RunError::io("inspect", &self.file(name), e))?;
        match statat(&self.fd, name, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(named) => Ok(named.st_ino == open_one.st_ino && named.st_dev == open_one.st_dev),
            Err(Errno::NOENT) => Ok(false),
            Err(e) => Err(RunError::io("inspect", &self.file(name), e)),
        }
    }

    /// Reads a short text file, if it is there.
    pub(super) fn read_text(&self, name: &str) -> Result<Option<String>, RunError> {
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::CLOEXEC | OFlags::NONBLOCK;
        let fd = match openat(&self.fd, name, flags, Mode::empty()) {
            Ok(fd) => fd,
            Err(Errno::NOENT) => return Ok(None),
            Err(e) => return Err(RunError::io("read", &self.file(name), e)),
        };
        let mut text = String::new();
        File::from(fd)
            .take(MAX_TEXT_BYTES)
            .read_to_string(&mut text)
            .map_err(|e| RunError::io("read", &self.file(name), e))?;
        Ok(Some(text))
    }

    /// Replaces a file (0600) so that a reader sees the old text or the new one, never a half.
    pub(super) fn replace_text(&self, name: &str, text: &str) -> Result<(), RunError> {
        let temporary = format!(".{name}.new");
        let fail = |e: std::io::Error| RunError::io("write", &self.file(name), e);
        match unlinkat(&self.fd, &temporary, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => {}
            Err(e) => return Err(fail(e.into())),
        }
        let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let fd = openat(&self.fd, &temporary, flags, Mode::RUSR | Mode::WUSR).map_err(|e| fail(e.into()))?;
        File::from(fd).write_all(text.as_bytes()).map_err(fail)?;
        renameat(&self.fd, &temporary, &self.fd, name).map_err(|e| fail(e.into()))
    }

    /// Removes a file, if it is there.
    pub(super) fn remove_file(&self, name: &str) -> Result<(), RunError> {
        match unlinkat(&self.fd, name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(e) => Err(RunError::io("remove", &self.file(name), e)),
        }
    }
}

/// Outcome of an attempt to lock a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lock {
    /// We hold it.
    Held,
    /// Another process holds it.
    Taken,
}

/// Tries to lock a file without waiting.
pub(super) fn try_lock(file: &File, path: &Path, operation: FlockOperation) -> Result<Lock, RunError> {
    match flock(file, operation) {
        Ok(()) => Ok(Lock::Held),
        Err(Errno::WOULDBLOCK) => Ok(Lock::Taken),
        Err(e) => Err(RunError::io("lock", path, e)),
    }
}

/// Checks the directory in which ours is going to live; symlinks are resolved first.
pub(super) fn check_parent(path: &Path) -> Result<PathBuf, RunError> {
    let real = path.canonicalize().map_err(|e| RunError::io("find", path, e))?;
    let stat = rustix::fs::stat(&real).map_err(|e| RunError::io("inspect", &real, e))?;
    let refuse = |reason| Err(RunError::Unsafe { path: real.clone(), reason });
    if stat.st_uid != rustix::process::geteuid().as_raw() && stat.st_uid != 0 {
        return refuse("belongs to another user");
    }
    if stat.st_mode & WRITE_BY_OTHERS != 0 && stat.st_mode & STICKY == 0 {
        return refuse("can be written by other users and is not sticky");
    }
    Ok(real)
}
