//! The solver's crew: OS threads that sweep the springs of a big mesh side by side (`solver.threads` of a scene file).
//!
//! They run on the processors that this process may use but the last, to which the servo thread is then bound; a scene that
//! asks for more hands than that gets as many as there are. On a machine with one processor to spare the solver's own thread
//! does all the work. How many there are changes no bit of the result (`sim_core::tissue::crew`).
//! The pool is rayon's: it waits without spinning for long and starts no thread per step, as crossbeam's scoped threads
//! would; the solver's thread waits for it and now and then pays a heap call for the queue between them.

use crate::solver::session::SolverSession;
use rayon_core::{ThreadPool, ThreadPoolBuilder};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use sim_core::tissue::crew::Crew;
use std::sync::Arc;

/// OS threads that join two pieces of work.
#[derive(Debug)]
pub struct Pool(ThreadPool);

impl Crew for Pool {
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send)) {
        self.0.join(first, second);
    }
}

impl Pool {
    /// As many OS threads as `hands`, on these processors; where a processor is refused they go where the system puts them.
    ///
    /// # Errors
    /// What the system says when it gives no more OS threads.
    pub fn on(processors: &CpuSet, hands: usize) -> Result<Self, rayon_core::ThreadPoolBuildError> {
        let processors = *processors;
        let pool = ThreadPoolBuilder::new()
            .num_threads(hands)
            .thread_name(|index| format!("solver-hand-{index}"))
            .start_handler(move |_| {
                // Without it the results are the same; only the servo's processor is no longer kept free.
                let _ = sched_setaffinity(None, &processors);
            })
            .build()?;
        Ok(Self(pool))
    }
}

/// Gives a session the hands that its scenes ask for, as far as the machine has them; the session works without, too.
pub fn hire(session: &mut SolverSession) {
    let Some(wanted) = session.threads() else { return };
    let processors = processors_for_hands();
    let hands = (wanted as usize).min(processors.count() as usize);
    if hands < wanted as usize {
        tracing::info!("the scene asks for {wanted} hands; {} are here beside the servo's processor", hands.max(1));
    }
    if hands < 2 {
        return;
    }
    match Pool::on(&processors, hands) {
        Ok(pool) => {
            let pool: Arc<dyn Crew> = Arc::new(pool);
            session.share(&pool);
        }
        Err(error) => tracing::warn!("the solver works with one pair of hands ({error}); raise the limit of processes"),
    }
}

/// The processor of the servo where a crew works: the last that this process and its children may use; `None` where it is the
/// only one.
#[must_use]
pub fn servo_processor() -> Option<usize> {
    let set = sched_getaffinity(None).ok().filter(|set| set.count() > 1)?;
    last(&set)
}

fn last(set: &CpuSet) -> Option<usize> {
    (0..CpuSet::MAX_CPU).rev().find(|&processor| set.is_set(processor))
}

/// The processors that this process may use, but the last.
fn processors_for_hands() -> CpuSet {
    let mut set = sched_getaffinity(None).unwrap_or_else(|_| CpuSet::new());
    if let Some(last) = last(&set) {
        set.unset(last);
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::servo_state::{DeviceState, ServoState};
    use protocol::wire::Field;
    use sim_core::scene::config::{SceneConfig, TissueConfig};
    use sim_core::scene::presets;
    use sim_core::scene::procedure::SceneSource;

    /// A skin of more than one strip, with a hand that takes a suture point and pulls.
    fn places(threads: Option<u32>, crew: Option<Arc<dyn Crew>>) -> Vec<[u64; 3]> {
        let mut config: SceneConfig = presets::skin();
        if let TissueConfig::Utsm { spacing_mm, .. } = &mut config.tissue {
            *spacing_mm = 0.8;
        }
        config.solver.threads = threads;
        let mut session = SolverSession::new(&[SceneSource { config, mesh: None }]).unwrap();
        if let Some(crew) = crew {
            session.share(&crew);
        }
        let target = session.port().target_m;
        for step in 0..20 {
            let reach = 1e-4 * f64::from(step);
            let device = DeviceState {
                position_m: [target[0] - reach, target[1], target[2] + reach],
                orientation: [0.0, 0.0, 0.0, 1.0],
                buttons: 1,
                present: 1,
                press_count: [u32::from(step > 0), 0],
                ..DeviceState::EMPTY
            };
            let mut servo = ServoState { devices: [device, DeviceState::EMPTY], ..ServoState::EMPTY };
            servo.header.sequence = step as u64 + 1;
            session.step(Some(&servo), None, u64::from(step as u32) * 1_000_000);
        }
        let state = session.procedure().scene().solver().state();
        state.position_m.iter().map(|x| [x.x.to_bits(), x.y.to_bits(), x.z.to_bits()]).collect()
    }

    fn pool(hands: usize) -> Arc<dyn Crew> {
        Arc::new(Pool::on(&sched_getaffinity(None).unwrap(), hands).unwrap())
    }

    #[test]
    fn a_scene_moves_to_the_same_bits_with_any_number_of_hands() {
        let alone = places(Some(2), None);
        assert!(alone.len() > 4096, "{} nodes are too few for three strips", alone.len());
        for hands in [1, 2, 3] {
            assert_eq!(places(Some(2), Some(pool(hands))), alone, "{hands} hands");
        }
        // A scene that asks for none is given none.
        assert_eq!(places(None, Some(pool(2))), places(None, None));
    }

    #[test]
    fn the_last_processor_is_left_to_the_servo() {
        let all = sched_getaffinity(None).unwrap();
        let hands = processors_for_hands();
        assert_eq!(hands.count() + 1, all.count());
        assert!(!hands.is_set(last(&all).unwrap()));
        assert_eq!(servo_processor(), (all.count() > 1).then(|| last(&all).unwrap()));
        let pool = Pool::on(&hands, 2).unwrap();
        let found = pool.0.broadcast(|_| sched_getaffinity(None).unwrap());
        assert!(hands.count() == 0 || found.iter().all(|set| *set == hands));
    }
}
