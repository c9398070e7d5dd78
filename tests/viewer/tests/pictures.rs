//! Small pictures of every renderer against stored ones, on every adapter of this machine (Vulkan and GL), and that
//! each of them shows what it is there for.

use viewer_client::camera::FixedView;
use viewer_client::colour::ColourBy;
use viewer_client::feed::View;
use viewer_client::gpu::{Gpu, Picture};
use viewer_client::headless::Studio;
use viewer_client::render::{Background, Look, Quality, Stereo};
use viewer_tests::compare::{Difference, assert_stored};
use viewer_tests::finer::finer;
use viewer_tests::scene::{Detail, Kind, corners, view};
use viewer_tests::{SIZE, adapters, studio};

const FULL: Look =
    Look { colour: ColourBy::Tissue, stereo: Stereo::Off, background: Background::Room, quality: Quality::Full };

fn picture(studio: &mut Studio, view: &View) -> Picture {
    let picture = studio.picture(view).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(studio.gpu().faults(), 0, "the device reports a fault");
    picture
}

/// Draws a view on every adapter.
fn on_all(look: Look, view: &View, check: impl Fn(&Gpu, &Picture)) {
    for gpu in adapters() {
        let mut studio = studio(gpu, look);
        let picture = picture(&mut studio, view);
        check(studio.gpu(), &picture);
    }
}

fn stored(name: &str, look: Look, view: &View) {
    on_all(look, view, |gpu, picture| assert_stored(name, &gpu.describe(), picture));
}

#[test]
fn skin() {
    stored("skin", FULL, &view(Kind::Skin));
}

#[test]
fn liver() {
    stored("liver", FULL, &view(Kind::Liver));
}

#[test]
fn vessel() {
    stored("vessel", FULL, &view(Kind::Vessel));
}

#[test]
fn paper() {
    stored("print", Look { background: Background::Print, ..FULL }, &view(Kind::Skin));
}

#[test]
fn strain() {
    stored("strain", Look { colour: ColourBy::Strain, ..FULL }, &view(Kind::Skin));
}

#[test]
fn two_eyes() {
    stored("stereo", Look { stereo: Stereo::SideBySide, ..FULL }, &view(Kind::Vessel));
}

#[test]
fn fast() {
    for (name, kind) in [("fast", Kind::Liver), ("fast-skin", Kind::Skin), ("fast-vessel", Kind::Vessel)] {
        stored(name, Look { quality: Quality::Fast, ..FULL }, &view(kind));
    }
}

#[test]
fn fast_on_paper() {
    stored("fast-print", Look { quality: Quality::Fast, background: Background::Print, ..FULL }, &view(Kind::Skin));
}

#[test]
fn fast_with_small_triangles() {
    // Beyond 8,000 triangles of the outer surface.
    stored("fast-dense", Look { quality: Quality::Fast, ..FULL }, &finer(finer(view(Kind::Skin))));
}

/// Looks at a detail from nearby.
fn go_near(studio: &mut Studio, detail: Detail) {
    studio.camera.frame_all(corners(detail, &view(Kind::Skin)).into_iter(), SIZE[0] as f32 / SIZE[1] as f32);
}

fn stored_detail(name: &str, detail: Detail) {
    for gpu in adapters() {
        let mut studio = studio(gpu, FULL);
        picture(&mut studio, &view(Kind::Skin));
        go_near(&mut studio, detail);
        let near = picture(&mut studio, &view(Kind::Skin));
        assert_stored(name, &studio.gpu().describe(), &near);
    }
}

#[test]
fn stitch() {
    stored_detail("stitch", Detail::Stitch);
}

#[test]
fn tool() {
    stored_detail("tool", Detail::Tool);
}

#[test]
fn proxy() {
    stored_detail("proxy", Detail::Proxy);
}

