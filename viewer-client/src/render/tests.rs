//! Knot, needle, proxy and shadow taken out of a picture one by one, which no view can ask for: the comparison with a stored
//! picture would miss each of them. Scene and comparison are those of the pictures that are stored.

#[expect(dead_code, unreachable_pub, reason = "pictures are compared with each other here, and not with stored ones")]
#[path = "../../../tests/viewer/src/compare.rs"]
mod compare;
#[expect(dead_code, unreachable_pub, reason = "one scene of three")]
#[path = "../../../tests/viewer/src/scene.rs"]
mod scene;

use super::shared::PictureOf;
use super::*;
use crate::camera::FixedView;
use crate::gpu::{Offscreen, Picture};
use crate::headless::frame;
use compare::Difference;
use scene::{Detail, Kind, corners, view};
use solids::Shape;

/// Size of the stored pictures.
const SIZE: [u32; 2] = [160, 120];
const ASPECT: f32 = SIZE[0] as f32 / SIZE[1] as f32;
const LOOK: Look = Look {
    colour: crate::colour::ColourBy::Tissue,
    stereo: Stereo::Off,
    background: Background::Room,
    quality: Quality::Full,
};

/// A body's share of light of its own: a knot's ball has none, a suture point 0.25, a proxy 0.45.
const GLOW: usize = 17;

/// What is taken out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Knot,
    Needle,
    Proxy,
    Shadow,
}

/// A renderer with what it draws into.
struct Rig {
    gpu: Gpu,
    renderer: Renderer,
    target: Offscreen,
}

impl Rig {
    /// The picture, whole or without a part.
    fn picture(&mut self, view: &View, camera: &Camera, without: Option<Part>) -> Picture {
        let Self { gpu, renderer, target } = self;
        renderer.update(gpu, view, &LOOK);
        let before = renderer.props.bodies.len();
        renderer.props.bodies.retain(|(shape, body)| match without {
            Some(Part::Knot) => !(*shape == Shape::Ball && body[GLOW] == 0.0),
            Some(Part::Needle) => *shape != Shape::Needle,
            Some(Part::Proxy) => !(*shape == Shape::Ball && body[GLOW] == 0.45),
            Some(Part::Shadow) | None => true,
        });
        let is_solid = without.is_some_and(|part| part != Part::Shadow);
        assert_eq!(renderer.props.bodies.len() < before, is_solid, "{without:?} is one of the solids");
        renderer.solids.update(gpu, &renderer.props.bodies);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if without == Some(Part::Shadow) {
            unshadowed(renderer, gpu, &mut encoder, target.view(), camera);
        } else {
            renderer.draw(gpu, &mut encoder, target.view(), SIZE, camera, &LOOK);
        }
        target.read(gpu, encoder).unwrap_or_else(|e| panic!("{e}"))
    }
}

/// Draws as the renderer does, with nothing in the shadow map.
fn unshadowed(
    renderer: &mut Renderer,
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
    camera: &Camera,
) {
    let (scene, background) = (renderer.tissue.place(), LOOK.background);
    let eye = Eye::Middle;
    renderer.shared.write(gpu, &PictureOf { camera, eye, aspect: ASPECT, scene, background, scale_end: 1.0 });
    renderer.tissue.shape(encoder);
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(targets::depth(renderer.shared.shadow_view(), wgpu::StoreOp::Store)),
        ..Default::default()
    }));
    renderer.targets.fit(gpu, renderer.shared.format(), renderer.shared.detail.samples, SIZE);
    let mut pass = renderer.targets.begin(encoder, target, background);
    renderer.shared.bind(&mut pass, eye);
    renderer.solids.draw(&mut pass);
    renderer.tubes.draw(&mut pass);
    renderer.tissue.draw(&mut pass);
    renderer.ground.draw(&mut pass);
}

/// The cameras of stored pictures: of all of the tissue, and of details.
fn cameras(view: &View) -> [Camera; 4] {
    let mut afar = Camera::default();
    afar.fixed(FixedView::Surgeon);
    frame(&mut afar, view, ASPECT);
    let near = |detail| {
        let mut camera = afar.clone();
        camera.frame_all(corners(detail, view).into_iter(), ASPECT);
        camera
    };
    [afar.clone(), near(Detail::Stitch), near(Detail::Tool), near(Detail::Proxy)]
}

#[test]
fn each_small_part_that_is_missing_is_missed() {
    let Ok(gpu) = Gpu::headless() else { return println!("skipped: there is no adapter") };
    let (renderer, target) = (Renderer::new(&gpu, Offscreen::FORMAT), Offscreen::new(&gpu, SIZE));
    let mut rig = Rig { gpu, renderer, target };
    let view = view(Kind::Skin);
    let cameras = cameras(&view);
    let whole = cameras.each_ref().map(|camera| rig.picture(&view, camera, None));
    for part in [Part::Knot, Part::Needle, Part::Proxy, Part::Shadow] {
        let differences: [Difference; 4] =
            std::array::from_fn(|i| Difference::of(&whole[i], &rig.picture(&view, &cameras[i], Some(part))));
        println!("{part:?}: {differences:?}");
        assert!(
            differences.iter().any(|d| !d.is_small()),
            "without its {part:?} the picture is the same: {differences:?}"
        );
        let again = rig.picture(&view, &cameras[0], None);
        assert!(Difference::of(&whole[0], &again).is_small(), "{part:?} does not come back");
    }
}
