//! `wound_report`: Table 1 live, the suture line, and how the solver does.

use crate::session_command::{CommandAnswer, MAX_ANSWERS, REFUSED};
use crate::text;
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
    pub struct LedgerRow as "suture.v4.LedgerRow" {
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
    pub struct WoundReport as "suture.v4.WoundReport" {
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
        /// Low half of the sequence of the session command that was answered last.
        pub command_sequence: u32,
        /// Its result: 0 none, else as in `session_command`.
        pub command_result: u32,
        /// Points of the hand that were taken so far.
        pub points_taken: u32,
        /// Presses that took a suture point or the line, also one that was taken before.
        pub grips_used: u32,
        /// Counts scene loads and restores, as in `tissue_port`.
        pub scene_generation: u32,
        /// Suture pair at work, as in `tissue_port`.
        pub pair: u32,
        /// Pairs of the scene at work.
        pub pair_count: u32,
        /// Distance of the patches of the pair at work, metres, as in `tissue_port`.
        pub gap_m: f64,
        /// At or below this distance the pair at work counts as closed, metres; 0 when it is not told.
        pub closed_gap_m: f64,
        /// `D_floor` of `ER`, metres; 0 when it is not told.
        pub distance_floor_m: f64,
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
        /// Answers to the last session commands, the newest first: every sender finds its own.
        pub answers: [CommandAnswer; MAX_ANSWERS],
        /// Suture line points, metres.
        pub line_m: [[f64; 3]; MAX_LINE_POINTS],
        /// Table 1.
        pub rows: [LedgerRow; MAX_LEDGER_ROWS],
    }
}

impl WoundReport {
    /// Writes the reason for the integrator; what does not fit is left out.
    pub fn set_integrator_reason(&mut self, reason: &str) {
        self.integrator_reason = text::words(reason);
    }

    /// The reason for the integrator.
    #[must_use]
    pub fn integrator_reason(&self) -> String {
        text::of_words(&self.integrator_reason)
    }

    /// Adds an answer; the oldest one is forgotten.
    pub fn add_answer(&mut self, answer: CommandAnswer) {
        self.answers.rotate_right(1);
        self.answers[0] = answer;
        // The low half: older readers compare it with the low half of their own.
        self.command_sequence = answer.sequence as u32;
        self.command_result = answer.result;
    }

    /// The answer to the command of this sequence, if there is one.
    #[must_use]
    pub fn answer_to(&self, sequence: u64) -> Option<&CommandAnswer> {
        self.answers.iter().find(|answer| answer.result != 0 && answer.sequence == sequence)
    }

    /// Why the last command was refused; empty when it was not.
    #[must_use]
    pub fn command_reason(&self) -> String {
        self.answers[0].reason()
    }
}

message!(WoundReport, "wound_report", parts: [LedgerRow, CommandAnswer], check: |m| {
    if m.row_count as usize > MAX_LEDGER_ROWS {
        return Some("row_count");
    }
    if m.stage > 5 {
        return Some("stage");
    }
    if m.control > 2 {
        return Some("control");
    }
    if m.answers.iter().any(|a| a.result > REFUSED) {
        return Some("answers.result");
    }
    (m.line_point_count as usize > MAX_LINE_POINTS).then_some("line_point_count")
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sender_finds_its_own_answer_until_the_room_is_used_up() {
        let mut report = WoundReport::default();
        assert_eq!(report.answer_to(0), None, "no answer is an answer to nothing");
        let sequence = |n: usize| (7 << 32) + n as u64;
        for n in 0..=MAX_ANSWERS {
            let reason = if n.is_multiple_of(2) { "" } else { "the gap is still open" };
            report.add_answer(CommandAnswer::new(sequence(n), n as u32, 4, reason));
            assert_eq!((report.command_sequence, report.command_result), (n as u32, 1 + n as u32 % 2));
            assert_eq!(report.command_reason(), reason);
        }
        assert_eq!(report.answer_to(sequence(0)), None, "forgotten");
        for n in 1..=MAX_ANSWERS {
            let answer = report.answer_to(sequence(n)).expect("kept");
            assert_eq!((answer.sender, answer.is_refused()), (n as u32, !n.is_multiple_of(2)));
        }
        // Another sender with the same low half.
        assert_eq!(report.answer_to(sequence(3) + (1 << 32)), None);
    }
}
