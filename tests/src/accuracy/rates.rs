//! What the hand feels when the tissue is slow or late: force error against solver rate, delay and jitter.
//!
//! A hand moves a held suture point 5 mm at 2 Hz. Three ways to give it force: the affine port `f* − S(x − x*)` on the
//! point that the servo integrates at 1 kHz (ours), the same with the one-ring stiffness, and the held force of other
//! systems (the hand's position goes to the tissue, the tissue's last force to the hand). Each is compared with itself at
//! 5 kHz without delay. Energy: what the device gave the hand over the whole motion, less what it gives at 5 kHz.

use super::cases::{PULLED_PAIR, pulled_patch, scene_config};
use super::plot::{Axis, Level, Panel, Series, nth_style, panels_svg};
use super::section::{Effort, Figure, Progress, Row, Section};
use crate::generators::SplitMix;
use serde_json::json;
use sim_core::kinematics::coupling::{DEFAULT_COUPLING, StylusState};
use sim_core::kinematics::integrate::NodeState;
use sim_core::kinematics::port_tick::{AffinePort, PortRung, tick_held};
use sim_core::scene::step::Scene;
use sim_core::tissue::handle::HandleSlot;
use sim_core::tissue::port::Port;
use sim_core::tissue::solver::{Stages, TissueSolver};
use sim_core::tissue::solver_params::{SolverError, SolverParams, SubstepPolicy};
use sim_core::vector::Vec3;

/// Length of the motion, seconds: two periods.
const END_S: f64 = 1.0;
/// Tick of the servo, seconds.
const TICK_S: f64 = 1e-3;
/// Tick and solver period of the runs taken as true, seconds.
const FINE_S: f64 = 2e-4;
/// Way of the hand, metres, and its rate, hertz.
const HAND_M: f64 = 5e-3;
const HAND_HZ: f64 = 2.0;
/// Mass of the suture point with its needle, kilograms: the presets'.
const POINT_KG: f64 = 2e-3;
/// Solver rates, hertz.
const RATES_HZ: [f64; 6] = [1000.0, 500.0, 200.0, 100.0, 60.0, 20.0];
/// Delays and jitters, milliseconds.
const LATE_MS: [f64; 5] = [0.0, 2.0, 5.0, 10.0, 20.0];
/// Solver rate of the runs with delay or jitter.
const LATE_RATE_HZ: f64 = 200.0;
const HANDLE: HandleSlot = HandleSlot(0);

/// How the tissue comes to the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scheme {
    Affine,
    OneRing,
    HeldForce,
}

impl Scheme {
    const ALL: [Self; 3] = [Self::Affine, Self::OneRing, Self::HeldForce];

    const fn name(self) -> &'static str {
        match self {
            Self::Affine => "affine_port",
            Self::OneRing => "one_ring_port",
            Self::HeldForce => "held_force",
        }
    }
}

/// When a port reaches the servo.
#[derive(Clone, Copy, Debug)]
struct Lateness {
    rate_hz: f64,
    delay_s: f64,
    jitter_s: f64,
}

/// Force on the hand at each sample, and the energy that it got.
struct Felt {
    force_n: Vec<Vec3>,
    energy_j: f64,
}

/// The section.
pub(super) fn measure(progress: &Progress<'_>) -> Section {
    let mut section = Section {
        key: "rates",
        title: "Force at the hand against solver rate, delay and jitter".into(),
        words: vec![
            "A hand moves a held suture point of the skin by 5 mm at 2 Hz. The tissue is solved at the rate given, its result \
             reaches the 1 kHz servo after the delay given, plus a random part up to the jitter. affine_port is what this server \
             sends; one_ring_port is its fallback when the solver is late; held_force is the common way, the last force of the solver \
             held until the next. Each is compared with itself at 5 kHz without delay. Positive extra energy is energy that the \
             device pushed into the hand though no spring ever stored it."
                .into(),
        ],
        figures: vec![],
        rows: vec![],
    };
    let sweep: Vec<Lateness> = RATES_HZ
        .map(|rate_hz| Lateness { rate_hz, delay_s: 0.0, jitter_s: 0.0 })
        .into_iter()
        .chain(LATE_MS[1..].iter().map(|ms| Lateness { rate_hz: LATE_RATE_HZ, delay_s: ms * 1e-3, jitter_s: 0.0 }))
        .chain(LATE_MS[1..].iter().map(|ms| Lateness { rate_hz: LATE_RATE_HZ, delay_s: 0.0, jitter_s: ms * 1e-3 }))
        .collect();
    // A coarse skin serves both efforts: what is measured is the rate, not the mesh.
    match Scene::new(&scene_config("skin", Effort::Quick), None) {
        Ok(scene) => {
            for scheme in Scheme::ALL {
                if let Err(why) = measure_scheme(&scene, scheme, &sweep, progress, &mut section.rows) {
                    section.words.push(format!("{}: not measured: {why}.", scheme.name()));
                }
            }
            section.figures.push(figure(&section.rows));
        }
        Err(why) => section.words.push(format!("not measured: {why}.")),
    }
    section
}

