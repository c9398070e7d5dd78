//! Sleeping nodes change no result: each scene with and without, over a pull, a release, a stitch and what follows.

use super::{ServoInput, drive, hand};
use crate::scene::config::{IntegratorReading, SceneConfig};
use crate::scene::presets;
use crate::scene::sleep::SleepReading;
use crate::scene::step::Scene;
use crate::vector::Vec3;

/// What sleeping may move a node by, metres: a fiftieth of what a hand can place.
const POSITION_TOLERANCE_M: f64 = 1e-6;
/// And change a port's force by, newtons: what a micrometre of a patch of five nodes amounts to.
const FORCE_TOLERANCE_N: f64 = 2e-3;
/// Periods after which a tissue at rest must sleep: the quiet ones and a few in which settling's remainder dies away.
const IDLE_STEPS: u32 = 60;

fn resting(mut config: SceneConfig) -> SceneConfig {
    config.solver.integrator = IntegratorReading::SemiImplicit;
    config.solver.sleep = SleepReading::On;
    config
}

/// The same scene twice, moved alike.
struct Twins {
    plain: Scene,
    resting: Scene,
    position_error_m: f64,
    force_error_n: f64,
}

impl Twins {
    fn new(mut config: SceneConfig, integrator: IntegratorReading) -> Self {
        config.solver.integrator = integrator;
        config.solver.max_substeps = 1000;
        config.solver.sleep = SleepReading::Off;
        let plain = Scene::new(&config, None).unwrap();
        config.solver.sleep = SleepReading::On;
        let resting = Scene::new(&config, None).unwrap();
        Self { plain, resting, position_error_m: 0.0, force_error_n: 0.0 }
    }

    fn drive(&mut self, input: ServoInput, handles: impl Fn(u32) -> [Option<Vec3>; 2], steps: u32) {
        for step in 0..steps {
            drive(&mut self.plain, input, handles(step), 1);
            drive(&mut self.resting, input, handles(step), 1);
            let (x, y) = (self.plain.solver().state(), self.resting.solver().state());
            let apart = x.position_m.iter().zip(&y.position_m).map(|(x, y)| (x - y).norm());
            self.position_error_m = apart.fold(self.position_error_m, f64::max);
            let grips: Vec<_> = self.plain.grips().iter().copied().collect();
            assert_eq!(grips.len(), self.resting.grips().iter().count());
            for grip in grips {
                let (Some(p), Some(q)) = (self.plain.port(&grip), self.resting.port(&grip)) else { continue };
                self.force_error_n = self.force_error_n.max((p.force_n - q.force_n).norm());
            }
        }
    }

    fn awake(&self) -> usize {
        self.resting.solver().awake_nodes().unwrap()
    }

    /// Idle, pull and let go, stitch, wait.
    fn session(&mut self) {
        self.drive(hand(Vec3::new(0.0, 0.0, 0.5), 0, 0), |_| [None; 2], IDLE_STEPS);
        assert_eq!(self.awake(), 0, "{} is at rest", self.plain.config().name);
        let start = self.plain.places()[0];
        let lifted = |step: u32| start.left_m + Vec3::new(0.0, 0.0, 5e-3) * (f64::from(step.min(50)) / 50.0);
        self.drive(hand(start.left_m, 1, 0), |step| [Some(lifted(step)), None], 80);
        assert!(self.awake() > 0);
        self.drive(hand(start.left_m, 1, 1), |_| [None; 2], 40);
        let open = self.plain.places()[0];
        let across = (open.right_m - open.left_m).normalize();
        let middle = 0.5 * (open.right_m + open.left_m);
        let half = 0.5 * (open.closed_m - 2e-4);
        let closed = [Some(middle + across * half), Some(middle - across * half)];
        self.drive(hand(open.right_m, 2, 1), |_| [Some(open.right_m), Some(open.left_m)], 1);
        self.drive(hand(open.right_m, 2, 1), |_| closed, 60);
        self.drive(hand(open.right_m, 2, 2), |_| [None; 2], 240);
        assert_eq!((self.plain.ledger_rows().len(), self.resting.ledger_rows().len()), (1, 1));
    }
}

#[test]
fn sleeping_changes_no_scene_by_more_than_its_tolerance() {
    let (explicit, verlet) = (IntegratorReading::SemiImplicit, IntegratorReading::Verlet);
    let cases = [
        (presets::skin(), explicit),
        (presets::liver(), explicit),
        (presets::vessel(), explicit),
        (presets::vessel(), verlet),
    ];
    for (config, integrator) in cases {
        let name = format!("{} {integrator:?}", config.name);
        let mut twins = Twins::new(config, integrator);
        twins.session();
        println!("{name}: {:e} m, {:e} N, {} awake", twins.position_error_m, twins.force_error_n, twins.awake());
        assert!(twins.position_error_m < POSITION_TOLERANCE_M, "{name}: {} m", twins.position_error_m);
        assert!(twins.force_error_n < FORCE_TOLERANCE_N, "{name}: {} N", twins.force_error_n);
        assert!(twins.position_error_m > 0.0, "{name}: something slept");
    }
}

#[test]
fn a_scene_at_rest_visits_no_spring_and_a_restored_one_wakes() {
    for config in [presets::skin(), presets::liver(), presets::vessel()] {
        let mut scene = Scene::new(&resting(config.clone()), None).unwrap();
        (0..IDLE_STEPS).for_each(|_| {
            scene.step(None);
        });
        let report = scene.step(None);
        assert_eq!((report.half_springs, report.awake_nodes), (0, 0), "{}", config.name);
        scene.restore();
        let report = scene.step(None);
        assert_eq!(report.awake_nodes as usize, scene.tissue().network.node_count());
    }
}
