//! The bridge thread: owns the subscribers of the servo process and hands the newest port, and the newest wish of a pointer, to
//! the loop.
//!
//! A subscriber that connects or disconnects costs its thread memory mapping and heap; here that is not the
//! servo thread, which takes ports from a wait-free cell (a triple buffer). The bridge looks every [`LOOK_PERIOD`],
//! well below one servo period of added age on average.

use super::pointer::Pointer;
use crate::complaints::Complaints;
use crate::hand::pointer::PointerWish;
use crate::servo_setup::ServoLinks;
use crossbeam::queue::ArrayQueue;
use protocol::ports::{PortError, PortNode, SessionCommandSubscriber, TissuePortSubscriber, WoundReportSubscriber};
use protocol::run::RunDir;
use protocol::session_command::Order;
use protocol::tissue_port::TissuePort;
use protocol::wound_report::WoundReport;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use triple_buffer::Input;

/// Time between two looks at the topics.
const LOOK_PERIOD: Duration = Duration::from_micros(400);
/// Report and commands are looked at once in so many looks.
const SLOW_LOOKS: u32 = 16;
/// Commands that are obeyed in one look; what a viewer sends beyond that waits in its lane or is lost, not the tissue port.
const COMMANDS_PER_LOOK: usize = 16;
/// Dead peers are cleaned up this often.
const CLEAN_UP_PERIOD: Duration = Duration::from_secs(1);

/// The cells of the loop.
pub(super) struct Cells {
    /// For tissue ports.
    pub(super) ports: Input<TissuePort>,
    /// For the wishes of a pointer, if that is the hand.
    pub(super) wishes: Option<Input<PointerWish>>,
}

/// Where the bridge delivers to, and when it ends.
pub(super) struct Delivery {
    /// Re-arm orders, for the loop.
    pub(super) links: Arc<ServoLinks>,
    /// Newest report (a queue of one), for the supervisor and the summary.
    pub(super) reports: ArrayQueue<WoundReport>,
    /// Ends the bridge.
    pub(super) stop: AtomicBool,
}

impl Delivery {
    /// To this loop, with nothing delivered yet.
    pub(super) fn new(links: Arc<ServoLinks>) -> Self {
        Self { links, reports: ArrayQueue::new(1), stop: AtomicBool::new(false) }
    }
}

/// Opens the subscribers in this thread and delivers until told to stop.
pub(super) fn run(run: &RunDir, cells: &mut Cells, delivery: &Delivery) -> Result<(), PortError> {
    let node = PortNode::join(run, "servo-bridge")?;
    let mut ports = TissuePortSubscriber::open(&node)?;
    let mut reports = WoundReportSubscriber::open(&node)?;
    let mut commands = Some(SessionCommandSubscriber::open(&node)?);
    let mut pointer = match &mut cells.wishes {
        Some(cell) => Some(Pointer::open(&node, cell)?),
        None => None,
    };
    let mut complaints = Complaints::default();
    let mut next_clean_up = Instant::now() + CLEAN_UP_PERIOD;
    let mut looks = 0_u32;
    while !delivery.stop.load(Ordering::Relaxed) {
        if let Some(port) = complaints.kept(ports.newest())? {
            cells.ports.write(port);
        }
        if let Some(hand) = &mut pointer
            && let Err(error) = hand.look(&mut complaints, &delivery.links)
        {
            tracing::warn!("{error}; the pointer is not heard any more");
            let (_, turn) = delivery.links.hand();
            delivery.links.tell_hand(0, turn);
            pointer = None;
        }
        looks = looks.wrapping_add(1);
        if looks.is_multiple_of(SLOW_LOOKS) {
            if let Some(report) = complaints.kept(reports.newest())? {
                delivery.reports.force_push(report);
            }
            if let Some(subscriber) = &mut commands
                && let Err(error) = obey(subscriber, &mut complaints, &delivery.links)
            {
                tracing::warn!("{error}; commands to re-arm are not heard any more, the device's back button is");
                commands = None;
            }
            if Instant::now() >= next_clean_up {
                next_clean_up = Instant::now() + CLEAN_UP_PERIOD;
                node.clean_up_dead();
            }
        }
        std::thread::sleep(LOOK_PERIOD);
    }
    Ok(())
}

/// Hands orders to re-arm to the loop.
fn obey(
    commands: &mut SessionCommandSubscriber,
    complaints: &mut Complaints,
    links: &ServoLinks,
) -> Result<(), PortError> {
    complaints.passed(commands.look())?;
    let waiting = std::iter::from_fn(|| commands.next_command()).take(COMMANDS_PER_LOOK);
    waiting.filter(|command| command.order() == Some(Order::Rearm)).for_each(|_| links.order_rearm());
    Ok(())
}
