//! A scene with four faces for each.

use protocol::scene_frame::FrameNode;
use std::collections::HashMap;
use viewer_client::feed::View;

/// The same scene with a node in the middle of every side of a face.
///
/// # Panics
/// When frame and outline do not belong together.
#[must_use]
pub fn finer(mut view: View) -> View {
    let header = view.outline.header;
    let words = std::mem::take(&mut view.outline.elements);
    let (faces, rest) = words.split_at(3 * header.triangle_count as usize);
    let (layers, marks) = rest.split_at(header.node_count as usize);
    let (mut nodes, mut layers) = (std::mem::take(&mut view.frame.elements), layers.to_vec());
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let [p, q] = [a, b].map(|n| nodes[n as usize]);
            let position_m = std::array::from_fn(|c| 0.5 * (p.position_m[c] + q.position_m[c]));
            nodes.push(FrameNode { position_m, strain: 0.5 * (p.strain + q.strain), ..p });
            layers.push(layers[a as usize].max(layers[b as usize]));
            nodes.len() as u32 - 1
        })
    };
    let mut divided = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces.as_chunks::<3>().0 {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        divided.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
    }
    let count = nodes.len() as u32;
    view.outline.header.triangle_count *= 4;
    view.outline.header.node_count = count;
    view.frame.header.node_count = count;
    divided.extend(layers);
    divided.extend(marks);
    view.outline.elements = divided;
    view.frame.elements = nodes;
    assert!(view.outline_of_frame().is_some(), "the finer scene is one");
    view
}
