//! Times the force sweeps against plain C: `cargo bench -p suture-tests`.

use suture_tests::kernels::{QUICK_SPRINGS, crew, measure, meshes};

/// Sweeps of each kind, of which the fastest counts.
const CREW_REPEATS: usize = 200;

fn main() {
    for (name, network) in meshes::all() {
        println!("{name}: {} nodes, {} springs", network.node_count(), network.springs.len());
        for time in measure(&network, QUICK_SPRINGS) {
            let of_c = time.of_c.map_or(String::new(), |share| format!("{share:6.2} of C"));
            println!("  {:6} {:32} {:6.2} ns {of_c}", time.family, time.name, time.ns_per_spring);
        }
        if let Some(time) = crew::measure(&network, CREW_REPEATS) {
            println!(
                "  crew   undivided {:.2} ns, in strips {:.2} ns, with {} hands {:.2} ns",
                time.undivided_ns, time.alone_ns, time.hands, time.shared_ns
            );
        }
    }
}
