//! Scenes (Zhang et al., §3): what a scene file says, the three presets, which stages a scene has, and one
//! step of a scene.

pub mod config;
pub mod presets;
pub mod suturing;
