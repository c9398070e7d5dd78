//! What must be seen at once: the servo's fault with its reason and the way out, or that the server is gone.

use super::situation::{Link, Situation};
use super::style;
use super::wish::Wish;
use crate::feed::View;
use crate::orders::Order;
use egui::{Color32, RichText, Ui};
use protocol::words;

/// Servo state machine: fault.
const FAULT: u32 = 5;

/// An alarm: headline and sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Alarm {
    pub(super) headline: &'static str,
    pub(super) sentence: String,
    offers_rearm: bool,
}

/// What is wrong, if anything is; the server's absence outweighs what it said before.
pub(super) fn alarm(view: &View, situation: &Situation<'_>) -> Option<Alarm> {
    if situation.link == Link::Gone {
        let sentence = "It has ended or does not answer. This is the last picture; the viewer closes soon unless somebody is at it."
            .to_owned();
        return Some(Alarm { headline: "The server is gone", sentence, offers_rearm: false });
    }
    let servo = view.servo.as_ref().filter(|servo| servo.mode == FAULT)?;
    Some(Alarm {
        headline: "Fault: no force",
        sentence: format!("{} (fault {})", words::fault(servo.fault), servo.fault),
        offers_rearm: situation.link != Link::Recorded,
    })
}

pub(super) fn show(ui: &mut Ui, alarm: &Alarm, wishes: &mut Vec<Wish>) {
    style::alarm(style::BAD).show(ui, |ui| {
        ui.set_max_width(460.0);
        ui.label(RichText::new(alarm.headline).strong().size(15.0).color(Color32::WHITE));
        ui.label(RichText::new(&alarm.sentence).color(Color32::from_rgb(255, 214, 208)));
        if alarm.offers_rearm && ui.button("Re-arm (A)").clicked() {
            wishes.push(Wish::Order(Order::Rearm));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::samples::Samples;
    use protocol::servo_state::ServoState;
    use protocol::wire::Field;

    #[test]
    fn a_fault_is_told_with_its_reason_and_only_a_live_one_can_be_re_armed() {
        let (camera, samples) = (Camera::default(), Samples::default());
        let mut situation = Situation::seen_by(&camera, 1.0, Link::Live(0), &samples);
        let mut servo = ServoState { fault: 4, mode: 4, ..ServoState::EMPTY };
        let with = |servo| View { servo: Some(servo), ..View::default() };
        assert_eq!(alarm(&with(servo), &situation), None);
        servo.mode = FAULT;
        let live = alarm(&with(servo), &situation).expect("an alarm");
        assert!(live.sentence.contains("missed too many ticks") && live.offers_rearm, "{live:?}");
        situation.link = Link::Recorded;
        assert!(alarm(&with(servo), &situation).is_some_and(|a| !a.offers_rearm));
        situation.link = Link::Gone;
        assert!(alarm(&with(servo), &situation).is_some_and(|a| a.headline.contains("gone")));
    }
}
