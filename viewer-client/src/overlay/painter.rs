//! Puts egui's triangles over a finished picture; used by the window and without one.
//!
//! Two steps, because a picture may be drawn more often than its panels change: [`Painter::update`] takes what egui has
//! laid out (textures, triangles), [`Painter::paint`] draws what was last taken over a target of the given size.

use crate::gpu::Gpu;
use egui::{ClippedPrimitive, Context, FullOutput};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};

/// egui on a target of one format.
pub struct Painter {
    renderer: Renderer,
    primitives: Vec<ClippedPrimitive>,
    pixels_per_point: f32,
}

impl Painter {
    /// For targets of this format, one sample per pixel.
    #[must_use]
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        Self { renderer: Renderer::new(&gpu.device, format, options), primitives: Vec::new(), pixels_per_point: 1.0 }
    }

    /// Takes what egui has laid out; gives back what concerns the window (cursor, clipboard).
    pub fn update(&mut self, gpu: &Gpu, context: &Context, output: FullOutput) -> egui::PlatformOutput {
        let FullOutput { platform_output, mut textures_delta, shapes, pixels_per_point, .. } = output;
        for (id, deltas) in textures_delta.set.drain() {
            for delta in &deltas {
                self.renderer.update_texture(&gpu.device, &gpu.queue, id, delta);
            }
        }
        self.primitives = context.tessellate(shapes, pixels_per_point);
        self.pixels_per_point = pixels_per_point;
        for id in textures_delta.free.drain() {
            self.renderer.free_texture(&id);
        }
        platform_output
    }

    /// Draws over what is in the target.
    pub fn paint(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView, size: [u32; 2]) {
        let screen = ScreenDescriptor { size_in_pixels: size, pixels_per_point: self.pixels_per_point };
        // Without paint callbacks there are no command buffers of their own.
        self.renderer.update_buffers(&gpu.device, &gpu.queue, encoder, &self.primitives, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("overlay"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        self.renderer.render(&mut pass.forget_lifetime(), &self.primitives, &screen);
    }
}
