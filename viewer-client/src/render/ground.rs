//! Draws the table below the tissue.

use super::shared::{Draw, Pipelines, Shared};
use crate::gpu::Gpu;

const SOURCE: &str = include_str!("ground.wgsl");

/// The table.
pub(super) struct Ground {
    pipelines: Pipelines,
    cells: u32,
}

impl Ground {
    pub(super) fn new(gpu: &Gpu, shared: &Shared) -> Self {
        let cells = shared.detail.cells;
        let pipelines = shared.pipelines(
            gpu,
            &Draw {
                label: "table",
                source: SOURCE,
                buffers: &[],
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                constants: &[("CELLS", f64::from(cells))],
                casts: false,
                cull: None,
                cull_shadow: None,
            },
        );
        Self { pipelines, cells }
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipelines.drawn);
        pass.draw(0..2 * (self.cells + 1), 0..self.cells);
    }
}
