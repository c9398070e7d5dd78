//! The stages of a scene: what each touches, what it keeps, and which cases tell its cost.
//!
//! Items and bytes are of the scene as its preset has it, with two stitches tied and one suture point engaged.

use super::cases::{Hand, Parts};
use super::full::scene_steps::{config, sutured};
use super::proof::Absence;
use super::tick_cases::TICKS;
use haptic_server::servo::flight_recorder::TickRecord;
use haptic_server::servo_setup::TICK_RING;
use sim_core::scene::line_course::LineCourse;
use sim_core::scene::step::Scene;
use sim_core::scene::stitching::Stitching;
use sim_core::tissue::constraint::PairConstraint;
use sim_core::tissue::integrator::NodeFactors;
use sim_core::tissue::model::TissueKind;
use sim_core::tissue::network::Spring;
use sim_core::tissue::port::Port;
use sim_core::vector::Vec3;
use sim_core::wound::control::WoundControl;

/// What a node keeps: position, velocity, force, the integrator's factors, mobility.
const NODE_BYTES: usize = 3 * size_of::<Vec3>() + size_of::<NodeFactors>() + size_of::<f64>();
/// Every optional stage.
const ALL: &str = "attachments+contact+line+control";

/// One stage of one scene.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Scene.
    pub scene: &'static str,
    /// Name.
    pub name: &'static str,
    /// Whether the scene has it.
    pub present: bool,
    /// What one step touches of it.
    pub items: usize,
    /// What it keeps, bytes.
    pub bytes: usize,
    /// The case with it and the case without; the second is empty where the first is the cost.
    pub cost: [String; 2],
    /// How its absence is shown; `None` for what every scene has.
    pub absence: Option<Absence>,
}

impl Stage {
    /// The cases that its row needs.
    pub fn cases(&self) -> impl Iterator<Item = &String> {
        let absence = self.absence.iter().flat_map(|a| [&a.without, &a.bare]);
        self.cost.iter().filter(|case| self.present && !case.is_empty()).chain(absence)
    }
}

/// The stages of a scene; none where the preset cannot be built.
#[must_use]
pub fn stages(scene: &'static str, mesh: &str) -> Vec<Stage> {
    let Some(config) = config(scene, mesh, &Parts::new(ALL)) else { return Vec::new() };
    let Ok((built, _)) = sutured(&config, Hand::Away) else { return Vec::new() };
    let case = |work: &str| format!("{mesh}/{scene}/{work}");
    let parts = |parts: &str| case(&format!("full/{parts}"));
    let none = parts("none");
    let preset = |work: &str| format!("preset/{scene}/{work}");
    // The build without optional stages has no inner layers either: it can be asked for sheets only.
    let absent = built_bare(&built).then(|| Absence {
        scene,
        without: preset("full/none"),
        bare: preset("bare/none"),
        present: Vec::new(),
    });
    let silent =
        Absence { scene, without: "servo/silent".to_owned(), bare: "servo/without".to_owned(), present: Vec::new() };
    let sizes = Sizes::of(&built);
    let stage = |name, [items, bytes]: [usize; 2], cost, absence| Stage {
        scene,
        name,
        present: items > 0,
        items,
        bytes,
        cost,
        absence,
    };
    vec![
        stage("springs", sizes.springs, [case("sweep"), String::new()], None),
        stage("motion", sizes.motion, [none.clone(), case("sweep")], None),
        stage("inner layers", sizes.inner, [none.clone(), case("outer")], absent.clone()),
        stage("attachments", sizes.attachments, [parts("attachments"), none.clone()], absent.clone()),
        stage("wound contact", sizes.contacts, [parts("contact"), none.clone()], None),
        stage("suture line", sizes.line, [parts("line"), none.clone()], absent.clone()),
        stage("suture control", sizes.control, [parts("line+control"), parts("line")], absent.clone()),
        stage("sleep", sizes.sleep, [parts("sleep"), none.clone()], absent),
        stage("held point and its port", sizes.handle, [case("holding"), none.clone()], None),
        stage("recording", sizes.recording, ["servo/recording".to_owned(), "servo/silent".to_owned()], Some(silent)),
        stage("whole step", sizes.motion, [parts(ALL), String::new()], None),
    ]
}

/// Whether the build without optional stages has such a tissue.
fn built_bare(scene: &Scene) -> bool {
    bare_core::absent::INNER_LAYERS || scene.tissue().kind == TissueKind::Utsm
}

/// Items and bytes of each stage.
struct Sizes {
    springs: [usize; 2],
    motion: [usize; 2],
    inner: [usize; 2],
    attachments: [usize; 2],
    contacts: [usize; 2],
    line: [usize; 2],
    control: [usize; 2],
    sleep: [usize; 2],
    handle: [usize; 2],
    recording: [usize; 2],
}

impl Sizes {
    fn of(scene: &Scene) -> Self {
        let (network, layer, stages) = (scene.solver().network(), &scene.tissue().layer, scene.stages());
        let substeps = scene.solver().stability().substeps as usize;
        let nodes = network.node_count();
        let springs = network.springs.len();
        let is_inner = |node: u32| layer[node as usize] > 0;
        let inner_nodes = layer.iter().filter(|l| **l > 0).count();
        let inner_springs = network.springs.iter().filter(|s| is_inner(s.a) || is_inner(s.b)).count();
        let contacts = if scene.plan().contact_n_per_m.is_some() { scene.places().len() } else { 0 };
        let stitches = scene.ledger_rows().len();
        let points = scene.line().map_or(0, |l| l.polyline().len());
        let line = size_of::<LineCourse>() + size_of::<Stitching>() + points * size_of::<Vec3>();
        Self {
            springs: [springs * substeps, springs * size_of::<Spring>()],
            motion: [nodes * substeps, nodes * NODE_BYTES],
            inner: [
                (inner_nodes + inner_springs) * substeps,
                inner_nodes * NODE_BYTES + inner_springs * size_of::<Spring>(),
            ],
            attachments: stages.attachments.as_ref().map_or([0, 0], |a| [a.link_count() * substeps, a.bytes()]),
            contacts: [contacts * substeps, contacts * size_of::<PairConstraint>()],
            line: scene.line().map_or([0, 0], |_| [points + stitches, line]),
            control: scene.control_mode().map_or([0, 0], |_| [stitches, size_of::<WoundControl>()]),
            // The marks of a node that may sleep are private; its limits and its place in a tile are four numbers or less.
            sleep: scene
                .solver()
                .awake_nodes()
                .map_or([0, 0], |awake| [awake * substeps, nodes * 4 * size_of::<f64>()]),
            handle: [1, size_of::<Port>()],
            // Recording is the user's choice of a run: it is shown as it is when chosen.
            recording: [TICKS as usize, TICK_RING * size_of::<TickRecord>()],
        }
    }
}
