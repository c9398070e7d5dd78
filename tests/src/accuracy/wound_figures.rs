//! Figs. 8 and 9: original and current distances of all stitches, and the wound from above, with and without suture control.
//!
//! Each run is the server's own lockstep with the synthetic hand, which pulls at every stitch once more after the last is
//! tied. The paper compares its wound with that of another system, which is not public; here the same wound is sutured
//! by the same hand with Algorithm 2 off. Full: skin, liver and vessel with four stitches each, as in the paper; quick: skin.

use super::section::{Effort, Figure, Progress, Row, Section};
use haptic_server::cli::choice::{DeviceChoice, HandChoice, HandSide};
use haptic_server::device::DeviceLimits;
use haptic_server::lockstep::{self, LockstepJob, RunEnd};
use haptic_server::report::radar::{RadarAxis, radar_svg};
use haptic_server::report::svg::{Anchor, Svg};
use haptic_server::report::tables::{ledger_rows, scene_kind_name};
use haptic_server::rig::{self, RigChoice};
use haptic_server::servo::params::{ServoConfig, ServoParams};
use haptic_server::servo_link::RunLength;
use haptic_server::solver::session::SolverSession;
use protocol::wound_report::WoundReport;
use serde_json::json;
use sim_core::scene::config::ControlReading;
use sim_core::scene::presets;
use sim_core::scene::procedure::SceneSource;
use sim_core::scene::step::Scene;
use sim_core::vector::Vec3;

/// A hand that has not finished one scene by then never will, seconds.
const LONGEST_S: f64 = 300.0;

/// What a run left.
#[derive(Debug)]
pub struct Sutured {
    /// Table 1 and the figures of the run.
    pub report: WoundReport,
    session: SolverSession,
}

impl Sutured {
    /// The scene as the run left it.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        self.session.procedure().scene()
    }
}

/// Sutures one preset with the synthetic hand; `None` when the server refuses the scene or the run.
#[must_use]
pub fn suture(scene: &str, control: ControlReading) -> Option<Sutured> {
    let mut config = presets::by_name(scene)?;
    config.control.iter_mut().for_each(|c| c.mode = control);
    let mut session = SolverSession::new(&[SceneSource { config, mesh: None }]).ok()?;
    let mut rig = rig::build(&RigChoice {
        device: &DeviceChoice::Simulated,
        hand: &HandChoice::Synthetic,
        side: HandSide::default(),
        length: RunLength::OfTheHand,
        library: None,
        device_file: None,
    })
    .ok()?;
    lockstep::run(LockstepJob {
        scene: scene.to_owned(),
        hand: "synthetic".to_owned(),
        registration: String::new(),
        session: &mut session,
        device: rig.device.pulled()?,
        params: ServoParams::new(&ServoConfig::default(), &DeviceLimits::OMNI).ok()?,
        longest_s: LONGEST_S,
        ends: RunEnd::WhenFinished,
        out: None,
        kept: None,
    })
    .ok()?;
    Some(Sutured { report: *session.report(), session })
}

const CONTROLS: [(ControlReading, &str); 2] =
    [(ControlReading::On, "control on"), (ControlReading::Off, "control off")];

/// Measures both figures.
#[must_use]
pub fn measure(effort: Effort, progress: &Progress<'_>) -> Section {
    let scenes: &[&str] = if effort == Effort::Quick { &["skin"] } else { &["skin", "liver", "vessel"] };
    let (mut rows, mut figures, mut wounds) = (Vec::new(), Vec::new(), Vec::new());
    for (control, name) in CONTROLS {
        let mut axes = Vec::new();
        for scene in scenes {
            if progress.stopped() {
                break;
            }
            (progress.say)(&format!("{scene}, {name}"));
            let Some(sutured) = suture(scene, control) else { continue };
            rows.extend(table(scene, name, &sutured.report));
            axes.extend(radar_axes(&sutured.report));
            if *scene == "skin" {
                wounds.push((name, sutured));
            }
        }
        figures.push(Figure {
            name: format!("fig8_{}", name.replace(' ', "_")),
            caption: format!(
                "Fig. 8, {name}: original (red) and current (blue) distance of every pair of suture points at the end."
            ),
            svg: radar_svg(&format!("distance of the suture points, {name}"), &axes),
        });
    }
    figures.push(Figure {
        name: "fig9_wound".to_owned(),
        caption: "Fig. 9. The skin wound from above after the same hand has sutured it and pulled at every stitch once more: dark the \
                  gap between the edges, blue the stitches."
            .to_owned(),
        svg: wounds_svg(&wounds),
    });
    Section {
        key: "wound_control",
        title: "Figs. 8 and 9: stitches with and without suture control".to_owned(),
        words: vec![
            "Each scene is sutured in lockstep by the synthetic hand, which pulls at every stitch once more after the last is tied. \
             A knot slips above its holding force; Algorithm 2 then has the work that the paper gives it."
                .to_owned(),
        ],
        figures,
        rows,
    }
}

