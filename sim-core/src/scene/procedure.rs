//! A procedure: scenes in a row, each until its stitches are done, any of which can be restored, left or gone back to
//! at any time (Zhang et al., §1: a wrong step can be repeated). One scene alone is a procedure of one.

use crate::tissue::triangle_mesh::TriangleMesh;
use crate::wound::control::ControlMode;
use crate::wound::ledger::LedgerRow;

use super::build::SceneError;
use super::config::SceneConfig;
use super::presets;
use super::step::{Scene, ServoInput};
use super::suturing::Stage;

/// A finished scene stays this long after the hand last held something before the next one begins: time to look and to
/// pull at a stitch, seconds.
const LINGER_S: f64 = 4.0;
/// The same once every stitch has been pulled at: time for the tissue to come to rest, seconds.
const LINGER_AFTER_PULLS_S: f64 = 1.5;

/// One scene of a procedure with its mesh, if it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSource {
    /// What the scene file says.
    pub config: SceneConfig,
    /// The mesh it names.
    pub mesh: Option<TriangleMesh>,
}

/// What a person asks of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionRequest {
    /// Reset the current scene.
    Restore,
    /// Next scene.
    Next,
    /// Previous scene.
    Previous,
    /// Tie the stitch in hand.
    Tie,
    /// Change the suture control.
    Control(ControlMode),
}

/// A row of Table 1 with the scene it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcedureRow {
    /// Code of the tissue model: 0 skin, 1 liver, 2 vessel.
    pub kind_code: u32,
    /// The row.
    pub row: LedgerRow,
}

/// The scenes and where we are in them.
#[derive(Clone, Debug)]
pub struct Procedure {
    sources: Vec<SceneSource>,
    current: usize,
    scene: Scene,
    kept: Vec<Vec<ProcedureRow>>,
    points_taken: Vec<u32>,
    control: Option<ControlMode>,
    generation: u32,
    idle_steps: u64,
    total_steps: u64,
}

impl Procedure {
    /// Loads the first scene.
    ///
    /// # Errors
    /// [`SceneError`] when there is no scene or one of them cannot be built; all are built once here, so
    /// that a later scene cannot fail in the middle of a session.
    pub fn new(sources: Vec<SceneSource>) -> Result<Self, SceneError> {
        for later in sources.iter().skip(1) {
            Scene::new(&later.config, later.mesh.as_ref())?;
        }
        let first = sources.first().ok_or(SceneError::NoScene)?;
        let scene = load(first, None)?;
        let count = sources.len();
        Ok(Self {
            sources,
            current: 0,
            scene,
            kept: vec![Vec::new(); count],
            points_taken: vec![0; count],
            control: None,
            generation: 1,
            idle_steps: 0,
            total_steps: 0,
        })
    }

    /// The paper's liver surgery: skin, liver, hepatic vessel.
    #[must_use]
    pub fn liver_surgery() -> Vec<SceneSource> {
        [presets::skin(), presets::liver(), presets::vessel()].map(|config| SceneSource { config, mesh: None }).into()
    }

    /// The scene at work.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene at work, to measure its ports.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// Index of the scene at work, and number of scenes.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.current, self.sources.len())
    }

    /// Counts loads and restores.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Steps of all scenes.
    #[must_use]
    pub fn total_steps(&self) -> u64 {
        self.total_steps
    }

    /// Suture points that the hand took, in all scenes.
    #[must_use]
    pub fn points_taken(&self) -> u32 {
        let others = self.points_taken.iter().enumerate().filter(|(i, _)| *i != self.current).map(|(_, n)| n);
        others.sum::<u32>() + self.scene.suturing().points_taken()
    }

    /// Table 1 of all scenes in order: rows of scenes that were left stay as they were then.
    pub fn rows(&self) -> impl Iterator<Item = ProcedureRow> + '_ {
        let kind_code = self.scene.kind_code();
        let live = self.scene.ledger_rows().iter().map(move |row| ProcedureRow { kind_code, row: *row });
        let before = self.kept[..self.current].iter().flatten().copied();
        let after = self.kept[self.current + 1..].iter().flatten().copied();
        before.chain(live).chain(after)
    }

    /// Whether the last scene is done.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.current + 1 == self.sources.len() && self.scene_done()
    }

    /// One step; goes on to the next scene when this one is done.
    pub fn step(&mut self, servo: Option<&ServoInput>) {
        self.scene.step(servo);
        self.total_steps += 1;
        let idle = self.scene.suturing().stage() == Stage::Done && self.scene.grips().iter().next().is_none();
        self.idle_steps = if idle { self.idle_steps + 1 } else { 0 };
        if self.current + 1 < self.sources.len() && self.scene_done() {
            // Every scene was built once in `new`: a failure here leaves the present scene at work.
            let _ = self.go_to(self.current + 1);
        }
    }

    /// Carries out a request.
    ///
    /// # Errors
    /// Why it is refused, as a sentence.
    pub fn request(&mut self, request: SessionRequest) -> Result<(), &'static str> {
        match request {
            SessionRequest::Restore => {
                self.scene.restore();
                self.generation = self.generation.wrapping_add(1);
                self.idle_steps = 0;
                Ok(())
            }
            SessionRequest::Next if self.current + 1 == self.sources.len() => Err("this is the last scene"),
            SessionRequest::Next => self.go_to(self.current + 1),
            SessionRequest::Previous if self.current == 0 => Err("this is the first scene"),
            SessionRequest::Previous => self.go_to(self.current - 1),
            SessionRequest::Tie => self.scene.tie(),
            SessionRequest::Control(mode) if self.scene.set_control_mode(mode) => {
                self.control = Some(mode);
                Ok(())
            }
            SessionRequest::Control(_) => Err("this scene has no suture control"),
        }
    }

    fn scene_done(&self) -> bool {
        let suturing = self.scene.suturing();
        let linger_s = if suturing.drags() < suturing.stitches() { LINGER_S } else { LINGER_AFTER_PULLS_S };
        self.idle_steps as f64 * self.scene.solver().params().period_s >= linger_s
    }

    fn go_to(&mut self, index: usize) -> Result<(), &'static str> {
        let scene = load(&self.sources[index], self.control).map_err(|_| "the scene cannot be loaded")?;
        let kind_code = self.scene.kind_code();
        self.kept[self.current] =
            self.scene.ledger_rows().iter().map(|row| ProcedureRow { kind_code, row: *row }).collect();
        self.points_taken[self.current] = self.scene.suturing().points_taken();
        self.kept[index].clear();
        self.scene = scene;
        self.current = index;
        self.generation = self.generation.wrapping_add(1);
        self.idle_steps = 0;
        Ok(())
    }
}

fn load(source: &SceneSource, control: Option<ControlMode>) -> Result<Scene, SceneError> {
    let mut scene = Scene::new(&source.config, source.mesh.as_ref())?;
    if let Some(mode) = control {
        // A scene without control has nothing to switch.
        scene.set_control_mode(mode);
    }
    Ok(scene)
}
