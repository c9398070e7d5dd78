//! In steady state a picture takes nothing that stays: the graphics objects and the bytes that live after 50 pictures of a moving
//! scene are those after 200, with and without panels, and of the calls of the allocator none is the renderer's own.
//!
//! What is left are calls of wgpu and egui, given back within the picture. Their number is printed; it must not depend on
//! the number of nodes. Its own program, because it replaces the allocator.

mod allocator;
mod film;

use egui::{Context, Pos2, RawInput, Rect, Vec2};
use film::{Film, ROUND};
use std::collections::BTreeMap;
use std::process::Command;
use viewer_client::camera::{Camera, FixedView};
use viewer_client::colour::ColourBy;
use viewer_client::feed::View;
use viewer_client::gpu::{Gpu, Offscreen};
use viewer_client::headless::frame;
use viewer_client::overlay::Overlay;
use viewer_client::overlay::painter::Painter;
use viewer_client::overlay::situation::{Link, Situation};
use viewer_client::render::{Look, Renderer};
use viewer_client::samples::Samples;
use viewer_tests::adapters;
use viewer_tests::scene::Kind;

/// Pictures after which everything is as it stays, and pictures until the second look: the same picture of a round.
const SETTLED: u32 = ROUND;
const LATER: u32 = 4 * ROUND;
/// Growth that is none. A leak of one node's 28 bytes a picture would be 4,200 bytes.
const LEEWAY_BYTES: i64 = 1_000;
/// The same with panels, whose text changes: egui keeps every glyph that it has seen, and the table of them grows in leaps of
/// some thousand bytes. A leak of 110 bytes a picture would be more.
const GLYPHS_BYTES: i64 = 16_000;
/// Calls of wgpu may differ by so many from scene to scene, however many nodes there are: a tissue that is cut open takes a draw more,
/// and which container grows in which picture is a matter of chance. One call a node would be thousands.
const CHANCE_CALLS: u64 = 12;
/// More nodes by this factor, for the same number of calls.
const COPIES: u32 = 8;
/// The variable that switches off what `Backtrace::capture` does.
const OFF: &str = "RUST_LIB_BACKTRACE";
/// Small, because a processor draws it.
const SIZE: [u32; 2] = [64, 48];
/// A picture in which all panels fit, points, and its size in pixels: a processor paints it.
const ROOMY: Vec2 = Vec2::new(1280.0, 720.0);
const ROOMY_PIXELS: [u32; 2] = [320, 180];

/// Whether panels are painted.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Scene,
    Panels,
}

/// egui over a picture of its own, laid out once a picture as in the window.
struct Panels {
    context: Context,
    overlay: Overlay,
    painter: Painter,
    target: Offscreen,
    samples: Samples,
}

/// Everything that draws.
struct Rig {
    gpu: Gpu,
    renderer: Renderer,
    target: Offscreen,
    camera: Camera,
    look: Look,
    panels: Option<Panels>,
}

/// Calls of the allocator in one picture.
#[derive(Clone, Copy, Debug, Default)]
struct Calls {
    update: u64,
    draw: u64,
    panels: u64,
    submit: u64,
}

impl Rig {
    fn new(gpu: Gpu, shown: Shown, film: &mut Film) -> Self {
        let panels = (shown == Shown::Panels).then(|| Panels::new(&gpu, film));
        let (renderer, target) = (Renderer::new(&gpu, Offscreen::FORMAT), Offscreen::new(&gpu, SIZE));
        let mut camera = Camera::default();
        camera.fixed(FixedView::Surgeon);
        frame(&mut camera, film.next(), SIZE[0] as f32 / SIZE[1] as f32);
        let look = Look { colour: ColourBy::Strain, ..Look::default() };
        Self { gpu, renderer, target, camera, look, panels }
    }

