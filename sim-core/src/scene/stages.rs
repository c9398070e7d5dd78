//! What a scene prepares at load: suture points as patches, when a pair counts as closed, and the optional stages.
//!
//! Contacts of the wound edges come first among the pair constraints, stitches and holds after them.

use crate::absent::Keep;
use crate::kinematics::coupling::DEFAULT_COUPLING;
use crate::kinematics::integrate::{KinematicsForm, literal_min_mass_kg};
use crate::kinematics::line_pull::LINE_STIFFNESS_SHARE;
use crate::kinematics::literal_tick::{MAX_SUBSTEPS, STEP_SHARE, literal_substeps};
use crate::kinematics::suture_point::SpringLaw;
use crate::tissue::constraint::{PairConstraint, PairSense, Pairs};
use crate::tissue::geodesic::neighbours_within;
use crate::tissue::model::Tissue;
use crate::tissue::network::TissueState;
use crate::tissue::patch_set::{PatchId, PatchSet};
use crate::tissue::regulation::{AttachmentSpec, Attachments};
use crate::tissue::solver::{Stages, TissueSolver};

use super::build::SceneError;
use super::plan::{AttachmentPlan, ScenePlan};
use super::stitching::{left_patch, right_patch};

/// Tick of the servo that the literal form is judged by, seconds.
const SERVO_PERIOD_S: f64 = 1e-3;

/// What stays fixed about a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PairFacts {
    /// Distance before suturing, metres.
    pub(super) open_distance_m: f64,
    /// Distance at which the wound edges touch, metres.
    pub(super) contact_m: f64,
    /// A distance at or below this is a closed gap, metres.
    pub(super) closed_m: f64,
}

/// Suture points as patches: left and right of pair `i` are patches `2i` and `2i + 1`.
pub(super) fn patch_set(tissue: &Tissue) -> Result<PatchSet, SceneError> {
    let points = tissue.pairs.iter().flat_map(|p| [&p.left.patch, &p.right.patch]);
    let patches = points.map(|p| (p.nodes.as_slice(), p.weights.as_slice()));
    Ok(PatchSet::new(tissue.network.node_count(), patches)?)
}

/// A gap is closed when the wound edges at the pair have come together: the points are then as far apart as their
/// bites, `|r − l| − |edge_r − edge_l|`, measured on the settled tissue.
pub(super) fn pair_facts(
    tissue: &Tissue,
    patches: &PatchSet,
    settled: &TissueState,
    closed_gap_m: f64,
) -> Vec<PairFacts> {
    let x = &settled.position_m;
    let facts = tissue.pairs.iter().enumerate().map(|(pair, p)| {
        let open_distance_m = (patches.mean(right_patch(pair), x) - patches.mean(left_patch(pair), x)).norm();
        let edges_m = (x[p.right_edge as usize] - x[p.left_edge as usize]).norm();
        let contact_m = (open_distance_m - edges_m).max(0.0);
        PairFacts { open_distance_m, contact_m, closed_m: contact_m + closed_gap_m }
    });
    facts.collect()
}

/// Reads the springs at the suture points as the plan says: those between a patch and anything else. Inside a patch they
/// keep its shape and stay as they are.
pub(super) fn read_springs(plan: &ScenePlan, tissue: &mut Tissue) {
    let (SpringLaw::PaperTension, Some(attachments)) = (plan.suture.spring_law, &plan.attachments) else { return };
    let mut point = vec![None; tissue.network.node_count()];
    for (index, p) in tissue.pairs.iter().flat_map(|p| [&p.left.patch, &p.right.patch]).enumerate() {
        for &node in &p.nodes {
            point[node as usize] = Some(index);
        }
    }
    tissue.network.read_as_relaxed(attachments.beta, |s| point[s.a as usize] != point[s.b as usize]);
}

/// Refuses the literal form where a tick of 1 kHz has not enough sub-steps for it. `K` is what the point feels with all
/// around it held and every link pulling.
pub(super) fn require_literal_steps(
    plan: &ScenePlan,
    solver: &TissueSolver,
    stages: &Stages,
    point_mass_kg: f64,
) -> Result<(), SceneError> {
    if plan.suture.kinematics == KinematicsForm::ImplicitDrag {
        return Ok(());
    }
    let (network, patches) = (solver.network(), solver.patches());
    let edges = &network.half_edges;
    for point in 0..patches.len() {
        let nodes = patches.nodes(PatchId(point as u32));
        let springs = nodes.iter().flat_map(|&n| edges.row(n as usize));
        let ring = springs.filter(|&e| !nodes.contains(&edges.neighbour[e])).map(|e| edges.stiffness_n_per_m[e]);
        let links = stages
            .attachments
            .as_ref()
            .map_or(0.0, |a| a.total_stiffness_n_per_m(point, network, solver.stability().substep_s()));
        let coupling = DEFAULT_COUPLING.stiffness_n_per_m * LINE_STIFFNESS_SHARE;
        let stiffness_n_per_m = ring.sum::<f64>() + links + coupling;
        let drag = nodes.iter().map(|&n| network.drag_n_s_per_m[n as usize]).sum::<f64>();
        let drag_n_s_per_m = drag + DEFAULT_COUPLING.damping_n_s_per_m * LINE_STIFFNESS_SHARE;
        let mass_kg = point_mass_kg + nodes.iter().map(|&n| network.mass_kg[n as usize]).sum::<f64>();
        if literal_substeps(stiffness_n_per_m, drag_n_s_per_m, mass_kg, SERVO_PERIOD_S).is_none() {
            let h = SERVO_PERIOD_S / f64::from(MAX_SUBSTEPS) / STEP_SHARE;
            let mass_needed_kg = literal_min_mass_kg(stiffness_n_per_m, drag_n_s_per_m, h);
            return Err(SceneError::LiteralUnstable {
                point,
                stiffness_n_per_m,
                drag_n_s_per_m,
                mass_kg,
                mass_needed_kg,
            });
        }
    }
    Ok(())
}

