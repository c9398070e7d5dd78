//! What a person has in hand at a viewer: camera, look, picked points, the last sentence, the picture held still. Everything
//! of the window but the window itself and the GPU.

use crate::camera::{Camera, FixedView};
use crate::colour::ColourBy;
use crate::feed::View;
use crate::headless;
use crate::notice::{Notice, Tone};
use crate::orders::{self, Order};
use crate::overlay::situation::{FrameTime, Link, Picture, Situation};
use crate::overlay::wish::Wish;
use crate::overlay::{Help, Overlay};
use crate::pick;
use crate::pointer::{Button, Press, Sight};
use crate::render::{Background, Look, Stereo};
use crate::samples::Samples;
use crate::source::Source;
use crate::tell::Tell;
use nalgebra::Point3;
use protocol::servo_state::FLAG_DEGRADED;
use protocol::words;
use serde_json::json;
use std::path::PathBuf;

/// Sentences stay for this long, seconds; bad ones for twice as long.
const NOTICE_S: f64 = 6.0;
/// Servo state machine: fault.
const FAULT: u32 = 5;
/// Width of the columns of panels that framing leaves free, pixels.
const COLUMNS: f32 = 2.0 * 240.0;

/// What the window has to do itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// The picture as a file.
    Screenshot,
    /// The end.
    Quit,
}

/// Size of the picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Size {
    pub(crate) width: f32,
    pub(crate) height: f32,
}

impl Size {
    /// Width over height of one eye's picture.
    fn aspect(self, stereo: Stereo) -> f32 {
        let eyes = if stereo == Stereo::SideBySide { 2.0 } else { 1.0 };
        self.width.max(1.0) / (eyes * self.height.max(1.0))
    }

    /// Shape of what the panels leave free.
    fn free_aspect(self, stereo: Stereo) -> f32 {
        let free = Self { width: (self.width - COLUMNS).max(0.5 * self.width), ..self };
        free.aspect(stereo)
    }
}

/// Everything that is in hand.
pub(crate) struct Desk {
    pub(crate) source: Source,
    pub(crate) camera: Camera,
    pub(crate) look: Look,
    pub(crate) samples: Samples,
    pub(crate) tell: Tell,
    pub(crate) folder: PathBuf,
    held: Option<Box<View>>,
    notice: Option<(Notice, f64)>,
    /// Kind and node count of the scene that was framed.
    framed: Option<(u32, u32)>,
    /// State, fault and flags of the servo that were told last.
    told: Option<(u32, u32, u32)>,
    now_s: f64,
}

impl Desk {
    pub(crate) fn new(source: Source, look: Look, view: FixedView, folder: PathBuf, tell: Tell) -> Self {
        let mut camera = Camera::default();
        camera.fixed(view);
        let samples = Samples::default();
        Self {
            source,
            camera,
            look,
            samples,
            tell,
            folder,
            held: None,
            notice: None,
            framed: None,
            told: None,
            now_s: 0.0,
        }
    }

    /// The view that is drawn.
    pub(crate) fn view(&self) -> &View {
        self.held.as_deref().unwrap_or_else(|| self.source.view())
    }

    /// Whether the picture is held still.
    pub(crate) fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// Whether a sentence is shown, or was until a moment ago.
    pub(crate) fn speaks(&self) -> bool {
        self.notice.as_ref().is_some_and(|(_, until_s)| self.now_s < *until_s + 1.0)
    }

    /// Takes in what is new; `now_s` counts from the start of the viewer.
    pub(crate) fn look_around(&mut self, now_s: f64, size: Size, overlay: &mut Overlay) {
        self.now_s = now_s;
        if let Some(notice) = self.source.look() {
            self.say(notice);
        }
        let view = self.source.view();
        overlay.take(view);
        self.samples.take(view);
        if self.held.is_some() && view.servo.as_ref().is_some_and(|servo| servo.mode == FAULT) {
            // A fault must be seen.
            self.held = None;
        }
        let scene = (view.outline.header.scene_kind, view.frame.header.node_count);
        if self.framed != Some(scene) && view.outline_of_frame().is_some() {
            self.framed = Some(scene);
            headless::frame(&mut self.camera, view, size.free_aspect(self.look.stereo));
            self.tell_camera(size);
        }
        self.tell_servo();
    }

