//! No step of a tissue allocates: idle, taken, pulled, let go, whatever the integrator, asleep, in strips or in single
//! precision. Where a point is taken or let go the patch in hand may take memory; the solver is another process than the servo.

use crate::allocator;
use sim_core::scene::config::{IntegratorReading, PrecisionReading, SceneConfig};
use sim_core::scene::presets;
use sim_core::scene::sleep::SleepReading;
use sim_core::scene::step::{Scene, ServoInput};
use sim_core::scene::suturing::HandInput;
use sim_core::tissue::handle::MAX_HANDLES;
use sim_core::vector::Vec3;

/// Heap calls of a hand that takes a suture point, pulls it 5 mm out of the tissue and lets go.
fn calls_of_a_pull(config: &SceneConfig) -> u64 {
    let mut scene = Scene::new(config, None).expect("the scene loads");
    let start_m = scene.places()[0].left_m;
    let mut calls = 0;
    for step in 0..80_u32 {
        let (pressed, released) = (u32::from(step >= 20), u32::from(step >= 60));
        let lifted_m = start_m + Vec3::new(0.0, 0.0, 1e-4) * f64::from(step.saturating_sub(20).min(50));
        let mut handles_m = [None; MAX_HANDLES];
        handles_m[0] = (pressed > released).then_some(lifted_m);
        let input = ServoInput {
            hand: HandInput { position_m: lifted_m, press_count: pressed, release_count: released },
            second: None,
            port_epoch: scene.grips().epoch(),
            handles_m,
        };
        let (held, before) = (scene.grips().iter().count(), allocator::calls());
        scene.step(Some(&input));
        if scene.grips().iter().count() == held {
            calls += allocator::calls() - before;
        }
        assert_eq!(scene.grips().iter().count(), usize::from(pressed > released), "step {step}");
    }
    calls
}

fn skin(change: impl FnOnce(&mut SceneConfig)) -> SceneConfig {
    let mut config = presets::skin();
    config.solver.max_substeps = 1000;
    change(&mut config);
    config
}

#[test]
fn no_step_of_a_tissue_allocates() {
    let by_name = |integrator| skin(|config| config.solver.integrator = integrator);
    let cases = [
        ("skin", presets::skin()),
        ("liver", presets::liver()),
        ("vessel", presets::vessel()),
        ("semi-implicit", by_name(IntegratorReading::SemiImplicit)),
        ("Verlet", by_name(IntegratorReading::Verlet)),
        ("BDF2", by_name(IntegratorReading::Bdf2)),
        ("XPBD", by_name(IntegratorReading::Xpbd)),
        ("asleep", skin(|c| (c.solver.integrator, c.solver.sleep) = (IntegratorReading::Verlet, SleepReading::On))),
        ("in strips", skin(|c| c.solver.threads = Some(2))),
        ("single", skin(|c| c.solver.precision = PrecisionReading::Single)),
    ];
    let calls: Vec<(&str, u64)> = cases.iter().map(|(name, config)| (*name, calls_of_a_pull(config))).collect();
    assert!(calls.iter().all(|(_, calls)| *calls == 0), "{calls:?}");
}
