//! Soft tissue (Zhang et al., §2.1): networks, models, integrators, regulation.

pub mod area;
mod condensation;
pub mod constraint;
pub mod cut;
pub mod energy;
pub mod force;
pub mod geodesic;
pub mod handle;
pub mod integrator;
pub mod lattice;
mod link_solve;
pub mod load;
pub mod model;
pub mod network;
pub mod paper_explicit;
pub mod params;
mod patch_select;
pub mod patch_set;
pub mod port;
pub mod regulation;
pub mod semi_implicit;
pub mod settle;
pub mod solver;
pub mod solver_params;
pub mod stability;
pub mod surface;
pub mod suture_pair;
#[cfg(test)]
mod tests;
pub mod ttsm;
pub mod utsm;

#[cfg(test)]
mod lattice_tests;
#[cfg(test)]
mod test_support;
