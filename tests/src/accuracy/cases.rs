//! The nine smooth cases: three scenes, each with Table 2's drag, with little drag, and a hundred times stiffer.
//!
//! One suture patch is pulled 7 mm, held, and let back within 0.45 s. The way is infinitely smooth,
//! `s(u) = 1/(1 + e^{1/u − 1/(1−u)})`, so that what is measured is the integrator, not a kink in its input. No attachment,
//! stitch or contact acts. Little drag: `c/m = 100 1/s` on every node.

use super::section::Effort;
use crate::reference::Driven;
use haptic_server::cli::choice::SceneChoice;
use haptic_server::error::ServerError;
use haptic_server::scene_file;
use sim_core::scene::build::SceneError;
use sim_core::scene::config::{SceneConfig, TissueConfig};
use sim_core::scene::presets;
use sim_core::scene::procedure::SceneSource;
use sim_core::scene::step::Scene;
use sim_core::tissue::network::{NetworkError, Spring, SpringNetwork};
use sim_core::tissue::patch_set::{PatchId, PatchSet};
use sim_core::vector::Vec3;

/// End of the scenario, seconds.
pub(super) const END_S: f64 = 0.45;
/// Time between samples; every step of the ladders divides it.
pub(super) const SAMPLE_S: f64 = 0.01;
/// Way of the pulled patch, metres.
const PULL_M: f64 = 7e-3;
/// Little drag, 1/s.
const LOW_DRAG_PER_S: f64 = 100.0;
/// The stiff case.
const STIFF_FACTOR: f64 = 100.0;

/// A scene that is measured.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    /// Name of the preset, or of the file without folder and ending.
    pub(super) name: String,
    source: SceneSource,
}

impl Subject {
    /// A preset on the mesh that the effort allows.
    fn preset(name: &str, effort: Effort) -> Self {
        Self { name: name.to_owned(), source: SceneSource { config: scene_config(name, effort), mesh: None } }
    }

    /// The presets.
    pub(super) fn presets(effort: Effort) -> Vec<Self> {
        ["skin", "liver", "vessel"].map(|name| Self::preset(name, effort)).into()
    }

    /// What the command line chose; a file keeps its own mesh.
    ///
    /// # Errors
    /// 66 or 65 for a scene file that cannot be used.
    pub(super) fn chosen(choice: &SceneChoice, effort: Effort) -> Result<Self, ServerError> {
        let SceneChoice::File(path) = choice else { return Ok(Self::preset(&choice.to_string(), effort)) };
        let name = path.file_stem().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
        let subject = Self { name, source: scene_file::load(path)? };
        match subject.build() {
            Ok(_) => Ok(subject),
            Err(error) => Err(ServerError::BadData(format!("{}: {error}", path.display()))),
        }
    }

    /// The scene, built.
    pub(super) fn build(&self) -> Result<Scene, SceneError> {
        Scene::new(&self.source.config, self.source.mesh.as_ref())
    }
}

/// Drag and stiffness of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Regime {
    /// As in Table 2.
    Table2,
    /// c/m = 100 1/s.
    LowDrag,
    /// c/m = 100 1/s and every spring a hundred times stiffer.
    Stiff,
}

impl Regime {
    pub(super) const ALL: [Self; 3] = [Self::Table2, Self::LowDrag, Self::Stiff];

    /// Name in rows.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Table2 => "table2_drag",
            Self::LowDrag => "low_drag",
            Self::Stiff => "stiff_x100_low_drag",
        }
    }

    /// Name in figures.
    pub(super) const fn title(self) -> &'static str {
        match self {
            Self::Table2 => "drag of Table 2",
            Self::LowDrag => "low drag (c/m = 100 1/s)",
            Self::Stiff => "k × 100, low drag",
        }
    }
}

/// Why a case cannot be built.
#[derive(Debug, thiserror::Error)]
pub(super) enum CaseError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Springs that the references and the cases do not know.
    #[error(
        "{springs} springs at the suture points of scene {scene} pull only, which the references of this report cannot follow; \
         set suture.spring_law = \"bilateral\""
    )]
    PullsOnly {
        /// Scene.
        scene: String,
        /// How many.
        springs: usize,
    },
}

/// One case.
#[derive(Clone, Debug)]
pub(super) struct Case {
    pub(super) scene: String,
    pub(super) regime: Regime,
    pub(super) network: SpringNetwork,
    pub(super) start_m: Vec<Vec3>,
    pub(super) patches: PatchSet,
    /// The patch that is pulled.
    pub(super) patch: PatchId,
    /// Unit.
    pub(super) direction: Vec3,
    /// Solver period of the scene, seconds.
    pub(super) period_s: f64,
}

/// The second pair, near the middle of the wound; its left point is pulled. A scene of one pair has that only.
pub(super) const PULLED_PAIR: usize = 1;

/// Left point of the pair that is pulled.
pub(super) fn pulled_patch(pairs: usize) -> PatchId {
    PatchId(2 * PULLED_PAIR.min(pairs.saturating_sub(1)) as u32)
}

