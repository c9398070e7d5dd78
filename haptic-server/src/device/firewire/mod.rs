//! The original Omni on FireWire, without the vendor's software.
//!
//! | file | work |
//! |---|---|
//! | `registers` | addresses, identification, serial number |
//! | `packet`, `sequence` | what goes over the two isochronous channels, and in which order |
//! | `find`, `node`, `event`, `ioctl` | the kernel's list, character device, events and requests |
//! | `opener` | which Omni: at the start the first, later only the same |
//! | `calibrate`, `direction`, `fit`, `bench` | `haptic-server calibrate-force`: questions, signs, least squares, motors |
//! | `session` | the talk that starts and stops the packets |
//! | `arm` | from packet to sample; from force to motors, if there is a scale |
//! | `force_scale` | the file that says what a count of the motors' converters is worth |

pub mod arm;
mod bench;
pub mod calibrate;
mod direction;
mod event;
pub mod find;
pub mod fit;
pub mod force_scale;
mod ioctl;
pub mod node;
pub mod opener;
pub mod packet;
pub mod registers;
pub mod sequence;
pub mod session;

use super::Device;
use super::frame::SceneFromDevice;
use super::wire::{Opener, WireDevice, WireDriver, WireError};
use crate::error::ServerError;
use arm::FireWireOmni;
use bench::FireWireBench;
use calibrate::CalibrateError;
use find::Found;
use force_scale::ForceScaleFile;
use node::CdevNode;
use opener::NodeOpener;
use session::Session;
use sim_core::vector::Vec3;
use std::io::ErrorKind;
use std::path::Path;

/// Opens the Omni on the bus; without a force scale it gives its pose only.
///
/// # Errors
/// 69 when there is none, 77 without rights on its node, 66 or 65 for a scale that cannot be used.
pub fn open(file: Option<&Path>, centre_m: Vec3) -> Result<Box<dyn Device>, ServerError> {
    let frame = SceneFromDevice::workspace_at(centre_m);
    let (found, mut opener) = attached()?;
    let session = first(&found, &mut opener)?;
    let scale = file.map(|path| ForceScaleFile::load(path, session.serial())).transpose()?;
    tracing::info!("PHANTOM Omni, serial {}, at {}", session.serial(), found.node.display());
    if scale.is_none() {
        tracing::warn!("this Omni gives its pose and no force: {}", arm::NO_SCALE);
    }
    let omni = FireWireOmni::new(scale, frame);
    Ok(Box::new(WireDevice::new("firewire", omni.limits(), omni, opener, session)))
}

/// The Omni on the bus and who opens it.
///
/// # Errors
/// 69 when there is none.
pub fn attached() -> Result<(Found, NodeOpener), ServerError> {
    let list = Path::new(find::LIST);
    let found = find::find(list).map_err(|e| ServerError::Unavailable(e.to_string()))?.swap_remove(0);
    let rest = FireWireOmni::new(None, SceneFromDevice::workspace_at(Vec3::zeros())).rest();
    let opener = NodeOpener::new(list, rest);
    Ok((found, opener))
}

/// Opens it for the first time.
///
/// # Errors
/// 77 without rights, 69 for a device that is in use, has left or does not answer.
pub fn first(found: &Found, opener: &mut NodeOpener) -> Result<Session<CdevNode>, ServerError> {
    opener.open().map_err(|error| refusal(&format!("{} ({})", found.node.display(), found.guid), error))
}

/// Only missing rights are mended by a rule.
fn refusal(place: &str, error: WireError) -> ServerError {
    let WireError::Os(number) = error else { return ServerError::Unavailable(format!("{place}: {error}")) };
    let cause = std::io::Error::from_raw_os_error(number);
    if cause.kind() == ErrorKind::PermissionDenied {
        return ServerError::Permission(format!(
            "{place}: {cause}; a udev rule gives the rights: SUBSYSTEM==\"firewire\", ATTR{{vendor}}==\"0x000b99\", \
             MODE=\"0660\", GROUP=\"haptic\", TAG+=\"uaccess\"; then as root: usermod -aG haptic USER"
        ));
    }
    ServerError::Unavailable(format!("{place}: {cause}; end other programs that use it, check its cable and power"))
}

impl From<CalibrateError> for ServerError {
    fn from(error: CalibrateError) -> Self {
        match error {
            CalibrateError::Fit(_)
            | CalibrateError::Implausible(_)
            | CalibrateError::NotMoved(_)
            | CalibrateError::OneWay(_) => Self::BadData(error.to_string()),
            CalibrateError::Quit | CalibrateError::NoAnswer(_) => Self::Usage(error.to_string()),
            CalibrateError::Talk(_) | CalibrateError::Device(_) => Self::Unavailable(error.to_string()),
        }
    }
}

/// `haptic-server calibrate-force`: asks on the terminal, writes a new file, says what was written.
///
/// # Errors
/// 69 without an Omni, 64 when the person ends it, 65 for readings that give no scale, 77 for a file that cannot be written.
pub fn calibrate_force(out: &Path) -> Result<String, ServerError> {
    if out.exists() {
        return Err(ServerError::Usage(format!("{} is there already; name another file", out.display())));
    }
    let (found, mut opener) = attached()?;
    let session = first(&found, &mut opener)?;
    let serial = session.serial().to_owned();
    let mut bench = FireWireBench::new(&serial, session)
        .map_err(|e| ServerError::Unavailable(format!("cannot start a thread: {e}; raise the limit of processes")))?;
    let file = calibrate::calibrate(&mut bench, &mut std::io::stdin().lock(), &mut std::io::stderr().lock())?;
    let text = toml::to_string(&file).map_err(|e| ServerError::Internal(format!("cannot write the scale: {e}")))?;
    std::fs::write(out, text).map_err(|e| {
        ServerError::Permission(format!("{}: cannot write: {e}; name a place that you may write to", out.display()))
    })?;
    Ok(format!(
        "{} written for serial number {serial}: at most {:.2} N. Use it with --device firewire --device-file {}\n",
        out.display(),
        file.max_force_n,
        out.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::io::Errno;

    #[test]
    fn only_missing_rights_are_told_with_the_rule() {
        for errno in [Errno::ACCESS, Errno::PERM] {
            let told = refusal("/dev/fw1", WireError::Os(errno.raw_os_error()));
            assert!(matches!(&told, ServerError::Permission(text) if text.contains("udev rule")), "{told:?}");
        }
        for error in [WireError::Os(Errno::BUSY.raw_os_error()), WireError::Gone, WireError::Another] {
            let told = refusal("/dev/fw1", error);
            assert!(matches!(&told, ServerError::Unavailable(text) if !text.contains("udev")), "{told:?}");
        }
        let busy = refusal("/dev/fw1", WireError::Os(Errno::BUSY.raw_os_error())).to_string();
        assert!(busy.contains("busy"), "{busy}");
    }
}
