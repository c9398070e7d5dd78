//! Draws round tubes: the suture line and the tied stitches.

use super::shared::{Draw, Pipelines, Shared};
use super::store::Store;
use crate::gpu::Gpu;

const SOURCE: &str = include_str!("tubes.wgsl");
/// Vertices of the strip around a piece: eight sides, closed.
const STRIP: u32 = 18;

/// A piece of a tube: ends with radii, directions with lengths along the line, colour (linear).
pub(super) type Piece = [f32; 20];

/// Tubes.
pub(super) struct Tubes {
    pipelines: Pipelines,
    store: Store,
    count: u32,
}

impl Tubes {
    pub(super) fn new(gpu: &Gpu, shared: &Shared) -> Self {
        let attributes = wgpu::vertex_attr_array![
            0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4, 4 => Float32x4
        ];
        let pipelines = shared.pipelines(
            gpu,
            &Draw {
                label: "tubes",
                source: SOURCE,
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Piece>() as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &attributes,
                })],
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                constants: &[],
                casts: true,
                cull: None,
                cull_shadow: None,
            },
        );
        Self { pipelines, store: Store::new(gpu, "tubes", wgpu::BufferUsages::VERTEX), count: 0 }
    }

    pub(super) fn update(&mut self, gpu: &Gpu, pieces: &[Piece]) {
        self.store.fill(gpu, bytemuck::cast_slice(pieces.as_flattened()));
        self.count = pieces.len() as u32;
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_with(pass, &self.pipelines.drawn);
    }

    pub(super) fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.pipelines.shadow.iter().for_each(|pipeline| self.draw_with(pass, pipeline));
    }

    fn draw_with(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline) {
        if self.count > 0 {
            pass.set_pipeline(pipeline);
            pass.set_vertex_buffer(0, self.store.buffer().slice(..));
            pass.draw(0..STRIP, 0..self.count);
        }
    }
}
