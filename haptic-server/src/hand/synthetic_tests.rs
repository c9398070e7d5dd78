//! The synthetic surgeon against a wound of point masses and the real suturing state machine.
//!
//! Each suture point is an overdamped mass on a spring to its place: `c ẋ = K (x₀ − x) + F`. The line pulls as
//! `T = k max(0, L − L₀)`, a tied stitch is an elastic that resists only opening, a held point follows the stylus on a coupling.
//! The view is refreshed every fifth tick, as by a 200 Hz solver.

use super::synthetic::{SyntheticHand, SyntheticHandParams};
use super::{BUTTON_1, Hand};
use crate::device::frame::SceneFromDevice;
use crate::device::simulated::{SimulatedDevice, SimulatedDeviceParams};
use crate::device::{DeviceCommand, HandView, PulledDevice, TickTime};
use sim_core::scene::suturing::{HandInput, PairPlace, Side, Stage, Suturing, SuturingEvent};
use sim_core::vector::Vec3;

const TICK_S: f64 = 1e-3;
const TISSUE_N_PER_M: f64 = 100.0;
const DRAG_N_S_PER_M: f64 = 3.0;
const LINE_N_PER_M: f64 = 400.0;
const HALF_GAP_M: f64 = 4.5e-3;
const CLOSED_M: f64 = 6.3e-3;

struct MockWound {
    suturing: Suturing,
    places: Vec<PairPlace>,
    rest: Vec<(Vec3, Vec3)>,
    /// Length at which a stitch was tied.
    tied_m: Vec<Option<f64>>,
    line_rest_m: Option<f64>,
    /// Held point and its offset to the stylus.
    held: Option<(usize, Side, Vec3)>,
    buttons: u32,
    presses: u32,
    releases: u32,
    widest_tugged_m: f64,
    generation: u32,
}

impl MockWound {
    fn new(pairs: usize) -> Self {
        let rest: Vec<_> = (0..pairs)
            .map(|i| {
                let y = 0.008 * i as f64;
                (Vec3::new(-HALF_GAP_M, y, 0.0), Vec3::new(HALF_GAP_M, y, 0.0))
            })
            .collect();
        let places = rest.iter().map(|&(left_m, right_m)| PairPlace { left_m, right_m, closed_m: CLOSED_M }).collect();
        Self {
            suturing: Suturing::new(pairs, 0.004),
            places,
            rest,
            tied_m: vec![None; pairs],
            line_rest_m: None,
            held: None,
            buttons: 0,
            presses: 0,
            releases: 0,
            widest_tugged_m: 0.0,
            generation: 1,
        }
    }

    fn view(&self) -> HandView {
        let pair = self.suturing.pair();
        let target = self.suturing.next_target();
        HandView {
            valid: true,
            stage: self.suturing.stage().code(),
            pair: pair as u32,
            pair_count: self.places.len() as u32,
            stitches: self.suturing.stitches() as u32,
            scene_generation: self.generation,
            target_m: target.map_or(Vec3::zeros(), |(pair, side)| self.point(pair, side)),
            target_normal: Vec3::z(),
            across: Vec3::x(),
            gap_m: self.places[pair].distance_m(),
            closed_gap_m: CLOSED_M,
        }
    }

    fn point(&self, pair: usize, side: Side) -> Vec3 {
        match side {
            Side::Left => self.places[pair].left_m,
            Side::Right => self.places[pair].right_m,
        }
    }

