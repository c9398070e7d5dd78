//! V2: the force in stitch 2 while a running suture of seven stitches closes a wound (Horeman et al. 2013).
//!
//! In artificial skin the force in stitch 2 fell from 3 (SD 1.2) to 1 (SD 0.3) N by the fourth stitch; the fifth to
//! seventh changed nothing. Here: the 46 × 13 mm wound of V1, stitches evenly along it, tied one after another from one
//! end. A stitch is elastic with the presets' 5 N/mm between the suture points and as long as what lets the edges meet.
//! Each stitch keeps its own length (locked); a thread that slides freely has one tension everywhere and is not this case.
//! The fall is 58 to 62 % on cells of 2.5 to 1 mm, and 51 % at 3 mm, where a suture point has too few nodes.

use super::closing::{OpenWound, StitchPatches, open_wound};
use super::v1_wound_closing::{PRE_STRAIN, spacing_m};
use super::{Finding, Outcome, Verdict};
use crate::accuracy::plot::{Axis, Panel, Series, nth_style, panels_svg};
use crate::accuracy::section::{Effort, Figure};
use sim_core::scene::presets;
use sim_core::tissue::network::{Spring, SpringFamily, SpringNetwork};

/// The wound: the longest of V1, metres.
pub const WOUND_M: [f64; 2] = [0.046, 0.013];
/// Stitches.
pub const STITCHES: usize = 7;
/// Stiffness of a tied stitch: the presets', newtons per metre.
const STITCH_N_PER_M: f64 = 5000.0;
/// Published fall of the force in stitch 2.
const FALL: f64 = 0.67;
/// Tolerance on it.
const FALL_TOLERANCE: f64 = 0.15;
/// Flat: the fall after stitch 4 is at most this share of the first force; the published words are "no influence".
const FLAT: f64 = 0.05;

/// A suture tied stitch by stitch.
#[derive(Clone, Debug)]
pub struct Run {
    /// `tension_n[n][i]`: tension of stitch `i` once stitches 0 to `n` are tied.
    pub tension_n: Vec<Vec<f64>>,
}

impl Run {
    /// Force in stitch 2 from when it is tied, after 2, 3, … stitches.
    #[must_use]
    pub fn second_n(&self) -> Vec<f64> {
        self.tension_n.iter().skip(1).map(|t| t[1]).collect()
    }
}

/// Falls of a series from its first value: to its end, and from the fourth stitch (the third value) to its end.
#[must_use]
pub fn falls(second_n: &[f64]) -> [f64; 2] {
    let (Some(first), Some(last)) = (second_n.first(), second_n.last()) else { return [f64::NAN; 2] };
    let fourth = second_n.get(2).unwrap_or(last);
    [1.0 - last / first, (fourth - last) / first]
}

/// Springs of a stitch: each node to its mirror image.
fn stitch_springs(wound: &OpenWound, stitch: &StitchPatches) -> Vec<Spring> {
    let x = &wound.statics.position_m;
    let gap_m = wound.gap_m(stitch);
    let stiffness_n_per_m = STITCH_N_PER_M / stitch.left.len().max(1) as f64;
    let mirror = |l: u32| {
        let off = |r: &&u32| (x[**r as usize].x + x[l as usize].x).abs() + (x[**r as usize].y - x[l as usize].y).abs();
        stitch.right.iter().min_by(|a, b| off(a).total_cmp(&off(b))).copied()
    };
    let spring = |(l, r): (u32, u32)| {
        let open_m = (x[r as usize] - x[l as usize]).norm();
        let rest_length_m = (open_m - gap_m).max(0.0);
        Spring { a: l, b: r, stiffness_n_per_m, rest_length_m, family: SpringFamily::Structural }
    };
    stitch.left.iter().filter_map(|l| mirror(*l).map(|r| (*l, r))).map(spring).collect()
}

