//! Makes pictures of one size: adapter, renderer, camera, and the panels when they are wanted.

use crate::camera::{Camera, FixedView};
use crate::feed::View;
use crate::gpu::{Gpu, GpuError, Offscreen, Picture};
use crate::overlay::situation::{Link, Situation};
use crate::overlay::still::StillOverlay;
use crate::render::{Look, Renderer, Stereo};
use crate::samples::Samples;
use protocol::ports::monotonic_ns;

/// How much of the picture the wound takes in the surgeon's view.
const WOUND_SHARE: f32 = 0.64;

/// Everything that makes pictures of one size.
pub struct Studio {
    gpu: Gpu,
    renderer: Renderer,
    offscreen: Offscreen,
    /// Where one looks from.
    pub camera: Camera,
    /// How the pictures look.
    pub look: Look,
    framed: bool,
    panels: Option<Panels>,
}

/// Panels over the pictures.
struct Panels {
    overlay: StillOverlay,
    /// Nothing is picked in a picture that nobody clicks on.
    samples: Samples,
    origin: Origin,
}

/// What the panels say of where the views come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A running server.
    Live,
    /// A recording.
    Recorded,
}

/// Width of the columns of panels that framing leaves free, pixels.
const COLUMNS: f32 = 2.0 * 240.0;

impl Studio {
    /// Opens an adapter.
    ///
    /// # Errors
    /// [`GpuError`] when there is none.
    pub fn open(size: [u32; 2], view: FixedView, look: Look) -> Result<Self, GpuError> {
        Ok(Self::on(Gpu::headless()?, size, view, look))
    }

    /// Uses an adapter that is open.
    #[must_use]
    pub fn on(gpu: Gpu, size: [u32; 2], view: FixedView, look: Look) -> Self {
        let mut camera = Camera::default();
        camera.fixed(view);
        let renderer = Renderer::new(&gpu, Offscreen::FORMAT);
        let offscreen = Offscreen::new(&gpu, size);
        Self { gpu, renderer, offscreen, camera, look, framed: false, panels: None }
    }

    /// The adapter.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The renderer, for its legend and notice.
    #[must_use]
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Puts the panels over every picture from now on.
    pub fn show_panels(&mut self, origin: Origin) {
        let overlay = StillOverlay::new(&self.gpu, Offscreen::FORMAT);
        self.panels = Some(Panels { overlay, samples: Samples::default(), origin });
    }

    /// Takes a view into the panels' curves without drawing it.
    pub fn take(&mut self, view: &View) {
        if let Some(panels) = &mut self.panels {
            panels.overlay.take(view);
        }
    }

    /// Size of the pictures.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.offscreen.size()
    }

    /// Draws a view; the picture stays in the adapter once this is handed in.
    pub(super) fn draw(&mut self, view: &View) -> wgpu::CommandEncoder {
        let [width, height] = self.offscreen.size();
        let eyes = if self.look.stereo == Stereo::SideBySide { 2.0 } else { 1.0 };
        let aspect = |width: f32| width / (eyes * height as f32);
        if !self.framed && view.outline_of_frame().is_some() {
            let columns = if self.panels.is_some() { COLUMNS } else { 0.0 };
            frame(&mut self.camera, view, aspect((width as f32 - columns).max(0.5 * width as f32)));
            self.framed = true;
        }
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.update(&self.gpu, view, &self.look);
        let target = self.offscreen.view();
        self.renderer.draw(&self.gpu, &mut encoder, target, [width, height], &self.camera, &self.look);
        if let Some(Panels { overlay, samples, origin }) = &mut self.panels {
            let newest_ns = view.servo.as_ref().map(|servo| servo.header.time_ns);
            let link = match origin {
                Origin::Live => Link::live(monotonic_ns(), newest_ns),
                Origin::Recorded => Link::Recorded,
            };
            let mut situation = Situation::seen_by(&self.camera, aspect(width as f32), link, samples);
            situation.legend = self.renderer.legend();
            if self.look.stereo == Stereo::SideBySide {
                situation.projection = None;
            }
            overlay.draw(&self.gpu, &mut encoder, target, [width, height], view, &situation);
        }
        encoder
    }

    /// Draws a view.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`] when the device was lost.
    pub fn picture(&mut self, view: &View) -> Result<Picture, GpuError> {
        let encoder = self.draw(view);
        self.offscreen.read(&self.gpu, encoder)
    }
}

/// Frames a view: from the surgeon's side the wound with the tissue around it, otherwise the whole tissue.
pub fn frame(camera: &mut Camera, view: &View, aspect: f32) {
    let nodes = &view.frame.elements;
    let place = |node: &u32| nodes.get(*node as usize).map(|n| n.position_m);
    let parts = view.outline_of_frame();
    let wound = parts.into_iter().flat_map(|p| p.edges.iter().chain(p.pairs)).filter_map(place);
    let surgeon = {
        let mut like = camera.clone();
        like.fixed(FixedView::Surgeon);
        like == *camera
    };
    camera.frame_all(nodes.iter().map(|n| n.position_m), aspect);
    if surgeon && parts.is_some_and(|p| !p.edges.is_empty() || !p.pairs.is_empty()) {
        let whole_m = camera.distance_m();
        camera.frame_all(wound, aspect);
        let near = camera.distance_m() / WOUND_SHARE;
        camera.zoom(camera.distance_m() / near.min(whole_m));
    }
}
