//! Sleeping nodes: what they change, who wakes them, what a step visits.
//!
//! Deliberately absent: the scenes with stitches (`scene::tests::rest`).

use super::{Net, Rim, SKIN, dust, even_patches};
use crate::tissue::energy::{kinetic_j, momentum_n_s, spring_j};
use crate::tissue::handle::HandleSlot;
use crate::tissue::integrator::Integrator;
use crate::tissue::load::{Loads, NodeForce};
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::sleep::params::SleepParams;
use crate::tissue::solver::{Stages, TissueSolver};
use crate::tissue::solver_params::{SolverError, SolverParams};
use crate::vector::Vec3;

const SLOT: HandleSlot = HandleSlot(0);
/// The default.
const TOLERANCE_M: f64 = 1e-9;
const BOTH: [Integrator; 2] = [Integrator::SemiImplicit, Integrator::Verlet];

fn params(integrator: Integrator, tolerance_m: Option<f64>) -> SolverParams {
    let sleep = tolerance_m.map(|tolerance_m| SleepParams { tolerance_m });
    SolverParams { integrator, sleep, ..SolverParams::with_period(2e-3) }
}

/// A solver whose patch is a plus in the middle.
fn centred(net: &Net, params: SolverParams) -> TissueSolver {
    let network = net.build();
    let middle = net.side / 2;
    let patches = even_patches(network.node_count(), &[net.plus(middle, middle)]);
    TissueSolver::new(network, patches, params).unwrap()
}

fn rest(solver: &mut TissueSolver, stages: &mut Stages) {
    let asleep = (0..10_000).any(|_| {
        solver.step(stages);
        solver.awake_nodes() == Some(0)
    });
    assert!(asleep, "{:?} nodes are awake", solver.awake_nodes());
}

/// Pulls the middle by `way` within 20 periods and holds it there.
fn pull(solver: &mut TissueSolver, way: Vec3, periods: u32, mut each: impl FnMut(&TissueSolver, u64)) {
    solver.grasp(SLOT, PatchId(0)).unwrap();
    let start = solver.handle(SLOT).unwrap().1;
    for period in 1..=periods {
        assert!(solver.lead(SLOT, start + way * (f64::from(period.min(20)) / 20.0)));
        let report = solver.step(&mut Stages::default());
        each(solver, report.half_springs / u64::from(report.substeps));
    }
}

