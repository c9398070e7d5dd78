//! Paper against sound mode: every place where the server by default departs from the printed method, with the measured
//! effect of the departure.
//!
//! One function per deviation, each on the smallest system that shows it. What the readings are is in `docs/paper.md`.

mod attachments;
mod points;

pub use attachments::{Held, Rig, hold_at_rate, ratchet_m};
pub use points::{ftl_sweeps, spring_law_forces_n, stable_steps_s, wound_distances_m};

use super::plot::{Axis, Panel, Series, nth_style, panels_svg};
use super::refinement::{Drag, relaxation_time_s};
use super::section::{Effort, Figure, Progress, Row, Section};
use crate::closed_forms::attachment_stiffness_n_per_m;
use serde_json::json;
use sim_core::scene::presets;
use sim_core::tissue::regulation::ProjectedVelocity;
use sim_core::wound::ledger::relative_error;

/// Solver rates, hertz. Below 200 Hz the skin needs sub-steps, and β acts once in each.
const RATES_HZ: [f64; 6] = [60.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];

/// One departure.
struct Deviation {
    deviation: String,
    paper: (f64, String),
    sound: (f64, String),
    unit: &'static str,
    effect: String,
}

impl Deviation {
    fn row(&self) -> Row {
        vec![
            ("deviation", json!(self.deviation)),
            ("paper_mode", json!(self.paper.1)),
            ("sound_mode", json!(self.sound.1)),
            ("paper_value", json!(self.paper.0)),
            ("sound_value", json!(self.sound.0)),
            ("unit", json!(self.unit)),
            ("effect", json!(self.effect)),
        ]
    }
}

/// Measures all deviations.
#[must_use]
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    (progress.say)("attachments at five rates");
    let (mut all, figure) = rates(effort);
    type Group = fn() -> Vec<Deviation>;
    let groups: [(&str, Group); 7] = [
        ("ratchet of Algorithm 1", ratchet),
        ("reaction and velocity of the attachments", reaction_and_velocity),
        ("readings of the original distance", original_distance),
        ("literal drag", literal_drag),
        ("spring laws", spring_laws),
        ("c per node and per area", drag_per_node),
        ("a taut line", taut_line),
    ];
    for (name, group) in groups {
        if progress.stopped() {
            break;
        }
        (progress.say)(name);
        all.extend(group());
    }
    Section {
        key: "deviations",
        title: "Paper against sound mode".to_owned(),
        words: WORDS.map(str::to_owned).to_vec(),
        figures: figure.into_iter().collect(),
        rows: all.iter().map(Deviation::row).collect(),
    }
}

const WORDS: [&str; 1] = [
    "Each row is one place where the printed method leaves something open or cannot be run as printed, with both readings \
     measured on the same small system: skin of Table 2, 2 mm cells, a suture point pulled by 5 mm unless the row says otherwise. \
     Both readings can be chosen in a scene file where docs/paper.md says so.",
];