    /// Says, for programs, how the servo is when that has changed.
    fn tell_servo(&mut self) {
        let Some(servo) = &self.source.view().servo else { return };
        let now = (servo.mode, servo.fault, servo.flags & FLAG_DEGRADED);
        if self.told.replace(now) != Some(now) {
            let fault = (servo.mode == FAULT).then(|| words::fault(servo.fault));
            let state = words::mode(servo.mode);
            self.tell.say("servo", json!({ "state": state, "fault": fault, "is_degraded": now.2 != 0 }));
        }
    }

    /// A sentence for the person.
    pub(crate) fn say(&mut self, notice: Notice) {
        let tone = format!("{:?}", notice.tone).to_lowercase();
        self.tell.say("notice", json!({ "tone": tone, "text": notice.text }));
        let stays_s = if notice.tone == Tone::Bad { 2.0 * NOTICE_S } else { NOTICE_S };
        self.notice = Some((notice, self.now_s + stays_s));
    }

    /// What the panels show beyond the view.
    pub(crate) fn situation(&self, size: Size, link: Link, frame_time: Option<FrameTime>) -> Situation<'_> {
        let mut situation = Situation::seen_by(&self.camera, size.aspect(self.look.stereo), link, &self.samples);
        if self.look.stereo == Stereo::SideBySide {
            situation.projection = None;
        }
        situation.notice = self.notice.as_ref().filter(|(_, until)| *until > self.now_s).map(|(notice, _)| notice);
        situation.picture = if self.held.is_some() { Picture::Paused } else { Picture::Running };
        situation.hand = self.source.hand_mode();
        situation.time_line = self.source.time_line();
        situation.frame_time = frame_time;
        situation
    }

    /// Carries out a wish; what concerns the window itself comes back.
    pub(crate) fn fulfil(&mut self, wish: Wish, size: Size, overlay: &mut Overlay) -> Option<Task> {
        match wish {
            Wish::Order(order) => self.order(order),
            Wish::CycleControl => self.order(orders::next_control(self.source.view())),
            Wish::FrameAll => self.frame_all(size),
            Wish::Fixed(view) => {
                self.camera.fixed(view);
                self.tell_camera(size);
            }
            Wish::Pause if self.held.is_some() => self.held = None,
            Wish::Pause => self.held = Some(Box::new(self.source.view().clone())),
            Wish::NextColour => self.look.colour = after(&ColourBy::ALL, self.look.colour),
            Wish::Stereo => self.look.stereo = after(&[Stereo::Off, Stereo::SideBySide], self.look.stereo),
            Wish::Background => {
                self.look.background = after(&[Background::Room, Background::Print], self.look.background);
            }
            Wish::Help => overlay.help = after(&[Help::Closed, Help::Open], overlay.help),
            Wish::Panels => overlay.panels = overlay.panels.next(),
            Wish::SaveSamples => self.save_samples(),
            Wish::ClearSamples => self.samples.clear(),
            Wish::Hand => {
                let notice = self.source.toggle_hand();
                self.say(notice);
                self.tell.say("hand", json!({ "mode": format!("{:?}", self.source.hand_mode()).to_lowercase() }));
            }
            Wish::Play(wish) => self.source.play(wish),
            Wish::Screenshot => return Some(Task::Screenshot),
            Wish::Quit => return Some(Task::Quit),
        }
        None
    }

    /// Picks the node under a place of the picture as a sample point.
    pub(crate) fn pick(&mut self, at: [f32; 2], size: Size) {
        let sight = self.sight(at, size);
        let view = self.held.as_deref().unwrap_or_else(|| self.source.view());
        let hit = view
            .outline_of_frame()
            .and_then(|parts| pick::nearest(&sight.origin_m, &sight.direction, &view.frame.elements, parts.triangles));
        match hit {
            Some(hit) if self.samples.pick(view, hit.node) => {
                let place: [f32; 3] = hit.at_m.into();
                self.tell.say("picked", json!({ "node": hit.node, "at_m": place }));
                self.say(Notice::note(format!("node {} is watched; K saves its curve", hit.node)));
            }
            _ => self.say(Notice::note("there is no tissue under the pointer")),
        }
    }

    /// The mouse moved to this place while it is the hand.
    pub(crate) fn lead_hand(&mut self, at: [f32; 2], size: Size) {
        let sight = self.sight(at, size);
        let points = suture_points(self.source.view());
        self.source.act(|pointer| pointer.follow(&sight, points.iter().copied()));
    }

    /// The wheel turned while the mouse is the hand.
    pub(crate) fn push_hand(&mut self, at: [f32; 2], notches: f32, size: Size) {
        let sight = self.sight(at, size);
        self.source.act(|pointer| pointer.wheel(&sight, notches));
    }

    /// A button of the stylus.
    pub(crate) fn press_hand(&mut self, button: Button, press: Press) {
        self.source.act(|pointer| pointer.press(button, press));
    }

    /// Lets go of every button of the stylus: the window does not hear any more when they come up.
    pub(crate) fn let_go(&mut self) {
        self.press_hand(Button::Front, Press::Up);
        self.press_hand(Button::Back, Press::Up);
    }

    /// Says where the camera is, for programs.
    pub(crate) fn tell_camera(&self, size: Size) {
        let matrix = self.camera.view_projection(size.aspect(self.look.stereo));
        let size = [size.width, size.height];
        self.tell.say("camera", json!({ "scene_to_clip": matrix.as_slice(), "size": size }));
    }

    fn order(&mut self, order: Order) {
        if let Some(notice) = self.source.order(order) {
            self.say(notice);
        }
    }

    fn frame_all(&mut self, size: Size) {
        let view = self.held.as_deref().unwrap_or_else(|| self.source.view());
        let points = view.frame.elements.iter().map(|node| node.position_m);
        self.camera.frame_all(points, size.free_aspect(self.look.stereo));
        self.tell_camera(size);
    }

    fn save_samples(&mut self) {
        match self.samples.save(&self.folder) {
            Ok(path) => {
                self.tell.say("saved", json!({ "file": path }));
                self.say(Notice::good(format!("sample curves are in {}", path.display())));
            }
            Err(error) => self.say(Notice::bad(format!("sample curves are not saved: {error}"))),
        }
    }

    /// The line of sight under a place of the picture, pixels from its upper left corner.
    fn sight(&self, [x, y]: [f32; 2], size: Size) -> Sight {
        let width = if self.look.stereo == Stereo::SideBySide { 0.5 * size.width } else { size.width }.max(1.0);
        let x_ndc = 2.0 * (x % width) / width - 1.0;
        let y_ndc = 1.0 - 2.0 * y / size.height.max(1.0);
        let (origin_m, direction) = self.camera.ray(x_ndc, y_ndc, size.aspect(self.look.stereo));
        Sight { origin_m: Point3::from(origin_m), direction, forward: self.camera.forward() }
    }
}

