//! Draws rigid bodies: suture points, proxies, tool, needle, force arrow.

use super::meshes;
use super::shared::{Draw, Pipelines, Shared};
use super::store::Store;
use crate::gpu::Gpu;
use std::ops::Range;

const SOURCE: &str = include_str!("solids.wgsl");

/// What is drawn at a place: three rows of `scene_from_body`; colour (linear) and strength of the reflection; its
/// sharpness, share of own light, two spare numbers.
pub(super) type Body = [f32; 20];

/// The meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Ball,
    Rod,
    Cone,
    Holder,
    Needle,
}

impl Shape {
    pub(super) const ALL: [Self; 5] = [Self::Ball, Self::Rod, Self::Cone, Self::Holder, Self::Needle];
}

/// Rigid bodies.
pub(super) struct Solids {
    pipelines: Pipelines,
    vertices: Store,
    indices: Store,
    /// Indices of each shape, and its first vertex.
    ranges: [(Range<u32>, i32); 5],
    bodies: Store,
    /// Bodies of each shape, shape after shape.
    counts: [u32; 5],
    /// Reused from picture to picture.
    packed: Vec<Body>,
}

impl Solids {
    pub(super) fn new(gpu: &Gpu, shared: &Shared) -> Self {
        let body = wgpu::vertex_attr_array![
            2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4
        ];
        let pipelines = shared.pipelines(
            gpu,
            &Draw {
                label: "solids",
                source: SOURCE,
                buffers: &[
                    Some(wgpu::VertexBufferLayout {
                        array_stride: size_of::<[f32; 6]>() as u64,
                        step_mode: wgpu::VertexStepMode::Vertex,
                        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
                    }),
                    Some(wgpu::VertexBufferLayout {
                        array_stride: size_of::<Body>() as u64,
                        step_mode: wgpu::VertexStepMode::Instance,
                        attributes: &body,
                    }),
                ],
                topology: wgpu::PrimitiveTopology::TriangleList,
                constants: &[],
                casts: true,
                cull: Some(wgpu::Face::Back),
                cull_shadow: Some(wgpu::Face::Back),
            },
        );
        let mut all = meshes::Mesh::default();
        let made = [meshes::ball(), meshes::rod(), meshes::cone(), meshes::holder(), meshes::needle()];
        let ranges = made.map(|mesh| {
            let (first, vertex) = (all.indices.len() as u32, all.vertices.len() as i32);
            all.vertices.extend(mesh.vertices);
            all.indices.extend(mesh.indices);
            (first..all.indices.len() as u32, vertex)
        });
        let mut vertices = Store::new(gpu, "bodies' vertices", wgpu::BufferUsages::VERTEX);
        vertices.fill(gpu, bytemuck::cast_slice(all.vertices.as_flattened()));
        let mut indices = Store::new(gpu, "bodies' triangles", wgpu::BufferUsages::INDEX);
        indices.fill(gpu, bytemuck::cast_slice(&all.indices));
        let bodies = Store::new(gpu, "bodies", wgpu::BufferUsages::VERTEX);
        Self { pipelines, vertices, indices, ranges, bodies, counts: [0; 5], packed: Vec::new() }
    }

    pub(super) fn update(&mut self, gpu: &Gpu, bodies: &[(Shape, Body)]) {
        self.packed.clear();
        for (shape, count) in Shape::ALL.iter().zip(&mut self.counts) {
            let before = self.packed.len();
            self.packed.extend(bodies.iter().filter(|(s, _)| s == shape).map(|(_, body)| *body));
            *count = (self.packed.len() - before) as u32;
        }
        self.bodies.fill(gpu, bytemuck::cast_slice(self.packed.as_flattened()));
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_with(pass, &self.pipelines.drawn);
    }

    pub(super) fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.pipelines.shadow.iter().for_each(|pipeline| self.draw_with(pass, pipeline));
    }

    fn draw_with(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline) {
        pass.set_pipeline(pipeline);
        pass.set_vertex_buffer(0, self.vertices.buffer().slice(..));
        pass.set_index_buffer(self.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
        pass.set_vertex_buffer(1, self.bodies.buffer().slice(..));
        let mut first = 0;
        for ((range, vertex), count) in self.ranges.iter().zip(self.counts) {
            if count > 0 {
                pass.draw_indexed(range.clone(), *vertex, first..first + count);
            }
            first += count;
        }
    }
}
