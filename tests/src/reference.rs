//! A second opinion: mass-spring networks by classical Runge–Kutta on a plain list of edges.
//!
//! ẍ_i = (Σ_e k_e (ℓ_e − L_e) ê − c_i ẋ_i + f_i) / m_i, fixed nodes at rest. Independent of sim-core on purpose: own
//! vectors, own force loop over edges (no compressed rows), no shared function; from a [`SpringNetwork`] it takes the
//! spring list only. Slow and of order 4; for checks, never for the product.
//!
//! `driven`, `explicit` and `implicit_midpoint` are the two references of the accuracy report: flat, and as different from
//! each other as the same springs allow.

mod driven;
mod edges;
mod explicit;
mod implicit_midpoint;

pub use driven::{Difference, Driven, Probe, Samples};
pub use explicit::{ExplicitMethod, explicit_run, explicit_step_s};
pub use implicit_midpoint::midpoint_run;

use sim_core::tissue::network::{SpringNetwork, TissueState};

type Vector = [f64; 3];

/// A network and its state.
#[derive(Clone, Debug)]
pub struct ReferenceNetwork {
    /// Positions, metres.
    pub position_m: Vec<Vector>,
    /// Velocities, metres per second.
    pub velocity_m_per_s: Vec<Vector>,
    /// Outside forces, newtons.
    pub load_n: Vec<Vector>,
    mass_kg: Vec<f64>,
    drag_n_s_per_m: Vec<f64>,
    fixed: Vec<bool>,
    edges: Vec<Edge>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    ends: [usize; 2],
    stiffness_n_per_m: f64,
    rest_length_m: f64,
}

impl ReferenceNetwork {
    /// The same network in the same state, without load.
    #[must_use]
    pub fn new(network: &SpringNetwork, state: &TissueState) -> Self {
        let edges = network.springs.iter().map(|s| Edge {
            ends: [s.a as usize, s.b as usize],
            stiffness_n_per_m: s.stiffness_n_per_m,
            rest_length_m: s.rest_length_m,
        });
        Self {
            position_m: state.position_m.iter().map(|x| [x.x, x.y, x.z]).collect(),
            velocity_m_per_s: state.velocity_m_per_s.iter().map(|v| [v.x, v.y, v.z]).collect(),
            load_n: vec![[0.0; 3]; network.mass_kg.len()],
            mass_kg: network.mass_kg.clone(),
            drag_n_s_per_m: network.drag_n_s_per_m.clone(),
            fixed: network.fixed.iter().map(|f| *f != 0).collect(),
            edges: edges.collect(),
        }
    }

    /// Advances by `steps` Runge–Kutta steps of `dt_s`.
    pub fn run(&mut self, dt_s: f64, steps: usize) {
        for _ in 0..steps {
            self.step(dt_s);
        }
    }

    fn step(&mut self, dt: f64) {
        let (x, v) = (self.position_m.clone(), self.velocity_m_per_s.clone());
        let a1 = self.acceleration(&x, &v);
        let (x2, v2) = (ahead(&x, &v, dt / 2.0), ahead(&v, &a1, dt / 2.0));
        let a2 = self.acceleration(&x2, &v2);
        let (x3, v3) = (ahead(&x, &v2, dt / 2.0), ahead(&v, &a2, dt / 2.0));
        let a3 = self.acceleration(&x3, &v3);
        let (x4, v4) = (ahead(&x, &v3, dt), ahead(&v, &a3, dt));
        let a4 = self.acceleration(&x4, &v4);
        for i in (0..x.len()).filter(|i| !self.fixed[*i]) {
            for d in 0..3 {
                self.position_m[i][d] += dt / 6.0 * (v[i][d] + 2.0 * v2[i][d] + 2.0 * v3[i][d] + v4[i][d]);
                self.velocity_m_per_s[i][d] += dt / 6.0 * (a1[i][d] + 2.0 * a2[i][d] + 2.0 * a3[i][d] + a4[i][d]);
            }
        }
    }

    fn acceleration(&self, x: &[Vector], v: &[Vector]) -> Vec<Vector> {
        let mut force = self.spring_forces_n(x);
        for i in 0..x.len() {
            for d in 0..3 {
                let sum = force[i][d] + self.load_n[i][d] - self.drag_n_s_per_m[i] * v[i][d];
                force[i][d] = if self.fixed[i] { 0.0 } else { sum / self.mass_kg[i] };
            }
        }
        force
    }

    /// Spring forces on every node, fixed ones too, at positions `x`.
    #[must_use]
    pub fn spring_forces_n(&self, x: &[Vector]) -> Vec<Vector> {
        let mut force = vec![[0.0; 3]; x.len()];
        for edge in &self.edges {
            let [a, b] = edge.ends;
            let along: Vector = std::array::from_fn(|d| x[b][d] - x[a][d]);
            let length = along.iter().map(|c| c * c).sum::<f64>().sqrt();
            if length == 0.0 {
                continue;
            }
            let pull = edge.stiffness_n_per_m * (length - edge.rest_length_m) / length;
            for d in 0..3 {
                force[a][d] += pull * along[d];
                force[b][d] -= pull * along[d];
            }
        }
        force
    }

