//! `scene_frame` and `scene_outline`: the moving and the fixed part of what a viewer draws.
//!
//! Both are slices with a header: the frame carries one [`FrameNode`] per node, the outline
//! carries `u32` words: `3 · triangle_count` node indices, then `node_count` layer numbers, then
//! `2 · pair_count` suture point nodes (left, right), then `edge_count` wound-edge nodes.

use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// Upper bound on nodes in a frame; a reader rejects more before it allocates.
pub const MAX_NODES: usize = 1 << 20;
/// Upper bound on words in an outline.
pub const MAX_OUTLINE_WORDS: usize = 1 << 24;

pod! {
    /// One drawn node.
    pub struct FrameNode {
        /// Position, metres.
        pub position_m: [f32; 3],
        /// Reaction of the Long Range Attachments on this node, newtons.
        pub attachment_force_n: f32,
    }
}

pod! {
    /// User header of a frame.
    pub struct FrameHeader {
        /// Header; `length` is the size of this struct.
        pub header: Header,
        /// Matches the outline's generation.
        pub scene_generation: u32,
        /// Nodes that follow.
        pub node_count: u32,
        /// Simulated seconds.
        pub sim_time_s: f64,
    }
}

pod! {
    /// User header of an outline.
    pub struct OutlineHeader {
        /// Header; `length` is the size of this struct.
        pub header: Header,
        /// Counts scene loads and restores.
        pub scene_generation: u32,
        /// Kind of the scene: 0 skin, 1 liver, 2 vessel.
        pub scene_kind: u32,
        /// Nodes of the scene.
        pub node_count: u32,
        /// Triangles.
        pub triangle_count: u32,
        /// Suture pairs.
        pub pair_count: u32,
        /// Wound-edge nodes.
        pub edge_count: u32,
    }
}

message!(FrameHeader, "scene_frame", parts: [FrameNode], check: |m| {
    (m.node_count as usize > MAX_NODES).then_some("node_count")
});
message!(OutlineHeader, "scene_outline", parts: [], check: |m| {
    if m.node_count as usize > MAX_NODES {
        return Some("node_count");
    }
    let words = 3 * u64::from(m.triangle_count)
        + u64::from(m.node_count)
        + 2 * u64::from(m.pair_count)
        + u64::from(m.edge_count);
    (words > MAX_OUTLINE_WORDS as u64).then_some("triangle_count")
});