fn table(scene: &str, control: &str, report: &WoundReport) -> Vec<Row> {
    let rows = ledger_rows(report).iter().map(|row| {
        vec![
            ("scene", json!(scene)),
            ("control", json!(control)),
            ("pair", json!(row.pair + 1)),
            ("open_distance_mm", json!(row.open_distance_m * 1e3)),
            ("d_o_mm", json!(row.original_distance_m * 1e3)),
            ("d_c_mm", json!(row.current_distance_m * 1e3)),
            ("er", json!(row.relative_error)),
        ]
    });
    rows.collect()
}

fn radar_axes(report: &WoundReport) -> Vec<RadarAxis> {
    let axis = |row: &protocol::wound_report::LedgerRow| RadarAxis {
        label: format!("{} {}", scene_kind_name(row.scene_kind), row.pair + 1),
        original_mm: row.original_distance_m * 1e3,
        current_mm: row.current_distance_m * 1e3,
    };
    ledger_rows(report).iter().map(axis).collect()
}

/// Pixels per metre, and half of the picture of one wound in metres: across and along.
const SCALE: f64 = 16_000.0;
const HALF_M: [f64; 2] = [0.012, 0.019];

fn wounds_svg(wounds: &[(&str, Sutured)]) -> String {
    let (width, height) = (2.0 * HALF_M[0] * SCALE, 2.0 * HALF_M[1] * SCALE);
    let mut svg = Svg::new(20.0 + (width + 20.0) * wounds.len().max(1) as f64, height + 60.0);
    for (i, (name, sutured)) in wounds.iter().enumerate() {
        let left = 20.0 + (width + 20.0) * i as f64;
        let at = |x: &Vec3| (left + (x.x + HALF_M[0]) * SCALE, 40.0 + (HALF_M[1] - x.y) * SCALE);
        svg.text((left + 0.5 * width, 24.0), 14.0, Anchor::Middle, name);
        // A window onto the drawing, in the same coordinates: what reaches beyond it is cut off.
        svg.element(&format!(
            r#"<svg x="{left}" y="40" width="{width}" height="{height}" viewBox="{left} 40 {width} {height}" overflow="hidden">"#
        ));
        draw_wound(&mut svg, sutured.scene(), &at);
        svg.element("</svg>");
        svg.element(&format!(
            r##"<rect x="{left}" y="40" width="{width}" height="{height}" fill="none" stroke="#888888"/>"##
        ));
    }
    svg.finish()
}

fn draw_wound(svg: &mut Svg, scene: &Scene, at: &dyn Fn(&Vec3) -> (f64, f64)) {
    let (tissue, x) = (scene.tissue(), &scene.solver().state().position_m);
    let inside = |c: &u32| x[*c as usize].x.abs() <= HALF_M[0] && x[*c as usize].y.abs() <= HALF_M[1];
    for corners in &tissue.triangles {
        if corners.iter().any(inside) {
            svg.polygon(
                &corners.map(|c| at(&x[c as usize])),
                r##"fill="#f3d3bf" stroke="#e2b79c" stroke-width="0.5""##,
            );
        }
    }
    let edge: Vec<(f64, f64)> = tissue.wound_edge.iter().map(|n| at(&x[*n as usize])).collect();
    svg.polygon(&edge, r##"fill="#7a1f1f" stroke="#7a1f1f" stroke-width="1""##);
    for row in scene.ledger_rows() {
        svg.line(at(&row.left_current_m), at(&row.right_current_m), "#1f5fbf", 2.0);
        for point in [&row.left_current_m, &row.right_current_m] {
            svg.dot(at(point), 3.5, "#1f5fbf");
        }
    }
}
