//! Soft tissue (Zhang et al., §2.1): networks, models, integrators, regulation.

pub mod network;
