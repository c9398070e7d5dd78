//! What is read about a machine: files below a root, the user, the environment. Tests put a folder in the root's place.
//!
//! Every path is written as it stands on a real machine (`/proc/version`) and looked up below the root. Texts are cut at 256 KiB,
//! lists at 4096 names, and what cannot be read is `None`: the checks say what that means. Nothing is written here.

use rustix::fs::{Access, access};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Group whose members may use the devices and run in real time (`packaging/`).
pub const GROUP: &str = "haptic";
/// Longest text that is read, bytes; the longest file of interest, `/proc/cpuinfo`, has about 1.5 KiB per processor.
const MAX_TEXT: u64 = 256 * 1024;
/// Most names of a folder that are looked at.
const MAX_NAMES: usize = 4096;

/// A machine as this user sees it.
#[derive(Clone, Debug)]
pub struct Machine {
    root: PathBuf,
    user_id: u32,
    groups: Vec<u32>,
    environment: Vec<(String, String)>,
    may_use: fn(&Path) -> bool,
}

/// How this user stands to the group [`GROUP`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Membership {
    /// There is no such group.
    NoGroup,
    /// The user is no member.
    NotListed,
    /// The user became a member after this session began.
    ListedLater,
    /// The user is a member, and so is this session.
    Member,
}

impl Machine {
    /// This machine, this user, this environment.
    #[must_use]
    pub fn of_process() -> Self {
        let mut groups: Vec<u32> =
            rustix::process::getgroups().unwrap_or_default().iter().map(|g| g.as_raw()).collect();
        groups.push(rustix::process::getegid().as_raw());
        Self {
            root: PathBuf::from("/"),
            user_id: rustix::process::geteuid().as_raw(),
            groups,
            environment: std::env::vars_os()
                .filter_map(|(k, v)| Some((k.into_string().ok()?, v.into_string().ok()?)))
                .collect(),
            may_use: |path| access(path, Access::READ_OK | Access::WRITE_OK).is_ok(),
        }
    }

    /// A machine whose files stand below a folder; every file may be used when `may_use` says so.
    #[must_use]
    pub fn below(root: &Path, user_id: u32, groups: &[u32], may_use: fn(&Path) -> bool) -> Self {
        Self { root: root.to_owned(), user_id, groups: groups.to_vec(), environment: Vec::new(), may_use }
    }

    /// The same with a variable more in its environment.
    #[must_use]
    pub fn with_variable(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Where a path of the machine really stands.
    #[must_use]
    pub fn place(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// The bytes of a file.
    #[must_use]
    pub fn bytes(&self, path: &str) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(self.place(path)).ok()?.take(MAX_TEXT).read_to_end(&mut bytes).ok()?;
        Some(bytes)
    }

    /// The text of a file.
    #[must_use]
    pub fn text(&self, path: &str) -> Option<String> {
        self.bytes(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
    }

    /// The text of a file of one value, without blanks round it.
    #[must_use]
    pub fn value(&self, path: &str) -> Option<String> {
        self.text(path).map(|text| text.trim().to_owned())
    }

    /// Names in a folder, sorted; none when it is not there.
    #[must_use]
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.place(folder)).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries.filter_map(|e| e.file_name().into_string().ok()).take(MAX_NAMES).collect();
        names.sort();
        names
    }

    /// Whether a path is there.
    #[must_use]
    pub fn has(&self, path: &str) -> bool {
        self.place(path).exists()
    }

    /// Whether this user may read and write it.
    #[must_use]
    pub fn is_usable(&self, path: &str) -> bool {
        (self.may_use)(&self.place(path))
    }

    /// A variable of the environment that is set and not empty.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<&str> {
        self.environment.iter().rev().find(|(n, v)| n == name && !v.is_empty()).map(|(_, v)| v.as_str())
    }

    /// The user's name, or the number when nobody gave it one here.
    #[must_use]
    pub fn user_name(&self) -> String {
        let number = self.user_id.to_string();
        let passwd = self.text("/etc/passwd").unwrap_or_default();
        let fields = |line: &str| line.split(':').map(str::to_owned).collect::<Vec<_>>();
        let named = passwd.lines().map(fields).find(|f| f.get(2) == Some(&number));
        named.and_then(|f| f.into_iter().next()).filter(|name| !name.is_empty()).unwrap_or(number)
    }

    /// Whether this is the superuser.
    #[must_use]
    pub fn is_root(&self) -> bool {
        self.user_id == 0
    }

    /// How the user stands to the group [`GROUP`].
    #[must_use]
    pub fn membership(&self) -> Membership {
        let text = self.text("/etc/group").unwrap_or_default();
        let mut lines = text.lines().map(|line| line.split(':').collect::<Vec<_>>());
        let Some(group) = lines.find(|f| f.first() == Some(&GROUP)) else { return Membership::NoGroup };
        let user = self.user_name();
        if group.get(2).and_then(|id| id.parse().ok()).is_some_and(|id: u32| self.groups.contains(&id)) {
            Membership::Member
        } else if group.get(3).is_some_and(|members| members.split(',').any(|m| m == user)) {
            Membership::ListedLater
        } else {
            Membership::NotListed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_what_stands_below_its_root() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir_all(folder.path().join("etc")).expect("own folder");
        std::fs::write(folder.path().join("etc/passwd"), "root:x:0:0::/:/bin/sh\nann:x:1001:1001::/:/bin/sh\n")
            .expect("written");
        let machine = |groups: &[u32]| Machine::below(folder.path(), 1001, groups, |_| true).with_variable("LANG", "C");
        assert_eq!((machine(&[]).user_name().as_str(), machine(&[]).membership()), ("ann", Membership::NoGroup));
        for (group, own, expected) in [
            ("haptic:x:990:bob", &[1001][..], Membership::NotListed),
            ("haptic:x:990:bob,ann", &[1001], Membership::ListedLater),
            ("haptic:x:990:bob,ann", &[1001, 990], Membership::Member),
            ("haptic:x:many:", &[990], Membership::NotListed),
            ("haptic", &[990], Membership::NotListed),
        ] {
            std::fs::write(folder.path().join("etc/group"), group).expect("written");
            assert_eq!(machine(own).membership(), expected, "{group}");
        }
        assert_eq!(machine(&[]).variable("LANG"), Some("C"));
        assert_eq!(machine(&[]).with_variable("LANG", "").variable("LANG"), Some("C"));
        assert_eq!((machine(&[]).text("/no/such"), machine(&[]).names("/no/such")), (None, Vec::new()));
        assert_eq!(machine(&[]).names("/etc"), ["group", "passwd"]);
    }
}
