//! Loads and wounds at their ends: a meganewton, forces and targets that are no numbers, a line cut under 5 N, no gap, D_o = 0.

use super::nets::{
    self, NODE_KG, SKIN_C, SKIN_K, farthest_m, is_sound, loaded, network, relax, run, skin_sheet, solver,
};
use super::rig::{PEAK_N, SessionRig, small_skin};
use super::{Ending, Named, Outcome};
use sim_core::suture_line::line::{FreeEnd, LineShape, SutureLine, SutureLineParams};
use sim_core::tissue::constraint::{PairConstraint, PairSense, Pairs};
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::SolverParams;
use sim_core::vector::Vec3;
use sim_core::wound::control::{ControlMode, ControlParams, WoundControl};
use sim_core::wound::ledger::Ledger;

/// The cases.
pub(super) const CASES: &[Named] = &[
    ("1e6 N on one node, in the plane, for 0.1 s", || meganewton(Vec3::new(6e5, 8e5, 0.0), 0.1)),
    ("1e6 N on one node, across the sheet, for a step", || meganewton(Vec3::new(6e5, 0.0, 8e5), 5e-3)),
    ("loads that are not finite", bad_loads),
    ("a handle led 1e6 m away", far_target),
    ("handle targets that are not finite", bad_targets),
    ("suture line cut under 5 N", cut_line),
    ("line let go under 5 N in a session", line_let_go),
    ("wound without a gap", no_gap),
    ("stitch tied at D_o = 0", stitch_of_no_length),
    ("suture control at D_o = 0", control_at_zero),
];

/// In the plane for 0.1 s; across it, where only the pre-tension pulls back, for one step.
fn meganewton(force_n: Vec3, seconds: f64) -> Outcome {
    let side = 17;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let mut solver = solver(net.clone(), 5e-3);
    let mut stages = loaded([(side * side / 2, force_n)]);
    let report = run(&mut solver, &mut stages, seconds);
    let out = farthest_m(&solver.state().position_m, &net.rest_m);
    let growth = relax(&mut solver, &mut Stages::default(), 2.0);
    let left = farthest_m(&solver.state().position_m, &net.rest_m);
    let note = format!("{} node moves cut; {:.1} mm out, then 2 s free", report.saturated, out * 1e3);
    Outcome::measured(Ending::Clamped, note, left, 1e-3, "m from rest")
        .require(report.saturated > 0, "the displacement limit acted and was counted")
        .require(growth <= nets::ENERGY_GROWTH, "the energy only falls once let go")
}

fn bad_loads() -> Outcome {
    let side = 9;
    let mut solver = solver(skin_sheet(side, SKIN_K, NODE_KG, SKIN_C), 5e-3);
    let before = solver.state().position_m.clone();
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let mut stages = loaded(bad.iter().enumerate().map(|(i, b)| (30 + i, Vec3::new(*b, 0.0, 1.0))));
    let report = run(&mut solver, &mut stages, 0.5);
    let moved = farthest_m(&solver.state().position_m, &before);
    let note = format!("{} loads left out and counted", report.contained);
    // The sheet stands in its pre-strained rest shape, up to rounding.
    Outcome::measured(Ending::Clamped, note, moved, 1e-15, "m moved").require(report.contained > 0, "they are counted")
}

fn far_target() -> Outcome {
    let side = 17;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let mut solver = nets::solver_at(net.clone(), (side * side / 2) as u32, SolverParams::with_period(5e-3));
    solver.grasp(HandleSlot(0), nets::POINT).expect("free");
    solver.lead(HandleSlot(0), Vec3::new(1e6, 0.0, 0.0));
    let report = run(&mut solver, &mut Stages::default(), 0.05);
    let sound = is_sound(&solver.state().position_m) && is_sound(&solver.state().velocity_m_per_s);
    solver.release(HandleSlot(0));
    run(&mut solver, &mut Stages::default(), 4.0);
    let left = farthest_m(&solver.state().position_m, &net.rest_m);
    let note = format!("{} ways of the handle cut; distance from rest 4 s after release", report.handles_cut);
    Outcome::measured(Ending::Clamped, note, left, 1e-3, "m")
        .require(report.handles_cut == 10, "every way is cut and counted")
        .require(sound, "the tissue stays finite")
}

