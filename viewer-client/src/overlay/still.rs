//! The panels without a window: laid out for one picture of a given size.

use super::Overlay;
use super::painter::Painter;
use super::situation::Situation;
use crate::feed::View;
use crate::gpu::Gpu;
use egui::{Context, Pos2, RawInput, Rect, Vec2};

/// egui measures a panel in one pass and places it in the next.
const PASSES: usize = 3;

/// Overlay and painter for pictures that nobody clicks on.
pub struct StillOverlay {
    context: Context,
    overlay: Overlay,
    painter: Painter,
}

impl StillOverlay {
    /// For targets of this format, one sample per pixel.
    #[must_use]
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let context = Context::default();
        Self { overlay: Overlay::new(&context), context, painter: Painter::new(gpu, format) }
    }

    /// The overlay, to choose what is shown.
    pub fn overlay(&mut self) -> &mut Overlay {
        &mut self.overlay
    }

    /// Takes a view into the curves without drawing: for the time before the picture.
    pub fn take(&mut self, view: &View) {
        self.overlay.take(view);
    }

    /// Draws the panels for this view over the target.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        size: [u32; 2],
        view: &View,
        situation: &Situation<'_>,
    ) {
        self.overlay.take(view);
        for _ in 0..PASSES {
            let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(size[0] as f32, size[1] as f32));
            let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
            let output = self.context.run_ui(input, |ui| {
                self.overlay.show(ui, view, situation);
            });
            self.painter.update(gpu, &self.context, output);
        }
        self.painter.paint(gpu, encoder, target, size);
    }
}
