//! A synthetic surgeon: sutures by eye, stitch after stitch, then tugs at every stitch once.
//!
//! ```text
//! Look → Approach (above the point) → Descend → Press ─ left taken ──▶ Hold ──────────────┐
//!   ▲                                             ├──── line taken ──▶ Pull ⇄ Settle ─────┤
//!   │                                             └─ all tied ──▶ Tug → TugHold ──────────┤
//!   └──── Lift ◀──────────────────────── LetGo ◀── time out, stage lost ──────────────────┘
//! ```
//! It knows what [`HandView`] shows and nothing else: the point to take, the normal, the gap. Strokes are minimum-jerk, the pull
//! goes up along the normal and a bit towards the left point until the gap is closed with a margin. Every act that waits has
//! a time-out and leads back to Look, so that a lost port, a missed point or a restored scene only costs time. A new
//! scene generation begins anew. Deterministic, no heap, metres and seconds, scene frame.
//! Deliberately absent: tremor, fatigue, learning.

use crate::device::HandView;
use crate::hand::motion::{Pull, PullBounds, Pulling, limit_step, minimum_jerk, stroke_duration_s};
use crate::hand::{BUTTON_1, Hand, HandTarget};
use sim_core::vector::Vec3;

/// A jump of the seen target beyond this starts a stroke anew, metres.
const TARGET_JUMP_M: f64 = 2e-3;
/// A stroke has arrived this near its goal, metres.
const ARRIVED_M: f64 = 3e-4;

/// How the synthetic surgeon works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SyntheticHandParams {
    /// Peak speed of a stroke, metres per second.
    pub stroke_speed_m_per_s: f64,
    /// No motion is faster, metres per second.
    pub speed_limit_m_per_s: f64,
    /// Height above a point from which it is approached, metres.
    pub hover_m: f64,
    /// Shortest press, seconds.
    pub press_s: f64,
    /// A press without success is given up after this, seconds.
    pub press_timeout_s: f64,
    /// How long a taken point is held and a closed gap is watched before letting go, seconds.
    pub hold_s: f64,
    /// Pause after letting go, seconds.
    pub pause_s: f64,
    /// Bounds of the pull; each retry pulls a quarter further.
    pub pull: PullBounds,
    /// Lean of the pull towards the left point, per unit of the way up.
    pub pull_lean: f64,
    /// A pull that does not close the gap is given up after this, seconds.
    pub pull_timeout_s: f64,
    /// The gap must be below its closed size by this, metres.
    pub close_margin_m: f64,
    /// Way of a tug at a tied stitch, away from the wound, metres; 0: no tugs.
    pub tug_m: f64,
    /// How long a tug is held, seconds.
    pub tug_hold_s: f64,
    /// How far the hand retracts when all is done, metres.
    pub rest_height_m: f64,
}

impl Default for SyntheticHandParams {
    fn default() -> Self {
        Self {
            stroke_speed_m_per_s: 0.1,
            speed_limit_m_per_s: 0.12,
            hover_m: 0.015,
            press_s: 0.15,
            press_timeout_s: 1.0,
            hold_s: 0.2,
            pause_s: 0.2,
            pull: PullBounds { way_m: 0.055, speed_m_per_s: 0.03, acceleration_m_per_s2: 0.3 },
            pull_lean: 0.5,
            pull_timeout_s: 8.0,
            close_margin_m: 1.5e-4,
            tug_m: 0.004,
            tug_hold_s: 0.5,
            rest_height_m: 0.03,
        }
    }
}

/// What the hand is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Act {
    Look,
    Approach,
    Descend,
    Press,
    Hold,
    Pull,
    Settle,
    Tug,
    TugHold,
    LetGo,
    Lift,
    Rest,
}

/// The synthetic surgeon.
#[derive(Clone, Debug)]
pub struct SyntheticHand {
    params: SyntheticHandParams,
    last_s: Option<f64>,
    position_m: Vec3,
    generation: Option<u32>,
    act: Act,
    act_start_s: f64,
    /// Where the act began.
    from_m: Vec3,
    /// Goal of the last tick, to see it jump.
    goal_m: Vec3,
    /// Planned length of a stroke.
    stroke_s: f64,
    /// Stage when the button went down.
    pressed_stage: u32,
    /// Where the button went down, with the axes seen there.
    grip: Grip,
    pull: Pull,
    pull_start_s: f64,
    failed_attempts: u32,
    stitches: u32,
    tugs: u32,
}

