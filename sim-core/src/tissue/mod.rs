//! Soft tissue (Zhang et al., §2.1): networks, models, integrators, regulation.

pub mod area;
mod bdf2;
pub mod choice;
mod condensation;
pub mod constraint;
mod couplings;
pub mod crew;
pub mod cut;
pub mod energy;
pub mod force;
pub mod geodesic;
pub mod handle;
pub mod inner_shell;
pub mod integrator;
pub mod lattice;
mod link_solve;
pub mod load;
pub mod model;
pub mod network;
pub mod newton;
mod node;
pub mod paper_explicit;
pub mod params;
mod patch_select;
pub mod patch_set;
mod pcg;
pub mod port;
mod ray;
pub mod regulation;
mod scheme;
pub mod semi_implicit;
pub mod settle;
pub mod sleep;
mod slit_path;
pub mod solver;
pub mod solver_params;
pub mod spring_load;
pub mod stability;
mod step_matrix;
pub mod surface;
pub mod suture_pair;
pub mod sweep;
#[cfg(test)]
mod tests;
pub mod triangle_mesh;
pub mod ttsm;
pub mod utsm;
pub mod verlet;
pub mod vosm;
pub mod wound_frame;
pub mod xpbd;

#[cfg(test)]
mod lattice_tests;
#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod organ_mesh_tests;
#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod test_support;
