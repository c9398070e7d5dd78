//! Draws a view: one renderer is one file with one shader, all drawn after each other into one picture.
//!
//! 1 `shape` makes the tissue's vertices (compute, only after a new frame) · 2 everything that casts a shadow into the
//! shadow map · 3 tissue, solids, tubes, table into the picture, with four samples a pixel or one, once for each eye.
//! In steady state nothing is allocated here. Deliberately absent: egui (painted over it afterwards), the window.

mod ground;
mod look;
mod meshes;
mod props;
mod shape;
mod shared;
mod solids;
mod store;
mod targets;
mod tissue;
mod topology;
mod tubes;

pub use look::{Background, Look, Quality, Stereo};

use crate::camera::{Camera, Eye};
use crate::colour::{Legend, Scale};
use crate::feed::View;
use crate::gpu::Gpu;
use ground::Ground;
use props::Props;
use shared::{Detail, PictureOf, Shared};
use solids::Solids;
use targets::Targets;
use tissue::Tissue;
use tubes::Tubes;

/// The shaders: name and whole source, as they are compiled.
#[must_use]
pub fn shaders() -> [(&'static str, String); 5] {
    let drawn = |source: &str| [include_str!("common.wgsl"), source].concat();
    [
        ("shape", include_str!("shape.wgsl").to_owned()),
        ("tissue", drawn(tissue::SOURCE)),
        ("tubes", drawn(include_str!("tubes.wgsl"))),
        ("solids", drawn(include_str!("solids.wgsl"))),
        ("ground", drawn(include_str!("ground.wgsl"))),
    ]
}

/// Draws views.
pub struct Renderer {
    shared: Shared,
    tissue: Tissue,
    solids: Solids,
    tubes: Tubes,
    ground: Ground,
    targets: Targets,
    props: Props,
    scale: Scale,
    scaled_frame: u64,
}

impl Renderer {
    /// Makes what is needed to draw into targets of this format, sRGB or plain (then colours are gamma-encoded here).
    #[must_use]
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let shared = Shared::new(gpu, format, detail(gpu, Quality::Auto));
        Self {
            tissue: Tissue::new(gpu),
            solids: Solids::new(gpu, &shared),
            tubes: Tubes::new(gpu, &shared),
            ground: Ground::new(gpu, &shared),
            targets: Targets::default(),
            props: Props::default(),
            scale: Scale::default(),
            scaled_frame: 0,
            shared,
        }
    }

    /// Takes in what is new in a view.
    pub fn update(&mut self, gpu: &Gpu, view: &View, look: &Look) {
        let wanted = detail(gpu, look.quality);
        if wanted != self.shared.detail {
            self.shared = Shared::new(gpu, self.shared.format(), wanted);
            self.solids = Solids::new(gpu, &self.shared);
            self.tubes = Tubes::new(gpu, &self.shared);
            self.ground = Ground::new(gpu, &self.shared);
            self.targets = Targets::default();
            self.tissue.forget_pipelines();
        }
        self.tissue.update(gpu, view, look.colour, &self.shared);
        let other = self.scale.legend().is_none_or(|l| l.colour != look.colour);
        if other || self.scaled_frame != view.frames {
            self.scaled_frame = view.frames;
            self.scale.follow(look.colour, view);
        }
        self.props.lay(view, self.tissue.place());
        self.solids.update(gpu, &self.props.bodies);
        self.tubes.update(gpu, &self.props.pieces);
    }

    /// Draws what was taken in last into a target with one sample a pixel.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        size: [u32; 2],
        camera: &Camera,
        look: &Look,
    ) {
        let size = size.map(|side| side.max(1));
        let [width, height] = size.map(|side| side as f32);
        let eyes: &[(Eye, f32, f32)] = match look.stereo {
            Stereo::Off => &[(Eye::Middle, 0.0, 1.0)],
            Stereo::SideBySide => &[(Eye::Left, 0.0, 0.5), (Eye::Right, 0.5, 0.5)],
        };
        let scale_end = self.scale.legend().map_or(1.0, |l| l.end);
        for &(eye, _, share) in eyes {
            let (aspect, scene, background) = (width * share / height, self.tissue.place(), look.background);
            self.shared.write(gpu, &PictureOf { camera, eye, aspect, scene, background, scale_end });
        }
        self.tissue.shape(encoder);
        self.cast_shadows(encoder);
        self.targets.fit(gpu, self.shared.format(), self.shared.detail.samples, size);
        let mut pass = self.targets.begin(encoder, target, look.background);
        for &(eye, left, share) in eyes {
            pass.set_viewport(left * width, 0.0, (share * width).max(1.0), height, 0.0, 1.0);
            self.shared.bind(&mut pass, eye);
            // From front to back, so that little is drawn for nothing.
            self.solids.draw(&mut pass);
            self.tubes.draw(&mut pass);
            self.tissue.draw(&mut pass);
            self.ground.draw(&mut pass);
        }
    }

    fn cast_shadows(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadows"),
            depth_stencil_attachment: Some(targets::depth(self.shared.shadow_view(), wgpu::StoreOp::Store)),
            ..Default::default()
        });
        self.shared.bind_lamp(&mut pass);
        self.tissue.cast(&mut pass);
        self.solids.cast(&mut pass);
        self.tubes.cast(&mut pass);
    }

    /// What the colours mean now; nothing for the tissue's own look.
    #[must_use]
    pub fn legend(&self) -> Option<Legend> {
        self.scale.legend()
    }

    /// Triangles of the tissue as drawn, after division of coarse faces.
    #[must_use]
    pub fn triangles(&self) -> u32 {
        self.tissue.triangles()
    }

    /// Samples and shadow of a picture, for a person.
    #[must_use]
    pub fn detail(&self) -> String {
        let Detail { samples, shadow_side, .. } = self.shared.detail;
        format!("{samples} samples a pixel, shadow map of {shadow_side}")
    }

    /// What a person should know: a scene that is too large, faces that were left out.
    #[must_use]
    pub fn notice(&self) -> Option<&str> {
        self.tissue.notice()
    }
}

fn detail(gpu: &Gpu, quality: Quality) -> Detail {
    match quality {
        Quality::Full => Detail::FULL,
        Quality::Fast => Detail::FAST,
        Quality::Auto if gpu.is_software() => Detail::FAST,
        Quality::Auto => Detail::FULL,
    }
}

#[cfg(test)]
mod tests;
