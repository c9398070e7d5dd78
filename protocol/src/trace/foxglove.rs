//! JSON forms after Foxglove's published schemas: `PoseInFrame` and `PointCloud`.
//!
//! Additional properties (`buttons`, `scene_generation`, …) are allowed by JSON Schema and ignored
//! by Foxglove. Points are packed in little-endian words of four bytes: x, y, z and what else a frame says of a node.

use super::view::{HandPose, checked};
use super::{base64, split_time};
use crate::scene_frame::{FrameHeader, FrameNode, MAX_NODES};
use crate::wire::{Field, Message};
use serde::{Deserialize, Serialize};

/// All positions of a trace are in this frame.
const FRAME_ID: &str = "scene";
/// Bytes of a packed number.
const WORD: usize = 4;
/// Bytes per packed point.
const STRIDE: usize = WORD * FIELDS.len();
/// `foxglove.PackedElementField`: UINT32.
const UINT32: u32 = 5;
/// `foxglove.PackedElementField`: FLOAT32.
const FLOAT32: u32 = 7;

/// Time in Foxglove's form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Timestamp {
    sec: u64,
    nsec: u32,
}

impl Timestamp {
    pub(super) fn of(time_ns: u64) -> Self {
        let (sec, nsec) = split_time(time_ns);
        Self { sec, nsec }
    }

    pub(super) fn nanoseconds(self) -> Result<u64, String> {
        self.sec
            .checked_mul(1_000_000_000)
            .and_then(|ns| ns.checked_add(u64::from(self.nsec)))
            .ok_or_else(|| "its time is out of range".to_owned())
    }
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Xyzw {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Pose {
    position: Xyz,
    orientation: Xyzw,
}

const IDENTITY: Pose =
    Pose { position: Xyz { x: 0.0, y: 0.0, z: 0.0 }, orientation: Xyzw { x: 0.0, y: 0.0, z: 0.0, w: 1.0 } };

/// `foxglove.PoseInFrame`, with the buttons.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PoseInFrame {
    timestamp: Timestamp,
    frame_id: String,
    pose: Pose,
    #[serde(default)]
    buttons: u32,
}

impl PoseInFrame {
    pub(super) fn of(time_ns: u64, hand: &HandPose) -> Self {
        let [x, y, z] = hand.position_m;
        let [qx, qy, qz, qw] = hand.orientation;
        Self {
            timestamp: Timestamp::of(time_ns),
            frame_id: FRAME_ID.to_owned(),
            pose: Pose { position: Xyz { x, y, z }, orientation: Xyzw { x: qx, y: qy, z: qz, w: qw } },
            buttons: hand.buttons,
        }
    }

    pub(super) fn restore(&self) -> Result<HandPose, String> {
        let (p, q) = (self.pose.position, self.pose.orientation);
        let hand = HandPose { position_m: [p.x, p.y, p.z], orientation: [q.x, q.y, q.z, q.w], buttons: self.buttons };
        if !(hand.position_m.is_usable() && hand.orientation.is_usable()) {
            return Err("its pose is not finite".to_owned());
        }
        Ok(hand)
    }
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct PackedField {
    name: String,
    offset: u32,
    #[serde(rename = "type")]
    kind: u32,
}

/// `foxglove.PointCloud` of all nodes.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PointCloud {
    timestamp: Timestamp,
    frame_id: String,
    pose: Pose,
    point_stride: u32,
    fields: Vec<PackedField>,
    data: String,
    sequence: u64,
    scene_generation: u32,
    sim_time_s: f64,
}

/// What is packed of a node, in this order; a recording of wire version 2 has the first [`OLD_FIELDS`] only.
const FIELDS: [(&str, u32); 7] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("attachment_force_n", FLOAT32),
    ("spring_force_n", FLOAT32),
    ("strain", FLOAT32),
    ("flags", UINT32),
];
const OLD_FIELDS: usize = 4;

