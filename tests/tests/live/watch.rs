//! A running server seen through its `servo_state`, as any reader sees it.
//!
//! Tests wait for what they need to see instead of for a time, and end the run themselves: a slow machine then only takes
//! longer. A servo that has latched a fault will show nothing more, so that waiting ends with it.

use protocol::ports::{PortNode, ServoStateReader, WoundReportSubscriber};
use protocol::run::{Environment, RunDir, RunRoot};
use protocol::servo_state::ServoState;
use protocol::wound_report::WoundReport;
use std::time::Duration;
use suture_tests::processes::{Sandbox, wait_for};

/// `servo_state` mode: full force.
const ACTIVE: u32 = 4;
/// `servo_state` mode: latched fault.
const FAULT: u32 = 5;
/// A force that is clearly a pull, newtons.
pub(super) const PULL_N: f64 = 0.15;

/// A reader of one server's state.
pub(super) struct Watch {
    reader: ServoStateReader,
    reports: WoundReportSubscriber,
}

impl Watch {
    /// Attaches to the server of this sandbox.
    pub(super) fn attach(sandbox: &Sandbox) -> Self {
        Self::attach_to_run(sandbox).0
    }

    /// The same, with the run, for others who attach to it.
    pub(super) fn attach_to_run(sandbox: &Sandbox) -> (Self, RunDir) {
        let environment =
            Environment { xdg_runtime_dir: Some(sandbox.folder().to_path_buf()), ..Environment::of_process() };
        let root = RunRoot::open(&environment).expect("the server made its root");
        let run = root.attach().expect("a server runs");
        let node = PortNode::join(&run, "watching-test").expect("a reader may come and go");
        let reports = WoundReportSubscriber::open(&node).expect("a reader may come and go");
        (Self { reader: ServoStateReader::new(&node), reports }, run)
    }

    /// The first state seen that has what is wanted; `None` when `limit` passes, or the servo faults, before that.
    pub(super) fn until(&mut self, limit: Duration, mut wanted: impl FnMut(&ServoState) -> bool) -> Option<ServoState> {
        let reader = &mut self.reader;
        let seen = wait_for(limit, || match reader.newest().ok().flatten() {
            Some(state) if wanted(&state) => Some(Some(state)),
            Some(state) if state.mode == FAULT => Some(None),
            _ => None,
        });
        seen.flatten()
    }

    /// The first report seen that has what is wanted.
    pub(super) fn report(&mut self, limit: Duration, wanted: impl Fn(&WoundReport) -> bool) -> Option<WoundReport> {
        wait_for(limit, || self.reports.newest().ok().flatten().filter(&wanted))
    }
}

/// Norm of the force on the hand, newtons.
pub(super) fn force_n(state: &ServoState) -> f64 {
    state.devices[0].force_n.iter().map(|f| f * f).sum::<f64>().sqrt()
}

/// Whether the hand pulls at full gain.
pub(super) fn pulls(state: &ServoState) -> bool {
    state.mode == ACTIVE && force_n(state) > PULL_N
}