/// Every part that a picture shows makes a difference beyond the tolerance of the comparison; those that no view can leave
/// out (knot, needle, proxy, shadow) are taken out beside the renderer itself.
#[test]
fn what_is_missing_is_missed() {
    type Remove = fn(&mut View);
    let remove: [(&str, Remove); 6] = [
        ("suture line and stitch", |v| v.report.iter_mut().for_each(|r| (r.line_point_count, r.row_count) = (0, 0))),
        ("tool and arrow", |v| v.servo.iter_mut().for_each(|s| s.devices[0].present = 0)),
        ("suture points", |v| {
            let pairs = 2 * std::mem::take(&mut v.outline.header.pair_count) as usize;
            let at = v.outline.elements.len() - pairs - v.outline.header.edge_count as usize;
            v.outline.elements.drain(at..at + pairs);
        }),
        ("reddened edge and bed", |v| {
            let edges = std::mem::take(&mut v.outline.header.edge_count) as usize;
            v.outline.elements.truncate(v.outline.elements.len() - edges);
        }),
        ("tissue", |v| v.frames = 0),
        ("depth of the sheet", |v| v.frame.elements.iter_mut().for_each(|n| n.position_m[2] *= 3.0)),
    ];
    // From afar, and so near that a suture point is more than a few pixels.
    let both = |studio: &mut Studio, view: &View| {
        let camera = studio.camera.clone();
        let afar = picture(studio, view);
        go_near(studio, Detail::Stitch);
        let near = picture(studio, view);
        studio.camera = camera;
        [afar, near]
    };
    for gpu in adapters() {
        let whole = view(Kind::Skin);
        let mut studio = studio(gpu, FULL);
        // The first picture sets the camera.
        picture(&mut studio, &whole);
        let before = both(&mut studio, &whole);
        for (name, remove) in remove {
            let mut less = whole.clone();
            remove(&mut less);
            (less.outlines, less.frames) = (less.outlines + 1, less.frames * 2);
            let after = both(&mut studio, &less);
            let differences = [0, 1].map(|i| Difference::of(&before[i], &after[i]));
            let missed = differences.iter().any(|d| !d.is_small());
            assert!(missed, "without its {name} the picture is the same: {differences:?}");
            // Back again, so that the next one is compared with the whole.
            let mut again = whole.clone();
            (again.outlines, again.frames) = (less.outlines + 7, 99);
            let restored = both(&mut studio, &again);
            assert!([0, 1].iter().all(|i| Difference::of(&before[*i], &restored[*i]).is_small()), "{name}");
        }
    }
}

#[test]
fn every_colour_and_background_looks_different() {
    for gpu in adapters() {
        let mut studio = studio(gpu, FULL);
        let mut pictures: Vec<(String, Picture)> = Vec::new();
        for colour in ColourBy::ALL {
            for background in [Background::Room, Background::Print] {
                studio.look = Look { colour, background, ..FULL };
                pictures.push((format!("{colour:?} {background:?}"), picture(&mut studio, &view(Kind::Skin))));
                let legend = studio.renderer().legend();
                assert_eq!(legend.map(|l| l.colour), Some(colour).filter(|c| *c != ColourBy::Tissue));
            }
        }
        for (i, (name, a)) in pictures.iter().enumerate() {
            for (other, b) in &pictures[..i] {
                // Strain, force and attachment are the same field here, each on its own scale.
                let same_field = ["Strain", "Force", "Attachment"];
                let alike =
                    same_field.iter().any(|f| name.starts_with(f)) && same_field.iter().any(|f| other.starts_with(f));
                let same_ground = name.split(' ').nth(1) == other.split(' ').nth(1);
                assert_eq!(Difference::of(a, b).is_small(), alike && same_ground, "{name} against {other}");
            }
        }
    }
}

#[test]
fn equal_input_gives_equal_pictures() {
    on_all(FULL, &view(Kind::Liver), |gpu, first| {
        let backend = gpu.adapter.get_info().backend;
        let again = Gpu::headless_on(backend.into()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(picture(&mut studio(again, FULL), &view(Kind::Liver)), *first);
    });
}

#[test]
fn whatever_is_missing_or_wrong_a_picture_comes() {
    let frame_only = View { outlines: 0, ..view(Kind::Skin) };
    let outline_only = View { frames: 0, ..view(Kind::Skin) };
    let mut no_triangles = view(Kind::Skin);
    let triangles = 3 * std::mem::take(&mut no_triangles.outline.header.triangle_count) as usize;
    no_triangles.outline.elements.drain(..triangles);
    let mut other_scene = view(Kind::Skin);
    other_scene.frame.header.scene_generation = 2;
    let mut absurd = view(Kind::Vessel);
    absurd.outline.elements[..30].fill(u32::MAX);
    absurd.outline.header.scene_kind = 77;
    let mut one_spot = view(Kind::Liver);
    one_spot.frame.elements.iter_mut().for_each(|n| n.position_m = [0.0; 3]);
    let mut far = view(Kind::Skin);
    far.frame.elements.iter_mut().for_each(|n| n.position_m = n.position_m.map(|c| c * 1.0e30));
    let views = [View::default(), frame_only, outline_only, no_triangles, other_scene, absurd, one_spot, far];
    for gpu in adapters() {
        for stereo in [Stereo::Off, Stereo::SideBySide] {
            let again = Gpu::headless_on(gpu.adapter.get_info().backend.into()).unwrap_or_else(|e| panic!("{e}"));
            let mut studio = Studio::on(again, [33, 17], FixedView::Top, Look { stereo, ..FULL });
            for view in &views {
                assert_eq!(picture(&mut studio, view).rgba.len(), 33 * 17 * 4);
            }
        }
    }
    assert!(SIZE[0] > 33);
}

#[test]
fn faces_that_name_absent_nodes_are_said() {
    let mut wrong = view(Kind::Skin);
    wrong.outline.elements[..6].fill(u32::MAX);
    for gpu in adapters() {
        let mut studio = studio(gpu, FULL);
        picture(&mut studio, &view(Kind::Skin));
        assert_eq!(studio.renderer().notice(), None);
        wrong.outlines = 5;
        picture(&mut studio, &wrong);
        assert!(studio.renderer().notice().is_some_and(|n| n.starts_with("2 faces")));
    }
}
