//! Follow the Leader: the shape of a slack line as a chain of links of one length.
//!
//! `p_i ← p_{i−1} + ℓ·(p_i − p_{i−1})/‖p_i − p_{i−1}‖` from the leader on (Brown, Latombe and Montgomery 2004, as
//! used by Zhang et al., §2.1). Metres. Link lengths are exact to rounding; the shape depends on the way the leader took.
//! With both ends held the sweep runs from each end in turn until they meet; what is missing is blended linearly into the chain.
//!
//! The sweep count grows without bound as the line gets straight (some hundreds at 99 %), so a taut line is not its
//! business. Deliberately absent: forces, gravity, bending, self-contact, knots.

use crate::vector::Vec3;

/// How two held ends met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Sweeps from the end and back.
    pub sweeps: usize,
    /// Distance by which the chain missed the end before blending, metres.
    pub miss_m: f64,
}

/// Point at `link_m` from `leader` towards `follower`; a follower on its leader goes on in `fallback` direction.
fn pulled_behind(leader: Vec3, follower: Vec3, link_m: f64, fallback: Vec3) -> Vec3 {
    let away = follower - leader;
    let distance = away.norm();
    if distance > 0.0 { leader + away * (link_m / distance) } else { leader + fallback * link_m }
}

fn direction_or_x(from: Vec3, to: Vec3) -> Vec3 {
    (to - from).try_normalize(0.0).unwrap_or_else(Vec3::x)
}

/// The first point leads; all others follow at `link_m`.
pub fn follow_first(points: &mut [Vec3], link_m: f64) {
    for i in 1..points.len() {
        let fallback = if i > 1 { direction_or_x(points[i - 2], points[i - 1]) } else { Vec3::x() };
        points[i] = pulled_behind(points[i - 1], points[i], link_m, fallback);
    }
}

/// The last point leads; all others follow at `link_m`.
pub fn follow_last(points: &mut [Vec3], link_m: f64) {
    let count = points.len();
    for i in (1..count).rev() {
        let fallback = if i + 1 < count { direction_or_x(points[i + 1], points[i]) } else { Vec3::x() };
        points[i - 1] = pulled_behind(points[i], points[i - 1], link_m, fallback);
    }
}