fn farthest(a: &TissueSolver, b: &TissueSolver) -> f64 {
    let pairs = a.state().position_m.iter().zip(&b.state().position_m);
    pairs.map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

#[test]
fn a_swing_and_its_end_are_the_same_with_and_without_sleep() {
    // Table 2's drag, and a thousandth of it: waves that cross the sheet several times.
    for (integrator, drag) in BOTH.into_iter().flat_map(|i| [(i, 3.0), (i, 3e-3)]) {
        let net = Net { side: 33, drag_n_s_per_m: drag, ..SKIN };
        let mut plain = centred(&net, params(integrator, None));
        let mut resting = centred(&net, params(integrator, Some(TOLERANCE_M)));
        rest(&mut resting, &mut Stages::default());
        let way = Vec3::new(1e-3, 0.0, 3e-3);
        pull(&mut plain, way, 60, |_, _| {});
        pull(&mut resting, way, 60, |_, _| {});
        let mut worst = farthest(&plain, &resting);
        plain.release(SLOT);
        resting.release(SLOT);
        for _ in 0..600 {
            plain.step(&mut Stages::default());
            resting.step(&mut Stages::default());
            worst = worst.max(farthest(&plain, &resting));
        }
        println!("{} c = {drag}: {worst:e} m, {:?} awake", integrator.name(), resting.awake_nodes());
        // A sheet of 32 cells clamped all round: 1 nm against own springs is at most 32²/2 times that over all, and 20
        // times as much out of the plane, where 5 % of pre-strain resist. Neglected forces of all signs stay far below.
        assert!(worst < 1e-6, "{}: {worst:e} m", integrator.name());
    }
}

#[test]
fn the_far_side_wakes_and_the_static_stiffness_stays() {
    // Freezing by distance makes such a point stiffer by 3.7 to 48 per cent.
    for integrator in BOTH {
        let net = Net { side: 33, ..SKIN };
        let force = |tolerance_m: Option<f64>| {
            let mut solver = centred(&net, params(integrator, tolerance_m));
            if tolerance_m.is_some() {
                rest(&mut solver, &mut Stages::default());
            }
            let mut most = 0;
            pull(&mut solver, Vec3::new(2e-3, 0.0, 0.0), 2500, |s, _| most = most.max(s.awake_nodes().unwrap_or(0)));
            (solver.port(SLOT, &Stages::default()).unwrap().force_n.norm(), most)
        };
        let (plain, _) = force(None);
        let (resting, most) = force(Some(TOLERANCE_M));
        assert_eq!(most, 33 * 33, "the pull reaches every tile");
        let error = (resting / plain - 1.0).abs();
        println!("{}: {plain} N, error {error:e}", integrator.name());
        // A tenth of a micrometre of the way of 2 mm.
        assert!(error < 5e-5, "{}: {error:e}", integrator.name());
    }
}

#[test]
fn a_sheet_at_rest_visits_no_spring_until_something_touches_it() {
    for integrator in BOTH {
        // A tenth of Table 2's drag: the slowest motion out of the plane then ends in 0.7 s instead of 7.
        let net = Net { side: 33, drag_n_s_per_m: 0.3, ..SKIN };
        let mut solver = centred(&net, params(integrator, Some(TOLERANCE_M)));
        let mut none = Stages::default();
        rest(&mut solver, &mut none);
        let before = solver.state().clone();
        let report = solver.step(&mut none);
        assert_eq!((report.half_springs, report.awake_nodes), (0, 0));
        assert_eq!(solver.state(), &before);

        let node = net.node(7, 9);
        let load = NodeForce { node, force_n: Vec3::new(0.0, 0.0, 0.1) };
        let mut loaded = Stages { loads: Some(Loads { nodes: vec![load], patches: Vec::new() }), ..Stages::default() };
        let report = solver.step(&mut loaded);
        assert!((1..33 * 33).contains(&report.awake_nodes) && report.half_springs > 0);
        assert!(solver.state().position_m[node as usize].z > 0.0);
        for _ in 0..300 {
            solver.step(&mut loaded);
        }
        assert!(solver.awake_nodes().unwrap() > 0, "a load keeps its tile awake");
        rest(&mut solver, &mut none);
        assert!((solver.state().position_m[node as usize] - before.position_m[node as usize]).norm() < 1e-6);

        solver.displace(PatchId(0), Vec3::new(0.0, 1e-4, 0.0));
        assert!((1..33 * 33).contains(&solver.awake_nodes().unwrap()));
        rest(&mut solver, &mut none);
        solver.grasp(SLOT, PatchId(0)).unwrap();
        assert!(solver.awake_nodes().unwrap() > 0);
        (0..50).for_each(|_| {
            solver.step(&mut none);
        });
        assert!(solver.awake_nodes().unwrap() > 0, "a held tile stays awake");
        solver.release(SLOT);
        rest(&mut solver, &mut none);
        solver.reset(&before).unwrap();
        assert_eq!(solver.awake_nodes(), Some(33 * 33));
        rest(&mut solver, &mut none);
        solver.reassess().unwrap();
        assert_eq!(solver.awake_nodes(), Some(33 * 33));
    }
}

/// Least squares `y = a + b x`.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (sx, sy) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    let (mx, my) = (sx / n, sy / n);
    let (sxx, sxy) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - mx).powi(2), s.1 + (p.0 - mx) * (p.1 - my)));
    (my - sxy / sxx * mx, sxy / sxx)
}

#[test]
fn work_follows_the_awake_nodes_whatever_the_size_of_the_mesh() {
    let mut fits = Vec::new();
    for side in [65, 129, 193] {
        let net = Net { side, ..SKIN };
        let nodes = side * side;
        let mut solver = centred(&net, params(Integrator::SemiImplicit, Some(1e-8)));
        rest(&mut solver, &mut Stages::default());
        let mut points = Vec::new();
        pull(&mut solver, Vec3::new(0.0, 0.0, 5e-4), 60, |s, visited| {
            let awake = s.awake_nodes().unwrap();
            if 2 * awake < nodes {
                points.push((awake as f64, visited as f64));
            }
        });
        let (a, b) = line(&points);
        let most = points.iter().map(|p| p.0).fold(0.0, f64::max);
        println!("{side}²: {} periods, up to {most} awake, half-springs = {a:.0} + {b:.2} awake", points.len());
        assert!(points.len() > 20);
        for (awake, visited) in &points {
            // Eight springs per node; the border of a lump of tiles is at most as many nodes again as lie in it.
            assert!((8.0 * awake..=16.0 * awake).contains(visited), "{visited} half-springs of {awake} nodes");
        }
        fits.push((a, b, most));
    }
    for (a, b, most) in &fits[1..] {
        // Where the borders of tiles fall differs between the meshes, by less than two tiles of half-springs; the meshes
        // differ by a factor of 9 in nodes.
        assert!((a - fits[0].0).abs() < 2.0 * 8.0 * 64.0, "{fits:?}");
        assert!((b / fits[0].1 - 1.0).abs() < 0.15, "{fits:?}");
        assert!((most / fits[0].2 - 1.0).abs() < 0.5, "{fits:?}");
    }
}