    fn picture(&mut self, view: &View) -> Calls {
        let Self { gpu, renderer, target, camera, look, panels } = self;
        let start = allocator::calls();
        renderer.update(gpu, view, look);
        let updated = allocator::calls();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.draw(gpu, &mut encoder, target.view(), SIZE, camera, look);
        let drawn = allocator::calls();
        if let Some(panels) = panels {
            panels.paint(gpu, &mut encoder, camera, view);
        }
        let painted = allocator::calls();
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        let done = allocator::calls();
        Calls { update: updated - start, draw: drawn - updated, panels: painted - drawn, submit: done - painted }
    }
}

impl Panels {
    fn new(gpu: &Gpu, film: &mut Film) -> Self {
        let context = Context::default();
        context.set_zoom_factor(ROOMY_PIXELS[0] as f32 / ROOMY.x);
        let mut overlay = Overlay::new(&context);
        // The curves are full before the first picture.
        (0..1_500).for_each(|_| overlay.take(film.next()));
        let painter = Painter::new(gpu, Offscreen::FORMAT);
        Self { context, overlay, painter, target: Offscreen::new(gpu, ROOMY_PIXELS), samples: Samples::default() }
    }

    fn paint(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, camera: &Camera, view: &View) {
        let situation = Situation::seen_by(camera, ROOMY.x / ROOMY.y, Link::Live(4_000_000), &self.samples);
        self.overlay.take(view);
        let screen = Rect::from_min_size(Pos2::ZERO, ROOMY);
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let output = self.context.run_ui(input, |ui| {
            self.overlay.show(ui, view, &situation);
        });
        self.painter.update(gpu, &self.context, output);
        self.painter.paint(gpu, encoder, self.target.view(), ROOMY_PIXELS);
    }
}

