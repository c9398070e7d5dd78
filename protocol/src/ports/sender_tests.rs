//! Several senders of one topic: nobody is kept waiting by somebody else who sends without end, is stopped, or sends nonsense.

use super::commands::raw_sender_for_test;
use super::tests::{TestRun, wait_for};
use super::*;
use crate::pointer_hand::PointerHand;
use crate::session_command::{Order, SessionCommand};
use crate::wire::{Field, Message};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A sender that began first and never ends.
struct Flood {
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<u64>>,
}

impl Flood {
    fn start(run: &TestRun, mut send: impl FnMut(&PortNode) -> Box<dyn FnMut()> + Send + 'static) -> Self {
        let (stop, dir) = (Arc::new(AtomicBool::new(false)), run.dir().clone());
        let (ready, is_ready) = std::sync::mpsc::channel();
        let until = stop.clone();
        let thread = std::thread::spawn(move || {
            let node = PortNode::join(&dir, "flood").unwrap();
            let mut one = send(&node);
            let mut sent = 0;
            while !until.load(Ordering::Relaxed) {
                one();
                sent += 1;
                if sent == 100 {
                    ready.send(()).unwrap();
                }
            }
            sent
        });
        is_ready.recv().unwrap();
        Self { stop, thread: Some(thread) }
    }

    fn end(&mut self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map_or(0, |thread| thread.join().unwrap())
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        self.end();
    }
}

#[test]
fn a_flood_of_commands_lets_another_sender_have_its_turn() {
    let run = TestRun::start();
    let mut receiver = SessionCommandSubscriber::open(&run.node()).unwrap();
    let mut flood = Flood::start(&run, |node| {
        let mut publisher = SessionCommandPublisher::open(node).unwrap();
        Box::new(move || {
            publisher.send(Order::Tie).unwrap();
        })
    });
    receiver.look().unwrap();
    assert_eq!(receiver.next_command().and_then(|c| c.order()), Some(Order::Tie));
    let mut other = SessionCommandPublisher::open(&run.node()).unwrap();
    for _ in 0..20 {
        other.send(Order::Restore).unwrap();
        receiver.look().unwrap();
        let turns: Vec<Order> = (0..2).filter_map(|_| receiver.next_command()?.order()).collect();
        assert!(turns.contains(&Order::Restore), "{turns:?}");
    }
    let sent = flood.end();
    receiver.look().unwrap();
    while receiver.next_command().is_some() {}
    let told: Vec<CommandFlood> = std::iter::from_fn(|| receiver.flood()).collect();
    let lost: u64 = told.iter().map(|t| if let CommandFlood::Ended { lost, .. } = t { *lost } else { 0 }).sum();
    println!("{sent} commands sent, {lost} lost, told {} times", told.len());
    assert!(matches!(told[0], CommandFlood::Began { sender } if sender == std::process::id()), "{told:?}");
    // It is over: every beginning has its end, and what was obeyed or lost before the first look is not in the count.
    assert!(told.len().is_multiple_of(2) && lost > 0 && lost < sent, "{lost} of {sent}, {told:?}");
}

#[test]
fn nonsense_hides_no_command_and_is_one_answer_however_much_of_it_there_is() {
    let run = TestRun::start();
    let node = run.node();
    let mut receiver = SessionCommandSubscriber::open(&node).unwrap();
    let nonsense = raw_sender_for_test(&node).unwrap();
    let mut sender = SessionCommandPublisher::open(&node).unwrap();
    for sequence in 1..=10 {
        let mut message = SessionCommand { command: 4711, ..SessionCommand::EMPTY };
        message.stamp(sequence, monotonic_ns());
        nonsense.send_copy(message).unwrap();
    }
    sender.send(Order::Next).unwrap();
    assert!(matches!(receiver.look(), Err(PortError::Rejected(_))));
    assert_eq!(receiver.next_command().and_then(|c| c.order()), Some(Order::Next));
    assert_eq!((receiver.look(), receiver.next_command()), (Ok(()), None));
}

fn wish(x_m: f64, sender: u32) -> PointerHand {
    PointerHand { position_m: [x_m, 0.0, 0.0], sender, ..PointerHand::EMPTY }
}

#[test]
fn the_newest_wish_of_each_sender_arrives_with_its_port_and_one_too_many_is_refused() {
    let run = TestRun::start();
    let node = run.node();
    let mut receiver = PointerHandSubscriber::open(&node).unwrap();
    let mut senders: Vec<_> = (0..MAX_HAND_SENDERS).map(|_| PointerHandPublisher::open(&node).unwrap()).collect();
    let refused = PointerHandPublisher::open(&node);
    assert!(matches!(refused, Err(PortError::Full { role: "writer", .. })), "{refused:?}");
    for (sender, port) in (1..).zip(&mut senders) {
        port.send(&mut wish(0.1, sender)).unwrap();
        port.send(&mut wish(0.2, sender)).unwrap();
    }
    // One that cannot be used does not take the others with it.
    senders[0].send(&mut wish(f64::NAN, 1)).unwrap();
    let mut heard = Vec::new();
    let outcome = receiver.each(|writer, message| heard.push((writer, message)));
    assert!(matches!(outcome, Err(PortError::Rejected(_))), "{outcome:?}");
    heard.sort_by_key(|(_, message)| message.sender);
    assert!(heard.iter().all(|(_, message)| message.position_m[0] == 0.2));
    assert_eq!(heard.iter().map(|(_, m)| m.sender).collect::<Vec<_>>(), (2..=8).collect::<Vec<_>>());
    heard.dedup_by_key(|(writer, _)| *writer);
    assert_eq!(heard.len(), MAX_HAND_SENDERS - 1);
    drop(senders.pop());
    PointerHandPublisher::open(&node).unwrap();
}

#[test]
fn a_flood_of_wishes_does_not_hide_the_hand() {
    let run = TestRun::start();
    let mut receiver = PointerHandSubscriber::open(&run.node()).unwrap();
    let _flood = Flood::start(&run, |node| {
        let mut publisher = PointerHandPublisher::open(node).unwrap();
        Box::new(move || publisher.send(&mut wish(0.0, 1)).unwrap())
    });
    let mut hand = PointerHandPublisher::open(&run.node()).unwrap();
    for _ in 0..50 {
        hand.send(&mut wish(0.1, 2)).unwrap();
        wait_for(|| {
            let mut is_heard = false;
            receiver.each(|_, message| is_heard |= message.sender == 2).unwrap();
            is_heard.then_some(())
        });
    }
}
