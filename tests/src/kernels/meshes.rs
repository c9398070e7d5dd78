//! The meshes that kernels are timed on: a plain sheet, a liver, a vessel of three layers.

use crate::shared::shared;
use haptic_server::solver::mesh_obj::{ObjLimits, read_obj};
use sim_core::scene::build::build_tissue;
use sim_core::scene::presets;
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};
use sim_core::vector::Vec3;

/// Metres per unit of the shared liver.
const LIVER_UNIT_M: f64 = 0.01;
/// Spacing of the sheet, metres.
const SPACING_M: f64 = 2e-3;

/// A sheet of `side`² nodes with structural and shear springs, slightly uneven.
///
/// # Panics
/// Never: the network is sound by construction.
#[must_use]
pub fn sheet(side: u32) -> SpringNetwork {
    let place = |i: u32| {
        let (column, row) = (f64::from(i % side), f64::from(i / side));
        let uneven = 0.05 * SPACING_M * f64::from(i).sin();
        Vec3::new(SPACING_M * column + uneven, SPACING_M * row, 2.0 * uneven)
    };
    let mut springs = Vec::new();
    let across = SPACING_M * std::f64::consts::SQRT_2;
    for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
        let a = row * side + column;
        let mut join = |b: u32, stiffness_n_per_m: f64, rest_length_m: f64| {
            springs.push(Spring { a, b, stiffness_n_per_m, rest_length_m, family: SpringFamily::Structural });
        };
        if column + 1 < side {
            join(a + 1, 160.0, SPACING_M);
        }
        if row + 1 < side {
            join(a + side, 160.0, SPACING_M);
            if column > 0 {
                join(a + side - 1, 80.0, across);
            }
            if column + 1 < side {
                join(a + side + 1, 80.0, across);
            }
        }
    }
    let n = (side * side) as usize;
    SpringNetwork::new((0..side * side).map(place).collect(), vec![1e-3; n], vec![0.0; n], vec![0; n], springs)
        .expect("a grid is sound")
}

/// The meshes by name: a sheet of 128², the shared liver where it is there and else the built-in one, and a vessel of
/// three layers.
///
/// # Panics
/// When a preset, or the shared liver, does not build.
#[must_use]
pub fn all() -> Vec<(String, SpringNetwork)> {
    let liver = presets::liver();
    let mesh = shared("meshes/liver-smooth.obj").map(|path| {
        let bytes = std::fs::read(&path).expect("the shared liver can be read");
        read_obj(&bytes, "liver-smooth.obj", LIVER_UNIT_M, ObjLimits::default()).expect("the shared liver is sound")
    });
    let name = if mesh.is_some() { "liver-smooth.obj" } else { "liver" };
    let built = |config, mesh| build_tissue(config, mesh).expect("a preset builds").network;
    vec![
        ("sheet of 128 x 128".to_owned(), sheet(128)),
        (name.to_owned(), built(&liver, mesh.as_ref())),
        ("vessel of three layers".to_owned(), built(&presets::vessel(), None)),
    ]
}
