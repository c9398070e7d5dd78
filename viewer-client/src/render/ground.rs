//! Draws the table below the tissue.

use super::shared::{Draw, Pipelines, Shared};
use crate::gpu::Gpu;

const SOURCE: &str = include_str!("ground.wgsl");

/// The table.
pub(super) struct Ground {
    pipelines: Pipelines,
}

impl Ground {
    pub(super) fn new(gpu: &Gpu, shared: &Shared) -> Self {
        let pipelines = shared.pipelines(
            gpu,
            &Draw {
                label: "table",
                source: SOURCE,
                buffers: &[],
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                constants: &[],
                casts: false,
                cull: None,
            },
        );
        Self { pipelines }
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipelines.drawn);
        pass.draw(0..4, 0..1);
    }
}