fn bad_targets() -> Outcome {
    let side = 9;
    let net = skin_sheet(side, SKIN_K, NODE_KG, SKIN_C);
    let mut solver = nets::solver_at(net, 40, SolverParams::with_period(5e-3));
    solver.grasp(HandleSlot(0), nets::POINT).expect("free");
    let before = solver.state().clone();
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let taken = bad.iter().filter(|b| solver.lead(HandleSlot(0), Vec3::new(0.0, **b, 0.0))).count();
    run(&mut solver, &mut Stages::default(), 0.1);
    let moved = farthest_m(&solver.state().position_m, &before.position_m);
    Outcome::measured(Ending::Refused, "the handle stays where it was", taken as f64, 0.0, "targets taken")
        .require(moved < 1e-15, "nothing moves")
}

fn cut_line() -> Outcome {
    let (length, stiffness, tension) = (0.1, 273.0, 5.0);
    let params = SutureLineParams::new(length, stiffness, 20).expect("valid");
    let mut line = SutureLine::new(params, Vec3::zeros(), Vec3::x());
    let hand = Vec3::x() * (length * (1.0 + tension / stiffness));
    let before = line.step(&[Vec3::zeros()], FreeEnd::Held(hand));
    line.cut(0.5);
    let after = line.step(&[Vec3::zeros()], FreeEnd::Held(hand));
    let note = format!("{:.6} N before the cut; tension in the next step, both halves led on", before.tension_n);
    Outcome::measured(Ending::Correct, note, after.tension_n, 0.0, "N")
        .require((before.tension_n / tension - 1.0).abs() < 1e-9, "5 N before")
        .require(after.shape == LineShape::Cut && is_sound(line.polyline()), "two sound halves")
}

/// The line pulled to 5 N wanted (the device saturates), then let go: zero force at the slew, and the tissue only loses.
fn line_let_go() -> Outcome {
    let mut config = small_skin();
    // Attachments and touching edges store energy of their own, which the energy of springs does not count.
    config.attachment = None;
    config.wound.contact_stiffness_n_per_mm = None;
    let mut rig = SessionRig::new(&config).expect("the scene loads");
    rig.hold_left();
    rig.take_line();
    let mut wanted: f64 = 0.0;
    for _ in 0..300 {
        rig.pull(Vec3::new(0.0, 0.0, 1e-4), 1);
        wanted = rig.servo.state().handles[0].line_tension_n;
        if wanted >= 5.0 {
            break;
        }
    }
    let pulled_n = rig.force_n.norm();
    rig.sample.buttons = 0;
    let mut to_zero = 0;
    let energy = |rig: &SessionRig| {
        let solver = rig.session.procedure().scene().solver();
        nets::energy_j(solver.network(), solver.state())
    };
    while rig.servo.state().handles[0].mode != 0 && to_zero < 100 {
        rig.tick();
        to_zero += 1;
    }
    let freed_j = energy(&rig);
    let (mut ticks, mut largest_j) = (0, freed_j);
    while rig.force_n != Vec3::zeros() && ticks < 1_000 {
        rig.tick();
        ticks += 1;
    }
    for _ in 0..500 {
        rig.tick();
        largest_j = largest_j.max(energy(&rig));
    }
    let breach = rig.findings.breach.clone();
    let note = format!("{wanted:.2} N wanted, {pulled_n:.2} N rendered; ticks to exactly zero after the line is gone");
    // 3.3 N at 0.5 N per tick, then the tail of the low-pass down to a micronewton.
    Outcome::measured(Ending::Clamped, note, f64::from(ticks), 30.0, "ticks")
        .require(wanted >= 5.0 && pulled_n <= PEAK_N, "5 N wanted, at most the peak rendered")
        .require(largest_j <= freed_j * (1.0 + nets::ENERGY_GROWTH), "the tissue's energy only falls")
        .require(breach.is_none(), breach.as_deref().unwrap_or(""))
}