    /// Kinetic plus elastic energy, joules.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let kinetic = self
            .mass_kg
            .iter()
            .zip(&self.velocity_m_per_s)
            .map(|(m, v)| 0.5 * m * v.iter().map(|c| c * c).sum::<f64>());
        let elastic = self.edges.iter().map(|e| {
            let [a, b] = e.ends.map(|i| self.position_m[i]);
            let length = (0..3).map(|d| (b[d] - a[d]).powi(2)).sum::<f64>().sqrt();
            0.5 * e.stiffness_n_per_m * (length - e.rest_length_m).powi(2)
        });
        kinetic.sum::<f64>() + elastic.sum::<f64>()
    }
}

fn ahead(from: &[Vector], rate: &[Vector], dt: f64) -> Vec<Vector> {
    from.iter().zip(rate).map(|(x, v)| std::array::from_fn(|d| x[d] + dt * v[d])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_forms::{SpringMassDamper, chain_frequency};
    use crate::generators::chain;
    use sim_core::vector::Vec3;

    fn oscillator_error(dt_s: f64) -> f64 {
        let system = SpringMassDamper { mass_kg: 0.01, drag_n_s_per_m: 0.05, stiffness_n_per_m: 200.0 };
        let network = chain(2, 0.1, system.stiffness_n_per_m / 2.0, system.mass_kg, system.drag_n_s_per_m);
        let mut state = network.rest_state();
        state.position_m[1].x += 0.01;
        let mut reference = ReferenceNetwork::new(&network, &state);
        let end_s = 0.1;
        reference.run(dt_s, (end_s / dt_s).round() as usize);
        (reference.position_m[1][0] - 0.1 - system.displacement_m(0.01, 0.0, end_s)).abs()
    }

    #[test]
    fn order_is_four_against_the_closed_form() {
        let (coarse, fine) = (oscillator_error(2e-3), oscillator_error(1e-3));
        let order = (coarse / fine).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }

    #[test]
    fn a_mode_of_the_chain_comes_back_after_its_period() {
        let (links, stiffness, mass) = (20, 160.0, 1e-4);
        let network = chain(links, 0.01, stiffness, mass, 0.0);
        let mut state = network.rest_state();
        for i in 0..=links {
            let phase = std::f64::consts::PI * i as f64 / links as f64;
            state.position_m[i].x += 1e-6 * phase.sin();
        }
        let start = state.position_m.clone();
        let mut reference = ReferenceNetwork::new(&network, &state);
        let period = 2.0 * std::f64::consts::PI / chain_frequency(stiffness, mass, links, 1);
        reference.run(period / 2000.0, 2000);
        let off = (0..=links).map(|i| (reference.position_m[i][0] - start[i].x).abs()).fold(0.0, f64::max);
        assert!(off < 1e-11, "{off}");
    }

    fn pulled_sheet(drag_n_s_per_m: f64, run: impl Fn(&Driven<'_>) -> Option<Samples>) -> (Samples, Vec<Vec3>) {
        let network = crate::generators::sheet(6, 5, 0.002, 160.0, 1e-5, drag_n_s_per_m);
        let network = crate::generators::with_fixed(network, |i| crate::generators::on_rim(i, 6, 5));
        let network = crate::generators::pre_strained(network, 0.05);
        let start = network.rest_m.clone();
        let path = |t: f64| [0.0, 0.0, 1e-3 * (1.0 - (std::f64::consts::TAU * t / 0.04).cos())];
        let driven = Driven {
            network: &network,
            start_m: &start,
            held: &[8],
            path: &path,
            loads: &[],
            end_s: 0.04,
            sample_s: 0.01,
        };
        (run(&driven).expect("nobody stops it and Newton ends"), start)
    }

    #[test]
    fn explicit_and_implicit_references_agree_with_much_and_little_drag() {
        use std::sync::atomic::AtomicBool;
        let never = AtomicBool::new(false);
        for drag in [0.0, 0.02, 3.0] {
            let explicit =
                |method| pulled_sheet(drag, |d| explicit_run(d, method, explicit_step_s(d, method, 0.1).0, &never)).0;
            let (runge_kutta, verlet) = (explicit(ExplicitMethod::RungeKutta), explicit(ExplicitMethod::Verlet));
            let midpoint = |dt_s| pulled_sheet(drag, |d| midpoint_run(d, dt_s, &never));
            let ((coarse, _), (fine, start)) = (midpoint(4e-5), midpoint(2e-5));
            let order =
                (coarse.against(&runge_kutta, &start).position / fine.against(&runge_kutta, &start).position).log2();
            assert!((order - 2.0).abs() < 0.1, "drag {drag}: midpoint is of order {order}");
            let off = fine.extrapolated(&coarse, 2).against(&runge_kutta, &start);
            // What a table of the report needs.
            assert!(off.position < 1e-6 && off.force < 1e-6, "drag {drag}: {off:?}");
            let off = verlet.against(&runge_kutta, &start);
            assert!(off.position < 1e-4 && off.force < 1e-4, "drag {drag}: {off:?}");
        }
    }
}
