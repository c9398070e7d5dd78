//! Scenes (Zhang et al., §3): what a scene file says, the three presets, which stages a scene has, and one
//! step of a scene.

pub mod build;
pub mod config;
pub mod grip;
pub mod line_course;
pub mod plan;
pub mod presets;
pub mod procedure;
mod second_hand;
pub mod sleep;
mod stages;
pub mod step;
pub mod stitching;
pub mod suturing;

#[cfg(test)]
mod tests;