fn no_gap() -> Outcome {
    let mut config = small_skin();
    config.wound.gap_mm = 0.0;
    let mut rig = match SessionRig::new(&config) {
        Ok(rig) => rig,
        Err(error) => return Outcome::refusal(Some(error.to_string()), "wound"),
    };
    rig.hold_left();
    rig.take_line();
    rig.pull(Vec3::new(0.0, 0.0, 0.008), 100);
    rig.button(0);
    rig.run(500);
    let breach = rig.findings.breach.clone();
    let rows = rig.session.procedure().scene().ledger_rows();
    let er = rows.first().map_or(f64::NAN, |row| row.relative_error);
    Outcome::measured(
        Ending::Correct,
        "a stitch is tied on a wound without a gap; its ER half a second later",
        er,
        0.1,
        "ER",
    )
    .require(breach.is_none(), breach.as_deref().unwrap_or(""))
}

/// Two patches drawn onto each other by a rigid stitch of no length.
fn stitch_of_no_length() -> Outcome {
    let x = [Vec3::zeros(), Vec3::new(4e-3, 0.0, 0.0)];
    let net = network(&x, 1e-3, 3.0, &[]);
    let nodes = [[0_u32], [1]];
    let patches = PatchSet::new(2, nodes.iter().map(|n| (&n[..], &[1.0][..]))).expect("two patches");
    let mut pairs = Pairs::default();
    let constraint = PairConstraint {
        a: PatchId(0),
        b: PatchId(1),
        target_m: 0.0,
        stiffness_n_per_m: f64::INFINITY,
        max_force_n: 100.0,
        sense: PairSense::PullOnly,
    };
    pairs.push(&patches, constraint).expect("a usable pair");
    let mut stages = Stages { pairs: Some(pairs), ..Stages::default() };
    let mut params = SolverParams::with_period(1e-3);
    params.displacement_limit_spacings = 1e-3;
    let mut solver = TissueSolver::new(net, patches, params).expect("no spring, no limit");
    let report = run(&mut solver, &mut stages, 0.5);
    let [a, b] = [0, 1].map(|i| solver.state().position_m[i]);
    let tension = stages.pairs.as_ref().map_or(f64::NAN, |p| p.tension_n(0));
    let note = format!("two points drawn onto each other; tension at the end {tension:.1e} N");
    Outcome::measured(Ending::Correct, note, (a - b).norm(), 1e-8, "m apart")
        .require(report.contained == 0 && tension.is_finite(), "no number is lost")
}

/// ER of a stitch tied at no distance, as its points part by 0, 0.1 and 5 mm.
fn control_at_zero() -> Outcome {
    let mut ledger = Ledger::default();
    let row = ledger.record(0, Vec3::zeros(), Vec3::zeros(), 0.0).expect("room");
    let mut control = WoundControl::new(ControlMode::Sound, ControlParams::default());
    let mut errors = Vec::new();
    let mut sound = true;
    for apart in [0.0, 1e-4, 5e-3] {
        ledger.measure(row, Vec3::zeros(), Vec3::new(apart, 0.0, 0.0));
        let outcome = control.supervise(&mut ledger, 5e-3, &[0.0]);
        sound &= outcome.targets.iter().all(|t| t.target_m.is_finite() && t.stiffness_n_per_m.is_finite());
        sound &= outcome.corrections.iter().all(|c| is_sound(&[c.left_m, c.right_m]));
        errors.push(ledger.rows()[row].relative_error);
    }
    let note = format!("ER at 0, 0.1 and 5 mm: {:.3}, {:.3}, {:.3} (floor 2 mm)", errors[0], errors[1], errors[2]);
    let off = (errors[1] - 0.05).abs().max((errors[2] - 2.5).abs()).max(errors[0]);
    Outcome::measured(Ending::Correct, note, off, 1e-12, "difference from |D_c|/2 mm")
        .require(sound, "every target is finite")
}