/// The optional stages that the plan asks for.
pub(super) fn stages(
    plan: &ScenePlan,
    tissue: &Tissue,
    patches: &PatchSet,
    settled: &TissueState,
    facts: &[PairFacts],
) -> Result<Stages, SceneError> {
    let attachments = match &plan.attachments {
        Some(a) => Keep::keep(attachments(a, tissue, patches, settled)?),
        None => None,
    };
    // Per suture pair at most its contact, its stitch and the control's hold.
    let needs_pairs = plan.line.is_some() || plan.contact_n_per_m.is_some();
    let mut pairs = needs_pairs.then(|| Pairs::with_capacity(3 * tissue.pairs.len()));
    if let Some(pairs) = &mut pairs {
        push_contacts(plan, facts, patches, pairs);
    }
    Ok(Stages { attachments, pairs, loads: None })
}

/// Edges that touch at a pair push its suture points apart: without that a pulled wound would close through itself.
pub(super) fn push_contacts(plan: &ScenePlan, facts: &[PairFacts], patches: &PatchSet, pairs: &mut Pairs) {
    let Some(stiffness_n_per_m) = plan.contact_n_per_m else { return };
    for (pair, facts) in facts.iter().enumerate() {
        let contact = PairConstraint {
            a: left_patch(pair),
            b: right_patch(pair),
            target_m: facts.contact_m,
            stiffness_n_per_m,
            max_force_n: f64::MAX,
            sense: PairSense::PushOnly,
        };
        // Patches and numbers were validated when the scene was built.
        let _ = pairs.push(patches, contact);
    }
}

/// A path along the mesh is a detour (around the wound, around the lumen) when it is longer than this many times the
/// straight distance. Lattice paths overshoot straight ones by up to 15 % on triangles and by 41 % across layers:
/// taken as `d_i⁰`, that would be slack which the tissue does not have.
const DETOUR_RATIO: f64 = 1.45;

/// `d_i⁰`, metres: the straight distance of the settled follower from the suture point, or the path around a detour
/// if that is longer. Never below the distance at rest: a follower at rest feels nothing (Eq. (1)).
fn initial_distance_m(path_m: f64, built_straight_m: f64, settled_m: f64) -> f64 {
    if path_m > DETOUR_RATIO * built_straight_m { path_m.max(settled_m) } else { settled_m }
}

/// Followers of every suture point, chosen by their distance along the mesh, each with its `d_i⁰`.
fn attachments(
    plan: &AttachmentPlan,
    tissue: &Tissue,
    patches: &PatchSet,
    settled: &TissueState,
) -> Result<Attachments, SceneError> {
    let x = &settled.position_m;
    let points = tissue.pairs.iter().flat_map(|p| [p.left.node, p.right.node]);
    let specs: Vec<AttachmentSpec> = points
        .enumerate()
        .map(|(index, node)| {
            let patch = PatchId(index as u32);
            let center = patches.mean(patch, x);
            let near = neighbours_within(&tissue.network, node, plan.radius_m, plan.distance);
            let built = &tissue.network.rest_m;
            let followers = near.into_iter().map(|(n, path_m)| {
                let built_straight_m = (built[n as usize] - built[node as usize]).norm();
                (n, initial_distance_m(path_m, built_straight_m, (x[n as usize] - center).norm()))
            });
            let followers = followers.collect();
            AttachmentSpec { patch, followers }
        })
        .collect();
    Ok(Attachments::new(&tissue.network, patches, &specs, plan.beta, plan.mode)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{build::build_tissue, presets};
    use crate::tissue::geodesic::DistanceKind;

    #[test]
    fn eq1_initial_distance_is_straight_unless_the_path_is_a_detour() {
        // 41 % more across layers is the lattice's, three times as far is a way around the wound.
        assert_eq!(initial_distance_m(14.1e-3, 10e-3, 9.8e-3), 9.8e-3);
        assert_eq!(initial_distance_m(30e-3, 10e-3, 9.8e-3), 30e-3);
        assert_eq!(initial_distance_m(15e-3, 10e-3, 16e-3), 16e-3, "a follower at rest feels nothing");
    }

    #[test]
    fn only_paths_around_the_wound_are_detours_on_the_skin() {
        let tissue = build_tissue(&presets::skin(), None).unwrap();
        let x = &tissue.network.rest_m;
        let mut detours = 0;
        for pair in &tissue.pairs {
            let (node, across) = (pair.left.node, x[pair.right.node as usize] - x[pair.left.node as usize]);
            let from = x[node as usize];
            let middle = 0.5 * across.norm_squared();
            for (n, path_m) in neighbours_within(&tissue.network, node, 20e-3, DistanceKind::Geodesic) {
                let way = x[n as usize] - from;
                if path_m > DETOUR_RATIO * way.norm() {
                    assert!(way.dot(&across) > middle, "node {n} lies on the same side of the wound");
                    detours += 1;
                }
            }
        }
        assert!(detours > 0, "some followers lie across the wound");
    }
}
