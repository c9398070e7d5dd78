//! One open window: what is drawn, in which order, and how events reach the panels, the camera and the hand.
//!
//! A picture is: look at what is new → upload → lay out the panels, if something in them changed → draw the scene → paint the
//! panels over it → present. The panels are laid out at most 30 times a second while nobody touches anything; in between the last
//! triangles are painted again.

use super::clock::Clock;
use super::keys::{self, Keyboard, Played};
use super::mouse::{Gesture, Mouse};
use super::pace::{Pace, Seen};
use super::screen::{Next, Screen, ScreenError};
use super::shot;
use crate::desk::{Desk, Size, Task};
use crate::gpu::Gpu;
use crate::notice::Notice;
use crate::overlay::Overlay;
use crate::overlay::painter::Painter;
use crate::overlay::situation::{FrameTime, HandMode, Link};
use crate::overlay::wish::Wish;
use crate::pointer::Press;
use crate::render::Renderer;
use egui::{Context, ViewportId};
use serde_json::json;
use std::sync::Arc;
use winit::event::{ElementState, KeyEvent, WindowEvent};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Zoom per notch of the wheel.
const ZOOM: f32 = 1.12;
/// From layout to layout of the panels while nobody touches anything.
const LAYOUT_S: f64 = 1.0 / 30.0;
/// What is told of time in the panels may be this old.
const STALE_S: f64 = 0.25;
/// egui measures a panel in one pass and places it in the next.
const PASSES: usize = 3;
/// A server that has been gone for this long ends the viewer, unless somebody is at it.
const LAST_LOOK_S: f64 = 10.0;

/// What the event loop is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    GoOn,
    Quit,
}

/// An open window with everything in it.
pub(super) struct Stage {
    window: Arc<Window>,
    screen: Screen,
    gpu: Gpu,
    renderer: Renderer,
    painter: Painter,
    panels: egui_winit::State,
    context: Context,
    overlay: Overlay,
    desk: Desk,
    mouse: Mouse,
    pace: Pace,
    clock: Clock,
    looked_s: f64,
    /// When the window was asked last whether it is minimised, and whether another one covers it.
    asked_s: f64,
    is_covered: bool,
    /// When the panels were laid out last, and whether something asks for it sooner.
    laid_out_s: f64,
    is_touched: bool,
    /// What was new at the last look: frames, and the servo's sequence.
    seen: (u64, u64),
    gone_s: Option<f64>,
}

impl Stage {
    /// Opens the GPU for a window.
    pub(super) fn open(event_loop: &ActiveEventLoop, window: Arc<Window>, desk: Desk) -> Result<Self, ScreenError> {
        let (screen, gpu) = Screen::open(event_loop, &window)?;
        let renderer = Renderer::new(&gpu, screen.format());
        let painter = Painter::new(&gpu, screen.format());
        let context = Context::default();
        let overlay = Overlay::new(&context);
        let scale = Some(window.scale_factor() as f32);
        let largest = Some(gpu.device.limits().max_texture_dimension_2d as usize);
        let panels = egui_winit::State::new(context.clone(), ViewportId::ROOT, &window, scale, None, largest);
        let size = window.inner_size();
        desk.tell.say("started", json!({ "adapter": gpu.describe(), "size": [size.width, size.height] }));
        let mut stage = Self {
            window,
            screen,
            gpu,
            renderer,
            painter,
            panels,
            context,
            overlay,
            desk,
            mouse: Mouse::default(),
            pace: Pace::new(),
            clock: Clock::start(),
            looked_s: 0.0,
            asked_s: 0.0,
            is_covered: false,
            laid_out_s: 0.0,
            is_touched: true,
            seen: (0, 0),
            gone_s: None,
        };
        // The first picture shows something.
        stage.look_around(0.0);
        for _ in 0..PASSES {
            stage.lay_out(0.0);
        }
        stage.is_touched = true;
        Ok(stage)
    }

    /// Looks at what is new when it is time to; says when to be woken next.
    pub(super) fn wake(&mut self) -> (std::time::Instant, Then) {
        let now_s = self.clock.now_s();
        if now_s >= self.pace.next_s(now_s, self.looked_s) {
            self.looked_s = now_s;
            self.look_around(now_s);
            if self.has_stayed_gone(now_s) {
                return (self.clock.at(now_s), Then::Quit);
            }
        }
        (self.clock.at(self.pace.next_s(now_s, self.looked_s)), Then::GoOn)
    }