#[test]
fn equal_inputs_give_equal_bits_and_a_copy_goes_on_alike() {
    let net = Net { side: 65, ..SKIN };
    let run = || {
        let mut solver = centred(&net, params(Integrator::Verlet, Some(1e-8)));
        rest(&mut solver, &mut Stages::default());
        pull(&mut solver, Vec3::new(2e-4, 2e-4, 2e-4), 40, |_, _| {});
        solver
    };
    let (mut first, mut second) = (run(), run());
    assert_eq!(first.state(), second.state());
    assert!((1..65 * 65 / 2).contains(&first.awake_nodes().unwrap()));
    let mut copy = first.clone();
    for solver in [&mut first, &mut second, &mut copy] {
        solver.release(SLOT);
        rest(solver, &mut Stages::default());
    }
    assert_eq!(first.state(), second.state());
    assert_eq!(first.state(), copy.state());
}

#[test]
fn falling_asleep_takes_energy_and_never_gives_any() {
    for integrator in BOTH {
        let net = Net { side: 33, drag_n_s_per_m: 0.3, ..SKIN };
        let mut solver = centred(&net, params(integrator, Some(1e-8)));
        pull(&mut solver, Vec3::new(0.0, 0.0, 2e-3), 30, |_, _| {});
        solver.release(SLOT);
        let energy =
            |s: &TissueSolver| kinetic_j(s.network(), s.state()) + spring_j(s.network(), &s.state().position_m);
        let mut before = energy(&solver);
        for _ in 0..6000 {
            if solver.awake_nodes() == Some(0) {
                break;
            }
            solver.step(&mut Stages::default());
            let now = energy(&solver);
            // Rounding of a sum over four thousand springs.
            assert!(now <= before * (1.0 + 1e-12), "{}: {now:e} J after {before:e} J", integrator.name());
            before = now;
        }
        assert_eq!(solver.awake_nodes(), Some(0));
        assert_eq!(kinetic_j(solver.network(), solver.state()), 0.0);
    }
}

#[test]
fn a_free_body_above_the_speed_limit_keeps_its_momentum_and_a_slower_one_stops() {
    for integrator in BOTH {
        let net = Net { side: 12, drag_n_s_per_m: 0.0, rest_ratio: 1.0, rim: Rim::Free, ..SKIN };
        // 8 springs of 160 N/m on 0.048 g: the limit is 1e-9 m · 5164 /s.
        for (speed, stops) in [(1e-3, false), (1e-6, true)] {
            let mut solver =
                TissueSolver::new(net.build(), PatchSet::default(), params(integrator, Some(1e-9))).unwrap();
            let mut state = solver.state().clone();
            state.velocity_m_per_s.fill(Vec3::new(speed, 0.0, 0.0));
            solver.reset(&state).unwrap();
            let start = momentum_n_s(solver.network(), solver.state());
            for _ in 0..200 {
                solver.step(&mut Stages::default());
            }
            let lost = (momentum_n_s(solver.network(), solver.state()) - start).norm();
            if stops {
                assert_eq!(lost, start.norm(), "{}", integrator.name());
            } else {
                assert!(lost < 1e-12 * start.norm(), "{}: {lost:e}", integrator.name());
            }
        }
    }
}

#[test]
fn what_cannot_sleep_does_not_and_useless_tolerances_are_refused() {
    for integrator in [Integrator::Bdf2, Integrator::Xpbd] {
        let solver = centred(&SKIN, params(integrator, Some(1e-9)));
        assert_eq!(solver.awake_nodes(), None);
    }
    let network = || dust(&[Vec3::zeros(), Vec3::x()], 1e-3, 0.1);
    for bad in [0.0, -1e-9, f64::NAN, f64::INFINITY] {
        let refused = TissueSolver::new(network(), PatchSet::default(), params(Integrator::SemiImplicit, Some(bad)));
        assert!(matches!(refused.unwrap_err(), SolverError::Value { .. }));
    }
    let mut still = TissueSolver::new(network(), PatchSet::default(), params(Integrator::Verlet, Some(1e-9))).unwrap();
    rest(&mut still, &mut Stages::default());
}
