//! What a viewer receives: newest servo state, newest wound report, newest frame header. Each may be missing at any
//! time; a message that is rejected counts as missing.

use protocol::ports::{PortError, PortNode, SceneFrameSubscriber, ServoStateReader, WoundReportSubscriber};
use protocol::run::RunDir;
use protocol::scene_frame::FrameHeader;
use protocol::servo_state::ServoState;
use protocol::wound_report::WoundReport;

/// The newest of everything.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Servo, 1 kHz.
    pub servo: Option<ServoState>,
    /// Table 1, line, solver health.
    pub report: Option<Box<WoundReport>>,
    /// Header of the newest tissue frame.
    pub frame: Option<FrameHeader>,
    /// Messages that were rejected.
    pub rejected: u64,
}

/// Subscribers of one viewer.
pub struct Feed {
    node: PortNode,
    servo: ServoStateReader,
    reports: WoundReportSubscriber,
    frames: SceneFrameSubscriber,
    view: View,
}

impl Feed {
    /// Joins a run.
    ///
    /// # Errors
    /// [`PortError`] when the run's services cannot be opened.
    pub fn join(run: &RunDir) -> Result<Self, PortError> {
        let node = PortNode::join(run, "viewer")?;
        Ok(Self {
            servo: ServoStateReader::new(&node),
            reports: WoundReportSubscriber::open(&node)?,
            frames: SceneFrameSubscriber::open(&node)?,
            node,
            view: View::default(),
        })
    }

    /// Takes in what is new and returns the whole view.
    ///
    /// # Errors
    /// [`PortError`] when a service is broken; a rejected message is counted instead.
    pub fn look(&mut self) -> Result<&View, PortError> {
        if let Some(servo) = kept(self.servo.newest(), &mut self.view.rejected)? {
            self.view.servo = Some(servo);
        }
        if let Some(report) = kept(self.reports.newest(), &mut self.view.rejected)? {
            self.view.report = Some(Box::new(report));
        }
        if let Some(header) = kept(self.frames.newest().map(|f| f.map(|f| f.header)), &mut self.view.rejected)? {
            self.view.frame = Some(header);
        }
        Ok(&self.view)
    }

    /// Cleans up after processes of this run that died; once a second is enough.
    pub fn clean_up(&self) {
        self.node.clean_up_dead();
    }
}

fn kept<M>(received: Result<Option<M>, PortError>, rejected: &mut u64) -> Result<Option<M>, PortError> {
    match received {
        Err(PortError::Rejected(_)) => {
            *rejected += 1;
            Ok(None)
        }
        other => other,
    }
}
