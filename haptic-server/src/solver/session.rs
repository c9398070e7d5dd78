//! A session: the procedure at work, in the words of the wire. The live solver process and lockstep call the same
//! [`SolverSession::step`]; it reads no clock and no port.
//!
//! servo state → suturing, tissue, control (`sim_core::scene`) → `tissue_port`, `wound_report`, frames.

use protocol::scene_frame::{FrameHeader, FrameNode, OutlineHeader};
use protocol::servo_state::ServoState;
use protocol::session_command::SessionCommand;
use protocol::tissue_port::{KINEMATICS_IMPLICIT_DRAG, KINEMATICS_LITERAL, TissuePort};
use protocol::wire::Field;
use protocol::wound_report::WoundReport;
use sim_core::kinematics::integrate::KinematicsForm;
use sim_core::scene::build::SceneError;
use sim_core::scene::grip::Grip;
use sim_core::scene::procedure::{Procedure, ProcedureStanding, SceneSource, SessionRequest};
use sim_core::scene::step::{ResumeError, ServoInput};
use sim_core::scene::suturing::Side;
use sim_core::tissue::crew::Crew;
use sim_core::tissue::handle::MAX_HANDLES;
use sim_core::tissue::integrator::Integrator;
use sim_core::vector::Vec3;
use sim_core::wound::control::ControlMode;
use std::sync::Arc;

mod frame;
mod orders;
mod wire;

use frame::show_nodes;
use orders::{Rearms, SERVO_FAULT, START_IN_FAULT, answer, request_of};
use wire::{hand, handle_port, ledger_row, mode_code};

/// The tissue side of a run.
#[derive(Debug)]
pub struct SolverSession {
    procedure: Procedure,
    port: TissuePort,
    report: WoundReport,
    rearms: Rearms,
}

impl SolverSession {
    /// Loads a procedure (one scene is a procedure of one).
    ///
    /// # Errors
    /// [`SceneError`] when a scene cannot be built.
    pub fn new(sources: &[SceneSource]) -> Result<Self, SceneError> {
        let procedure = Procedure::new(sources)?;
        let mut session =
            Self { procedure, port: TissuePort::EMPTY, report: WoundReport::EMPTY, rearms: Rearms::default() };
        session.describe(0, 0);
        Ok(session)
    }

    /// The most hands that a scene asks for; `None` where no sweep is divided.
    #[must_use]
    pub fn threads(&self) -> Option<u32> {
        self.procedure.threads()
    }

    /// Gives the work on the springs to a crew, in the scenes that ask for one. No result changes by a bit.
    pub fn share(&mut self, crew: &Arc<dyn Crew>) {
        self.procedure.share(crew);
    }

    /// Goes on where another solver stood.
    ///
    /// # Errors
    /// [`ResumeError`] when that cannot have been this procedure; nothing has changed then.
    pub fn resume(&mut self, standing: &ProcedureStanding) -> Result<(), ResumeError> {
        self.procedure.resume(standing)?;
        self.describe(0, 0);
        Ok(())
    }

    /// One solver period: what the servo last said, at most one command, the time for the port's stamps.
    pub fn step(&mut self, servo: Option<&ServoState>, command: Option<&SessionCommand>, now_ns: u64) {
        self.rearms.look(servo);
        if let Some(command) = command {
            self.obey(command, servo, now_ns);
        }
        while let Some((command, outcome)) = self.rearms.settled(now_ns) {
            self.report.add_answer(answer(&command, outcome));
        }
        let input = servo.map(|s| self.input(s));
        self.procedure.step(input.as_ref());
        self.describe(now_ns, servo.map_or(0, |s| s.header.sequence));
    }

    /// The port of the last step; the publisher stamps it.
    #[must_use]
    pub fn port(&self) -> &TissuePort {
        &self.port
    }

    /// The report of the last step; the publisher stamps it and adds its step times.
    #[must_use]
    pub fn report(&self) -> &WoundReport {
        &self.report
    }

