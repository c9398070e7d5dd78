//! The words of the scene in the words of the wire, and back.

use protocol::servo_state::DeviceState;
use protocol::tissue_port::{HANDLE_HELD, HANDLE_LINKED, HANDLE_PULLED, HandlePort};
use protocol::wound_report::{LedgerRow, MAX_LEDGER_ROWS};
use sim_core::scene::grip::{Grip, HandleMode};
use sim_core::scene::procedure::ProcedureRow;
use sim_core::scene::suturing::HandInput;
use sim_core::tissue::port::Port;
use sim_core::vector::{Mat3, Vec3};

/// What a device tells the scene: place and front button.
pub(super) fn hand(device: &DeviceState) -> HandInput {
    HandInput {
        position_m: Vec3::from(device.position_m),
        press_count: device.press_count[0],
        release_count: device.release_count[0],
    }
}

pub(super) fn mode_code(mode: HandleMode) -> u32 {
    match mode {
        HandleMode::Held => HANDLE_HELD,
        HandleMode::Pulled => HANDLE_PULLED,
        HandleMode::Linked => HANDLE_LINKED,
    }
}

pub(super) fn handle_port(grip: &Grip, port: &Port) -> HandlePort {
    HandlePort {
        position_m: port.position_m.into(),
        velocity_m_per_s: port.velocity_m_per_s.into(),
        force_n: port.force_n.into(),
        stiffness_n_per_m: symmetric(&port.step_stiffness_n_per_m),
        one_ring_n_per_m: symmetric(&port.one_ring_n_per_m),
        trust_radius_m: port.trust_radius_m,
        mass_kg: port.mass_kg,
        drag_n_s_per_m: port.drag_n_s_per_m,
        mode: mode_code(grip.mode),
        pair: grip.pair as u32,
    }
}

/// xx, xy, xz, yy, yz, zz.
fn symmetric(m: &Mat3) -> [f64; 6] {
    [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]]
}

pub(super) fn ledger_row(row: &ProcedureRow) -> LedgerRow {
    let r = &row.row;
    let history =
        [r.history.control_acts, r.history.control_has_acted, r.history.knot_slipped, r.history.pulled_through];
    LedgerRow {
        left_original_m: r.left_original_m.into(),
        left_current_m: r.left_current_m.into(),
        right_original_m: r.right_original_m.into(),
        right_current_m: r.right_current_m.into(),
        open_distance_m: r.open_distance_m,
        original_distance_m: r.original_distance_m,
        current_distance_m: r.current_distance_m,
        relative_error: r.relative_error,
        holding_force_n: r.holding_force_n,
        stitch_tension_n: r.stitch_tension_n,
        rest_length_m: r.rest_length_m,
        slipped_m: r.slipped_m,
        pair: r.pair,
        scene_kind: row.kind_code,
        flags: history.iter().enumerate().map(|(bit, set)| u32::from(*set) << bit).sum(),
        scene_index: row.scene as u32,
    }
}

/// Rows of Table 1 that a report can carry: three scenes of sixteen stitches.
const _: () = assert!(MAX_LEDGER_ROWS >= 3 * 16);

#[cfg(test)]
mod tests {
    use crate::solver::session::SolverSession;
    use sim_core::scene::presets;
    use sim_core::scene::procedure::SceneSource;

    #[test]
    fn the_report_tells_the_gap_that_the_port_tells_and_the_floor_of_er() {
        let config = presets::skin();
        let floor_m = 1e-3 * config.control.as_ref().expect("control").distance_floor_mm;
        let mut session = SolverSession::new(&[SceneSource { config, mesh: None }]).expect("a preset");
        session.step(None, None, 1);
        let (port, report) = (session.port(), session.report());
        assert_eq!((report.pair, report.pair_count), (port.pair, port.pair_count));
        assert_eq!((report.gap_m, report.closed_gap_m), (port.gap_m, port.closed_gap_m));
        assert!(report.gap_m > report.closed_gap_m && report.closed_gap_m > 0.0);
        assert_eq!(report.distance_floor_m, floor_m);
    }
}
