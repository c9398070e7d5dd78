//! What the report says of validation, refinement, deviations and curves, on small meshes: each against a published figure
//! or a closed form.

mod cases;
mod departures;
mod meshes;
