//! When nodes count as at rest.
//!
//! Both limits follow from one displacement `τ` ([`SleepParams::tolerance_m`]): a node at rest may lack at most the force
//! `τ Σ k` of its own springs, and may still have the speed `τ max(√(Σ k/m), c/m)`, with which it would come to a stop
//! within `τ`. It falls asleep at [`SLEEP_SHARE`] of the force, so that it does not wake at once.
//! `τ` is per node, against its own springs. A slow mode of `n` nodes across can be left `¼ τ Σk / K_mode` from rest, up to
//! `n² τ` at 5 % pre-strain. `K_mode/Σk` is `¾ ε (π/(n − 1))²` out of the plane of a clamped sheet that only a pre-strain `ε` holds:
//! at 1 nm and 5 % that is 0.7 µm on 33², 2.8 µm on 65² and 11 µm on 129² nodes.

use crate::tissue::network::SpringNetwork;

/// Share of the waking force below which a node may fall asleep: the gap between the two keeps tiles from flickering.
pub const SLEEP_SHARE: f64 = 0.25;
/// Periods that a tile must have been quiet before it sleeps: a swing through its middle or its end is not rest.
pub const QUIET_PERIODS: u8 = 8;

/// What is neglected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SleepParams {
    /// How far a node at rest may be from where its own springs want it, metres.
    pub tolerance_m: f64,
}

impl Default for SleepParams {
    /// 1 nm: 1.3 µN on a node of the skin of Table 2.
    fn default() -> Self {
        Self { tolerance_m: 1e-9 }
    }
}

/// Limits of one node, squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RestLimits {
    pub(crate) sleep_n2: f64,
    pub(crate) wake_n2: f64,
    pub(crate) speed_m2_per_s2: f64,
}

impl RestLimits {
    pub(crate) fn of(network: &SpringNetwork, node: usize, params: &SleepParams) -> Self {
        let edges = &network.half_edges;
        let stiffness: f64 = edges.stiffness_n_per_m[edges.row(node)].iter().sum();
        let (mass, drag) = (network.mass_kg[node], network.drag_n_s_per_m[node]);
        let wake_n = params.tolerance_m * stiffness;
        let speed = params.tolerance_m * (stiffness / mass).sqrt().max(drag / mass);
        let sleep_n = SLEEP_SHARE * wake_n;
        Self { sleep_n2: sleep_n * sleep_n, wake_n2: wake_n * wake_n, speed_m2_per_s2: speed * speed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tissue::tests::{SKIN, dust};
    use crate::vector::Vec3;

    #[test]
    fn the_limits_of_a_node_are_its_tolerance_in_force_and_in_speed() {
        let network = SKIN.build();
        let limits = RestLimits::of(&network, SKIN.node(5, 5) as usize, &SleepParams { tolerance_m: 1e-9 });
        // Eight springs of 160 N/m; with 3 N s/m on 0.048 g the drag stops a node long before its springs do.
        let wake_n = 8.0 * 160.0 * 1e-9;
        assert!((limits.wake_n2.sqrt() / wake_n - 1.0).abs() < 1e-12);
        assert!((limits.sleep_n2.sqrt() / (SLEEP_SHARE * wake_n) - 1.0).abs() < 1e-12);
        assert!((limits.speed_m2_per_s2.sqrt() / (1e-9 * 3.0 / 4.8e-5) - 1.0).abs() < 1e-12);
        let alone = RestLimits::of(&dust(&[Vec3::zeros()], 1e-3, 0.0), 0, &SleepParams::default());
        assert_eq!(alone, RestLimits { sleep_n2: 0.0, wake_n2: 0.0, speed_m2_per_s2: 0.0 });
    }
}
