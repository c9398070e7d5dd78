//! The pointer's side of the bridge: takes in what the viewers wish, lets one of them be the hand, says which.
//!
//! Who it is, is decided in `hand/place.rs`; the wish goes to the servo thread through its cell, the name through the links.

use crate::complaints::Complaints;
use crate::hand::place::{Heard, Place};
use crate::hand::pointer::PointerWish;
use crate::servo_setup::ServoLinks;
use protocol::ports::{PointerHandSubscriber, PortError, PortNode, monotonic_ns};
use triple_buffer::Input;

/// What the bridge keeps of a pointer.
pub(super) struct Pointer<'c> {
    subscriber: PointerHandSubscriber,
    cell: &'c mut Input<PointerWish>,
    place: Place,
    heard: Vec<Heard>,
}

impl<'c> Pointer<'c> {
    /// Opens the topic; wishes go into this cell.
    pub(super) fn open(node: &PortNode, cell: &'c mut Input<PointerWish>) -> Result<Self, PortError> {
        let subscriber = PointerHandSubscriber::open(node)?;
        Ok(Self { subscriber, cell, place: Place::default(), heard: Vec::new() })
    }

    /// Takes in what came and passes on what counts.
    pub(super) fn look(&mut self, complaints: &mut Complaints, links: &ServoLinks) -> Result<(), PortError> {
        let Self { subscriber, cell, place, heard } = self;
        heard.clear();
        complaints.passed(subscriber.each(|writer, message| heard.push(Heard { writer, message })))?;
        let now_ns = monotonic_ns();
        if let Some(wish) = place.hear(heard, now_ns) {
            cell.write(wish);
        }
        let (sender, turn) = place.standing(now_ns);
        links.tell_hand(sender, turn);
        Ok(())
    }
}