#[derive(Clone, Copy, Debug)]
struct Grip {
    point_m: Vec3,
    normal: Vec3,
    across: Vec3,
}

impl SyntheticHand {
    /// A hand that waits at `home_m` until it sees something.
    #[must_use]
    pub fn new(params: SyntheticHandParams, home_m: Vec3) -> Self {
        Self {
            params,
            last_s: None,
            position_m: home_m,
            generation: None,
            act: Act::Look,
            act_start_s: 0.0,
            from_m: home_m,
            goal_m: home_m,
            stroke_s: 0.0,
            pressed_stage: 0,
            grip: Grip { point_m: home_m, normal: Vec3::z(), across: Vec3::x() },
            pull: Pull::default(),
            pull_start_s: 0.0,
            failed_attempts: 0,
            stitches: 0,
            tugs: 0,
        }
    }

    fn begin(&mut self, act: Act, time_s: f64) {
        self.act = act;
        self.act_start_s = time_s;
        self.from_m = self.position_m;
    }

    fn begin_stroke(&mut self, act: Act, time_s: f64, goal_m: Vec3) {
        self.begin(act, time_s);
        self.goal_m = goal_m;
        self.stroke_s = stroke_duration_s((goal_m - self.from_m).norm(), self.params.stroke_speed_m_per_s);
    }

    /// Follows the stroke to a goal that may drift; true when it has arrived or never will.
    fn stroke(&mut self, time_s: f64, goal_m: Vec3, wish_m: &mut Vec3) -> bool {
        let elapsed_s = time_s - self.act_start_s;
        self.goal_m = goal_m;
        *wish_m = self.from_m + (goal_m - self.from_m) * minimum_jerk(elapsed_s / self.stroke_s);
        let near = (self.position_m - goal_m).norm() < ARRIVED_M;
        (elapsed_s >= self.stroke_s && near) || elapsed_s > 2.0 * self.stroke_s + 1.0
    }

    fn give_up(&mut self, time_s: f64) {
        self.failed_attempts += 1;
        self.begin(Act::LetGo, time_s);
    }

    /// Whether there is still something to do.
    fn has_work(&self, view: &HandView) -> bool {
        view.stage != 5 || (self.params.tug_m > 0.0 && self.tugs < view.stitches)
    }

    fn above(&self, view: &HandView) -> Vec3 {
        view.target_m + view.target_normal * self.params.hover_m
    }

    /// Notices a new scene, a tied stitch or a jump of the target.
    fn notice(&mut self, time_s: f64, view: &HandView) {
        if self.generation != Some(view.scene_generation) {
            let restored = self.generation.replace(view.scene_generation).is_some();
            (self.failed_attempts, self.tugs, self.stitches) = (0, 0, view.stitches);
            self.begin(if restored { Act::LetGo } else { Act::Look }, time_s);
        }
        if view.stitches != self.stitches {
            self.stitches = view.stitches;
            self.failed_attempts = 0;
        }
        let goal_m = match self.act {
            Act::Approach => self.above(view),
            Act::Descend => view.target_m,
            _ => return,
        };
        if (goal_m - self.goal_m).norm() > TARGET_JUMP_M {
            self.begin_stroke(Act::Approach, time_s, self.above(view));
        }
    }

