//! Makes the tissue's vertices on the graphics adapter: one upload of the nodes per frame, everything else per outline.

use super::store::{Room, Store};
use super::topology::Topology;
use crate::colour::ColourBy;
use crate::feed::View;
use crate::gpu::Gpu;
use protocol::scene_frame::{FrameNode, OutlineParts};
use wgpu::{BufferUsages, ComputePipeline};

const SOURCE: &str = include_str!("shape.wgsl");
/// Bytes of a node as `shape.wgsl` reads it.
const NODE: usize = 28;
/// Bytes of a vertex.
pub(super) const VERTEX: u64 = 64;
/// Threads of a work group.
const GROUP: u32 = 64;
/// Groups side by side; more go into rows.
const GROUPS_PER_ROW: u32 = 32_768;

/// Names of the passes, in order.
const PASSES: [&str; 3] = ["at_nodes", "on_faces", "below_others"];

/// Buffers and passes.
pub(super) struct Shape {
    layout: wgpu::BindGroupLayout,
    passes: [ComputePipeline; 3],
    counts: Store,
    nodes: Store,
    rest: Store,
    plain: Store,
    faces: Store,
    made: Store,
    vertices: Store,
    indices: Store,
    group: Option<wgpu::BindGroup>,
    /// Vertices of each pass.
    sizes: [u32; 3],
    node_count: usize,
    index_count: u32,
    outer_count: u32,
    colour: ColourBy,
    rest_due: bool,
    due: bool,
}