    /// An event of the window.
    pub(super) fn on(&mut self, event: &WindowEvent) -> Result<Then, ScreenError> {
        match event {
            WindowEvent::CloseRequested => return Ok(Then::Quit),
            WindowEvent::RedrawRequested => {
                self.draw()?;
                return Ok(Then::GoOn);
            }
            WindowEvent::Resized(size) => self.screen.resize(&self.gpu, size.width, size.height),
            WindowEvent::Focused(false) => self.desk.let_go(),
            WindowEvent::Occluded(is_covered) => self.is_covered = *is_covered,
            _ => {}
        }
        let answer = self.panels.on_window_event(&self.window, event);
        let then = if answer.consumed { Then::GoOn } else { self.touch(event) };
        if answer.repaint || !matches!(event, WindowEvent::Moved(_)) {
            self.touched();
        }
        Ok(then)
    }

    /// The last word.
    pub(super) fn close(&self) {
        self.desk.tell.say("quit", json!({ "pictures": self.pace.count() }));
    }

    fn size(&self) -> Size {
        let [width, height] = self.screen.size().map(|side| side as f32);
        Size { width, height }
    }

    fn touched(&mut self) {
        self.is_touched = true;
        let now_s = self.clock.now_s();
        self.pace.news(now_s);
        if self.gone_s.is_some() {
            self.gone_s = Some(now_s);
        }
    }

    fn look_around(&mut self, now_s: f64) {
        if now_s - self.asked_s > STALE_S {
            self.asked_s = now_s;
            let is_hidden = self.is_covered || self.window.is_minimized() == Some(true);
            self.pace.see(if is_hidden { Seen::Hidden } else { Seen::Visible });
        }
        let size = self.size();
        self.desk.look_around(now_s, size, &mut self.overlay);
        let view = self.desk.source.view();
        let seen = (view.frames, view.servo.as_ref().map_or(0, |servo| servo.header.sequence));
        let link = self.desk.source.link();
        let is_new = seen != self.seen && !self.desk.is_held();
        self.seen = seen;
        if is_new {
            self.pace.news(now_s);
        }
        // Ages and sentences go on where nothing else does.
        let is_stale = now_s - self.laid_out_s > STALE_S && (link != Link::Recorded || self.desk.speaks());
        if self.pace.seen() == Seen::Visible && (is_new || self.is_touched || is_stale) {
            self.window.request_redraw();
        }
        match (link, self.gone_s) {
            (Link::Gone, None) => {
                self.gone_s = Some(now_s);
                self.desk.tell.say("gone", json!({}));
            }
            (Link::Live(_), Some(_)) => self.gone_s = None,
            _ => {}
        }
    }

    fn has_stayed_gone(&self, now_s: f64) -> bool {
        self.gone_s.is_some_and(|since_s| now_s - since_s > LAST_LOOK_S)
    }

    /// An event that the panels did not take.
    fn touch(&mut self, event: &WindowEvent) -> Then {
        let hand = self.desk.source.hand_mode();
        if let WindowEvent::KeyboardInput { event, is_synthetic: false, .. } = event {
            return self.key(event, hand);
        }
        let over_panel = self.context.is_pointer_over_egui();
        if let Some(gesture) = self.mouse.on(event, hand)
            && !(over_panel && matches!(gesture, Gesture::Lead(_)))
        {
            self.gesture(gesture);
        }
        Then::GoOn
    }

    fn key(&mut self, event: &KeyEvent, hand: HandMode) -> Then {
        if hand == HandMode::Hand
            && let Some(button) = keys::button(&event.logical_key)
        {
            let press = if event.state == ElementState::Pressed { Press::Down } else { Press::Up };
            self.desk.press_hand(button, press);
            return Then::GoOn;
        }
        if event.state == ElementState::Released {
            return Then::GoOn;
        }
        let played = if self.desk.source.time_line().is_some() { Played::Recording } else { Played::Live };
        let keyboard = Keyboard { played, help: self.overlay.help, shift: self.mouse.shift() };
        match keys::wish(&event.logical_key, keyboard) {
            Some(wish) if !event.repeat || matches!(wish, Wish::Play(_)) => self.fulfil(wish),
            _ => Then::GoOn,
        }
    }

