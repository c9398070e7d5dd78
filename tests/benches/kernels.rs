//! Times the force sweeps against plain C: `cargo bench -p suture-tests`.

use suture_tests::kernels::{QUICK_SPRINGS, measure, meshes};

fn main() {
    for (name, network) in meshes::all() {
        println!("{name}: {} nodes, {} springs", network.node_count(), network.springs.len());
        for time in measure(&network, QUICK_SPRINGS) {
            let of_c = time.of_c.map_or(String::new(), |share| format!("{share:6.2} of C"));
            println!("  {:6} {:32} {:6.2} ns {of_c}", time.family, time.name, time.ns_per_spring);
        }
    }
}
