//! Soft tissue (Zhang et al., §2.1): networks, models, integrators, regulation.

pub mod area;
pub mod cut;
pub mod geodesic;
pub mod lattice;
pub mod model;
pub mod network;
pub mod params;
mod patch_select;
pub mod surface;
pub mod suture_pair;
pub mod ttsm;
pub mod utsm;

#[cfg(test)]
mod lattice_tests;
#[cfg(test)]
mod test_support;
