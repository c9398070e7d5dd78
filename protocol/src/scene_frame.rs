//! `scene_frame` and `scene_outline`: the moving and the fixed part of what a viewer draws.
//!
//! Both are slices with a header: the frame carries one [`FrameNode`] per node, the outline
//! carries `u32` words: `3 · triangle_count` node indices, then `node_count` layer numbers, then
//! `2 · pair_count` suture point nodes (left, right), then `edge_count` wound-edge nodes.

use crate::wire::{Header, message, pod};
use iceoryx2::prelude::ZeroCopySend;

/// Upper bound on nodes in a frame; a reader rejects more before it allocates.
pub const MAX_NODES: usize = 1 << 20;
/// Bit of [`FrameNode::flags`]: the solver steps this node (it does not sleep).
pub const AWAKE: u32 = 1;
/// Bit of [`FrameNode::flags`]: a suture point in the hand prescribes where this node is.
pub const HELD: u32 = 2;
/// Upper bound on words in an outline.
pub const MAX_OUTLINE_WORDS: usize = 1 << 24;

pod! {
    /// One drawn node.
    pub struct FrameNode as "suture.v4.FrameNode" {
        /// Position, metres.
        pub position_m: [f32; 3],
        /// Reaction of the Long Range Attachments on this node, newtons.
        pub attachment_force_n: f32,
        /// Largest force of a spring at this node, newtons.
        pub spring_force_n: f32,
        /// Largest strain of a spring at this node, |l / l₀ − 1|.
        pub strain: f32,
        /// [`AWAKE`], [`HELD`].
        pub flags: u32,
    }
}

pod! {
    /// User header of a frame.
    pub struct FrameHeader as "suture.v4.FrameHeader" {
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
    pub struct OutlineHeader as "suture.v4.OutlineHeader" {
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

/// The parts of an outline's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutlineParts<'w> {
    /// Three node indices per triangle.
    pub triangles: &'w [u32],
    /// Layer number of every node.
    pub layers: &'w [u32],
    /// Left and right node of every suture pair.
    pub pairs: &'w [u32],
    /// Nodes of the wound edge.
    pub edges: &'w [u32],
}

impl OutlineHeader {
    /// Number of words that this header announces.
    #[must_use]
    pub fn words(&self) -> u64 {
        3 * u64::from(self.triangle_count)
            + u64::from(self.node_count)
            + 2 * u64::from(self.pair_count)
            + u64::from(self.edge_count)
    }

    /// Cuts the words into their parts; `None` when their number is not the announced one.
    #[must_use]
    pub fn split<'w>(&self, words: &'w [u32]) -> Option<OutlineParts<'w>> {
        if words.len() as u64 != self.words() {
            return None;
        }
        let (triangles, rest) = words.split_at(3 * self.triangle_count as usize);
        let (layers, rest) = rest.split_at(self.node_count as usize);
        let (pairs, edges) = rest.split_at(2 * self.pair_count as usize);
        Some(OutlineParts { triangles, layers, pairs, edges })
    }
}

message!(FrameHeader, "scene_frame", parts: [FrameNode], check: |m| {
    (m.node_count as usize > MAX_NODES).then_some("node_count")
});
message!(OutlineHeader, "scene_outline", parts: [], check: |m| {
    if m.node_count as usize > MAX_NODES {
        return Some("node_count");
    }
    (m.words() > MAX_OUTLINE_WORDS as u64).then_some("triangle_count")
});