fn measure_scheme(
    scene: &Scene,
    scheme: Scheme,
    sweep: &[Lateness],
    progress: &Progress<'_>,
    rows: &mut Vec<Row>,
) -> Result<(), SolverError> {
    (progress.say)(&format!("{} at 5 kHz", scheme.name()));
    let prompt = Lateness { rate_hz: 1.0 / FINE_S, delay_s: 0.0, jitter_s: 0.0 };
    let truth = feel(scene, scheme, prompt, FINE_S)?;
    for late in sweep {
        if progress.stopped() {
            break;
        }
        (progress.say)(&format!("{} at {} Hz", scheme.name(), late.rate_hz));
        let felt = feel(scene, scheme, *late, TICK_S)?;
        let squared = |v: &[Vec3]| v.iter().map(|f| f.norm_squared()).sum::<f64>();
        let off: Vec<Vec3> = felt.force_n.iter().zip(&truth.force_n).map(|(f, t)| f - t).collect();
        rows.push(vec![
            ("port", json!(scheme.name())),
            ("rate_hz", json!(late.rate_hz)),
            ("delay_ms", json!(late.delay_s * 1e3)),
            ("jitter_ms", json!(late.jitter_s * 1e3)),
            ("force_error", json!((squared(&off) / squared(&truth.force_n)).sqrt())),
            ("force_error_max_n", json!(off.iter().map(|f| f.norm()).fold(0.0, f64::max))),
            ("force_max_n", json!(truth.force_n.iter().map(|f| f.norm()).fold(0.0, f64::max))),
            ("extra_energy_mj", json!((felt.energy_j - truth.energy_j) * 1e3)),
        ]);
    }
    Ok(())
}

/// The hand's way from where it took the point: 5 mm and back, twice, without a jerk at the start.
fn hand_m(t: f64) -> f64 {
    0.5 * HAND_M * (1.0 - (std::f64::consts::TAU * HAND_HZ * t).cos())
}