/// Graphics objects by kind, as wgpu counts them, and the adapter's memory where it tells.
fn objects(gpu: &Gpu) -> Vec<(&'static str, u64)> {
    let report = gpu.instance.generate_report().expect("a native instance counts");
    let hub = report.hub_report();
    let kinds = [
        ("pipeline layouts", &hub.pipeline_layouts),
        ("shader modules", &hub.shader_modules),
        ("bind group layouts", &hub.bind_group_layouts),
        ("bind groups", &hub.bind_groups),
        ("command encoders", &hub.command_encoders),
        ("command buffers", &hub.command_buffers),
        ("render pipelines", &hub.render_pipelines),
        ("compute pipelines", &hub.compute_pipelines),
        ("buffers", &hub.buffers),
        ("textures", &hub.textures),
        ("texture views", &hub.texture_views),
        ("samplers", &hub.samplers),
        ("query sets", &hub.query_sets),
    ];
    let mut objects: Vec<(&'static str, u64)> =
        kinds.into_iter().map(|(name, kind)| (name, kind.num_kept_from_user as u64)).collect();
    if let Some(memory) = gpu.device.generate_allocator_report() {
        objects.push(("allocations", memory.allocations.len() as u64));
        objects.push(("bytes", memory.total_allocated_bytes));
    }
    objects
}

/// The middle one.
fn median(mut numbers: Vec<u64>) -> u64 {
    numbers.sort_unstable();
    numbers[numbers.len() / 2]
}

/// Draws the film; returns the middle number of calls for each part of a picture.
fn watch(gpu: Gpu, shown: Shown, film: &mut Film) -> Calls {
    let mut rig = Rig::new(gpu, shown, film);
    let mut kept = Vec::with_capacity(LATER as usize);
    let mut settled = (Vec::new(), 0);
    for number in 1..=LATER {
        let calls = rig.picture(film.next());
        kept.push(calls);
        if number == SETTLED {
            settled = (objects(&rig.gpu), 0);
            settled.1 = allocator::live_bytes();
        }
    }
    let grown = allocator::live_bytes() - settled.1;
    let (first, later) = (settled.0, objects(&rig.gpu));
    assert_eq!(first, later, "graphics objects after {SETTLED} and {LATER} pictures");
    let leeway = if shown == Shown::Panels { GLYPHS_BYTES } else { LEEWAY_BYTES };
    assert!(grown < leeway, "{grown} bytes more live after {LATER} pictures than after {SETTLED}");
    assert_eq!(rig.gpu.faults(), 0);
    let part = |of: fn(&Calls) -> u64| median(kept[SETTLED as usize..].iter().map(of).collect());
    let calls = Calls {
        update: part(|c| c.update),
        draw: part(|c| c.draw),
        panels: part(|c| c.panels),
        submit: part(|c| c.submit),
    };
    println!("{} {shown:?}: {grown} bytes grown; {calls:?}", rig.gpu.describe());
    println!("  {later:?}");
    calls
}

/// As many calls whatever the number of nodes.
fn assert_alike(few: Calls, many: Calls) {
    let parts = |c: Calls| [("update", c.update), ("draw", c.draw), ("panels", c.panels), ("submit", c.submit)];
    for ((name, few), (_, many)) in parts(few).into_iter().zip(parts(many)) {
        assert!(few.abs_diff(many) <= CHANCE_CALLS, "{name}: {few} calls, with {COPIES} times the nodes {many}");
    }
}

fn steady(shown: Shown) {
    // The first of each is warm-up of the drivers, which are loaded once.
    for gpu in adapters() {
        let backend = gpu.adapter.get_info().backend;
        let few = watch(gpu, shown, &mut Film::of(Kind::Vessel, 1));
        let again = Gpu::headless_on(backend.into()).expect("it was there");
        assert_alike(few, watch(again, shown, &mut Film::of(Kind::Vessel, COPIES)));
    }
}

/// Does the work of a test in a process of its own without `RUST_BACKTRACE`, under which an unoptimised wgpu notes the stack at
/// each of its locks.
fn by_itself(test: &str, work: impl FnOnce()) {
    if std::env::var_os(OFF).is_some_and(|value| value == "0") {
        return work();
    }
    let mut again = Command::new(std::env::current_exe().expect("a test knows its own path"));
    let done =
        again.args(["--exact", test, "--nocapture"]).env(OFF, "0").output().expect("a test can be started again");
    let said = String::from_utf8_lossy(&done.stdout);
    print!("{said}");
    assert!(done.status.success(), "{said}{}", String::from_utf8_lossy(&done.stderr));
}

#[test]
fn pictures_of_a_scene_take_nothing_that_stays() {
    by_itself("pictures_of_a_scene_take_nothing_that_stays", || steady(Shown::Scene));
}

#[test]
fn pictures_with_panels_take_nothing_that_stays() {
    by_itself("pictures_with_panels_take_nothing_that_stays", || steady(Shown::Panels));
}

#[test]
fn the_renderer_itself_never_calls_the_allocator() {
    by_itself("the_renderer_itself_never_calls_the_allocator", assert_no_call_is_ours);
}

fn assert_no_call_is_ours() {
    for gpu in adapters() {
        let backend = gpu.adapter.get_info().backend;
        let callers = callers(gpu, Shown::Scene);
        assert!(callers.keys().any(|name| name.starts_with("wgpu")), "stacks name no crate: {callers:?}");
        for ours in ["viewer_client", "protocol", "unknown"] {
            assert!(!callers.contains_key(ours), "{ours}: {:?}", callers.get(ours));
        }
        // Text of the panels is made anew for every layout, at most 30 times a second.
        self::callers(Gpu::headless_on(backend.into()).expect("it was there"), Shown::Panels);
    }
}

/// Who allocates in one settled picture.
fn callers(gpu: Gpu, shown: Shown) -> BTreeMap<&'static str, (u64, String)> {
    let mut film = Film::of(Kind::Vessel, 1);
    let mut rig = Rig::new(gpu, shown, &mut film);
    for _ in 0..SETTLED {
        rig.picture(film.next());
    }
    let view = film.next();
    let callers = allocator::callers(|| {
        rig.picture(view);
    });
    let counts: Vec<(&str, u64)> = callers.iter().map(|(name, (count, _))| (*name, *count)).collect();
    println!("{} {shown:?}: allocations in one picture: {counts:?}", rig.gpu.describe());
    callers
}