    /// One tick; returns the force on the hand.
    fn step(&mut self, stylus: Vec3, buttons: u32) -> Vec3 {
        self.presses += u32::from(buttons & !self.buttons & BUTTON_1 != 0);
        self.releases += u32::from(!buttons & self.buttons & BUTTON_1 != 0);
        self.buttons = buttons;
        let input = HandInput { position_m: stylus, press_count: self.presses, release_count: self.releases };
        for event in self.suturing.advance(&input, &self.places).into_iter().flatten() {
            self.react(event, stylus);
        }
        let mut forces = vec![[Vec3::zeros(); 2]; self.places.len()];
        let mut on_hand = Vec3::zeros();
        for (pair, place) in self.places.iter().enumerate() {
            let across = place.right_m - place.left_m;
            if let Some(tied_m) = self.tied_m[pair] {
                let pull = across.normalize() * (600.0 * (across.norm() - tied_m).max(0.0));
                forces[pair][0] += pull;
                forces[pair][1] -= pull;
            }
        }
        let pair = self.suturing.pair();
        if let Some(rest_m) = self.line_rest_m {
            let place = &self.places[pair];
            let up = stylus - place.right_m;
            let over = place.left_m - place.right_m;
            let tension = LINE_N_PER_M * (up.norm() + over.norm() - rest_m).max(0.0);
            let hand = up.try_normalize(1e-9).unwrap_or_default() * tension;
            let link = over.normalize() * tension;
            forces[pair][1] += hand + link;
            forces[pair][0] -= link;
            on_hand -= hand;
        }
        if let Some((pair, side, offset)) = self.held {
            let pull = (stylus - offset - self.point(pair, side)) * 400.0;
            forces[pair][usize::from(side == Side::Right)] += pull;
            on_hand -= pull;
            self.widest_tugged_m = self.widest_tugged_m.max(self.places[pair].distance_m());
        }
        for (i, place) in self.places.iter_mut().enumerate() {
            let gain = TICK_S / DRAG_N_S_PER_M;
            place.left_m += (forces[i][0] + (self.rest[i].0 - place.left_m) * TISSUE_N_PER_M) * gain;
            place.right_m += (forces[i][1] + (self.rest[i].1 - place.right_m) * TISSUE_N_PER_M) * gain;
        }
        on_hand
    }

    fn react(&mut self, event: SuturingEvent, stylus: Vec3) {
        match event {
            SuturingEvent::LeftTaken(pair) => {
                self.held = Some((pair, Side::Left, stylus - self.places[pair].left_m));
            }
            SuturingEvent::DragBegun(pair, side) => self.held = Some((pair, side, stylus - self.point(pair, side))),
            SuturingEvent::LeftReleased(_) | SuturingEvent::DragEnded(_) => self.held = None,
            SuturingEvent::LineTaken(pair) => {
                let place = &self.places[pair];
                self.line_rest_m = Some((stylus - place.right_m).norm() + place.distance_m());
            }
            SuturingEvent::LineReleased(_) => self.line_rest_m = None,
            SuturingEvent::Tied(pair) => {
                self.line_rest_m = None;
                self.tied_m[pair] = Some(self.places[pair].distance_m());
            }
        }
    }
}

/// Moves the hand over the wound for a while, the stylus being the hand; checks the speed at every tick.
fn operate(hand: &mut SyntheticHand, wound: &mut MockWound, from_tick: u32, ticks: u32, blind: &[u32]) -> Vec3 {
    let mut view = wound.view();
    let mut last: Option<Vec3> = None;
    for tick in from_tick..from_tick + ticks {
        if tick % 5 == 0 {
            view = wound.view();
            view.valid = !blind.contains(&(tick / 1000));
        }
        let target = hand.target(f64::from(tick) * TICK_S, &view);
        if let Some(last) = last {
            let speed = (target.position_m - last).norm() / TICK_S;
            assert!(speed <= 0.12 + 1e-9, "{speed} m/s at tick {tick}");
        }
        last = Some(target.position_m);
        wound.step(target.position_m, target.buttons);
    }
    last.unwrap_or_default()
}

fn hand() -> SyntheticHand {
    SyntheticHand::new(SyntheticHandParams::default(), Vec3::new(0.0, 0.0, 0.04))
}

