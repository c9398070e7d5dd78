//! The handles of one device: which suture points the hand holds or pulls, and what the hand feels of them.
//!
//! Per tick and handle one implicit 3 × 3 solve (`sim_core::kinematics::port_tick`; Zhang et al., Eq. (2), (3)). The port
//! says which handle is in use and how; a handle that comes into use starts at the port's x*, v*, and a held one keeps the
//! offset o = x_d − x* of its capture, so that taking a point never makes a force. A handle that stays in use through a
//! new epoch keeps its own state, and its anchor is blended over 10 ms. Force on the hand = −(coupling force), never the
//! solver's own force. A gain below 1 (ramp, decay, stop) weakens the coupling itself, Kvc, Bvc and the line's k and b, not
//! what the hand is told of it: at every gain the tissue is pulled by what the hand feels. Metres, newtons, scene frame.
//! Deliberately absent: limits (safety), the age of ports (ladder).

use crate::servo::ladder::Rung;
use crate::servo::params::CouplingParams;
use protocol::servo_state::HandleState;
use protocol::tissue_port::{
    HANDLE_FREE, HANDLE_HELD, HANDLE_LINKED, HANDLE_PULLED, HandlePort, KINEMATICS_LITERAL, TissuePort,
};
use sim_core::kinematics::coupling::{self, StylusState};
use sim_core::kinematics::integrate::{KinematicsForm, NodeState};
use sim_core::kinematics::line_pull::{LineParams, measure, pull};
use sim_core::kinematics::literal_tick::{tick_held_literal, tick_pulled_literal};
use sim_core::kinematics::port_tick::{AffinePort, PortRung, TickFlags, tick_held, tick_pulled};
use sim_core::vector::{Mat3, Vec3};

/// Handles of one device: the point at the hand, and its partner across the wound.
pub const HANDLES_PER_DEVICE: usize = 2;

/// What a handle has to tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HandleNews {
    /// It changed its mode or its pair.
    pub changed: bool,
    /// It left the trusted region.
    pub left_trust: bool,
    /// Its state was not finite and was put back to its port.
    pub was_reset: bool,
}

/// One suture point in the servo.
#[derive(Clone, Copy, Debug)]
struct Handle {
    mode: u32,
    pair: u32,
    node: NodeState,
    offset_m: Vec3,
    anchor: AffinePort,
    blend_from: AffinePort,
    blend_left_s: f64,
    applied_force_n: Vec3,
    line_tension_n: f64,
    is_outside_trust: bool,
    news: HandleNews,
}

/// What the port says about the line and the scene, beyond the handles.
#[derive(Clone, Copy, Debug)]
struct Context {
    epoch: u32,
    scene_generation: u32,
    line_rest_length_m: f64,
    line_friction: f64,
    form: KinematicsForm,
}

/// The handles of one device.
#[derive(Clone, Copy, Debug)]
pub struct Handles {
    params: CouplingParams,
    /// First handle of the device on the wire.
    first: usize,
    handles: [Handle; HANDLES_PER_DEVICE],
    context: Option<Context>,
    /// Rest length to which the line has slipped in this grip, metres; the port's own counts if it is longer.
    slipped_to_m: f64,
    last_rung: Rung,
}

impl Handles {
    /// None in use; for the device 0 or 1.
    #[must_use]
    pub fn new(params: CouplingParams, device: usize) -> Self {
        let free = Handle {
            mode: HANDLE_FREE,
            pair: 0,
            node: NodeState::default(),
            offset_m: Vec3::zeros(),
            anchor: NO_ANCHOR,
            blend_from: NO_ANCHOR,
            blend_left_s: 0.0,
            applied_force_n: Vec3::zeros(),
            line_tension_n: 0.0,
            is_outside_trust: false,
            news: HandleNews::default(),
        };
        let (first, handles) = (device * HANDLES_PER_DEVICE, [free; HANDLES_PER_DEVICE]);
        Self { params, first, handles, context: None, slipped_to_m: 0.0, last_rung: Rung::None }
    }

