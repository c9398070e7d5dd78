//! JSON forms of our own messages. Fixed arrays shrink to what is in use: trailing elements that
//! equal the empty value are left out and come back on reading, so nothing is lost.

use super::foxglove::Timestamp;
use crate::scene_frame::{MAX_NODES, MAX_OUTLINE_WORDS, OutlineHeader};
use crate::servo_state::{DeviceState, HandleState, ServoState};
use crate::session_command::{CommandAnswer, MAX_ANSWERS};
use crate::text;
use crate::wire::{Field, Message};
use crate::wound_report::{LedgerRow, WoundReport};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Stylus of one device at one time, as a hand file holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPose {
    /// Position, metres.
    pub position_m: [f64; 3],
    /// Orientation as quaternion (x, y, z, w).
    pub orientation: [f64; 4],
    /// Bit 0 front button, bit 1 back button.
    pub buttons: u32,
}

/// `/servo_state`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ServoView<'m> {
    timestamp: Timestamp,
    sequence: u64,
    port_epoch: u32,
    mode: u32,
    fault: u32,
    flags: u32,
    #[serde(default)]
    period_ns: u64,
    ticks: u64,
    missed: u64,
    port_sequence: u64,
    port_age_ns: u64,
    port_rung: u32,
    handle_count: u32,
    #[serde(default)]
    hand_sender: u32,
    #[serde(default)]
    hand_turn: u32,
    energy_to_hand_j: f64,
    devices: Cow<'m, [DeviceState]>,
    handles: Cow<'m, [HandleState]>,
}

impl<'m> ServoView<'m> {
    pub(super) fn of(m: &'m ServoState) -> Self {
        Self {
            timestamp: Timestamp::of(m.header.time_ns),
            sequence: m.header.sequence,
            port_epoch: m.port_epoch,
            mode: m.mode,
            fault: m.fault,
            flags: m.flags,
            period_ns: m.period_ns,
            ticks: m.ticks,
            missed: m.missed,
            port_sequence: m.port_sequence,
            port_age_ns: m.port_age_ns,
            port_rung: m.port_rung,
            handle_count: m.handle_count,
            hand_sender: m.hand_sender,
            hand_turn: m.hand_turn,
            energy_to_hand_j: m.energy_to_hand_j,
            devices: Cow::Borrowed(in_use(&m.devices)),
            handles: Cow::Borrowed(in_use(&m.handles)),
        }
    }

    pub(super) fn restore(&self) -> Result<ServoState, String> {
        let mut m = ServoState {
            port_epoch: self.port_epoch,
            mode: self.mode,
            fault: self.fault,
            flags: self.flags,
            period_ns: self.period_ns,
            ticks: self.ticks,
            missed: self.missed,
            port_sequence: self.port_sequence,
            port_age_ns: self.port_age_ns,
            port_rung: self.port_rung,
            handle_count: self.handle_count,
            hand_sender: self.hand_sender,
            hand_turn: self.hand_turn,
            energy_to_hand_j: self.energy_to_hand_j,
            devices: filled(&self.devices, "devices")?,
            handles: filled(&self.handles, "handles")?,
            ..ServoState::EMPTY
        };
        m.stamp(self.sequence, self.timestamp.nanoseconds()?);
        checked(m)
    }
}

/// An answer of a report, its reason as text.
#[derive(Debug, Serialize, Deserialize)]
struct AnswerView {
    sequence: u64,
    sender: u32,
    command: u32,
    result: u32,
    reason: String,
}

impl AnswerView {
    fn of(m: &CommandAnswer) -> Self {
        let CommandAnswer { sequence, sender, command, result, .. } = *m;
        Self { sequence, sender, command, result, reason: m.reason() }
    }

    fn restore(&self) -> CommandAnswer {
        let Self { sequence, sender, command, result, .. } = *self;
        CommandAnswer { sequence, sender, command, result, reserved: 0, reason: text::words(&self.reason) }
    }
}

/// `/wound_report`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ReportView<'m> {
    timestamp: Timestamp,
    sequence: u64,
    control: u32,
    scene_index: u32,
    scene_count: u32,
    scene_kind: u32,
    stage: u32,
    integrator: u32,
    substeps: u32,
    command_sequence: u32,
    command_result: u32,
    points_taken: u32,
    #[serde(default)]
    grips_used: u32,
    #[serde(default)]
    scene_generation: u32,
    #[serde(default)]
    pair: u32,
    #[serde(default)]
    pair_count: u32,
    #[serde(default)]
    gap_m: f64,
    #[serde(default)]
    closed_gap_m: f64,
    #[serde(default)]
    distance_floor_m: f64,
    #[serde(default)]
    integrator_reason: String,
    #[serde(default)]
    answers: Vec<AnswerView>,
    solver_steps: u64,
    sim_time_s: f64,
    stability_number: f64,
    er_max: f64,
    step_time_ns: u64,
    step_time_max_ns: u64,
    rows: Cow<'m, [LedgerRow]>,
    line_m: Cow<'m, [[f64; 3]]>,
}