fn feel(scene: &Scene, scheme: Scheme, late: Lateness, tick_s: f64) -> Result<Felt, SolverError> {
    let period_s = 1.0 / late.rate_hz;
    let params = SolverParams {
        substeps: SubstepPolicy::Automatic { max: 1000 },
        displacement_limit_spacings: 10.0,
        handle_limit_spacings: 10.0,
        ..SolverParams { period_s, ..*scene.solver().params() }
    };
    let patches = scene.solver().patches().clone();
    let mut solver = TissueSolver::new(scene.tissue().network.clone(), patches, params)?;
    solver.reset(scene.solver().state())?;
    solver.reassess()?;
    let mut stages = Stages::default();
    // The patch exists and no handle is in use.
    let _ = solver.grasp(HANDLE, pulled_patch(PULLED_PAIR + 1));
    let Some((_, home)) = solver.handle(HANDLE) else { return Ok(Felt { force_n: vec![], energy_j: 0.0 }) };
    let direction = scene.tissue().across * 0.6 + scene.tissue().outward * 0.8;
    let mut node = NodeState { position_m: home, velocity_m_per_s: Vec3::zeros() };
    let (mut port, mut on_the_way) = (None, std::collections::VecDeque::new());
    let mut chance = SplitMix(7);
    let (mut felt, mut last_hand) = (Felt { force_n: Vec::new(), energy_j: 0.0 }, home);
    let (mut solved, mut device_force) = (0_u64, Vec3::zeros());
    let ticks = (END_S / tick_s).round() as usize;
    let per_sample = (TICK_S / tick_s).round() as usize;
    for tick in 0..ticks {
        let t = tick as f64 * tick_s;
        let speed = (hand_m(t + 1e-6) - hand_m(t - 1e-6)) / 2e-6;
        let hand = StylusState { position_m: home + direction * hand_m(t), velocity_m_per_s: direction * speed };
        // The work of the force that was held over the last tick.
        felt.energy_j += device_force.dot(&(hand.position_m - last_hand));
        last_hand = hand.position_m;
        if t >= solved as f64 * period_s - 1e-12 {
            let place = if scheme == Scheme::HeldForce { hand.position_m } else { node.position_m };
            solver.lead(HANDLE, place);
            solver.step(&mut stages);
            solved += 1;
            if let Some(measured) = solver.port(HANDLE, &stages) {
                let arrival = t + late.delay_s + late.jitter_s * chance.unit();
                on_the_way.push_back((arrival, measured));
            }
        }
        // The newest that has arrived counts, also when it overtook an older one.
        while let Some(index) = on_the_way.iter().rposition(|(arrival, _): &(f64, Port)| *arrival <= t + 1e-12) {
            port = on_the_way.drain(..=index).next_back().map(|(_, measured)| measured);
        }
        device_force = match (&port, scheme) {
            (None, _) => Vec3::zeros(),
            (Some(p), Scheme::HeldForce) => p.force_n,
            (Some(p), Scheme::Affine | Scheme::OneRing) => {
                let stiffness = match scheme {
                    Scheme::OneRing => p.one_ring_n_per_m,
                    Scheme::Affine | Scheme::HeldForce => p.step_stiffness_n_per_m,
                };
                let affine = AffinePort {
                    position_m: p.position_m,
                    velocity_m_per_s: p.velocity_m_per_s,
                    force_n: p.force_n,
                    stiffness_n_per_m: stiffness,
                    one_ring_n_per_m: p.one_ring_n_per_m,
                    trust_radius_m: p.trust_radius_m,
                    mass_kg: p.mass_kg + POINT_KG,
                    drag_n_s_per_m: p.drag_n_s_per_m,
                };
                let done = tick_held(node, &affine, hand, Vec3::zeros(), DEFAULT_COUPLING, PortRung::Affine, tick_s);
                node = done.node;
                done.device_force_n
            }
        };
        if (tick + 1) % per_sample == 0 {
            felt.force_n.push(device_force);
        }
    }
    Ok(felt)
}

fn figure(rows: &[Row]) -> Figure {
    let number = |row: &Row, name: &str| row.iter().find(|(n, _)| *n == name).and_then(|(_, v)| v.as_f64());
    let panel = |title: &str, x: Axis, column: &str, fixed: [(&str, f64); 2]| {
        let series = Scheme::ALL.iter().enumerate().map(|(i, scheme)| {
            let mine = rows.iter().filter(|r| r[0].1 == scheme.name());
            let kept = mine.filter(|r| fixed.iter().all(|(name, value)| number(r, name) == Some(*value)));
            let points = kept.filter_map(|r| Some((number(r, column)?, number(r, "force_error")?))).collect();
            Series::new(scheme.name(), nth_style(i), points)
        });
        Panel {
            title: title.into(),
            x,
            y: Axis::log("force error at the hand (relative)"),
            series: series.collect(),
            levels: vec![Level::Y(0.05, "5 %".into())],
        }
    };
    let panels = [
        panel(
            "solver rate, no delay",
            Axis::log("solver rate (Hz)"),
            "rate_hz",
            [("delay_ms", 0.0), ("jitter_ms", 0.0)],
        ),
        panel(
            "delay at 200 Hz",
            Axis::linear("delay (ms)"),
            "delay_ms",
            [("rate_hz", LATE_RATE_HZ), ("jitter_ms", 0.0)],
        ),
        panel(
            "jitter at 200 Hz",
            Axis::linear("jitter, at most (ms)"),
            "jitter_ms",
            [("rate_hz", LATE_RATE_HZ), ("delay_ms", 0.0)],
        ),
    ];
    Figure {
        name: "force_at_the_hand".into(),
        caption: "Force error at the hand, each way against itself at 5 kHz without delay.".into(),
        svg: panels_svg("What the hand feels when the tissue is slow or late", &panels, 3),
    }
}
