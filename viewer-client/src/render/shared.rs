//! What all renderers share: the numbers of a picture (one set per eye), the shadow map, and how a pipeline is made.

use super::look::Background;
use crate::camera::{Camera, Eye};
use crate::colour::STOPS;
use crate::gpu::Gpu;
use nalgebra::{Matrix4, Vector3};
use wgpu::{BindGroup, BindGroupLayout, PipelineLayout, RenderPipeline, ShaderStages, TextureFormat, TextureView};

/// Depth of the picture and of the shadow map.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// In front of every shader that draws.
const COMMON: &str = include_str!("common.wgsl");
/// Numbers in a [`Globals`] block: two matrices, seven vectors, the stops.
const NUMBERS: usize = 2 * 16 + 7 * 4 + 9 * 4;
/// Towards the lamp: up, from the left, behind the wound.
const LAMP: [f32; 3] = [-0.45, 0.28, 0.85];
/// The shadow map covers the tissue and this much around it.
const LIT_RADIUS: f32 = 0.62;

/// Samples and details of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Detail {
    pub(super) samples: u32,
    pub(super) shadow_side: u32,
    pub(super) full: bool,
    /// Triangles of the tissue that are worth having.
    pub(super) triangles: usize,
    /// From so many triangles of the outer surface on, nothing is finer than its vertices.
    pub(super) dense: u32,
    /// Radius of the table, in diagonals of the tissue.
    pub(super) table: f32,
    /// Cells along a side of the table.
    pub(super) cells: u32,
}

impl Detail {
    pub(super) const FULL: Self =
        Self { samples: 4, shadow_side: 2048, full: true, triangles: 60_000, dense: u32::MAX, table: 1.72, cells: 1 };
    pub(super) const FAST: Self =
        Self { samples: 1, shadow_side: 768, full: false, triangles: 5_000, dense: 8_000, table: 1.15, cells: 24 };
}

/// Where the tissue is, for light and table.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    pub(super) low_m: Vector3<f32>,
    pub(super) high_m: Vector3<f32>,
    /// How far it reaches below its lowest node.
    pub(super) below_m: f32,
}

impl Place {
    /// Length of the diagonal; of nothing, that of a hand's breadth.
    pub(super) fn size_m(&self) -> f32 {
        let size = (self.high_m - self.low_m).norm();
        if size > 1.0e-6 { size } else { 0.08 }
    }
}

/// What an eye sees.
#[derive(Clone, Copy)]
pub(super) struct PictureOf<'p> {
    pub(super) camera: &'p Camera,
    pub(super) eye: Eye,
    pub(super) aspect: f32,
    pub(super) scene: &'p Place,
    pub(super) background: Background,
    pub(super) scale_end: f32,
}

struct EyeNumbers {
    buffer: wgpu::Buffer,
    group: BindGroup,
}

/// What all renderers share.
pub(super) struct Shared {
    drawn: PipelineLayout,
    cast: PipelineLayout,
    eyes: [EyeNumbers; 2],
    shadow_view: TextureView,
    shadow_group: BindGroup,
    format: TextureFormat,
    pub(super) detail: Detail,
}