/// Ties the stitches one after another in a wound of `size_m`; `None` when the sheet finds no rest.
#[must_use]
pub fn run_suture(size_m: [f64; 2], spacing_m: f64, pre_strain: f64) -> Option<Run> {
    let mut wound = open_wound(size_m, spacing_m, pre_strain, presets::SKIN.stiffness_n_per_mm * 1e3)?;
    let apart = size_m[0] / (STITCHES + 1) as f64;
    let at = |i: usize| (i as f64 - 0.5 * (STITCHES - 1) as f64) * apart;
    let stitches: Vec<Vec<Spring>> = (0..STITCHES).map(|i| stitch_springs(&wound, &wound.stitch_at(at(i)))).collect();
    let mut run = Run { tension_n: Vec::new() };
    for n in 0..STITCHES {
        let bare = wound.statics.network;
        let mut springs = bare.springs;
        springs.extend_from_slice(&stitches[n]);
        wound.statics.network =
            SpringNetwork::new(bare.rest_m, bare.mass_kg, bare.drag_n_s_per_m, bare.fixed, springs).ok()?;
        if !wound.statics.rest() {
            return None;
        }
        let x = &wound.statics.position_m;
        let pull = |s: &Spring| s.stiffness_n_per_m * ((x[s.b as usize] - x[s.a as usize]).norm() - s.rest_length_m);
        run.tension_n.push(stitches[..=n].iter().map(|s| s.iter().map(pull).sum()).collect());
    }
    Some(run)
}

pub(super) fn measure(effort: Effort) -> Outcome {
    let row = |quantity: &str, figure: f64, target: &str, verdict: Verdict, reason: String| Finding {
        case: "V2",
        quantity: quantity.to_owned(),
        figure,
        unit: "%",
        target: target.to_owned(),
        rule: "stitch 2 falls monotone by 67 ± 15 %, flat after stitch 4",
        verdict,
        reason,
    };
    let Some(run) = run_suture(WOUND_M, spacing_m(effort), PRE_STRAIN) else {
        let reason = "the sheet found no rest".to_owned();
        return Outcome { findings: vec![row("run", f64::NAN, "", Verdict::Fail, reason)], figures: Vec::new() };
    };
    let second = run.second_n();
    let [fall, late] = falls(&second);
    let falling = second.windows(2).all(|w| w[1] <= w[0]);
    let forces: Vec<String> = second.iter().map(|f| format!("{f:.3}")).collect();
    let series = format!("stitch 2 in newtons after 2, 3, … 7 stitches: {}", forces.join(", "));
    let fits = falling && (fall - FALL).abs() <= FALL_TOLERANCE;
    let level = "published: 3 to 1 N in artificial skin; the share is compared, not the level".to_owned();
    Outcome {
        findings: vec![
            row("fall of the force in stitch 2", 100.0 * fall, "67 ± 15", Verdict::of(fits), series),
            row("fall after stitch 4, of the first force", 100.0 * late, "0 to 5", Verdict::of(late <= FLAT), level),
        ],
        figures: vec![figure(&second)],
    }
}

/// Published force in stitch 2 when tied and once four are tied, newtons.
const PUBLISHED_N: [f64; 2] = [3.0, 1.0];

fn figure(second_n: &[f64]) -> Figure {
    let share = |n: usize| second_n[n] / second_n[0];
    let measured = (0..second_n.len()).map(|n| ((n + 2) as f64, share(n))).collect();
    let last = PUBLISHED_N[1] / PUBLISHED_N[0];
    let published = vec![(2.0, 1.0), (4.0, last), (7.0, last)];
    let panel = Panel {
        title: "force in stitch 2, share of its first value".to_owned(),
        x: Axis::linear("stitches tied"),
        y: Axis::linear("share of the first force").between(0.0, 1.1),
        series: vec![
            Series::new("measured", nth_style(0), measured),
            Series::new("published (Horeman 2013)", nth_style(1), published),
        ],
        levels: Vec::new(),
    };
    Figure {
        name: "v2_seven_stitches".to_owned(),
        caption: "V2. Force in the second of seven stitches while the others are tied.".to_owned(),
        svg: panels_svg("A running suture of seven stitches", &[panel], 1),
    }
}
