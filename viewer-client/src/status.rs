//! One line of text for a view: time, servo, force, suturing, largest ER, solver.

use crate::feed::View;

/// Names of the servo's modes.
const MODES: [&str; 6] = ["init", "monitor", "armed", "ramp", "active", "FAULT"];
/// Names of the suturing stages.
const STAGES: [&str; 6] = ["idle", "left held", "left taken", "pulling", "line free", "done"];
/// Names of the scene kinds.
const SCENES: [&str; 3] = ["skin", "liver", "vessel"];

/// The line; parts that are missing say so.
#[must_use]
pub fn line(view: &View) -> String {
    let servo = view.servo.as_ref().map_or_else(
        || "servo -".to_owned(),
        |s| {
            let force = s.devices[0].force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
            let age_ms = s.port_age_ns as f64 * 1e-6;
            let mode = name(&MODES, s.mode);
            format!("{mode} | {} ticks, {} missed | {force:.2} N | port {age_ms:.1} ms", s.ticks, s.missed)
        },
    );
    let wound = view.report.as_ref().map_or_else(
        || "solver -".to_owned(),
        |r| {
            format!(
                "{} {}/{}: {}, {} stitches, ER {:.1} %, {} steps",
                name(&SCENES, r.scene_kind),
                r.scene_index + 1,
                r.scene_count,
                name(&STAGES, r.stage),
                r.row_count,
                100.0 * r.er_max,
                r.solver_steps
            )
        },
    );
    let nodes = match view.frames {
        0 => "no frame".to_owned(),
        _ => format!("{} nodes", view.frame.header.node_count),
    };
    format!("{servo} | {wound} | {nodes}")
}

fn name(names: &[&'static str], code: u32) -> &'static str {
    names.get(code as usize).copied().unwrap_or("?")
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::servo_state::ServoState;
    use protocol::wire::Field;

    #[test]
    fn an_empty_view_says_what_is_missing() {
        assert_eq!(line(&View::default()), "servo - | solver - | no frame");
    }

    #[test]
    fn the_force_is_the_norm_and_unknown_codes_do_no_harm() {
        let mut servo = ServoState::EMPTY;
        servo.devices[0].force_n = [0.3, 0.4, 0.0];
        servo.mode = 99;
        let text = line(&View { servo: Some(servo), ..View::default() });
        assert!(text.starts_with("? |") && text.contains("0.50 N"), "{text}");
    }
}