impl Shared {
    pub(super) fn new(gpu: &Gpu, format: TextureFormat, detail: Detail) -> Self {
        let device = &gpu.device;
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let globals_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("numbers of a picture"),
            entries: &[entry(0, ShaderStages::VERTEX_FRAGMENT, uniform)],
        });
        let depth = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let shadow_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow"),
            entries: &[
                entry(0, ShaderStages::VERTEX_FRAGMENT, depth),
                entry(1, ShaderStages::VERTEX_FRAGMENT, sampler),
            ],
        });
        let layout = |label, groups: &[Option<&BindGroupLayout>]| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        let drawn = layout("drawn", &[Some(&globals_layout), Some(&shadow_layout)]);
        let cast = layout("shadow", &[Some(&globals_layout)]);
        let eyes = ["left or only eye", "right eye"].map(|label| {
            let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: 4 * NUMBERS as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &globals_layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
            });
            EyeNumbers { buffer, group }
        });
        let side = detail.shadow_side;
        let shadow_view = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("shadow map"),
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: DEPTH,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
            .create_view(&wgpu::TextureViewDescriptor::default());
        // A texel without a filter is what a processor can look up in time.
        let filter = if detail.full { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
        let compare = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: filter,
            min_filter: filter,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let shadow_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout: &shadow_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&shadow_view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&compare) },
            ],
        });
        Self { drawn, cast, eyes, shadow_view, shadow_group, format, detail }
    }

    /// Format of the pictures.
    pub(super) fn format(&self) -> TextureFormat {
        self.format
    }

    /// The target of the shadow pass.
    pub(super) fn shadow_view(&self) -> &TextureView {
        &self.shadow_view
    }

    /// Sets the numbers of an eye in a pass that draws.
    pub(super) fn bind(&self, pass: &mut wgpu::RenderPass<'_>, eye: Eye) {
        pass.set_bind_group(0, &self.eyes[usize::from(eye == Eye::Right)].group, &[]);
        pass.set_bind_group(1, &self.shadow_group, &[]);
    }

    /// Sets the numbers in the shadow pass.
    pub(super) fn bind_lamp(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(0, &self.eyes[0].group, &[]);
    }

    /// Writes the numbers of an eye's picture.
    pub(super) fn write(&self, gpu: &Gpu, picture: &PictureOf<'_>) {
        let PictureOf { camera, eye, aspect, scene, background, scale_end } = *picture;
        let size = scene.size_m();
        let table_m = scene.low_m.z - scene.below_m - 0.004 * size;
        let gamma = if self.format.is_srgb() { 0.0 } else { 1.0 };
        let lamp = Vector3::from(LAMP).normalize();
        let (table, behind, sky) = match background {
            Background::Room => ([0.022, 0.082, 0.078, 1.0], backdrop(background), 1.0),
            Background::Print => ([0.80, 0.80, 0.79, 0.0], backdrop(background), 1.25),
        };
        let with = |v: Vector3<f32>, w: f32| [v.x, v.y, v.z, w];
        let [r, g, b] = behind.map(|c| c.powf(2.2));
        // What bends towards 1 is straightened again, so that the table fades into exactly the background.
        let over = |c: f32| {
            let bent = (c - 0.7) / 0.3;
            if self.detail.full { 0.3 * bent / (1.0 - bent).max(1.0e-3) } else { 1.0 - (1.0 - bent).max(0.0).cbrt() }
        };
        let bright = |c: f32| if c > 0.7 { 0.7 + over(c) } else { c };
        let mut numbers = [0.0; NUMBERS];
        let vectors = [
            with(camera.eye_m(eye).coords, gamma),
            with(lamp, 0.86),
            with(scene.low_m, table_m),
            with(scene.high_m, 1.0 / self.detail.shadow_side as f32),
            [bright(r), bright(g), bright(b), self.detail.table * size],
            table,
            [scale_end, 0.0, 0.0, sky],
        ];
        let matrices = [camera.eye_view_projection(aspect, eye), light_from_scene(scene, lamp)];
        let stops = STOPS.map(|[r, g, b]| [r, g, b, 1.0]);
        let all =
            matrices.iter().flat_map(|m| m.as_slice()).chain(vectors.iter().flatten()).chain(stops.iter().flatten());
        numbers.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
        let buffer = &self.eyes[usize::from(eye == Eye::Right)].buffer;
        gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&numbers));
    }

    /// Makes the pipelines of a renderer.
    pub(super) fn pipelines(&self, gpu: &Gpu, draw: &Draw<'_>) -> Pipelines {
        let source = [COMMON, draw.source].concat();
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(draw.label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let mut constants = vec![("FULL", f64::from(u8::from(self.detail.full)))];
        constants.extend(draw.constants);
        let options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let make = |layout, entry, cull_mode, samples, bias, fragment| {
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(draw.label),
                layout: Some(layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: options.clone(),
                    buffers: draw.buffers,
                },
                primitive: wgpu::PrimitiveState { topology: draw.topology, cull_mode, ..Default::default() },
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::LessEqual),
                    stencil: wgpu::StencilState::default(),
                    bias,
                }),
                multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
                fragment,
                multiview_mask: None,
                cache: None,
            })
        };
        let targets = [Some(self.format.into())];
        let fragment = wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: options.clone(),
            targets: &targets,
        };
        let none = wgpu::DepthBiasState::default();
        let away = wgpu::DepthBiasState { constant: 2, slope_scale: 2.0, clamp: 0.0 };
        Pipelines {
            drawn: make(&self.drawn, "vertex", draw.cull, self.detail.samples, none, Some(fragment)),
            shadow: draw.casts.then(|| make(&self.cast, "shadow", draw.cull_shadow, 1, away, None)),
        }
    }
}

/// What is where nothing is drawn, as a screen takes it.
pub(super) fn backdrop(background: Background) -> [f32; 3] {
    match background {
        Background::Room => [0.045, 0.065, 0.075],
        Background::Print => [0.975, 0.975, 0.97],
    }
}

/// How a renderer draws.
pub(super) struct Draw<'d> {
    pub(super) label: &'d str,
    pub(super) source: &'d str,
    pub(super) buffers: &'d [Option<wgpu::VertexBufferLayout<'d>>],
    pub(super) topology: wgpu::PrimitiveTopology,
    pub(super) constants: &'d [(&'d str, f64)],
    pub(super) casts: bool,
    /// Which side of a face is left out.
    pub(super) cull: Option<wgpu::Face>,
    /// The same, seen from the lamp.
    pub(super) cull_shadow: Option<wgpu::Face>,
}

/// Pipelines of one renderer.
pub(super) struct Pipelines {
    pub(super) drawn: RenderPipeline,
    pub(super) shadow: Option<RenderPipeline>,
}

/// Scene to the lamp's view: a box around the tissue, deep enough for what is held over it.
fn light_from_scene(scene: &Place, lamp: Vector3<f32>) -> Matrix4<f32> {
    let middle = 0.5 * (scene.low_m + scene.high_m);
    let radius = LIT_RADIUS * scene.size_m();
    let right = Vector3::z().cross(&lamp).normalize();
    let up = lamp.cross(&right);
    let row = |axis: Vector3<f32>, scale: f32, shift: f32| {
        let a = axis * scale;
        [a.x, a.y, a.z, shift - a.dot(&middle)]
    };
    let deep = 2.0 * radius;
    let [x, y, z] = [row(right, 1.0 / radius, 0.0), row(up, 1.0 / radius, 0.0), row(-lamp, 0.5 / deep, 0.5)];
    Matrix4::from_row_slice([x, y, z, [0.0, 0.0, 0.0, 1.0]].as_flattened())
}
