//! The solver's topics: what it reads before a step and what it publishes after one.
//!
//! The tissue port leaves after every step; report and frame at [`VIEW_PERIOD_NS`], because eyes and tables need
//! no more, and at once when a command was answered or a stitch was tied; the outline when the scene changes, and
//! late viewers get it from the history. A rejected message counts as not arrived: the last good one stays. Senders of commands
//! take turns, one command each, so that one who sends without end delays the others by its turn only.

use super::pace::Pace;
use crate::complaints::Complaints;
use crate::solver::session::SolverSession;
use protocol::ports::{
    CommandFlood, PortError, PortNode, SceneFramePublisher, SceneOutlinePublisher, ServoStateReader,
    SessionCommandSubscriber, TissuePortPublisher, WoundReportPublisher, monotonic_ns,
};
use protocol::scene_frame::FrameNode;
use protocol::servo_state::ServoState;
use protocol::session_command::{CommandAnswer, SessionCommand};
use protocol::wire::Field;
use protocol::wound_report::WoundReport;

/// Frames and reports are published this often, nanoseconds: 60 Hz.
const VIEW_PERIOD_NS: u64 = 16_666_667;
/// Commands are obeyed no faster than this, nanoseconds: a restore publishes a whole scene, and nobody presses keys faster.
const COMMAND_PERIOD_NS: u64 = 20_000_000;
/// Dead peers are cleaned up this often, nanoseconds.
const CLEAN_UP_PERIOD_NS: u64 = 1_000_000_000;

/// All ports of the solver.
pub(super) struct Topics {
    node: PortNode,
    servo_reader: ServoStateReader,
    commands: SessionCommandSubscriber,
    port: TissuePortPublisher,
    report: WoundReportPublisher,
    frame: SceneFramePublisher,
    outline: SceneOutlinePublisher,
    servo: Option<ServoState>,
    command: Option<SessionCommand>,
    complaints: Complaints,
    nodes: Vec<FrameNode>,
    shown_generation: Option<u32>,
    next_view_ns: u64,
    next_clean_up_ns: u64,
    next_command_ns: u64,
    answered: CommandAnswer,
    shown_rows: u32,
}

impl Topics {
    /// Opens the ports, sized for the session's present scene.
    pub(super) fn open(node: &PortNode, session: &SolverSession) -> Result<Self, PortError> {
        let mut nodes = Vec::new();
        session.frame(&mut nodes);
        let words = session.outline().1.len();
        Ok(Self {
            node: node.clone(),
            servo_reader: ServoStateReader::new(node),
            commands: SessionCommandSubscriber::open(node)?,
            port: TissuePortPublisher::open(node)?,
            report: WoundReportPublisher::open(node)?,
            frame: SceneFramePublisher::open(node, nodes.len())?,
            outline: SceneOutlinePublisher::open(node, words)?,
            servo: None,
            command: None,
            complaints: Complaints::default(),
            nodes,
            shown_generation: None,
            next_view_ns: 0,
            next_clean_up_ns: 0,
            next_command_ns: 0,
            answered: CommandAnswer::EMPTY,
            shown_rows: 0,
        })
    }

    /// Takes in the newest servo state and the next command.
    pub(super) fn receive(&mut self) -> Result<(), PortError> {
        if let Some(servo) = self.complaints.kept(self.servo_reader.newest())? {
            self.servo = Some(servo);
        }
        let now_ns = monotonic_ns();
        self.command = None;
        if now_ns >= self.next_command_ns {
            let looked = self.commands.look();
            let is_rejected = looked.is_err();
            self.complaints.passed(looked)?;
            self.command = self.commands.next_command();
            std::iter::from_fn(|| self.commands.flood()).for_each(tell);
            if self.command.is_some() || is_rejected {
                self.next_command_ns = now_ns + COMMAND_PERIOD_NS;
            }
        }
        Ok(())
    }

    /// Newest servo state, if one was ever seen.
    pub(super) fn servo(&self) -> Option<&ServoState> {
        self.servo.as_ref()
    }

    /// When the servo wrote it, 0 if never.
    pub(super) fn servo_time_ns(&self) -> u64 {
        self.servo.map_or(0, |s| s.header.time_ns)
    }

    /// The command for this step.
    pub(super) fn command(&self) -> Option<&SessionCommand> {
        self.command.as_ref()
    }

    /// Publishes what the step has made.
    pub(super) fn publish(&mut self, session: &SolverSession, pace: &Pace) -> Result<(), PortError> {
        let now_ns = monotonic_ns();
        let mut port = *session.port();
        port.publish_ns = now_ns;
        self.port.send(&mut port)?;
        let report = session.report();
        let outline_is_new = self.shown_generation != Some(session.scene_generation());
        let is_news = report.answers[0] != self.answered || report.row_count != self.shown_rows;
        let views_are_due = now_ns >= self.next_view_ns || outline_is_new;
        if views_are_due || is_news {
            (self.answered, self.shown_rows) = (report.answers[0], report.row_count);
            self.publish_report(pace, *report)?;
        }
        if views_are_due {
            self.next_view_ns = now_ns + VIEW_PERIOD_NS;
            if outline_is_new {
                self.publish_outline(session)?;
            }
            if self.frame.has_receivers() {
                self.publish_frame(session)?;
            }
        }
        self.outline.serve_late_joiners()?;
        if now_ns >= self.next_clean_up_ns {
            self.next_clean_up_ns = now_ns + CLEAN_UP_PERIOD_NS;
            self.node.clean_up_dead();
        }
        Ok(())
    }

    fn publish_outline(&mut self, session: &SolverSession) -> Result<(), PortError> {
        let (mut header, words) = session.outline();
        self.outline.send(&mut header, words.len(), |i| words[i])?;
        self.shown_generation = Some(session.scene_generation());
        Ok(())
    }

    fn publish_report(&mut self, pace: &Pace, mut report: WoundReport) -> Result<(), PortError> {
        report.step_time_ns = pace.mean_ns();
        report.step_time_max_ns = pace.longest_ns();
        self.report.send(&mut report)
    }

    fn publish_frame(&mut self, session: &SolverSession) -> Result<(), PortError> {
        let mut header = session.frame(&mut self.nodes);
        let nodes = &self.nodes;
        self.frame.send(&mut header, nodes.len(), |i| nodes[i])
    }
}

/// A flood is told when it begins and when it is over, however many commands it had.
fn tell(flood: CommandFlood) {
    match flood {
        CommandFlood::Began { sender } => {
            tracing::warn!(
                "process {sender} sends session commands faster than they are obeyed; some of them are lost"
            );
        }
        CommandFlood::Ended { sender, lost } => {
            tracing::warn!("the flood of session commands of process {sender} is over; {lost} of them were lost");
        }
    }
}