impl<'m> ReportView<'m> {
    pub(super) fn of(m: &'m WoundReport) -> Self {
        Self {
            timestamp: Timestamp::of(m.header.time_ns),
            sequence: m.header.sequence,
            control: m.control,
            scene_index: m.scene_index,
            scene_count: m.scene_count,
            scene_kind: m.scene_kind,
            stage: m.stage,
            integrator: m.integrator,
            substeps: m.substeps,
            command_sequence: m.command_sequence,
            command_result: m.command_result,
            points_taken: m.points_taken,
            grips_used: m.grips_used,
            scene_generation: m.scene_generation,
            pair: m.pair,
            pair_count: m.pair_count,
            gap_m: m.gap_m,
            closed_gap_m: m.closed_gap_m,
            distance_floor_m: m.distance_floor_m,
            integrator_reason: m.integrator_reason(),
            answers: m.answers.iter().take_while(|a| a.result != 0).map(AnswerView::of).collect(),
            solver_steps: m.solver_steps,
            sim_time_s: m.sim_time_s,
            stability_number: m.stability_number,
            er_max: m.er_max,
            step_time_ns: m.step_time_ns,
            step_time_max_ns: m.step_time_max_ns,
            rows: Cow::Borrowed(m.rows.get(..m.row_count as usize).unwrap_or(&m.rows)),
            line_m: Cow::Borrowed(m.line_m.get(..m.line_point_count as usize).unwrap_or(&m.line_m)),
        }
    }

    pub(super) fn restore(&self) -> Result<WoundReport, String> {
        let mut m = WoundReport {
            rows: filled(&self.rows, "rows")?,
            line_m: filled(&self.line_m, "line_m")?,
            row_count: self.rows.len() as u32,
            line_point_count: self.line_m.len() as u32,
            control: self.control,
            scene_index: self.scene_index,
            scene_count: self.scene_count,
            scene_kind: self.scene_kind,
            stage: self.stage,
            integrator: self.integrator,
            substeps: self.substeps,
            command_sequence: self.command_sequence,
            command_result: self.command_result,
            points_taken: self.points_taken,
            grips_used: self.grips_used,
            scene_generation: self.scene_generation,
            pair: self.pair,
            pair_count: self.pair_count,
            gap_m: self.gap_m,
            closed_gap_m: self.closed_gap_m,
            distance_floor_m: self.distance_floor_m,
            solver_steps: self.solver_steps,
            sim_time_s: self.sim_time_s,
            stability_number: self.stability_number,
            er_max: self.er_max,
            step_time_ns: self.step_time_ns,
            step_time_max_ns: self.step_time_max_ns,
            ..WoundReport::EMPTY
        };
        m.set_integrator_reason(&self.integrator_reason);
        if self.answers.len() > MAX_ANSWERS {
            return Err(format!("answers has {} elements, at most {MAX_ANSWERS} are possible", self.answers.len()));
        }
        m.answers.iter_mut().zip(&self.answers).for_each(|(slot, answer)| *slot = answer.restore());
        m.stamp(self.sequence, self.timestamp.nanoseconds()?);
        checked(m)
    }
}

/// `/tissue_outline`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct OutlineView<'m> {
    timestamp: Timestamp,
    sequence: u64,
    scene_generation: u32,
    scene_kind: u32,
    node_count: u32,
    triangles: Cow<'m, [u32]>,
    layers: Cow<'m, [u32]>,
    pairs: Cow<'m, [u32]>,
    edges: Cow<'m, [u32]>,
}

impl<'m> OutlineView<'m> {
    /// `None` when the words are not what the header announces.
    pub(super) fn of(header: &OutlineHeader, words: &'m [u32]) -> Option<Self> {
        let parts = header.split(words)?;
        Some(Self {
            timestamp: Timestamp::of(header.header.time_ns),
            sequence: header.header.sequence,
            scene_generation: header.scene_generation,
            scene_kind: header.scene_kind,
            node_count: header.node_count,
            triangles: Cow::Borrowed(parts.triangles),
            layers: Cow::Borrowed(parts.layers),
            pairs: Cow::Borrowed(parts.pairs),
            edges: Cow::Borrowed(parts.edges),
        })
    }

    pub(super) fn restore(&self) -> Result<(OutlineHeader, Vec<u32>), String> {
        let words = [&self.triangles[..], &self.layers, &self.pairs, &self.edges].concat();
        if self.node_count as usize > MAX_NODES || words.len() > MAX_OUTLINE_WORDS {
            return Err("it is larger than any scene".to_owned());
        }
        let nodes_named = [&self.triangles, &self.pairs, &self.edges];
        if nodes_named.iter().any(|list| list.iter().any(|&node| node >= self.node_count)) {
            return Err("it names a node that is not there".to_owned());
        }
        if self.layers.len() != self.node_count as usize {
            return Err("it has not one layer per node".to_owned());
        }
        let mut header = OutlineHeader {
            scene_generation: self.scene_generation,
            scene_kind: self.scene_kind,
            node_count: self.node_count,
            triangle_count: whole(self.triangles.len(), 3, "triangles")?,
            pair_count: whole(self.pairs.len(), 2, "pairs")?,
            edge_count: whole(self.edges.len(), 1, "edges")?,
            ..OutlineHeader::EMPTY
        };
        header.stamp(self.sequence, self.timestamp.nanoseconds()?);
        Ok((checked(header)?, words))
    }
}

fn whole(length: usize, of: usize, name: &str) -> Result<u32, String> {
    if !length.is_multiple_of(of) {
        return Err(format!("the length of {name} is not a multiple of {of}"));
    }
    u32::try_from(length / of).map_err(|e| e.to_string())
}

/// The elements up to the last one that is not empty.
fn in_use<T: Field + PartialEq>(all: &[T]) -> &[T] {
    let count = all.iter().rposition(|e| *e != T::EMPTY).map_or(0, |last| last + 1);
    &all[..count]
}

/// The fixed array that begins with these elements.
fn filled<T: Field, const N: usize>(elements: &[T], name: &str) -> Result<[T; N], String> {
    let mut all = [T::EMPTY; N];
    all.get_mut(..elements.len())
        .ok_or_else(|| format!("{name} has {} elements, at most {N} are possible", elements.len()))?
        .copy_from_slice(elements);
    Ok(all)
}

pub(super) fn checked<M: Message>(message: M) -> Result<M, String> {
    message.validate().map_err(|e| e.to_string())?;
    Ok(message)
}
