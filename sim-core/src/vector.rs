//! The two linear-algebra types of the whole core: positions, velocities and forces are [`Vec3`],
//! stiffnesses are symmetric [`Mat3`]; SI units.

/// A vector in the scene frame.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 × 3 matrix, symmetric wherever it is a stiffness.
pub type Mat3 = nalgebra::Matrix3<f64>;