impl Shape {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("shape"),
            source: wgpu::ShaderSource::Wgsl(SOURCE.into()),
        });
        let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match binding {
                    0 => wgpu::BufferBindingType::Uniform,
                    _ => wgpu::BufferBindingType::Storage { read_only: binding != 6 },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shape"),
            entries: &[0, 1, 2, 3, 4, 5, 6].map(entry),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("shape"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let passes = PASSES.map(|name| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(name),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        let store = |label, usage| Store::new(gpu, label, usage);
        Self {
            layout,
            passes,
            counts: store("counts", BufferUsages::UNIFORM),
            nodes: store("nodes", BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            rest: store("nodes at rest", BufferUsages::STORAGE),
            plain: store("vertices at nodes", BufferUsages::STORAGE),
            faces: store("faces of vertices", BufferUsages::STORAGE),
            made: store("vertices between nodes", BufferUsages::STORAGE),
            vertices: store("vertices", BufferUsages::STORAGE | BufferUsages::VERTEX),
            indices: store("triangles", BufferUsages::INDEX),
            group: None,
            sizes: [0; 3],
            node_count: 0,
            index_count: 0,
            outer_count: 0,
            colour: ColourBy::Tissue,
            rest_due: false,
            due: false,
        }
    }

    /// Triangles to draw, as indices.
    pub(super) fn index_count(&self) -> u32 {
        self.index_count
    }

    /// How many of them, in front, are the outer surface's.
    pub(super) fn outer_count(&self) -> u32 {
        self.outer_count.min(self.index_count)
    }

    /// Vertices and triangles.
    pub(super) fn buffers(&self) -> (&wgpu::Buffer, &wgpu::Buffer) {
        (self.vertices.buffer(), self.indices.buffer())
    }

    /// Takes in an outline with the frame that belongs to it.
    ///
    /// # Errors
    /// One sentence when the adapter has no room for it; nothing is drawn then.
    pub(super) fn load(
        &mut self,
        gpu: &Gpu,
        parts: &OutlineParts<'_>,
        view: &View,
        triangles: usize,
    ) -> Result<Topology, String> {
        self.index_count = 0;
        let nodes = &view.frame.elements;
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let bytes = |t: &Topology| {
            let of = |count: usize, size: u64| count as u64 * size;
            let largest = of(t.vertices(), VERTEX).max(of(t.faces.len(), 8)).max(of(t.made.len(), 32));
            largest.max(of(t.indices.len(), 4)).max(of(nodes.len(), NODE as u64))
        };
        let topology = Topology::build(parts, nodes, view.outline.header.scene_kind, triangles);
        let needed = bytes(&topology);
        if needed > most {
            return Err(format!(
                "this scene of {} nodes needs a buffer of {} MiB and {} has at most {} MiB; choose a coarser scene",
                nodes.len(),
                needed >> 20,
                gpu.describe(),
                most >> 20
            ));
        }
        self.plain.fill(gpu, bytemuck::cast_slice(&topology.plain));
        self.faces.fill(gpu, bytemuck::cast_slice(&topology.faces));
        self.made.fill(gpu, bytemuck::cast_slice(&topology.made));
        self.indices.fill(gpu, bytemuck::cast_slice(&topology.indices));
        self.vertices.reserve(gpu, topology.vertices() as u64 * VERTEX);
        let node_bytes = (nodes.len() * NODE) as u64;
        self.nodes.reserve(gpu, node_bytes);
        self.rest.reserve(gpu, node_bytes);
        let buffers = [&self.counts, &self.nodes, &self.rest, &self.plain, &self.faces, &self.made, &self.vertices];
        let entries: [_; 7] = std::array::from_fn(|i| wgpu::BindGroupEntry {
            binding: i as u32,
            resource: buffers[i].buffer().as_entire_binding(),
        });
        self.group = Some(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shape"),
            layout: &self.layout,
            entries: &entries,
        }));
        self.sizes = [topology.plain.len() as u32, topology.curved, topology.made.len() as u32 - topology.curved];
        (self.node_count, self.index_count, self.rest_due) = (nodes.len(), topology.indices.len() as u32, true);
        self.outer_count = topology.outer;
        self.count(gpu);
        Ok(topology)
    }

    /// Takes in the nodes of a frame: one copy into the adapter's staging memory.
    pub(super) fn move_nodes(&mut self, gpu: &Gpu, nodes: &[FrameNode]) {
        let size = wgpu::BufferSize::new((nodes.len() * NODE) as u64);
        if let (Some(size), true) = (size, nodes.len() == self.node_count)
            && let Some(mut sink) = gpu.queue.write_buffer_with(self.nodes.buffer(), 0, size)
        {
            sink.slice(..).into_chunks::<NODE>().0.write_iter(nodes.iter().map(packed));
            self.due = true;
        }
    }

    /// Chooses what the vertices' value is.
    pub(super) fn colour_by(&mut self, gpu: &Gpu, colour: ColourBy) {
        if self.colour != colour {
            self.colour = colour;
            self.count(gpu);
        }
    }

    /// Draws nothing until the next outline.
    pub(super) fn clear(&mut self) {
        self.index_count = 0;
    }

    /// Makes the vertices when something has changed.
    pub(super) fn run(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let Some(group) = self.group.as_ref().filter(|_| self.due && self.index_count > 0) else { return };
        if std::mem::take(&mut self.rest_due) {
            let bytes = (self.node_count * NODE) as u64;
            encoder.copy_buffer_to_buffer(self.nodes.buffer(), 0, self.rest.buffer(), 0, bytes);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, group, &[]);
        for (pipeline, size) in self.passes.iter().zip(self.sizes) {
            let groups = size.div_ceil(GROUP);
            if groups > 0 {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(groups.min(GROUPS_PER_ROW), groups.div_ceil(GROUPS_PER_ROW), 1);
            }
        }
        self.due = false;
    }

    fn count(&mut self, gpu: &Gpu) {
        let [plain, curved, below] = self.sizes;
        let counts = [plain, curved, below, self.colour.code()];
        if self.counts.fill(gpu, bytemuck::cast_slice(&counts)) == Room::Same {
            self.due = true;
        }
    }
}

/// A node as `shape.wgsl` reads it.
fn packed(node: &FrameNode) -> [u8; NODE] {
    let [x, y, z] = node.position_m.map(f32::to_bits);
    let words =
        [x, y, z, node.attachment_force_n.to_bits(), node.spring_force_n.to_bits(), node.strain.to_bits(), node.flags];
    let mut bytes = [0; NODE];
    bytes.as_chunks_mut::<4>().0.iter_mut().zip(words).for_each(|(to, word)| *to = word.to_le_bytes());
    bytes
}
