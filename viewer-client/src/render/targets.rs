//! Depth and samples of a picture, made anew when its size changes.

use super::look::Background;
use super::shared::{DEPTH, backdrop};
use crate::gpu::Gpu;
use wgpu::{StoreOp, TextureFormat, TextureView};

/// What a picture is drawn into before it is resolved.
#[derive(Default)]
pub(super) struct Targets {
    made: Option<Made>,
}

struct Made {
    size: [u32; 2],
    samples: u32,
    depth: TextureView,
    /// The samples; none with one a pixel.
    colour: Option<TextureView>,
    linear: bool,
}

impl Targets {
    /// Makes what is missing for a picture of this size.
    pub(super) fn fit(&mut self, gpu: &Gpu, format: TextureFormat, samples: u32, size: [u32; 2]) {
        if self.made.as_ref().is_some_and(|m| (m.size, m.samples) == (size, samples)) {
            return;
        }
        let [width, height] = size;
        let texture = |label, format| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        self.made = Some(Made {
            size,
            samples,
            depth: texture("depth", DEPTH),
            colour: (samples > 1).then(|| texture("samples", format)),
            linear: format.is_srgb(),
        });
    }

    /// Begins a picture that is all background.
    pub(super) fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        target: &TextureView,
        background: Background,
    ) -> wgpu::RenderPass<'e> {
        let made = self.made.as_ref();
        let samples = made.and_then(|m| m.colour.as_ref());
        let linear = made.is_some_and(|m| m.linear);
        let [r, g, b] = backdrop(background).map(|c| f64::from(if linear { c.powf(2.2) } else { c }));
        let attachment = wgpu::RenderPassColorAttachment {
            view: samples.unwrap_or(target),
            depth_slice: None,
            resolve_target: samples.map(|_| target),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
                store: if samples.is_some() { StoreOp::Discard } else { StoreOp::Store },
            },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(attachment)],
            depth_stencil_attachment: made.map(|m| depth(&m.depth, StoreOp::Discard)),
            ..Default::default()
        })
    }
}

/// A depth attachment that begins far away.
pub(super) fn depth(view: &TextureView, store: StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store };
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(ops), stencil_ops: None }
}
