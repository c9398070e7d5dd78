//! Where the suture line runs, for a viewer: through the tied stitches in the order of tying, through the pair at
//! work, and on to the stylus while the hand holds it.

use protocol::wound_report::MAX_LINE_POINTS;
use sim_core::scene::step::Scene;
use sim_core::scene::suturing::Stage;
use sim_core::vector::Vec3;

/// Writes the points of the line and returns how many there are.
pub(super) fn measure(scene: &Scene, stylus_m: Option<Vec3>, line_m: &mut [[f64; 3]; MAX_LINE_POINTS]) -> u32 {
    let suturing = scene.suturing();
    let tied = scene.ledger_rows().iter().flat_map(|r| [r.left_current_m, r.right_current_m]);
    let at_work = scene.places().get(suturing.pair());
    let (left, right) = match (suturing.stage(), at_work) {
        (Stage::LeftHeld | Stage::LeftTaken, Some(place)) => (Some(place.left_m), None),
        (Stage::LinePulled | Stage::LineFree, Some(place)) => (Some(place.left_m), Some(place.right_m)),
        _ => (None, None),
    };
    let stylus = stylus_m.filter(|_| left.is_some());
    let mut count = 0;
    for (slot, point) in line_m.iter_mut().zip(tied.chain(left).chain(right).chain(stylus)) {
        *slot = point.into();
        count += 1;
    }
    count
}
