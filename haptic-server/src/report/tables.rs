//! The tables of a run as CSV: `ticks.csv` (one row per servo tick) and `ledger.csv` (Table 1 of the paper with
//! both positions, both distances, ER and holding force). Units in the column names. Numbers are written in
//! the shortest form that reads back to the same bits, so equal runs give equal bytes.

use std::io::{self, Write};

use protocol::servo_state::{HandleState, ServoState};
use protocol::tissue_port::HANDLE_FREE;
use protocol::wound_report::{LedgerRow, WoundReport};

/// Header of `ticks.csv`.
const TICK_COLUMNS: &str = "tick,time_s,stylus_x_m,stylus_y_m,stylus_z_m,buttons,node_x_m,node_y_m,node_z_m,\
force_x_n,force_y_n,force_z_n,unclipped_norm_n,line_tension_n,mode,port_rung,port_age_ms";

/// Header of `ledger.csv`.
const LEDGER_COLUMNS: &str = "row,scene,pair,left_original_x_mm,left_original_y_mm,left_original_z_mm,\
left_current_x_mm,left_current_y_mm,left_current_z_mm,right_original_x_mm,right_original_y_mm,\
right_original_z_mm,right_current_x_mm,right_current_y_mm,right_current_z_mm,open_distance_mm,d_o_mm,d_c_mm,\
er,holding_force_n,stitch_tension_n,control_acts,control_has_acted,knot_slipped,pulled_through";

/// Name of a servo mode code.
#[must_use]
pub fn mode_name(mode: u32) -> &'static str {
    ["init", "monitor", "armed", "ramp", "active", "fault"].get(mode as usize).copied().unwrap_or("unknown")
}

/// Name of a scene kind code.
#[must_use]
pub fn scene_kind_name(kind: u32) -> &'static str {
    ["skin", "liver", "vessel"].get(kind as usize).copied().unwrap_or("unknown")
}

/// Writes the header of `ticks.csv`.
///
/// # Errors
/// What the writer reports.
pub fn write_tick_header(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{TICK_COLUMNS}")
}

/// Writes one tick of the first device; `time_s` counts from the start of the run.
///
/// # Errors
/// What the writer reports.
pub fn write_tick(out: &mut dyn Write, time_s: f64, state: &ServoState) -> io::Result<()> {
    let device = &state.devices[0];
    let handle: Option<&HandleState> = state.handles.iter().find(|h| h.mode != HANDLE_FREE);
    let [x, y, z] = device.position_m;
    let [fx, fy, fz] = device.force_n;
    write!(out, "{},{time_s},{x},{y},{z},{},", state.header.sequence, device.buttons)?;
    match handle {
        Some(HandleState { position_m: [nx, ny, nz], .. }) => write!(out, "{nx},{ny},{nz},")?,
        None => write!(out, ",,,")?,
    }
    let unclipped = device.unclipped_force_n.iter().map(|f| f * f).sum::<f64>().sqrt();
    let tension = state.handles.iter().map(|h| h.line_tension_n).fold(0.0, f64::max);
    let age_ms = state.port_age_ns as f64 * 1e-6;
    writeln!(out, "{fx},{fy},{fz},{unclipped},{tension},{},{},{age_ms}", mode_name(state.mode), state.port_rung)
}

/// Writes Table 1.
///
/// # Errors
/// What the writer reports.
pub fn write_ledger(out: &mut dyn Write, report: &WoundReport) -> io::Result<()> {
    writeln!(out, "{LEDGER_COLUMNS}")?;
    for (index, row) in ledger_rows(report).iter().enumerate() {
        write!(out, "{},{},{}", index + 1, scene_kind_name(row.scene_kind), row.pair + 1)?;
        let positions = [row.left_original_m, row.left_current_m, row.right_original_m, row.right_current_m];
        for metres in positions.iter().flatten() {
            write!(out, ",{}", metres * 1e3)?;
        }
        for metres in [row.open_distance_m, row.original_distance_m, row.current_distance_m] {
            write!(out, ",{}", metres * 1e3)?;
        }
        write!(out, ",{},{},{}", row.relative_error, row.holding_force_n, row.stitch_tension_n)?;
        for bit in 0..4 {
            write!(out, ",{}", row.flags >> bit & 1)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// The rows in use, never more than fit the message.
#[must_use]
pub fn ledger_rows(report: &WoundReport) -> &[LedgerRow] {
    &report.rows[..(report.row_count as usize).min(report.rows.len())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::wire::Field;

    #[test]
    fn table1_every_column_has_a_value() {
        let mut report = WoundReport::EMPTY;
        report.row_count = 2;
        report.rows[1].original_distance_m = 4.0e-3;
        let mut bytes = Vec::new();
        write_ledger(&mut bytes, &report).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let widths: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert_eq!(widths, vec![LEDGER_COLUMNS.split(',').count(); 3]);
        assert!(text.lines().nth(2).unwrap().contains(",4,"));
    }

    #[test]
    fn a_tick_without_a_handle_has_empty_node_columns() {
        let mut bytes = Vec::new();
        write_tick(&mut bytes, 0.5, &ServoState::EMPTY).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(text.trim_end().split(',').count(), TICK_COLUMNS.split(',').count());
        assert!(text.contains(",,,"));
    }

    #[test]
    fn a_report_that_claims_too_many_rows_is_cut() {
        let mut report = WoundReport::EMPTY;
        report.row_count = u32::MAX;
        assert_eq!(ledger_rows(&report).len(), report.rows.len());
    }
}
