//! `wound_report`: Table 1 live, the suture line, and how the solver does.

use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// Ledger rows that fit one report (three scenes of up to 16 stitches).
pub const MAX_LEDGER_ROWS: usize = 48;
/// Words of eight bytes that the reason for the integrator may take.
pub const MAX_REASON_WORDS: usize = 32;
/// Points of the suture line that fit one report.
pub const MAX_LINE_POINTS: usize = 128;

pod! {
    /// One row of Table 1.
    #[derive(Serialize, Deserialize)]
    pub struct LedgerRow as "suture.v3.LedgerRow" {
        /// Original position of the left suture point (when the stitch was finished), metres.
        pub left_original_m: [f64; 3],
        /// Current position of the left suture point, metres.
        pub left_current_m: [f64; 3],
        /// Original position of the right suture point, metres.
        pub right_original_m: [f64; 3],
        /// Current position of the right suture point, metres.
        pub right_current_m: [f64; 3],
        /// Distance of the open wound at this pair before suturing, metres.
        pub open_distance_m: f64,
        /// `D_o`: distance when the stitch was finished, metres.
        pub original_distance_m: f64,
        /// `D_c`: distance now, metres.
        pub current_distance_m: f64,
        /// `ER = |D_c − D_o| / max(D_o, D_floor)`.
        pub relative_error: f64,
        /// Force with which the control holds the stitch, newtons.
        pub holding_force_n: f64,
        /// Tension of the tied line in this stitch, newtons.
        pub stitch_tension_n: f64,
        /// Rest length of the tied line, metres.
        #[serde(default)]
        pub rest_length_m: f64,
        /// Length that has slipped through its knot, metres.
        #[serde(default)]
        pub slipped_m: f64,
        /// Suture pair of its scene.
        pub pair: u32,
        /// Kind of the scene: 0 skin, 1 liver, 2 vessel.
        pub scene_kind: u32,
        /// Bit 0: control acts now. Bit 1: control has acted. Bit 2: knot has slipped. Bit 3: pulled through.
        pub flags: u32,
        /// Procedure: index of its scene.
        #[serde(default)]
        pub scene_index: u32,
    }
}

pod! {
    /// Ledger, line and solver health.
    pub struct WoundReport as "suture.v3.WoundReport" {
        /// Header.
        pub header: Header,
        /// Rows in use.
        pub row_count: u32,
        /// Line points in use.
        pub line_point_count: u32,
        /// 0 control off, 1 on (sound), 2 paper.
        pub control: u32,
        /// Procedure: index of the scene at work.
        pub scene_index: u32,
        /// Procedure: number of scenes.
        pub scene_count: u32,
        /// Kind of the scene: 0 skin, 1 liver, 2 vessel.
        pub scene_kind: u32,
        /// Suturing stage as in `tissue_port`.
        pub stage: u32,
        /// Integrator: 0 semi-implicit, 1 paper explicit, 2 Verlet, 3 BDF2, 4 XPBD.
        pub integrator: u32,
        /// Sub-steps per solver step.
        pub substeps: u32,
        /// Sequence of the newest session command seen.
        pub command_sequence: u32,
        /// Its result: 0 none, 1 done, 2 refused.
        pub command_result: u32,
        /// Points of the hand that were taken so far.
        pub points_taken: u32,
        /// Presses that took a suture point or the line, also one that was taken before.
        pub grips_used: u32,
        /// Counts scene loads and restores, as in `tissue_port`.
        pub scene_generation: u32,
        /// Solver steps done.
        pub solver_steps: u64,
        /// Simulated seconds.
        pub sim_time_s: f64,
        /// `S = λ dt² / (4m + 2c dt)` at load.
        pub stability_number: f64,
        /// Largest ER of the ledger.
        pub er_max: f64,
        /// Solver step time: mean of the last second, nanoseconds.
        pub step_time_ns: u64,
        /// Solver step time: longest since start, nanoseconds.
        pub step_time_max_ns: u64,
        /// Why this integrator with these sub-steps: UTF-8, eight bytes a word, zero after the end.
        pub integrator_reason: [u64; MAX_REASON_WORDS],
        /// Suture line points, metres.
        pub line_m: [[f64; 3]; MAX_LINE_POINTS],
        /// Table 1.
        pub rows: [LedgerRow; MAX_LEDGER_ROWS],
    }
}

impl WoundReport {
    /// Writes the reason for the integrator; what does not fit is left out.
    pub fn set_integrator_reason(&mut self, text: &str) {
        let mut end = text.len().min(8 * MAX_REASON_WORDS);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut words = [0; MAX_REASON_WORDS];
        for (index, byte) in text.as_bytes()[..end].iter().enumerate() {
            words[index / 8] |= u64::from(*byte) << (8 * (index % 8));
        }
        self.integrator_reason = words;
    }

    /// The reason for the integrator; whatever a writer left there, it is text of one line.
    #[must_use]
    pub fn integrator_reason(&self) -> String {
        let bytes = self.integrator_reason.iter().flat_map(|word| word.to_le_bytes());
        let text: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
        String::from_utf8_lossy(&text).chars().filter(|c| !c.is_control()).collect()
    }
}

message!(WoundReport, "wound_report", parts: [LedgerRow], check: |m| {
    if m.row_count as usize > MAX_LEDGER_ROWS {
        return Some("row_count");
    }
    if m.stage > 5 {
        return Some("stage");
    }
    if m.control > 2 {
        return Some("control");
    }
    (m.line_point_count as usize > MAX_LINE_POINTS).then_some("line_point_count")
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_comes_back_whole_or_cut_at_a_character() {
        let mut report = WoundReport::default();
        assert_eq!(report.integrator_reason(), "");
        report.set_integrator_reason("bdf2 x 1: S = 3.2");
        assert_eq!(report.integrator_reason(), "bdf2 x 1: S = 3.2");
        let long = format!("{}µµ", "x".repeat(8 * MAX_REASON_WORDS - 1));
        report.set_integrator_reason(&long);
        assert_eq!(report.integrator_reason(), "x".repeat(8 * MAX_REASON_WORDS - 1));
        report.integrator_reason = [0xFF0A_41FF_0A41_FFFF; MAX_REASON_WORDS];
        assert!(report.integrator_reason().chars().all(|c| !c.is_control()));
    }
}
