//! Devices behind hidraw: the open HID arm with force, 3D mice and foot switches as side inputs.
//!
//! | file | work |
//! |---|---|
//! | `known` | which device is which, by vendor and product |
//! | `report`, `arm_kinematics` | the arm's reports, geometry and motors |
//! | `homing`, `arm` | the zero of its joints; from report to sample, from force to currents |
//! | `port` | hidraw |
//! | `side_report`, `side_input` | reports of side inputs; deadman switch and buttons round any device |

pub mod arm;
pub mod arm_kinematics;
pub mod homing;
pub mod known;
pub mod port;
pub mod report;
pub mod side_input;
pub mod side_report;

use super::Device;
use super::frame::SceneFromDevice;
use super::wire::WireDevice;
use crate::error::ServerError;
use arm::HidArm;
use arm_kinematics::{ArmConfig, ArmParams};
use known::HidRole;
use port::{HidOpenError, HidOpener};
use sim_core::vector::Vec3;
use std::path::Path;

impl From<HidOpenError> for ServerError {
    fn from(error: HidOpenError) -> Self {
        match error {
            HidOpenError::Refused { .. } => Self::Permission(error.to_string()),
            _ => Self::Unavailable(error.to_string()),
        }
    }
}

/// Opens the arm: the named node or the only fitting one, in the build of the file or the published one.
///
/// # Errors
/// 69 when there is none, 77 without rights on its node, 66 or 65 for a file that cannot be used.
pub fn open(node: Option<&Path>, file: Option<&Path>, centre_m: Vec3) -> Result<Box<dyn Device>, ServerError> {
    let params = match file {
        None => ArmParams::new(&ArmConfig::default()).map_err(|e| ServerError::Internal(e.to_string()))?,
        Some(path) => read_build(path)?,
    };
    let device = port::choose(&port::list()?, HidRole::Arm, node)?;
    let opener = HidOpener::new(device.clone())?;
    let wire = opener.open_first()?;
    tracing::info!("{} ({:?}) at {}", HidRole::Arm.name(), device.name, device.path.display());
    let arm = HidArm::new(params, SceneFromDevice::workspace_at(centre_m));
    Ok(Box::new(WireDevice::new("hid", arm.limits(), arm, opener, wire)))
}

/// The build of an arm from its file.
///
/// # Errors
/// 66 for a file that cannot be read, 65 for one that cannot be used.
pub fn read_build(path: &Path) -> Result<ArmParams, ServerError> {
    let text = std::fs::read_to_string(path).map_err(|e| ServerError::reading(path, &e))?;
    let config: ArmConfig = toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        ServerError::BadData(format!("{}:{line}: {}; see docs/hid.md for the keys", path.display(), e.message()))
    })?;
    ArmParams::new(&config).map_err(|e| ServerError::BadData(format!("{}: {e}", path.display())))
}
