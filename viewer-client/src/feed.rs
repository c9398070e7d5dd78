//! What a viewer receives: newest servo state, wound report, frame and outline. Each may be missing at any
//! time; a message that is rejected counts as missing.

use protocol::ports::{
    PortError, PortNode, SceneFrame, SceneFrameSubscriber, SceneOutline, SceneOutlineSubscriber, ServoStateReader,
    SliceHeader, SliceMessage, WoundReportSubscriber,
};
use protocol::run::RunDir;
use protocol::scene_frame::OutlineParts;
use protocol::servo_state::ServoState;
use protocol::wound_report::WoundReport;

/// The newest of everything.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Servo, 1 kHz.
    pub servo: Option<ServoState>,
    /// Table 1, line, solver health.
    pub report: Option<Box<WoundReport>>,
    /// Newest nodes; none until one came.
    pub frame: SceneFrame,
    /// Newest outline; none until one came.
    pub outline: SceneOutline,
    /// Frames that came.
    pub frames: u64,
    /// Outlines that came.
    pub outlines: u64,
    /// Messages that were rejected.
    pub rejected: u64,
}

impl View {
    /// The outline that belongs to the newest frame; `None` while one of the two is missing or of another scene.
    #[must_use]
    pub fn outline_of_frame(&self) -> Option<OutlineParts<'_>> {
        let (frame, outline) = (&self.frame.header, &self.outline.header);
        let same = (frame.scene_generation, frame.node_count) == (outline.scene_generation, outline.node_count);
        if self.frames == 0 || self.outlines == 0 || !same {
            return None;
        }
        outline.split(&self.outline.elements)
    }
}

/// Subscribers of one viewer.
pub struct Feed {
    node: PortNode,
    servo: ServoStateReader,
    reports: WoundReportSubscriber,
    frames: SceneFrameSubscriber,
    outlines: SceneOutlineSubscriber,
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
            outlines: SceneOutlineSubscriber::open(&node)?,
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
            // Into the memory that the last report took.
            match &mut self.view.report {
                Some(kept) => **kept = report,
                none => *none = Some(Box::new(report)),
            }
        }
        if let Some(outline) = kept(self.outlines.newest(), &mut self.view.rejected)? {
            copy(outline, &mut self.view.outline);
            self.view.outlines += 1;
        }
        if let Some(frame) = kept(self.frames.newest(), &mut self.view.rejected)? {
            copy(frame, &mut self.view.frame);
            self.view.frames += 1;
        }
        Ok(&self.view)
    }

    /// The view as it was last taken in.
    #[must_use]
    pub fn view(&self) -> &View {
        &self.view
    }

    /// This viewer's membership in the run, for further ports of the same thread.
    #[must_use]
    pub fn node(&self) -> &PortNode {
        &self.node
    }

    /// Cleans up after processes of this run that died; once a second is enough.
    pub fn clean_up(&self) {
        self.node.clean_up_dead();
    }
}

/// Into the memory that the last message took.
fn copy<H: SliceHeader>(from: &SliceMessage<H>, into: &mut SliceMessage<H>) {
    into.header = from.header;
    into.elements.clone_from(&from.elements);
}

fn kept<M>(received: Result<Option<M>, PortError>, rejected: &mut u64) -> Result<Option<M>, PortError> {
    match received {
        Err(PortError::Rejected(_) | PortError::Count { .. }) => {
            *rejected += 1;
            Ok(None)
        }
        other => other,
    }
}