fn rates(effort: Effort) -> (Vec<Deviation>, Option<Figure>) {
    let shown: &[f64] = if effort == Effort::Quick { &[60.0, 200.0, 1000.0] } else { &RATES_HZ };
    let rig = Rig::skin();
    let run = |mode: fn(&Rig, f64) -> Option<Held>| {
        let mut held: Vec<Held> = shown.iter().filter_map(|rate| mode(&rig, *rate)).collect();
        held.sort_by(|a, b| a.projections_hz.total_cmp(&b.projections_hz));
        held
    };
    let paper = run(|rig, rate| hold_at_rate(rig, rate, rig.paper(ProjectedVelocity::Corrected)));
    let sound = run(|rig, rate| hold_at_rate(rig, rate, rig.compliant()));
    let ([slow, .., fast], [calm, .., swift]) = (paper.as_slice(), sound.as_slice()) else {
        return (Vec::new(), None);
    };
    let k = |rate: f64| {
        attachment_stiffness_n_per_m(presets::SKIN.beta, Rig::NODE_KG, presets::SKIN.drag_n_s_per_m, 1.0 / rate)
    };
    let deviation = |what: &str, unit, of: fn(&Held) -> f64| Deviation {
        deviation: format!(
            "relaxation β once per projection: {what}, {:.0} → {:.0} projections per second",
            slow.projections_hz, fast.projections_hz
        ),
        paper: (of(fast) / of(slow), format!("{:.3} → {:.3} {unit}", of(slow), of(fast))),
        sound: (of(swift) / of(calm), format!("{:.3} → {:.3} {unit}", of(calm), of(swift))),
        unit: "ratio",
        effect: format!(
            "as printed the link is a spring of (1 − β)(m + c dt)/(β dt²): {:.0} N/m at {:.0}/s, {:.0} N/m at {:.0}/s; sub-steps count \
             as steps; force on the hand: mean over 0.25 s, chatter ±{:.4} → ±{:.4} N as printed, ±{:.4} → ±{:.4} N converted",
            k(slow.projections_hz),
            slow.projections_hz,
            k(fast.projections_hz),
            fast.projections_hz,
            slow.chatter_n,
            fast.chatter_n,
            calm.chatter_n,
            swift.chatter_n
        ),
    };
    let deviations = vec![
        deviation("force on the hand", "N", |h| h.force_n),
        deviation("largest excess of a follower", "mm", |h| h.excess_m * 1e3),
    ];
    let series = |name: &str, i: usize, held: &[Held], of: fn(&Held) -> f64| {
        Series::new(name, nth_style(i), held.iter().map(|h| (h.projections_hz, of(h))).collect())
    };
    let panel = |title: &str, y: &str, of: fn(&Held) -> f64| Panel {
        title: title.to_owned(),
        x: Axis::log("projections per second"),
        y: Axis::linear(y),
        series: vec![series("β per step, as printed", 1, &paper, of), series("β converted once", 0, &sound, of)],
        levels: Vec::new(),
    };
    let panels = [
        panel("force on the hand", "force (N)", |h| h.force_n),
        panel("largest excess of a follower", "excess (mm)", |h| h.excess_m * 1e3),
    ];
    let figure = Figure {
        name: "lra_rate".to_owned(),
        caption: "A suture point pulled by 5 mm and held, at several solver rates: read as printed, the tissue stiffens with the number of projections.".to_owned(),
        svg: panels_svg("Relaxed attachments against the rate of projection", &panels, 2),
    };
    (deviations, Some(figure))
}

fn ratchet() -> Vec<Deviation> {
    let (excess_m, beta, steps) = (0.01, presets::SKIN.beta, 10);
    let carried = ratchet_m(excess_m, beta, steps);
    let last = carried.last().copied().unwrap_or(f64::NAN) * 1e3;
    let shown: Vec<String> = carried.iter().take(3).map(|d| format!("{:.2}", d * 1e3)).collect();
    vec![Deviation {
        deviation: "Algorithm 1 carries d_i over from step to step".to_owned(),
        paper: (last, format!("radius grows {} … {last:.4} mm while 10 mm are held", shown.join(", "))),
        sound: (beta * excess_m * 1e3, format!("{:.2} mm in every step: d_i starts from d_i⁰", beta * excess_m * 1e3)),
        unit: "mm",
        effect: "closed form of the carried radius: 10 mm · (1 − (1 − β)ⁿ): the tether lets go for ever".to_owned(),
    }]
}

fn reaction_and_velocity() -> Vec<Deviation> {
    let rig = Rig::skin();
    let mut all = Vec::new();
    if let Some(held) = hold_at_rate(&rig, 200.0, rig.compliant()) {
        all.push(Deviation {
            deviation: "force on the hand without the reaction of the attachments (Eq. 3 has no such term)".to_owned(),
            paper: (held.springs_n, format!("{:.3} N: springs only", held.springs_n)),
            sound: (held.force_n, format!("{:.3} N: springs and reaction", held.force_n)),
            unit: "N",
            effect: format!(
                "the rim holds {:.3} N: only with the reaction do hand and rim balance; without it {:.0} % of the force is missing",
                held.rim_n,
                100.0 * (1.0 - held.springs_n / held.force_n)
            ),
        });
    }
    let literal = hold_at_rate(&rig, 1000.0, rig.paper(ProjectedVelocity::Literal));
    let corrected = hold_at_rate(&rig, 1000.0, rig.paper(ProjectedVelocity::Corrected));
    if let (Some(literal), Some(corrected)) = (literal, corrected) {
        let drag = presets::SKIN.drag_n_s_per_m;
        all.push(Deviation {
            deviation: "velocity of a node after its projection, tissue at rest, 1 kHz".to_owned(),
            paper: (literal.speed_m_per_s, format!("{:.3} m/s though nothing moves", literal.speed_m_per_s)),
            sound: (corrected.speed_m_per_s, format!("{:.1e} m/s", corrected.speed_m_per_s)),
            unit: "m/s",
            effect: format!("left as it is, it feels {:.2} N of drag that is not there", drag * literal.speed_m_per_s),
        });
    }
    all
}