fn fields(count: usize) -> Vec<PackedField> {
    let packed = |(i, (name, kind)): (usize, &(&str, u32))| PackedField {
        name: (*name).to_owned(),
        offset: (WORD * i) as u32,
        kind: *kind,
    };
    FIELDS[..count].iter().enumerate().map(packed).collect()
}

impl PointCloud {
    pub(super) fn of(header: &FrameHeader, nodes: &[FrameNode]) -> Self {
        let mut bytes = Vec::with_capacity(nodes.len() * STRIDE);
        for node in nodes {
            let [x, y, z] = node.position_m;
            for number in [x, y, z, node.attachment_force_n, node.spring_force_n, node.strain] {
                bytes.extend_from_slice(&number.to_le_bytes());
            }
            bytes.extend_from_slice(&node.flags.to_le_bytes());
        }
        Self {
            timestamp: Timestamp::of(header.header.time_ns),
            frame_id: FRAME_ID.to_owned(),
            pose: IDENTITY,
            point_stride: STRIDE as u32,
            fields: fields(FIELDS.len()),
            data: base64::encode(&bytes),
            sequence: header.header.sequence,
            scene_generation: header.scene_generation,
            sim_time_s: header.sim_time_s,
        }
    }

    pub(super) fn restore(&self) -> Result<(FrameHeader, Vec<FrameNode>), String> {
        let count = self.fields.len();
        let known = [FIELDS.len(), OLD_FIELDS].contains(&count);
        if !known || self.fields != fields(count) || self.point_stride as usize != WORD * count {
            return Err("its points are not packed as x, y, z, attachment_force_n and so on".to_owned());
        }
        let bytes = base64::decode(&self.data).ok_or("its data is not base64")?;
        let (words, rest) = bytes.as_chunks::<WORD>();
        if !rest.is_empty() || !words.len().is_multiple_of(count) || words.len() / count > MAX_NODES {
            return Err("its data is no whole number of points, or too many".to_owned());
        }
        let nodes: Vec<FrameNode> = words.chunks_exact(count).map(unpack).collect();
        if !nodes.iter().all(Field::is_usable) {
            return Err("a point is not finite".to_owned());
        }
        let mut header = FrameHeader {
            scene_generation: self.scene_generation,
            node_count: nodes.len() as u32,
            sim_time_s: self.sim_time_s,
            ..FrameHeader::EMPTY
        };
        header.stamp(self.sequence, self.timestamp.nanoseconds()?);
        Ok((checked(header)?, nodes))
    }
}

/// Words that are not there are zero.
fn unpack(words: &[[u8; WORD]]) -> FrameNode {
    let word = |i: usize| words.get(i).copied().unwrap_or_default();
    let number = |i: usize| f32::from_le_bytes(word(i));
    FrameNode {
        position_m: [number(0), number(1), number(2)],
        attachment_force_n: number(3),
        spring_force_n: number(4),
        strain: number(5),
        flags: u32::from_le_bytes(word(6)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_with_fewer_fields_per_point_is_still_read() {
        let nodes = [FrameNode { position_m: [0.1, 0.2, 0.3], attachment_force_n: 0.4, ..FrameNode::EMPTY }; 2];
        let mut header = FrameHeader { node_count: 2, ..FrameHeader::EMPTY };
        header.stamp(1, 1);
        let mut cloud = PointCloud::of(&header, &nodes);
        let whole = base64::decode(&cloud.data).unwrap();
        let old: Vec<u8> = whole.chunks(STRIDE).flat_map(|point| &point[..WORD * OLD_FIELDS]).copied().collect();
        cloud.data = base64::encode(&old);
        assert!(cloud.restore().is_err(), "the fields still announce seven words");
        cloud.fields.truncate(OLD_FIELDS);
        assert!(cloud.restore().is_err(), "the stride still announces seven words");
        cloud.point_stride = (WORD * OLD_FIELDS) as u32;
        assert_eq!(cloud.restore().unwrap().1, nodes);
    }
}
