//! Every path at every level against the plain gather.
use super::dispatch::KernelLevel;
use super::*;
use crate::tissue::force;
use crate::tissue::network::{Spring, SpringFamily};

/// Sums in another order and fused products: a few roundings of the largest terms.
const ROUNDING: f64 = 4.0e-15;
const PATHS: [KernelPath; 3] = [KernelPath::Rows, KernelPath::Gather, KernelPath::Stencil];
const LEVELS: [KernelLevel; 3] = [KernelLevel::Best, KernelLevel::Avx2, KernelLevel::Portable];

fn spring(a: u32, b: u32) -> Spring {
    let stiffness_n_per_m = 100.0 + f64::from(a % 7);
    Spring { a, b, stiffness_n_per_m, rest_length_m: 1.5e-3 + 1e-6 * f64::from(b % 11), family: SpringFamily::Shear }
}

fn network(x: Vec<Vec3>, springs: Vec<Spring>) -> SpringNetwork {
    let n = x.len();
    SpringNetwork::new(x, vec![1.0; n], vec![0.0; n], vec![0; n], springs).unwrap()
}

/// A grid with a hole, and a handful of springs across it.
fn sheet(columns: u32, rows: u32) -> SpringNetwork {
    let place = |i: u32| {
        let (c, r) = (f64::from(i % columns), f64::from(i / columns));
        Vec3::new(2e-3 * c + 1e-4 * f64::from(i).sin(), 2e-3 * r, 2e-4 * (0.3 * f64::from(i)).cos())
    };
    let hole = |a: u32, b: u32| [a, b].iter().all(|i| i / columns == rows / 2 && i % columns > columns / 2);
    let mut springs = Vec::new();
    for (r, c) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        for (dr, dc) in [(0, 1), (1, -1), (1, 0), (1, 1)] {
            let (other_r, other_c) = (r + dr, c as i32 + dc);
            if other_r < rows && (0..columns as i32).contains(&other_c) {
                let (a, b) = (r * columns + c, other_r * columns + other_c as u32);
                if !hole(a, b) {
                    springs.push(spring(a, b));
                }
            }
        }
    }
    springs.extend([spring(0, columns * rows - 1), spring(3, columns * rows / 2), spring(1, columns - 1)]);
    network((0..columns * rows).map(place).collect(), springs)
}

/// Joins without any order.
fn tangle(nodes: u32) -> SpringNetwork {
    let place = |i: u32| Vec3::new((1.3 * f64::from(i)).sin(), (2.1 * f64::from(i)).cos(), 0.01 * f64::from(i)) * 1e-2;
    let mut pairs: Vec<(u32, u32)> = (0..nodes)
        .flat_map(|a| (1..8_u32).map(move |k| (a, (a * a * 7 + k * k * 31 + 5) % nodes)))
        .filter(|(a, b)| a != b)
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    network((0..nodes).map(place).collect(), pairs.into_iter().map(|(a, b)| spring(a, b)).collect())
}

