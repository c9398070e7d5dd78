//! What a crew saves: the undivided sweep, the same in strips by one pair of hands, and by several, interleaved in one run.
//!
//! Wall time, because side by side is what is measured; the least of all repeats, as for single kernels.

use super::nanoseconds;
use haptic_server::crew::Pool;
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::sweep::dispatch::KernelLevel;
use sim_core::tissue::sweep::{KernelPath, Precision, SpringSweep};
use sim_core::vector::Vec3;
use std::sync::Arc;

/// Nanoseconds per spring of one sweep.
#[derive(Clone, Copy, Debug)]
pub struct CrewTime {
    /// Undivided, on the path that suits the mesh.
    pub undivided_ns: f64,
    /// In strips, by one pair of hands.
    pub alone_ns: f64,
    /// In strips, by a pool.
    pub shared_ns: f64,
    /// Hands of the pool.
    pub hands: usize,
}

/// Times them with as many hands as there are processors; `None` where there is but one, or no OS threads to be had.
#[must_use]
pub fn measure(network: &SpringNetwork, repeats: usize) -> Option<CrewTime> {
    let processors = rustix::thread::sched_getaffinity(None).ok()?;
    let hands = processors.count() as usize;
    if hands < 2 {
        return None;
    }
    let pool = Arc::new(Pool::on(&processors, hands).ok()?);
    let (double, best) = (Precision::Double, KernelLevel::Best);
    let mut sweeps = [
        SpringSweep::automatic(network, double, best),
        SpringSweep::with(network, KernelPath::Strips, double, best),
        SpringSweep::shared(network, double, best, pool),
    ];
    let mut force_n = vec![Vec3::zeros(); network.node_count()];
    let mut least = [f64::INFINITY; 3];
    for _ in 0..repeats {
        for (sweep, least) in sweeps.iter_mut().zip(&mut least) {
            let spent = nanoseconds(|| {
                sweep.sweep(&network.rest_m, &mut force_n);
            });
            *least = least.min(spent / network.springs.len().max(1) as f64);
        }
    }
    let [undivided_ns, alone_ns, shared_ns] = least;
    Some(CrewTime { undivided_ns, alone_ns, shared_ns, hands })
}
