//! A procedure: scenes in a row, each until its stitches are done, any of which can be restored, left or gone back to
//! at any time (Zhang et al., §1: a wrong step can be repeated). One scene alone is a procedure of one.

use crate::tissue::crew::Crew;
use crate::tissue::triangle_mesh::TriangleMesh;
use crate::wound::control::ControlMode;
use crate::wound::ledger::LedgerRow;

use std::sync::Arc;

use super::build::SceneError;
use super::config::SceneConfig;
use super::presets;
use super::step::{ResumeError, Scene, ServoInput};
use super::stitching::TiedStitch;
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
    /// Begin the whole procedure anew.
    Start,
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

/// Where a procedure stood when another solver left it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProcedureStanding {
    /// Index of the scene at work.
    pub scene: usize,
    /// The generation to go on with.
    pub generation: u32,
    /// Control mode of that scene, if it is known.
    pub control: Option<ControlMode>,
    /// Tied stitches in the order of tying, each with the index of its scene.
    pub stitches: Vec<(usize, TiedStitch)>,
}

/// A row of Table 1 with the scene it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcedureRow {
    /// Index of the scene.
    pub scene: usize,
    /// Code of the tissue model: 0 skin, 1 liver, 2 vessel.
    pub kind_code: u32,
    /// The row.
    pub row: LedgerRow,
}

/// The scenes and where we are in them. All are built at load, so that going to another one takes no time.
#[derive(Clone, Debug)]
pub struct Procedure {
    scenes: Vec<Scene>,
    current: usize,
    control: Option<ControlMode>,
    generation: u32,
    idle_steps: u64,
    total_steps: u64,
}

impl Procedure {
    /// Builds every scene and begins with the first.
    ///
    /// # Errors
    /// [`SceneError`] when there is no scene or one of them cannot be built.
    pub fn new(sources: &[SceneSource]) -> Result<Self, SceneError> {
        if sources.is_empty() {
            return Err(SceneError::NoScene);
        }
        let scenes: Result<Vec<Scene>, SceneError> =
            sources.iter().map(|s| Scene::new(&s.config, s.mesh.as_ref())).collect();
        Ok(Self { scenes: scenes?, current: 0, control: None, generation: 1, idle_steps: 0, total_steps: 0 })
    }

    /// The most hands that a scene asks for; `None` where no sweep is divided.
    #[must_use]
    pub fn threads(&self) -> Option<u32> {
        self.scenes.iter().filter_map(Scene::threads).max()
    }

    /// Gives the work on the springs to a crew, in the scenes that ask for one. No result changes by a bit.
    pub fn share(&mut self, crew: &Arc<dyn Crew>) {
        self.scenes.iter_mut().for_each(|scene| scene.share(crew));
    }

    /// The paper's liver surgery: skin, liver, hepatic vessel.
    #[must_use]
    pub fn liver_surgery() -> Vec<SceneSource> {
        [presets::skin(), presets::liver(), presets::vessel()].map(|config| SceneSource { config, mesh: None }).into()
    }

    /// The scene at work.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scenes[self.current]
    }

    /// The scene at work, to measure its ports.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scenes[self.current]
    }

    /// Index of the scene at work, and number of scenes.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.current, self.scenes.len())
    }

    /// Counts scene changes and restores.
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
        self.scenes.iter().map(|s| s.suturing().points_taken()).sum()
    }

    /// Presses that took something, in all scenes.
    #[must_use]
    pub fn grips_used(&self) -> u32 {
        self.scenes.iter().map(|s| s.suturing().grips_used()).sum()
    }

    /// Table 1 of all scenes in order: a scene that was left stays as it was then.
    pub fn rows(&self) -> impl Iterator<Item = ProcedureRow> + '_ {
        self.scenes.iter().enumerate().flat_map(|(index, scene)| {
            let kind_code = scene.kind_code();
            scene.ledger_rows().iter().map(move |row| ProcedureRow { scene: index, kind_code, row: *row })
        })
    }

    /// Whether the last scene is done.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.current + 1 == self.scenes.len() && self.scene_done()
    }

    /// One step; goes on to the next scene when this one is done.
    pub fn step(&mut self, servo: Option<&ServoInput>) {
        let scene = &mut self.scenes[self.current];
        scene.step(servo);
        self.total_steps += 1;
        let idle = scene.suturing().stage() == Stage::Done && scene.grips().iter().next().is_none();
        self.idle_steps = if idle { self.idle_steps + 1 } else { 0 };
        if self.current + 1 < self.scenes.len() && self.scene_done() {
            self.go_to(self.current + 1);
        }
    }

    /// Carries out a request.
    ///
    /// # Errors
    /// Why it is refused, as a sentence.
    pub fn request(&mut self, request: SessionRequest) -> Result<(), &'static str> {
        match request {
            SessionRequest::Start => {
                self.scenes.iter_mut().for_each(Scene::restore);
                self.go_to(0);
            }
            SessionRequest::Restore => self.go_to(self.current),
            SessionRequest::Next if self.current + 1 == self.scenes.len() => return Err("this is the last scene"),
            SessionRequest::Next => self.go_to(self.current + 1),
            SessionRequest::Previous if self.current == 0 => return Err("this is the first scene"),
            SessionRequest::Previous => self.go_to(self.current - 1),
            SessionRequest::Tie => self.scene_mut().tie()?,
            SessionRequest::Control(mode) if self.scene_mut().set_control_mode(mode) => self.control = Some(mode),
            SessionRequest::Control(_) => return Err("this scene has no suture control"),
        }
        Ok(())
    }

    /// Goes on where another solver stood: every stitch is tied again, the tissue at rest with it.
    ///
    /// # Errors
    /// [`ResumeError`] when that cannot have been this procedure; nothing has changed then.
    pub fn resume(&mut self, standing: &ProcedureStanding) -> Result<(), ResumeError> {
        let count = self.scenes.len();
        let known = |scene: usize| if scene < count { Ok(scene) } else { Err(ResumeError::Scene { scene, count }) };
        let current = known(standing.scene)?;
        let mut tied = vec![Vec::new(); count];
        for (scene, stitch) in &standing.stitches {
            tied[known(*scene)?].push(*stitch);
        }
        for (scene, stitches) in self.scenes.iter().zip(&tied) {
            scene.check_stitches(stitches)?;
        }
        for (scene, stitches) in self.scenes.iter_mut().zip(&tied) {
            scene.resume(stitches)?;
        }
        self.current = current;
        self.generation = standing.generation;
        // A scene without control says nothing about what was chosen for the others.
        self.control = standing.control.filter(|mode| self.scenes[current].set_control_mode(*mode));
        Ok(())
    }

    fn scene_done(&self) -> bool {
        let suturing = self.scene().suturing();
        let linger_s = if suturing.drags() < suturing.stitches() { LINGER_S } else { LINGER_AFTER_PULLS_S };
        self.idle_steps as f64 * self.scene().solver().params().period_s >= linger_s
    }

    /// Begins a scene from its start; the one that is left lets go of the hand and keeps its ledger.
    fn go_to(&mut self, index: usize) {
        self.scenes[self.current].let_go();
        let scene = &mut self.scenes[index];
        scene.restore();
        if let Some(mode) = self.control {
            // A scene without control has nothing to switch.
            scene.set_control_mode(mode);
        }
        self.current = index;
        self.generation = self.generation.wrapping_add(1);
        self.idle_steps = 0;
    }
}