    fn gesture(&mut self, gesture: Gesture) {
        let size = self.size();
        match gesture {
            Gesture::Orbit(dx, dy) => self.desk.camera.orbit(dx, dy),
            Gesture::Pan(dx, dy) => self.desk.camera.pan(dx / size.height, -dy / size.height),
            Gesture::Zoom(notches) => self.desk.camera.zoom(ZOOM.powf(notches.clamp(-20.0, 20.0))),
            Gesture::Pick(at) => self.desk.pick(at, size),
            Gesture::Lead(at) => self.desk.lead_hand(at, size),
            Gesture::Push(at, notches) => self.desk.push_hand(at, notches, size),
            Gesture::Stylus(button, press) => self.desk.press_hand(button, press),
        }
    }

    fn fulfil(&mut self, wish: Wish) -> Then {
        let size = self.size();
        match self.desk.fulfil(wish, size, &mut self.overlay) {
            Some(Task::Quit) => return Then::Quit,
            Some(Task::Screenshot) => self.screenshot(),
            None => {}
        }
        Then::GoOn
    }

    /// Lays the panels out and carries out what was asked for by a button.
    fn lay_out(&mut self, now_s: f64) {
        self.laid_out_s = now_s;
        self.is_touched = false;
        let frame_time = self.pace.times(now_s).map(|(work_p50_ms, work_p99_ms, per_second)| FrameTime {
            work_p50_ms,
            work_p99_ms,
            per_second,
        });
        let mut situation = self.desk.situation(self.size(), self.desk.source.link(), frame_time);
        situation.legend = self.renderer.legend();
        let mut wishes = Vec::new();
        let input = self.panels.take_egui_input(&self.window);
        let output = self.context.run_ui(input, |ui| {
            wishes.extend(self.overlay.show(ui, self.desk.view(), &situation));
        });
        let platform = self.painter.update(&self.gpu, &self.context, output);
        self.panels.handle_platform_output(&self.window, platform);
        for wish in wishes {
            // Buttons do not quit.
            let _ = self.fulfil(wish);
        }
    }

    fn draw(&mut self) -> Result<(), ScreenError> {
        let start_s = self.clock.now_s();
        self.renderer.update(&self.gpu, self.desk.view(), &self.desk.look);
        if self.is_touched || start_s - self.laid_out_s >= LAYOUT_S {
            self.lay_out(start_s);
        }
        let before_s = self.clock.now_s();
        let target = match self.screen.next(&self.gpu)? {
            Next::Target(target) => target,
            Next::Later => return Ok(()),
        };
        // Waiting for a display is no work; a processor that draws works while one waits for it.
        let waited_s = if self.gpu.is_software() { 0.0 } else { self.clock.now_s() - before_s };
        let view = target.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder =
            self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("picture") });
        let size = self.screen.size();
        self.paint(&mut encoder, &view, size);
        self.gpu.queue.submit([encoder.finish()]);
        self.window.pre_present_notify();
        self.gpu.queue.present(target);
        self.pace.drew(start_s, self.clock.now_s() - start_s - waited_s);
        Ok(())
    }

    fn paint(&mut self, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView, size: [u32; 2]) {
        self.renderer.draw(&self.gpu, encoder, target, size, &self.desk.camera, &self.desk.look);
        self.painter.paint(&self.gpu, encoder, target, size);
    }

    fn screenshot(&mut self) {
        let size = self.screen.size();
        self.renderer.update(&self.gpu, self.desk.view(), &self.desk.look);
        let Self { renderer, painter, gpu, desk, screen, .. } = self;
        let taken = shot::take(gpu, screen.format(), size, &desk.folder, |encoder, target| {
            renderer.draw(gpu, encoder, target, size, &desk.camera, &desk.look);
            painter.paint(gpu, encoder, target, size);
        });
        match taken {
            Ok(path) => {
                desk.tell.say("saved", json!({ "file": path }));
                desk.say(Notice::good(format!("the picture is in {}", path.display())));
            }
            Err(reason) => desk.say(Notice::bad(format!("the picture is not saved: {reason}"))),
        }
        self.is_touched = true;
    }
}