    /// Takes over a new, validated port.
    pub fn take(&mut self, port: &TissuePort, stylus_m: Vec3) {
        let new = Context {
            epoch: port.epoch,
            scene_generation: port.scene_generation,
            line_rest_length_m: port.line_rest_length_m,
            line_friction: port.line_friction,
            form: if port.kinematics == KINEMATICS_LITERAL {
                KinematicsForm::Literal
            } else {
                KinematicsForm::ImplicitDrag
            },
        };
        let last = self.context.replace(new);
        if last.is_none_or(|c| c.epoch != new.epoch) {
            self.slipped_to_m = 0.0;
        }
        let own = &port.handles[self.first..self.first + HANDLES_PER_DEVICE];
        let takes_line = own[0].mode == HANDLE_PULLED && self.handles[0].mode != HANDLE_PULLED;
        if takes_line {
            // The stylus has moved since the solver saw it take the line: taking it must not make a tension.
            let (near, partner) = (&own[0], &own[1]);
            self.slipped_to_m = measure(stylus_m, Vec3::from(near.position_m), Vec3::from(partner.position_m)).length_m;
        }
        if let Some(context) = &mut self.context {
            context.line_rest_length_m = context.line_rest_length_m.max(self.slipped_to_m);
        }
        let is_new_scene = last.is_none_or(|c| c.scene_generation != new.scene_generation);
        let is_new_anchor = last.is_none_or(|c| c.epoch != new.epoch) || self.last_rung != Rung::Affine;
        for (handle, from) in self.handles.iter_mut().zip(own) {
            let is_other = handle.mode != from.mode || handle.pair != from.pair || is_new_scene;
            if is_other {
                handle.news.changed |= handle.mode != from.mode || handle.pair != from.pair;
                handle.start(from, stylus_m);
            } else if from.mode != HANDLE_FREE {
                if is_new_anchor && self.params.blend_s > 0.0 {
                    handle.blend_from = handle.blended(self.params.blend_s);
                    handle.blend_left_s = self.params.blend_s;
                }
                handle.anchor = affine(from);
            }
        }
    }

    /// Lets the grip slip to where the stylus is: no coupling force, no tension.
    pub fn slip(&mut self, stylus_m: Vec3) {
        for handle in &mut self.handles {
            handle.offset_m = stylus_m - handle.node.position_m;
        }
        let [near, partner] = &self.handles;
        if let Some(context) = &mut self.context {
            context.line_rest_length_m = measure(stylus_m, near.node.position_m, partner.node.position_m)
                .length_m
                .max(context.line_rest_length_m);
            self.slipped_to_m = context.line_rest_length_m;
        }
    }

    /// The force that the coupling would have now at full gain, newtons: what a start must wait to become small.
    #[must_use]
    pub fn full_force_n(&self, stylus: StylusState) -> f64 {
        let [near, partner] = &self.handles;
        match (near.mode, partner.mode, self.line(1.0)) {
            (HANDLE_HELD, _, _) => {
                coupling::coupling_force(self.coupling(1.0), stylus, near.offset_m, near.node).norm()
            }
            (HANDLE_PULLED, HANDLE_LINKED, Some(line)) => pull(&line, stylus, near.node, partner.node).0,
            _ => 0.0,
        }
    }

    fn coupling(&self, gain: f64) -> coupling::CouplingParams {
        coupling::CouplingParams {
            stiffness_n_per_m: self.params.stiffness_n_per_m * gain,
            damping_n_s_per_m: self.params.damping_n_s_per_m * gain,
        }
    }

    fn line(&self, gain: f64) -> Option<LineParams> {
        self.context.map(|context| LineParams {
            stiffness_n_per_m: self.params.line_stiffness_n_per_m * gain,
            damping_n_s_per_m: self.params.line_damping_n_s_per_m * gain,
            rest_length_m: context.line_rest_length_m,
            friction: context.line_friction,
        })
    }

    /// One tick with a coupling of this gain, 0 to 1; gives the force on the hand.
    pub fn tick(&mut self, stylus: StylusState, rung: Rung, gain: f64, dt_s: f64) -> Vec3 {
        self.last_rung = rung;
        let (coupling, line) = (self.coupling(gain), self.line(gain));
        let port_rung = match rung {
            Rung::Affine => PortRung::Affine,
            Rung::OneRing => PortRung::OneRing,
            Rung::Frozen | Rung::Decay | Rung::None => PortRung::Frozen,
        };
        for handle in &mut self.handles {
            handle.applied_force_n = Vec3::zeros();
            handle.line_tension_n = 0.0;
            handle.blend_left_s = (handle.blend_left_s - dt_s).max(0.0);
        }
        let form = self.context.map_or(KinematicsForm::default(), |c| c.form);
        let [near, partner] = &mut self.handles;
        match (near.mode, partner.mode, line) {
            (HANDLE_HELD, _, _) => {
                let anchor = near.blended(self.params.blend_s);
                near.tick_held(coupling, &anchor, stylus, port_rung, form, dt_s)
            }
            (HANDLE_PULLED, HANDLE_LINKED, Some(line)) => {
                let anchors = (near.blended(self.params.blend_s), partner.blended(self.params.blend_s));
                let tick = match form {
                    KinematicsForm::ImplicitDrag => tick_pulled,
                    KinematicsForm::Literal => tick_pulled_literal,
                };
                let out = tick((near.node, &anchors.0), (partner.node, &anchors.1), stylus, &line, port_rung, dt_s);
                near.settle(out.right, out.hand_force_n + out.link_force_n, out.right_flags, stylus.position_m);
                partner.settle(out.left, -out.link_force_n, out.left_flags, stylus.position_m);
                near.line_tension_n = out.tension_n;
                partner.line_tension_n = out.tension_n;
                out.device_force_n
            }
            _ => Vec3::zeros(),
        }
    }