    /// One tick of the act at work: returns where the hand wants to be.
    fn act(&mut self, time_s: f64, dt_s: f64, view: &HandView) -> Vec3 {
        let p = self.params;
        let elapsed_s = time_s - self.act_start_s;
        let mut wish_m = self.position_m;
        match self.act {
            Act::Look if self.has_work(view) => self.begin_stroke(Act::Approach, time_s, self.above(view)),
            Act::Look => {
                let goal_m = self.position_m + self.grip.normal * p.rest_height_m;
                self.begin_stroke(Act::Rest, time_s, goal_m);
            }
            Act::Rest if self.has_work(view) => self.begin(Act::Look, time_s),
            Act::Rest => {
                self.stroke(time_s, self.goal_m, &mut wish_m);
            }
            Act::Approach => {
                if self.stroke(time_s, self.above(view), &mut wish_m) {
                    self.begin_stroke(Act::Descend, time_s, view.target_m);
                }
            }
            Act::Descend => {
                if self.stroke(time_s, view.target_m, &mut wish_m) {
                    self.begin(Act::Press, time_s);
                    self.pressed_stage = view.stage;
                    self.grip = Grip { point_m: self.position_m, normal: view.target_normal, across: view.across };
                }
            }
            Act::Press if elapsed_s < p.press_s => {}
            Act::Press => match view.stage {
                1 => self.begin(Act::Hold, time_s),
                3 => {
                    self.begin(Act::Pull, time_s);
                    self.pull = Pull::default();
                    self.pull_start_s = time_s;
                }
                5 if self.pressed_stage == 5 => {
                    let goal_m = self.position_m + self.grip.across * p.tug_m;
                    self.begin_stroke(Act::Tug, time_s, goal_m);
                }
                _ if elapsed_s > p.press_timeout_s => self.give_up(time_s),
                _ => {}
            },
            Act::Hold if elapsed_s >= p.hold_s || view.stage != 1 => self.begin(Act::LetGo, time_s),
            Act::Hold => {}
            Act::Pull | Act::Settle if view.stage != 3 => self.begin(Act::LetGo, time_s),
            Act::Pull | Act::Settle if time_s - self.pull_start_s > p.pull_timeout_s => self.give_up(time_s),
            Act::Pull | Act::Settle => wish_m = self.pull_or_settle(time_s, dt_s, view),
            Act::Tug => {
                if self.stroke(time_s, self.goal_m, &mut wish_m) {
                    self.begin(Act::TugHold, time_s);
                }
            }
            Act::TugHold if elapsed_s >= p.tug_hold_s => {
                self.tugs += 1;
                self.begin(Act::LetGo, time_s);
            }
            Act::TugHold => {}
            Act::LetGo if elapsed_s >= p.pause_s => {
                let height_m = (self.position_m - self.grip.point_m).dot(&self.grip.normal);
                let goal_m = self.position_m + self.grip.normal * (p.hover_m - height_m).clamp(0.0, p.hover_m);
                self.begin_stroke(Act::Lift, time_s, goal_m);
            }
            Act::LetGo => {}
            Act::Lift => {
                if self.stroke(time_s, self.goal_m, &mut wish_m) {
                    self.begin(Act::Look, time_s);
                }
            }
        }
        wish_m
    }

    /// Pulls until the gap is closed with the margin, then watches that it stays so.
    fn pull_or_settle(&mut self, time_s: f64, dt_s: f64, view: &HandView) -> Vec3 {
        let p = self.params;
        let closed = view.gap_m <= view.closed_gap_m - p.close_margin_m;
        let bounds =
            PullBounds { way_m: p.pull.way_m * (1.0 + 0.25 * f64::from(self.failed_attempts.min(2))), ..p.pull };
        self.pull.step(if closed { Pulling::Stop } else { Pulling::Further }, &bounds, dt_s);
        match self.act {
            Act::Pull if closed && self.pull.speed_m_per_s == 0.0 => self.begin(Act::Settle, time_s),
            Act::Settle if view.gap_m > view.closed_gap_m - 0.5 * p.close_margin_m => self.begin(Act::Pull, time_s),
            Act::Settle if time_s - self.act_start_s >= p.hold_s => self.begin(Act::LetGo, time_s),
            _ => {}
        }
        let direction = (self.grip.normal - self.grip.across * p.pull_lean).normalize();
        self.grip.point_m + direction * self.pull.way_m
    }
}

impl Hand for SyntheticHand {
    fn target(&mut self, time_s: f64, view: &HandView) -> HandTarget {
        let dt_s = (time_s - self.last_s.replace(time_s).unwrap_or(time_s)).max(0.0);
        if view.valid {
            self.notice(time_s, view);
            let wish_m = self.act(time_s, dt_s, view);
            self.position_m = limit_step(self.position_m, wish_m, self.params.speed_limit_m_per_s, dt_s);
        } else if self.act != Act::Look {
            self.begin(Act::LetGo, time_s);
        }
        let pressing = matches!(self.act, Act::Press | Act::Hold | Act::Pull | Act::Settle | Act::Tug | Act::TugHold);
        HandTarget { position_m: self.position_m, buttons: if pressing { BUTTON_1 } else { 0 } }
    }
}