#[test]
fn four_stitches_are_tied_and_each_is_tugged_once() {
    let (mut hand, mut wound) = (hand(), MockWound::new(4));
    let end = operate(&mut hand, &mut wound, 0, 60_000, &[]);
    assert_eq!((wound.suturing.stage(), wound.suturing.stitches()), (Stage::Done, 4));
    assert!(wound.tied_m.iter().all(|m| m.is_some_and(|m| m <= CLOSED_M)));
    // Per stitch: left, right; then one tug each. No press was wasted.
    assert_eq!((wound.presses, wound.releases), (12, 12));
    assert!(wound.widest_tugged_m > CLOSED_M, "a tug opens its stitch");
    assert!(end.z > 0.03, "the hand rests above the wound: {end}");
}

#[test]
fn a_restored_scene_and_a_lost_port_only_cost_time() {
    let (mut hand, mut wound) = (hand(), MockWound::new(4));
    let mut tick = 0;
    while (wound.suturing.stage(), wound.suturing.stitches()) != (Stage::LinePulled, 1) {
        operate(&mut hand, &mut wound, tick, 100, &[]);
        tick += 100;
        assert!(tick < 20_000, "the second pull never came");
    }
    let mut again = MockWound::new(3);
    (again.generation, again.buttons, again.presses) = (2, wound.buttons, wound.presses);
    operate(&mut hand, &mut again, tick, 60_000, &[8, 11, 12, 17]);
    assert_eq!((again.suturing.stage(), again.suturing.stitches()), (Stage::Done, 3));
}

#[test]
fn a_line_that_slips_away_is_taken_again() {
    let (mut hand, mut wound) = (hand(), MockWound::new(1));
    let mut slipped = 0;
    for tick in 0..30_000_u32 {
        let view = wound.view();
        let target = hand.target(f64::from(tick) * TICK_S, &view);
        let slips = slipped < 2 && view.stage == 3 && view.gap_m < 0.008;
        slipped += u32::from(slips);
        wound.step(target.position_m, if slips { 0 } else { target.buttons });
    }
    assert_eq!((slipped, wound.suturing.stitches()), (2, 1));
}

#[test]
fn a_wound_that_never_closes_is_pulled_again_and_again() {
    let (mut hand, mut wound) = (hand(), MockWound::new(1));
    let mut pulls = 0;
    let mut last_stage = 0;
    for tick in 0..60_000_u32 {
        let view = HandView { gap_m: 0.02, ..wound.view() };
        pulls += u32::from(view.stage == 3 && last_stage != 3);
        last_stage = view.stage;
        // The stylus is what the state machine sees: far away from closing.
        wound.places[0].closed_m = 0.0;
        let target = hand.target(f64::from(tick) * TICK_S, &view);
        wound.step(target.position_m, target.buttons);
    }
    assert!((4..=8).contains(&pulls), "{pulls} pulls in a minute");
}

#[test]
fn it_sutures_through_a_simulated_device_that_feels_the_force() {
    let mut wound = MockWound::new(2);
    let frame = SceneFromDevice::workspace_at(Vec3::new(0.0, 0.004, 0.02));
    let mut device = SimulatedDevice::new(SimulatedDeviceParams::default(), frame, Box::new(hand()));
    let mut view = wound.view();
    let mut peak_n: f64 = 0.0;
    for tick in 0..40_000_u64 {
        if tick % 5 == 0 {
            view = wound.view();
        }
        let now_ns = tick * 1_000_000;
        let sample = device.sample(TickTime { scheduled_ns: now_ns, now_ns, dt_s: TICK_S }, &view);
        let force_n = wound.step(sample.position_m, sample.buttons);
        peak_n = peak_n.max(force_n.norm());
        device.command(DeviceCommand { force_n });
    }
    assert_eq!((wound.suturing.stage(), wound.suturing.stitches()), (Stage::Done, 2));
    assert!(peak_n > 0.1 && peak_n < 3.3, "peak force {peak_n} N");
}

#[test]
fn equal_views_give_equal_motion() {
    let run = || {
        let (mut hand, mut wound) = (hand(), MockWound::new(2));
        operate(&mut hand, &mut wound, 0, 10_000, &[])
    };
    assert_eq!(run(), run());
}
