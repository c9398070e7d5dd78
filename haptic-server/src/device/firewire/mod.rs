//! The original Omni on FireWire, without the vendor's software.
//!
//! | file | work |
//! |---|---|
//! | `registers` | addresses, identification, serial number |
//! | `packet`, `sequence` | what goes over the two isochronous channels, and in which order |
//! | `find`, `node`, `event`, `ioctl` | the kernel's list, character device, events and requests |
//! | `calibrate`, `fit`, `bench` | `haptic-server calibrate-force`: questions, least squares, motors |
//! | `session` | the talk that starts and stops the packets |
//! | `arm` | from packet to sample; from force to motors, if there is a scale |
//! | `force_scale` | the file that says what a count of the motors' converters is worth |

pub mod arm;
mod bench;
pub mod calibrate;
mod event;
pub mod find;
pub mod fit;
pub mod force_scale;
mod ioctl;
pub mod node;
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
use node::{CdevNode, NodeOpener};
use session::Session;
use sim_core::vector::Vec3;
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
    let found = find::find(Path::new(find::LIST)).map_err(|e| ServerError::Unavailable(e.to_string()))?;
    let rest = FireWireOmni::new(None, SceneFromDevice::workspace_at(Vec3::zeros())).rest();
    let opener = NodeOpener::new(&found, rest);
    Ok((found, opener))
}

/// Opens it for the first time.
///
/// # Errors
/// 77 without rights, 69 for a device that does not answer.
pub fn first(found: &Found, opener: &mut NodeOpener) -> Result<Session<CdevNode>, ServerError> {
    opener.open().map_err(|error| {
        let place = format!("{} ({}): {error}", found.node.display(), found.guid);
        match error {
            WireError::Os(_) => ServerError::Permission(format!(
                "{place}; a udev rule gives the rights: SUBSYSTEM==\"firewire\", ATTR{{vendor}}==\"0x000b99\", \
                 MODE=\"0660\", GROUP=\"haptic\", TAG+=\"uaccess\", and the same for ATTR{{is_local}}==\"1\"; then as root: \
                 usermod -aG haptic USER"
            )),
            _ => ServerError::Unavailable(place),
        }
    })
}

impl From<CalibrateError> for ServerError {
    fn from(error: CalibrateError) -> Self {
        match error {
            CalibrateError::Fit(_) | CalibrateError::Implausible(_) => Self::BadData(error.to_string()),
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
