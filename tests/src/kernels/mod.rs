//! Nanoseconds per spring of the force sweeps, beside plain C kernels of the same work, in one process.
//!
//! Repeats of all kernels are interleaved, and each kernel's least time counts: what a busy machine adds, it adds to all.
//! A ratio of two kernels of one run means something, a nanosecond of one run little.
//! Only time is measured here; that the sweeps are right is tested where they are.

pub mod crew;
pub mod meshes;

use plain_kernels::{Plain, PlainKernels};
use sim_core::tissue::network::SpringNetwork;
use sim_core::tissue::sweep::dispatch::KernelLevel;
use sim_core::tissue::sweep::{KernelPath, Precision, SpringSweep};
use sim_core::vector::Vec3;
use std::time::Instant;

/// Springs that each kernel sweeps in all, so that small and large meshes take the same time.
pub const QUICK_SPRINGS: usize = 4_000_000;

/// Time of one kernel on one mesh.
#[derive(Clone, Debug)]
pub struct KernelTime {
    /// `sweep` (ours) or `C`.
    pub family: &'static str,
    /// Path, precision and instruction set.
    pub name: String,
    /// Nanoseconds per spring, the least of all repeats.
    pub ns_per_spring: f64,
    /// Time as a share of the C kernel of the same path and precision; `None` for C itself, and for stencils of a mesh that
    /// has few springs on diagonals: the C stencil leaves the others out.
    pub of_c: Option<f64>,
}

/// Our paths with the C kernel that does the same work.
const PAIRS: [(KernelPath, Precision, Option<Plain>); 6] = [
    (KernelPath::Rows, Precision::Double, Some(Plain::GatherDouble)),
    (KernelPath::Rows, Precision::Single, Some(Plain::GatherSingle)),
    (KernelPath::Gather, Precision::Double, Some(Plain::GatherDouble)),
    (KernelPath::Gather, Precision::Single, Some(Plain::GatherSingle)),
    (KernelPath::Stencil, Precision::Double, Some(Plain::StencilDouble)),
    (KernelPath::Stencil, Precision::Single, Some(Plain::StencilSingle)),
];

/// Times all kernels on one network, each over about `springs` springs.
#[must_use]
pub fn measure(network: &SpringNetwork, springs: usize) -> Vec<KernelTime> {
    let mut plain = PlainKernels::new(network);
    let levels = [KernelLevel::Best, KernelLevel::Avx2];
    let mut sweeps = Vec::new();
    for level in levels {
        for (path, precision, rival) in PAIRS {
            sweeps.push((SpringSweep::with(network, path, precision, level), rival));
        }
    }
    let mut force = vec![Vec3::zeros(); network.node_count()];
    let count = network.springs.len().max(1);
    let mut plain_ns = [f64::INFINITY; Plain::ALL.len()];
    let mut sweep_ns = vec![f64::INFINITY; sweeps.len()];
    for _ in 0..(springs / count).max(5) {
        for (kernel, best) in Plain::ALL.into_iter().zip(&mut plain_ns) {
            let own = plain.springs(kernel).max(1);
            *best = best.min(nanoseconds(|| plain.sweep(kernel)) / own as f64);
        }
        for ((sweep, _), best) in sweeps.iter_mut().zip(&mut sweep_ns) {
            let spent = nanoseconds(|| {
                sweep.sweep(&network.rest_m, &mut force);
            });
            *best = best.min(spent / count as f64);
        }
    }
    let regular = SpringSweep::new(network).path() == KernelPath::Stencil;
    let comparable = |kernel: &Plain| regular || !matches!(kernel, Plain::StencilDouble | Plain::StencilSingle);
    let of = |kernel: Plain| Plain::ALL.iter().position(|k| *k == kernel).map(|at| plain_ns[at]);
    let mut times: Vec<KernelTime> = Plain::ALL
        .into_iter()
        .zip(plain_ns)
        .map(|(kernel, ns)| KernelTime { family: "C", name: format!("{kernel:?}"), ns_per_spring: ns, of_c: None })
        .collect();
    for ((sweep, rival), ns) in sweeps.iter().zip(sweep_ns) {
        let name = format!("{:?} {:?} {}", sweep.path(), sweep.precision(), sweep.level().taken());
        let of_c = rival.filter(comparable).and_then(of).map(|c| ns / c);
        times.push(KernelTime { family: "sweep", name, ns_per_spring: ns, of_c });
    }
    times
}

fn nanoseconds(work: impl FnOnce()) -> f64 {
    // Wall clock: the time is what is measured here.
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::tissue::force;

    /// Single precision of places of 0.1 m, on springs of 2 mm and 300 N/m.
    const SINGLE_N: f64 = 1e-4;

    #[test]
    fn the_c_kernels_do_the_same_work() {
        let network = meshes::sheet(24);
        let mut plain = PlainKernels::new(&network);
        let mut forces = vec![Vec3::zeros(); network.node_count()];
        force::gather(&network, &network.rest_m, &mut forces);
        for kernel in Plain::ALL {
            plain.sweep(kernel);
            let tolerance = match kernel {
                Plain::GatherSingle | Plain::StencilSingle => SINGLE_N,
                Plain::EdgesDouble | Plain::GatherDouble | Plain::StencilDouble => 1e-12,
            };
            if plain.springs(kernel) < network.springs.len() {
                continue;
            }
            for (node, f) in forces.iter().enumerate() {
                let found = Vec3::from(plain.force_n(kernel, node));
                assert!((f - found).norm() < tolerance, "{kernel:?} {node}: {f} {found}");
            }
        }
        assert!(plain.springs(Plain::StencilDouble) == network.springs.len());
    }

    #[test]
    fn every_kernel_is_timed() {
        let times = measure(&meshes::sheet(12), 1);
        assert_eq!(times.len(), Plain::ALL.len() + 12);
        assert!(times.iter().all(|t| t.ns_per_spring.is_finite() && t.ns_per_spring > 0.0));
    }
}