fn original_distance() -> Vec<Deviation> {
    let Some([open_m, closed_m]) = wound_distances_m() else { return Vec::new() };
    let floor_m = presets::skin().control.map_or(0.0, |c| c.distance_floor_mm * 1e-3);
    let (at_start, at_tie) = (relative_error(closed_m, open_m, floor_m), relative_error(closed_m, closed_m, floor_m));
    vec![Deviation {
        deviation: "original distance D_o: of the open wound, or when the stitch was tied".to_owned(),
        paper: (at_start, format!("open wound: ER {at_start:.2} as soon as the stitch is tied")),
        sound: (at_tie, format!("when tied: ER {at_tie:.2}")),
        unit: "1",
        effect: format!(
            "read as the open wound, Algorithm 2 would pull the closed stitch of {:.2} mm open again to {:.2} mm",
            closed_m * 1e3,
            open_m * 1e3
        ),
    }]
}

fn literal_drag() -> Vec<Deviation> {
    let Some([explicit_s, implicit_s]) = stable_steps_s() else { return Vec::new() };
    vec![Deviation {
        deviation: "drag at the start of the step (Eq. 2–3 as printed) or at its end: longest stable step, skin preset"
            .to_owned(),
        paper: (explicit_s * 1e3, format!("{:.4} ms", explicit_s * 1e3)),
        sound: (implicit_s * 1e3, format!("{:.3} ms", implicit_s * 1e3)),
        unit: "ms",
        effect: format!(
            "as printed the skin needs {:.0} steps per millisecond; with implicit drag one step of 1 ms is stable",
            (1e-3 / explicit_s).ceil()
        ),
    }]
}

fn spring_laws() -> Vec<Deviation> {
    let tissues = [("skin", presets::SKIN), ("liver", presets::LIVER), ("vessel", presets::VESSEL)];
    let one = |(name, row): (&str, presets::Table2)| {
        let [bilateral, tension] = spring_law_forces_n(row);
        Deviation {
            deviation: format!("d_i of Eq. (3): of Eq. (1), or the plain distance; edge node pulled by 1 mm, {name}"),
            paper: (tension, format!("{tension:.3} N: pulls only, with kβ")),
            sound: (bilateral, format!("{bilateral:.3} N: pulls and pushes with k")),
            unit: "N",
            effect: format!("softer by β = {}; by it the vessel would be no stiffer than the liver", row.beta),
        }
    };
    tissues.map(one).into_iter().collect()
}

fn drag_per_node() -> Vec<Deviation> {
    let time = |cells, drag| relaxation_time_s(cells, drag);
    let ratio = |drag| Some(time(32, drag)? / time(16, drag)?);
    let (Some(node), Some(area)) = (ratio(Drag::PerNode), ratio(Drag::PerArea)) else { return Vec::new() };
    vec![Deviation {
        deviation: "c of Table 2 per node or per area: relaxation time at half the spacing over that at the whole"
            .to_owned(),
        paper: (node, format!("{node:.2} times as long")),
        sound: (area, format!("{area:.2} times")),
        unit: "ratio",
        effect: "per node, the resolution of the mesh decides how fast the tissue moves".to_owned(),
    }]
}

fn taut_line() -> Vec<Deviation> {
    let sweeps: Vec<(f64, usize)> = [0.5, 0.9, 0.97, 0.99, 0.999].map(|r| (r, ftl_sweeps(r))).to_vec();
    let words: Vec<String> = sweeps.iter().map(|(r, s)| format!("{s} at {:.1} %", 100.0 * r)).collect();
    let taut = sweeps.iter().find(|s| s.0 == 0.99).map_or(0, |s| s.1);
    vec![Deviation {
        deviation: "line always tensioned by Follow the Leader: sweeps until both ends are met to 1 µm, 40 links"
            .to_owned(),
        paper: (taut as f64, words.join(", ")),
        sound: (0.0, "from 98 % on a straight line and one tension max(0, …); slack pulls nothing".to_owned()),
        unit: "sweeps at 99 %",
        effect: "Follow the Leader gives a shape and no force, and no shape either once the line is nearly straight"
            .to_owned(),
    }]
}
