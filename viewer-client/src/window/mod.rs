//! The window: one event loop, one stage. Ends by a key, by its close button, or some seconds after the server is gone.

mod clock;
mod keys;
mod mouse;
mod pace;
mod screen;
mod shot;
mod stage;

use crate::camera::FixedView;
use crate::desk::Desk;
use crate::render::Look;
use crate::source::Source;
use crate::tell::Tell;
use stage::{Stage, Then};
use std::path::PathBuf;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

/// What a window begins with.
pub struct Opening {
    /// Where views come from.
    pub source: Source,
    /// How the picture looks.
    pub look: Look,
    /// From where.
    pub view: FixedView,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Where screenshots and curves go.
    pub folder: PathBuf,
    /// Whether events are told on standard output.
    pub tell: Tell,
}

/// Shows the window until it is closed.
///
/// # Errors
/// One sentence with its remedy: no display, no window, no adapter.
pub fn show(opening: Opening) -> Result<(), String> {
    let event_loop = EventLoop::new().map_err(|error| no_display(&error.to_string()))?;
    let mut app = App { opening: Some(opening), stage: None, failure: None };
    let ended = event_loop.run_app(&mut app);
    if let Some(stage) = &app.stage {
        stage.close();
    }
    match app.failure {
        Some(sentence) => Err(sentence),
        None => ended.map_err(|error| format!("the display has failed ({error}); start the viewer again")),
    }
}

/// The reason stands behind the place in winit's sources that found it.
fn no_display(error: &str) -> String {
    let reason = error.rsplit_once(": ").map_or(error, |(_, reason)| reason).trim_end_matches('.');
    format!("there is no display ({reason}); start the viewer inside a desktop session, or use --headless or --text")
}

struct App {
    opening: Option<Opening>,
    stage: Option<Stage>,
    failure: Option<String>,
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop, opening: Opening) -> Result<Stage, String> {
        let [width, height] = opening.size;
        let attributes = Window::default_attributes()
            .with_title("Suture surgery")
            .with_min_inner_size(PhysicalSize::new(320, 240))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| format!("no window can be opened ({error}); use --headless or --text"))?;
        let desk = Desk::new(opening.source, opening.look, opening.view, opening.folder, opening.tell);
        Stage::open(event_loop, Arc::new(window), desk).map_err(|error| error.to_string())
    }

    fn end(&mut self, event_loop: &ActiveEventLoop, failure: Option<String>) {
        self.failure = failure;
        event_loop.exit();
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(opening) = self.opening.take() {
            match self.open(event_loop, opening) {
                Ok(stage) => self.stage = Some(stage),
                Err(sentence) => self.end(event_loop, Some(sentence)),
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let Some(stage) = &mut self.stage else { return };
        match stage.on(&event) {
            Ok(Then::GoOn) => {}
            Ok(Then::Quit) => self.end(event_loop, None),
            Err(error) => self.end(event_loop, Some(error.to_string())),
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(stage) = &mut self.stage else { return };
        let (next, then) = stage.wake();
        if then == Then::Quit {
            self.end(event_loop, None);
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(next));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_display_is_told_without_places_in_sources() {
        let told = no_display("os error at src/mod.rs:765: neither WAYLAND_DISPLAY nor DISPLAY is set.");
        assert!(told.starts_with("there is no display (neither WAYLAND_DISPLAY nor DISPLAY is set); start"), "{told}");
    }
}
