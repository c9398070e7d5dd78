//! Draws the tissue: skin, liver or vessel by its own look, or coloured by a value.

use super::shape::{Shape, VERTEX};
use super::shared::{Detail, Draw, Pipelines, Place, Shared};
use crate::colour::ColourBy;
use crate::feed::View;
use crate::gpu::Gpu;
use nalgebra::Vector3;
use std::ops::Range;

/// The looks, and what draws them.
pub(super) const SOURCE: &str = concat!(include_str!("looks.wgsl"), "\n", include_str!("tissue.wgsl"));
/// `LOOK` of the shader for a value's colours.
const SCALE: u32 = 3;

/// What the buffers were made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Loaded {
    outlines: u64,
    generation: u32,
    triangles: usize,
}

/// Which program draws the tissue: the look, and whether its triangles are small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Program {
    look: u32,
    dense: bool,
}

/// The tissue.
pub(super) struct Tissue {
    shape: Shape,
    /// For the look: the outer surface, and everything else. A processor runs both sides of a branch, so what is rare has
    /// a program of its own.
    pipelines: Option<(Program, [Pipelines; 2])>,
    loaded: Option<Loaded>,
    frames: u64,
    kind: u32,
    place: Place,
    notice: Option<String>,
}

impl Tissue {
    pub(super) fn new(gpu: &Gpu) -> Self {
        Self {
            shape: Shape::new(gpu),
            pipelines: None,
            loaded: None,
            frames: 0,
            kind: 0,
            place: Place::default(),
            notice: None,
        }
    }

    /// Where the tissue was when its outline came.
    pub(super) fn place(&self) -> &Place {
        &self.place
    }

    /// Triangles that are drawn.
    pub(super) fn triangles(&self) -> u32 {
        self.shape.index_count() / 3
    }

    /// What a person should know of this scene.
    pub(super) fn notice(&self) -> Option<&str> {
        self.notice.as_deref()
    }

    /// Pipelines belong to another picture now.
    pub(super) fn forget_pipelines(&mut self) {
        self.pipelines = None;
    }

    /// Takes in what is new.
    pub(super) fn update(&mut self, gpu: &Gpu, view: &View, colour: ColourBy, shared: &Shared) {
        if view.frames == 0 {
            self.shape.clear();
            (self.loaded, self.notice) = (None, None);
        }
        if let Some(parts) = view.outline_of_frame() {
            let Detail { triangles, .. } = shared.detail;
            let generation = view.outline.header.scene_generation;
            let wanted = Loaded { outlines: view.outlines, generation, triangles };
            if self.loaded != Some(wanted) {
                self.load(gpu, &parts, view, triangles);
                (self.loaded, self.frames) = (Some(wanted), 0);
            }
            if self.frames != view.frames {
                self.frames = view.frames;
                self.shape.move_nodes(gpu, &view.frame.elements);
            }
        }
        self.shape.colour_by(gpu, colour);
        let look = if colour == ColourBy::Tissue { self.kind } else { SCALE };
        let program = Program { look, dense: self.shape.outer_count() / 3 >= shared.detail.dense };
        if self.pipelines.as_ref().is_none_or(|(made_for, _)| *made_for != program) {
            self.pipelines = Some((program, [0, 1].map(|part| pipelines(gpu, shared, program, part))));
        }
    }

    fn load(&mut self, gpu: &Gpu, parts: &protocol::scene_frame::OutlineParts<'_>, view: &View, triangles: usize) {
        self.notice = None;
        self.kind = view.outline.header.scene_kind.min(SCALE - 1);
        match self.shape.load(gpu, parts, view, triangles) {
            Ok(topology) => {
                let (low_m, high_m) = (Vector3::from(topology.low_m), Vector3::from(topology.high_m));
                self.place = Place { low_m, high_m, below_m: topology.below_m };
                if topology.left_out > 0 {
                    self.notice = Some(format!("{} faces name absent nodes and are not drawn", topology.left_out));
                }
            }
            Err(sentence) => {
                self.shape.clear();
                self.notice = Some(sentence);
            }
        }
    }

    /// Makes the vertices when something has changed.
    pub(super) fn shape(&mut self, encoder: &mut wgpu::CommandEncoder) {
        self.shape.run(encoder);
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let (outer, all) = (self.shape.outer_count(), self.shape.index_count());
        if let Some((_, [on_outer, on_rest])) = &self.pipelines {
            self.draw_with(pass, &on_outer.drawn, 0..outer);
            self.draw_with(pass, &on_rest.drawn, outer..all);
        }
    }

    pub(super) fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(pipeline) = self.pipelines.as_ref().and_then(|(_, [p, _])| p.shadow.as_ref()) {
            // What lies below an outer surface is in its shadow already; a single layer has walls of its own.
            let single = self.place.below_m > 0.0;
            let casting = if single { self.shape.index_count() } else { self.shape.outer_count() };
            self.draw_with(pass, pipeline, 0..casting);
        }
    }

    fn draw_with(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline, range: Range<u32>) {
        if range.is_empty() {
            return;
        }
        let (vertices, indices) = self.shape.buffers();
        pass.set_pipeline(pipeline);
        pass.set_vertex_buffer(0, vertices.slice(..));
        pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(range, 0, 0..1);
    }
}

fn pipelines(gpu: &Gpu, shared: &Shared, program: Program, part: u32) -> Pipelines {
    let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4];
    shared.pipelines(
        gpu,
        &Draw {
            label: "tissue",
            source: SOURCE,
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: VERTEX,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
            topology: wgpu::PrimitiveTopology::TriangleList,
            constants: &[
                ("LOOK", f64::from(program.look)),
                ("OUTER", f64::from(1 - part)),
                ("DENSE", f64::from(u8::from(program.dense))),
            ],
            casts: part == 0,
            // The far side of a body would be drawn for nothing; what is not the outer surface has two sides.
            cull: (part == 0).then_some(wgpu::Face::Back),
            // Light that falls in through a wound must not come out below.
            cull_shadow: None,
        },
    )
}