    /// News since the last call, per handle.
    pub fn take_news(&mut self) -> [HandleNews; HANDLES_PER_DEVICE] {
        self.handles.each_mut().map(|handle| std::mem::take(&mut handle.news))
    }

    /// The handles as the wire has them.
    #[must_use]
    pub fn states(&self) -> [HandleState; HANDLES_PER_DEVICE] {
        self.handles.each_ref().map(|handle| HandleState {
            position_m: handle.node.position_m.into(),
            velocity_m_per_s: handle.node.velocity_m_per_s.into(),
            applied_force_n: handle.applied_force_n.into(),
            line_tension_n: handle.line_tension_n,
            mode: handle.mode,
            pair: handle.pair,
        })
    }
}

impl Handle {
    /// Comes into use (or out of it) as the port says.
    fn start(&mut self, from: &HandlePort, stylus_m: Vec3) {
        self.mode = from.mode;
        self.pair = from.pair;
        self.anchor = affine(from);
        self.blend_left_s = 0.0;
        self.is_outside_trust = false;
        self.restart(self.anchor.velocity_m_per_s, stylus_m);
    }

    fn restart(&mut self, velocity_m_per_s: Vec3, stylus_m: Vec3) {
        self.node = NodeState { position_m: self.anchor.position_m, velocity_m_per_s };
        self.offset_m = stylus_m - self.anchor.position_m;
    }

    fn tick_held(
        &mut self,
        coupling: coupling::CouplingParams,
        anchor: &AffinePort,
        stylus: StylusState,
        rung: PortRung,
        form: KinematicsForm,
        dt_s: f64,
    ) -> Vec3 {
        let tick = match form {
            KinematicsForm::ImplicitDrag => tick_held,
            KinematicsForm::Literal => tick_held_literal,
        };
        let out = tick(self.node, anchor, stylus, self.offset_m, coupling, rung, dt_s);
        self.settle(out.node, out.applied_force_n, out.flags, stylus.position_m);
        out.device_force_n
    }

    /// Keeps the result of a tick; a contained one starts again at its anchor, at rest.
    fn settle(&mut self, node: NodeState, applied_force_n: Vec3, flags: TickFlags, stylus_m: Vec3) {
        self.node = node;
        self.applied_force_n = applied_force_n;
        self.news.left_trust |= flags.beyond_trust && !self.is_outside_trust;
        self.is_outside_trust = flags.beyond_trust;
        if flags.contained {
            self.news.was_reset = true;
            self.restart(Vec3::zeros(), stylus_m);
        }
    }

    /// The anchor of this moment: from the old one to the new one while `blend_left_s` runs down.
    fn blended(&self, blend_s: f64) -> AffinePort {
        if self.blend_left_s <= 0.0 {
            return self.anchor;
        }
        let (old, new) = (&self.blend_from, &self.anchor);
        let t = (1.0 - self.blend_left_s / blend_s).clamp(0.0, 1.0);
        let lerp = |a: f64, b: f64| a + (b - a) * t;
        AffinePort {
            position_m: old.position_m.lerp(&new.position_m, t),
            velocity_m_per_s: old.velocity_m_per_s.lerp(&new.velocity_m_per_s, t),
            force_n: old.force_n.lerp(&new.force_n, t),
            stiffness_n_per_m: old.stiffness_n_per_m * (1.0 - t) + new.stiffness_n_per_m * t,
            one_ring_n_per_m: old.one_ring_n_per_m * (1.0 - t) + new.one_ring_n_per_m * t,
            trust_radius_m: lerp(old.trust_radius_m, new.trust_radius_m),
            mass_kg: lerp(old.mass_kg, new.mass_kg),
            drag_n_s_per_m: lerp(old.drag_n_s_per_m, new.drag_n_s_per_m),
        }
    }
}

/// Stands for "no anchor"; never ticked.
const NO_ANCHOR: AffinePort = AffinePort {
    position_m: Vec3::new(0.0, 0.0, 0.0),
    velocity_m_per_s: Vec3::new(0.0, 0.0, 0.0),
    force_n: Vec3::new(0.0, 0.0, 0.0),
    stiffness_n_per_m: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    one_ring_n_per_m: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    trust_radius_m: 0.0,
    mass_kg: 1.0,
    drag_n_s_per_m: 0.0,
};

fn affine(from: &HandlePort) -> AffinePort {
    AffinePort {
        position_m: Vec3::from(from.position_m),
        velocity_m_per_s: Vec3::from(from.velocity_m_per_s),
        force_n: Vec3::from(from.force_n),
        stiffness_n_per_m: symmetric(&from.stiffness_n_per_m),
        one_ring_n_per_m: symmetric(&from.one_ring_n_per_m),
        trust_radius_m: from.trust_radius_m,
        mass_kg: from.mass_kg,
        drag_n_s_per_m: from.drag_n_s_per_m,
    }
}

/// (xx, xy, xz, yy, yz, zz) as a matrix.
fn symmetric(s: &[f64; 6]) -> Mat3 {
    Mat3::new(s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5])
}