/// Where the suture points are now.
fn suture_points(view: &View) -> Vec<[f32; 3]> {
    let pairs = view.outline_of_frame().map_or(&[][..], |parts| parts.pairs);
    pairs.iter().filter_map(|node| view.frame.elements.get(*node as usize)).map(|node| node.position_m).collect()
}

/// The choice that follows in a round.
fn after<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let place = all.iter().position(|choice| *choice == now).unwrap_or(0);
    all[(place + 1) % all.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_go_round() {
        let mut colour = ColourBy::Tissue;
        for _ in ColourBy::ALL {
            colour = after(&ColourBy::ALL, colour);
        }
        assert_eq!(colour, ColourBy::Tissue);
        assert_eq!(after(&[Stereo::Off, Stereo::SideBySide], Stereo::Off), Stereo::SideBySide);
    }

    #[test]
    fn panels_take_their_room_from_the_framing_only_where_there_is_some() {
        let size = Size { width: 1280.0, height: 720.0 };
        assert!(size.free_aspect(Stereo::Off) < size.aspect(Stereo::Off));
        let small = Size { width: 400.0, height: 300.0 };
        assert!((small.free_aspect(Stereo::Off) - 0.5 * small.aspect(Stereo::Off)).abs() < 1e-6);
        assert_eq!(Size { width: 0.0, height: 0.0 }.aspect(Stereo::SideBySide), 0.5);
    }
}