/// The scene of this name on the mesh that the effort allows.
pub(super) fn scene_config(name: &str, effort: Effort) -> SceneConfig {
    let mut config = match name {
        "liver" => presets::liver(),
        "vessel" => presets::vessel(),
        _ => presets::skin(),
    };
    if effort == Effort::Quick {
        match &mut config.tissue {
            TissueConfig::Utsm { spacing_mm, .. } => *spacing_mm = 3.0,
            TissueConfig::Vosm { subdivisions, .. } => *subdivisions = 2,
            TissueConfig::Ttsm { around, along, layers, .. } => (*around, *along, *layers) = (8, 12, 2),
        }
        config.suture.patch_radius_mm *= 1.3;
    }
    config
}

impl Case {
    /// All regimes of a scene.
    pub(super) fn of_scene(subject: &Subject) -> Result<Vec<Self>, CaseError> {
        let scene = subject.build()?;
        let tissue = scene.tissue();
        let springs = tissue.network.pulls_only.len();
        if springs > 0 {
            return Err(CaseError::PullsOnly { scene: subject.name.clone(), springs });
        }
        let case = |regime| {
            Ok(Self {
                scene: subject.name.clone(),
                regime,
                network: in_regime(&tissue.network, regime)?,
                start_m: scene.solver().state().position_m.clone(),
                patches: scene.solver().patches().clone(),
                patch: pulled_patch(tissue.pairs.len()),
                direction: tissue.across * 0.6 + tissue.outward * 0.8,
                period_s: scene.solver().params().period_s,
            })
        };
        Regime::ALL.into_iter().map(case).collect()
    }

    /// Displacement of the pulled patch.
    pub(super) fn way(&self, t: f64) -> Vec3 {
        self.direction * (PULL_M * pull_and_release(t))
    }

    /// Runs `act` on this case as a problem for the references.
    pub(super) fn driven<R>(&self, act: impl FnOnce(&Driven<'_>) -> R) -> R {
        let path = |t: f64| self.way(t).into();
        act(&Driven {
            network: &self.network,
            start_m: &self.start_m,
            held: self.patches.nodes(self.patch),
            path: &path,
            loads: &[],
            end_s: END_S,
            sample_s: SAMPLE_S,
        })
    }
}

fn in_regime(network: &SpringNetwork, regime: Regime) -> Result<SpringNetwork, NetworkError> {
    let (factor, drag) = match regime {
        Regime::Table2 => (1.0, network.drag_n_s_per_m.clone()),
        Regime::LowDrag => (1.0, network.mass_kg.iter().map(|m| m * LOW_DRAG_PER_S).collect()),
        Regime::Stiff => (STIFF_FACTOR, network.mass_kg.iter().map(|m| m * LOW_DRAG_PER_S).collect()),
    };
    let stiffer = |s: &Spring| Spring { stiffness_n_per_m: s.stiffness_n_per_m * factor, ..*s };
    let springs = network.springs.iter().map(stiffer).collect();
    SpringNetwork::new(network.rest_m.clone(), network.mass_kg.clone(), drag, network.fixed.clone(), springs)
}

/// 0 to 1 within 0.15 s, held for 0.1 s, back within 0.15 s, at rest for the last 0.05 s.
fn pull_and_release(t: f64) -> f64 {
    smooth(t / 0.15) - smooth((t - 0.25) / 0.15)
}

fn smooth(u: f64) -> f64 {
    if u <= 0.0 {
        0.0
    } else if u >= 1.0 {
        1.0
    } else {
        1.0 / (1.0 + (1.0 / u - 1.0 / (1.0 - u)).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_core::scene::config::SpringLawReading;

    #[test]
    fn the_way_is_smooth_there_and_back() {
        assert_eq!((pull_and_release(0.0), pull_and_release(0.2), pull_and_release(0.45)), (0.0, 1.0, 0.0));
        let steps: Vec<f64> = (0..=4500).map(|i| pull_and_release(f64::from(i) * 1e-4)).collect();
        let second = steps.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f64::max);
        assert!(second < 1e-5, "no kink: {second}");
    }

    #[test]
    fn springs_that_pull_only_are_refused() {
        let mut subject = Subject::preset("skin", Effort::Quick);
        subject.source.config.suture.spring_law = SpringLawReading::PaperTension;
        let refusal = Case::of_scene(&subject).expect_err("no reference knows such springs").to_string();
        assert!(refusal.contains("scene skin") && refusal.contains("suture.spring_law = \"bilateral\""), "{refusal}");
    }

    #[test]
    fn regimes_change_what_their_name_says() {
        for subject in Subject::presets(Effort::Quick) {
            let cases = Case::of_scene(&subject).expect("the coarse presets build");
            let k = |c: &Case| c.network.springs[0].stiffness_n_per_m;
            assert!((k(&cases[2]) / k(&cases[1]) - STIFF_FACTOR).abs() < 1e-12);
            let rate = cases[1].network.drag_n_s_per_m[0] / cases[1].network.mass_kg[0];
            assert!((rate - LOW_DRAG_PER_S).abs() < 1e-9 && (cases[0].direction.norm() - 1.0).abs() < 1e-9);
        }
    }
}