    /// The procedure, for reports.
    #[must_use]
    pub fn procedure(&self) -> &Procedure {
        &self.procedure
    }

    /// Solver period of the scene at work, seconds.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.procedure.scene().solver().params().period_s
    }

    /// Counts scene loads and restores.
    #[must_use]
    pub fn scene_generation(&self) -> u32 {
        self.procedure.generation()
    }

    /// Whether the last scene of the procedure is done.
    #[must_use]
    pub fn finished(&self) -> bool {
        self.procedure.finished()
    }

    /// Nodes for a viewer; `nodes` is reused from frame to frame.
    pub fn frame(&self, nodes: &mut Vec<FrameNode>) -> FrameHeader {
        show_nodes(self.procedure.scene(), nodes);
        let mut header = FrameHeader::EMPTY;
        header.scene_generation = self.scene_generation();
        header.node_count = nodes.len() as u32;
        header.sim_time_s = self.report.sim_time_s;
        header
    }

    /// What a viewer needs once per scene: triangles, layers, suture points, wound edge.
    #[must_use]
    pub fn outline(&self) -> (OutlineHeader, Vec<u32>) {
        let scene = self.procedure.scene();
        let tissue = scene.tissue();
        let mut words: Vec<u32> = tissue.triangles.iter().flatten().copied().collect();
        words.extend(tissue.layer.iter().map(|l| u32::from(*l)));
        words.extend(tissue.pairs.iter().flat_map(|p| [p.left.node, p.right.node]));
        words.extend(&tissue.wound_edge);
        let mut header = OutlineHeader::EMPTY;
        header.scene_generation = self.scene_generation();
        header.scene_kind = scene.kind_code();
        header.node_count = tissue.network.node_count() as u32;
        header.triangle_count = tissue.triangles.len() as u32;
        header.pair_count = tissue.pairs.len() as u32;
        header.edge_count = tissue.wound_edge.len() as u32;
        (header, words)
    }

    fn obey(&mut self, command: &SessionCommand, servo: Option<&ServoState>, now_ns: u64) {
        let outcome = match request_of(command.command) {
            None => match self.rearms.judge(command, servo, now_ns) {
                Some(outcome) => outcome,
                None => return,
            },
            Some(SessionRequest::Start) if servo.is_some_and(|s| s.mode == SERVO_FAULT) => Err(START_IN_FAULT),
            Some(request) => self.procedure.request(request),
        };
        self.report.add_answer(answer(command, outcome));
    }

    /// Epoch on the wire: scene loads and restores count as well as grips.
    fn epoch(&self) -> u32 {
        self.scene_generation() << 16 | self.procedure.scene().grips().epoch() & 0xffff
    }

    fn input(&self, servo: &ServoState) -> ServoInput {
        let [first, second] = &servo.devices;
        let grips = self.procedure.scene().grips();
        let mut handles_m = [None; MAX_HANDLES];
        if servo.port_epoch == self.epoch() {
            for grip in grips.iter() {
                let handle = &servo.handles[grip.slot.0];
                if handle.mode == mode_code(grip.mode) {
                    handles_m[grip.slot.0] = Some(Vec3::from(handle.position_m));
                }
            }
        }
        ServoInput {
            hand: hand(first),
            second: (second.present != 0).then(|| hand(second)),
            // The handles above were already matched against the epoch on the wire.
            port_epoch: grips.epoch(),
            handles_m,
        }
    }

    fn describe(&mut self, now_ns: u64, servo_sequence: u64) {
        self.describe_port(now_ns, servo_sequence);
        self.describe_report();
    }

    fn describe_port(&mut self, now_ns: u64, servo_sequence: u64) {
        let mut port = TissuePort::EMPTY;
        port.epoch = self.epoch();
        port.scene_generation = self.scene_generation();
        let scene = self.procedure.scene_mut();
        let suturing = scene.suturing();
        let pair = suturing.pair();
        port.stage = suturing.stage().code();
        port.pair = pair as u32;
        port.pair_count = scene.places().len() as u32;
        port.stitches = suturing.stitches() as u32;
        port.scene_kind = scene.kind_code();
        port.valid_ns = now_ns;
        port.publish_ns = now_ns;
        port.servo_sequence = servo_sequence;
        if let Some(place) = scene.places().get(pair) {
            port.gap_m = place.distance_m();
            port.closed_gap_m = place.closed_m;
        }
        if let Some((pair, side)) = suturing.next_target() {
            let place = scene.places()[pair];
            port.target_m = match side {
                Side::Left => place.left_m,
                Side::Right => place.right_m,
            }
            .into();
        }
        port.target_normal = scene.tissue().outward.into();
        port.across = scene.tissue().across.into();
        port.line_rest_length_m = scene.grips().line_rest_length_m();
        port.line_friction = scene.plan().line.map_or(0.0, |l| l.friction);
        port.kinematics = match scene.plan().suture.kinematics {
            KinematicsForm::ImplicitDrag => KINEMATICS_IMPLICIT_DRAG,
            KinematicsForm::Literal => KINEMATICS_LITERAL,
        };
        let grips: [Option<Grip>; MAX_HANDLES] = {
            let mut all = scene.grips().iter().copied();
            std::array::from_fn(|_| all.next())
        };
        for grip in grips.into_iter().flatten() {
            if let Some(measured) = scene.port(&grip) {
                port.handles[grip.slot.0] = handle_port(&grip, &measured);
                port.handle_count += 1;
            }
        }
        self.port = port;
    }

    fn describe_report(&mut self) {
        let scene = self.procedure.scene();
        let report = &mut self.report;
        let (index, count) = self.procedure.progress();
        let was = (report.scene_index, report.integrator, report.substeps);
        report.scene_index = index as u32;
        report.scene_count = count as u32;
        report.scene_generation = self.procedure.generation();
        report.scene_kind = scene.kind_code();
        report.stage = scene.suturing().stage().code();
        let port = &self.port;
        (report.pair, report.pair_count) = (port.pair, port.pair_count);
        (report.gap_m, report.closed_gap_m) = (port.gap_m, port.closed_gap_m);
        report.distance_floor_m = scene.distance_floor_m();
        report.control = match scene.control_mode() {
            None | Some(ControlMode::Off) => 0,
            Some(ControlMode::Sound) => 1,
            Some(ControlMode::Paper) => 2,
        };
        let stability = scene.solver().stability();
        report.integrator = match stability.integrator {
            Integrator::SemiImplicit => 0,
            Integrator::PaperExplicit => 1,
            Integrator::Verlet => 2,
            Integrator::Bdf2 => 3,
            Integrator::Xpbd => 4,
        };
        report.substeps = stability.substeps;
        report.stability_number = stability.number;
        if was != (report.scene_index, report.integrator, report.substeps) {
            report.set_integrator_reason(&scene.solver().integrator_reason());
        }
        report.points_taken = self.procedure.points_taken();
        report.grips_used = self.procedure.grips_used();
        report.solver_steps = self.procedure.total_steps();
        report.sim_time_s = self.procedure.total_steps() as f64 * scene.solver().params().period_s;
        report.row_count = 0;
        report.er_max = 0.0;
        for (slot, row) in report.rows.iter_mut().zip(self.procedure.rows()) {
            *slot = ledger_row(&row);
            report.row_count += 1;
            report.er_max = report.er_max.max(slot.relative_error);
        }
        let line = scene.line().map_or(&[][..], |l| l.polyline());
        report.line_point_count = line.len().min(report.line_m.len()) as u32;
        for (slot, point) in report.line_m.iter_mut().zip(line) {
            *slot = (*point).into();
        }
    }
}
