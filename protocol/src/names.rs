//! Names of everything that is shared between processes.
//!
//! A service is called `suture/v<wire version>/<message>`: programs of different wire versions
//! never meet on a service. All files of one run begin with the run's own prefix
//! `hs_<16 hex digits>_`, so that two runs never meet either, and leftovers of a dead run can be
//! told from the files of a living one. Nothing outside this crate writes these names.

use crate::wire::{Message, WIRE_VERSION};

/// Name of the directory with all runs of a user.
pub const ROOT_DIRECTORY: &str = "haptic-suture";
/// Attribute of every service that holds the layout hash of its message.
pub const LAYOUT_ATTRIBUTE: &str = "layout";

/// Name of the service that carries messages of type `M`.
#[must_use]
pub fn service_name<M: Message>() -> String {
    format!("suture/v{WIRE_VERSION}/{}", M::NAME)
}

/// Value of [`LAYOUT_ATTRIBUTE`] for messages of type `M`.
#[must_use]
pub fn layout_text<M: Message>() -> String {
    format!("{:016x}", M::LAYOUT_HASH)
}

/// Prefix of all shared-memory files of a run.
#[must_use]
pub fn run_prefix(run_id: u64) -> String {
    format!("hs_{run_id:016x}_")
}

/// Name of a run's directory inside [`ROOT_DIRECTORY`].
#[must_use]
pub fn run_directory(run_id: u64) -> String {
    format!("run-{run_id:016x}")
}

/// The run that a directory of this name belongs to; inverse of [`run_directory`].
#[must_use]
pub fn run_id_of(directory: &str) -> Option<u64> {
    let digits = directory.strip_prefix("run-")?;
    let lower_hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
    if digits.len() != 16 || !digits.bytes().all(lower_hex) {
        return None;
    }
    u64::from_str_radix(digits, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pointer_hand::PointerHand;
    use crate::scene_frame::{FrameHeader, OutlineHeader};
    use crate::servo_state::ServoState;
    use crate::session_command::SessionCommand;
    use crate::tissue_port::TissuePort;
    use crate::wound_report::WoundReport;

    #[test]
    fn service_names_carry_the_wire_version_and_differ() {
        let names = [
            service_name::<ServoState>(),
            service_name::<TissuePort>(),
            service_name::<WoundReport>(),
            service_name::<FrameHeader>(),
            service_name::<OutlineHeader>(),
            service_name::<SessionCommand>(),
            service_name::<PointerHand>(),
        ];
        for (i, name) in names.iter().enumerate() {
            assert!(name.contains(&format!("/v{WIRE_VERSION}/")), "{name}");
            assert!(!names[..i].contains(name), "{name} is used twice");
        }
    }

    #[test]
    fn run_directory_names_are_read_back_and_others_are_not_ours() {
        for id in [0, 1, 0xdead_beef, u64::MAX] {
            assert_eq!(run_id_of(&run_directory(id)), Some(id));
        }
        for other in
            ["", "run-", "run-12", "run-+00000000000000f", "run-00000000000000FF", "run-00000000000000001", "x"]
        {
            assert_eq!(run_id_of(other), None, "{other}");
        }
    }
}