/// Both ends are held: sweeps from the last point and back from the first until the last one is met within `tolerance_m` or
/// `max_sweeps` are done; the rest is blended in, so that both ends are exact and each link is off by at most `miss / links`.
pub fn follow_both(
    points: &mut [Vec3],
    first_m: Vec3,
    last_m: Vec3,
    link_m: f64,
    tolerance_m: f64,
    max_sweeps: usize,
) -> Meeting {
    let Some(end) = points.len().checked_sub(1) else { return Meeting { sweeps: 0, miss_m: 0.0 } };
    let mut meeting = Meeting { sweeps: 0, miss_m: f64::INFINITY };
    while meeting.sweeps < max_sweeps.max(1) && meeting.miss_m > tolerance_m {
        points[end] = last_m;
        follow_last(points, link_m);
        points[0] = first_m;
        follow_first(points, link_m);
        meeting = Meeting { sweeps: meeting.sweeps + 1, miss_m: (points[end] - last_m).norm() };
    }
    let miss = last_m - points[end];
    for (i, point) in points.iter_mut().enumerate() {
        *point += miss * (i as f64 / end.max(1) as f64);
    }
    points[end] = last_m;
    meeting
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    /// A few roundings of coordinates below a metre.
    const ROUND_M: f64 = 1e-15;

    fn straight(links: usize, link_m: f64) -> Vec<Vec3> {
        (0..=links).map(|i| Vec3::new(-(i as f64) * link_m, 0.0, 0.0)).collect()
    }

    fn worst_link(points: &[Vec3], link_m: f64) -> f64 {
        points.windows(2).map(|w| ((w[1] - w[0]).norm() - link_m).abs()).fold(0.0, f64::max)
    }

    /// Leads a straight line of 0.3 m once round a circle of 20 mm radius and returns it.
    fn once_round() -> Vec<Vec3> {
        let (links, link) = (100, 0.003);
        let mut points = straight(links, link);
        for step in 1..=2000 {
            let (s, c) = (TAU * f64::from(step) / 2000.0).sin_cos();
            points[0] = Vec3::new(0.020 * s, 0.020 * (1.0 - c), 0.0);
            follow_first(&mut points, link);
        }
        points
    }

    #[test]
    fn links_keep_their_length_and_the_leader_its_place() {
        let points = once_round();
        assert!(worst_link(&points, 0.003) < ROUND_M);
        assert!(points[0].norm() < ROUND_M);
    }

    #[test]
    fn shape_depends_on_the_way_the_leader_took() {
        // The leader is back where it was after a way of 125.7 mm; the tail has come along by about 0.1 m.
        let (before, after) = (straight(100, 0.003), once_round());
        let moved_m = (after[100] - before[100]).norm();
        assert!(moved_m > 0.05 && moved_m < 0.1257, "{moved_m}");
    }

    fn sweeps(ratio: f64) -> Meeting {
        let (links, length) = (50, 0.2);
        let mut points: Vec<Vec3> = (0..=links).map(|i| Vec3::new(0.0, -length * i as f64 / 50.0, 0.0)).collect();
        let end = Vec3::new(ratio * length, 0.0, 0.0);
        let meeting = follow_both(&mut points, Vec3::zeros(), end, length / 50.0, 1e-6, 5000);
        assert_eq!((points[0], points[50]), (Vec3::zeros(), end));
        assert!(worst_link(&points, length / 50.0) <= meeting.miss_m / 50.0 + ROUND_M);
        meeting
    }

    #[test]
    fn both_ends_meet_soon_while_slack_and_late_when_nearly_straight() {
        // From a chain that hangs across the way: 28 sweeps at 50 %, 193 at 90 %, 1753 at 99 %.
        let [slack, long, straight] = [0.5, 0.9, 0.99].map(|ratio| sweeps(ratio).sweeps);
        assert!(slack < 40, "{slack}");
        assert!(long > 3 * slack && straight > 5 * long, "{slack} {long} {straight}");
    }

    #[test]
    fn coincident_points_unfold_without_nan() {
        let mut points = vec![Vec3::zeros(); 5];
        follow_first(&mut points, 0.01);
        assert!(worst_link(&points, 0.01) < ROUND_M);
        let mut points = vec![Vec3::zeros(); 5];
        follow_last(&mut points, 0.01);
        assert!(worst_link(&points, 0.01) < ROUND_M);
        let nobody = follow_both(&mut [], Vec3::zeros(), Vec3::x(), 0.01, 1e-6, 4);
        assert_eq!(nobody.sweeps, 0);
    }

    proptest! {
        #[test]
        fn any_leader_and_any_chain_keep_finite_exact_links(
            chain in prop::collection::vec(prop::array::uniform3(-0.5..0.5_f64), 2..30), link in 1e-4..0.05_f64,
        ) {
            let mut points: Vec<Vec3> = chain.into_iter().map(Vec3::from).collect();
            let leader = points[0];
            follow_first(&mut points, link);
            prop_assert_eq!(points[0], leader);
            // Coordinates up to 2 m: rounding of their differences.
            prop_assert!(worst_link(&points, link) < 2e-15);
            let (a, b) = (Vec3::new(0.0, 0.1, 0.0), Vec3::new(0.3, 0.0, 0.1));
            let meeting = follow_both(&mut points, a, b, link, 1e-6, 16);
            prop_assert_eq!(points[points.len() - 1], b);
            prop_assert!(meeting.sweeps <= 16 && points.iter().all(|p| p.iter().all(|x| x.is_finite())));
        }
    }
}