#[test]
fn eq3_every_path_and_level_gives_the_force_of_the_plain_gather() {
    let mut relaxed = sheet(40, 33);
    relaxed.read_as_relaxed(0.7, |s| s.a % 5 == 0);
    for net in [relaxed, sheet(40, 33), sheet(9, 5), tangle(61), network(vec![Vec3::zeros(); 3], Vec::new())] {
        let count = net.node_count();
        let mut plain = vec![Vec3::zeros(); count];
        force::gather(&net, &net.rest_m, &mut plain);
        let scale: f64 = net.springs.iter().map(|s| s.stiffness_n_per_m * s.rest_length_m).fold(0.0, f64::max);
        let reach = net.springs.iter().map(|s| (net.rest_m[s.a as usize] - net.rest_m[s.b as usize]).norm());
        let largest = scale.max(110.0 * reach.fold(0.0, f64::max));
        for (path, level) in PATHS.iter().flat_map(|p| LEVELS.iter().map(move |l| (*p, *l))) {
            let mut found = vec![Vec3::repeat(7.0); count];
            assert_eq!(SpringSweep::with(&net, path, Precision::Double, level).sweep(&net.rest_m, &mut found), 0);
            for (node, (a, b)) in plain.iter().zip(&found).enumerate() {
                assert!((a - b).norm() <= 20.0 * ROUNDING * largest, "{path:?} {level:?} {node}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_sheet_takes_the_stencil_and_a_tangle_takes_rows() {
    let sheet = SpringSweep::new(&sheet(40, 33));
    assert_eq!(sheet.path(), KernelPath::Stencil);
    assert!(sheet.regular_springs() > 5000 && sheet.regular_springs() < sheet.ends.len());
    assert_eq!(SpringSweep::new(&tangle(61)).path(), KernelPath::Rows);
}

#[test]
fn coincident_ends_give_no_force_and_are_counted() {
    let x = vec![Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.1, 0.2, 0.4)];
    let net = network(x, vec![spring(0, 1)]);
    for (path, level) in PATHS.iter().flat_map(|p| LEVELS.iter().map(move |l| (*p, *l))) {
        let mut f = vec![Vec3::repeat(7.0); 3];
        assert_eq!(SpringSweep::with(&net, path, Precision::Double, level).sweep(&net.rest_m, &mut f), 1);
        assert_eq!(f, vec![Vec3::zeros(); 3]);
    }
}

#[test]
fn ends_very_far_apart_stay_finite() {
    let net = network(vec![Vec3::zeros(), Vec3::new(1e200, 0.0, 0.0)], vec![spring(0, 1)]);
    for (path, level) in PATHS.iter().flat_map(|p| LEVELS.iter().map(move |l| (*p, *l))) {
        let mut f = vec![Vec3::zeros(); 2];
        SpringSweep::with(&net, path, Precision::Double, level).sweep(&net.rest_m, &mut f);
        assert!((f[0].x / 1e202 - 1.0).abs() < 1e-9 && f[1] == -f[0], "{path:?} {level:?} {f:?}");
    }
}

#[test]
fn a_sweep_repeats_to_the_bit_and_a_copy_of_it_too() {
    let net = sheet(40, 33);
    for path in PATHS {
        let mut sweep = SpringSweep::with(&net, path, Precision::Double, KernelLevel::Best);
        let (mut first, mut second) = (vec![Vec3::zeros(); net.node_count()], vec![Vec3::zeros(); net.node_count()]);
        sweep.sweep(&net.rest_m, &mut first);
        sweep.clone().sweep(&net.rest_m, &mut second);
        assert_eq!(first, second);
        sweep.sweep(&net.rest_m, &mut second);
        assert_eq!(first, second);
    }
}

#[test]
fn single_precision_keeps_its_tolerance_in_a_bent_mesh() {
    for net in [sheet(40, 33), sheet(9, 5), tangle(61)] {
        // Bent by 5 mm.
        let bend = |x: &Vec3| x + Vec3::new(0.0, 0.0, 5e-3 * (40.0 * x.x).sin() + 2e-4 * (900.0 * x.y).cos());
        let position: Vec<Vec3> = net.rest_m.iter().map(bend).collect();
        let mut plain = vec![Vec3::zeros(); net.node_count()];
        force::gather(&net, &position, &mut plain);
        let mut allowed = vec![0.0; net.node_count()];
        for s in &net.springs {
            let reach = (position[s.a as usize] - position[s.b as usize]).norm() + s.rest_length_m;
            let share = s.stiffness_n_per_m * single::SINGLE_TOLERANCE * reach;
            allowed[s.a as usize] += share;
            allowed[s.b as usize] += share;
        }
        for (path, level) in PATHS.iter().flat_map(|p| LEVELS.iter().map(move |l| (*p, *l))) {
            let mut found = vec![Vec3::repeat(7.0); net.node_count()];
            SpringSweep::with(&net, path, Precision::Single, level).sweep(&position, &mut found);
            for (node, ((a, b), allowed)) in plain.iter().zip(&found).zip(&allowed).enumerate() {
                assert!((a - b).norm() <= *allowed, "{path:?} {level:?} {node}: {a} {b}, {allowed:e}");
            }
        }
    }
}
