//! Devices behind hidraw: the open HID arm with force, 3D mice and foot switches as side inputs.
//!
//! | file | work |
//! |---|---|
//! | `known` | which device is which, by vendor and product |
//! | `report`, `arm_kinematics` | the arm's reports, geometry and motors |

pub mod arm_kinematics;
pub mod known;
pub mod report;
