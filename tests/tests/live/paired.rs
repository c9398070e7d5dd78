//! What twenty viewers cost the servo: blocks with and without them, in turns, in one live run.
//!
//! Every tick of the run is recorded. Tick `n` was due at `t₀ + (n + missed) T`; its lateness is the time at which its state was
//! written less that, less the least of the run. In each block with viewers five are killed and five stopped. The figures are
//! printed, nothing is asserted of them: a loaded machine is no fault of the code. Those that draw must have drawn, though: the
//! pictures that they wrote before any is killed are counted. Asked for by name, best in a release build:
//! `cargo test --release -p suture-tests --test live -- --ignored --nocapture twenty`.

use crate::viewers::Viewer;
use crate::watch::Watch;
use crate::{LIMIT, alone, assert_no_fault, ended, run, solver_of, summary};
use protocol::ports::monotonic_ns;
use protocol::run::RunDir;
use protocol::servo_state::ServoState;
use protocol::trace::{TraceItem, TraceReader};
use rustix::process::Signal;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::time::Duration;
use suture_tests::processes::{Program, Sandbox, viewer, wait_for};

const VIEWERS: usize = 20;
const BLOCK: Duration = Duration::from_secs(10);
/// Blocks without and with viewers, in turns: a minute.
const BLOCKS: usize = 6;
/// Pictures in front of what is counted: the driver compiles its shaders in them.
const WARM_UP: usize = 3;
/// Viewers of a block work for this long, once those that draw are warm, before some are killed and stopped.
const UNDISTURBED: Duration = Duration::from_secs(4);

/// Pictures that each one that draws must write in that time, at ten a second asked for: it draws beside nineteen others.
const DRAWN: usize = 4;

/// Who looks in a block.
#[derive(Clone, Copy, PartialEq)]
enum Block {
    Alone,
    Watched,
}

/// One tick.
#[derive(Clone, Copy)]
struct Tick {
    time_ns: u64,
    missed: u64,
    late_ns: u64,
}

fn recorded(file: &Path) -> Vec<Tick> {
    let mut reader = TraceReader::open(BufReader::new(File::open(file).expect("recorded"))).expect("MCAP");
    let mut states: Vec<(u64, u64, u64)> = Vec::new();
    let mut period_ns = 0;
    while let Some((_, item)) = reader.next_item().expect("a sound message") {
        if let TraceItem::ServoState(state) = item {
            let ServoState { header, ticks, missed, .. } = *state;
            period_ns = state.period_ns;
            states.push((header.time_ns, ticks, missed));
        }
    }
    let offset = |&(time_ns, ticks, missed): &(u64, u64, u64)| time_ns.wrapping_sub((ticks + missed) * period_ns);
    let least = states.iter().map(offset).min().expect("ticks were recorded");
    states.iter().map(|s| Tick { time_ns: s.0, missed: s.2, late_ns: offset(s) - least }).collect()
}

/// What the twenty are.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Readers of every topic at 60 Hz, as a viewer's feed is: this test program.
    Readers,
    /// The viewer itself; so many of them make pictures without a screen, the others lines of text.
    Viewers { drawing: usize },
}

/// One of the twenty.
enum Looker {
    Reader(Viewer),
    Viewer(Program),
    /// With the folder of its pictures.
    Drawing(Program, PathBuf),
}

impl Looker {
    fn signal(&self, signal: Signal) {
        match self {
            Self::Reader(reader) => reader.signal(signal),
            Self::Viewer(program) | Self::Drawing(program, _) => program.signal(signal),
        }
    }

    /// Pictures that were written so far; `None` of one that does not draw.
    fn pictures(&self) -> Option<usize> {
        let Self::Drawing(_, folder) = self else { return None };
        let files = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
        Some(files.filter(|file| file.path().extension().is_some_and(|end| end == "png")).count())
    }

    fn stderr(&self) -> String {
        match self {
            Self::Reader(_) => String::new(),
            Self::Viewer(program) | Self::Drawing(program, _) => program.stderr(),
        }
    }
}

/// Lets viewers work undisturbed from the moment when each that draws is warm; says how many pictures each wrote meanwhile.
fn work(viewers: &[Looker]) -> Vec<usize> {
    let drawing: Vec<&Looker> = viewers.iter().filter(|v| v.pictures().is_some()).collect();
    for viewer in &drawing {
        let begun = wait_for(LIMIT, || viewer.pictures().filter(|count| *count >= WARM_UP));
        assert!(begun.is_some(), "a viewer that draws has not got warm: {}", viewer.stderr());
    }
    let count = || -> Vec<usize> { drawing.iter().filter_map(|v| v.pictures()).collect() };
    let before = count();
    std::thread::sleep(UNDISTURBED);
    let drawn: Vec<usize> = count().into_iter().zip(before).map(|(now, before)| now - before).collect();
    for (viewer, drawn) in drawing.iter().zip(&drawn) {
        assert!(*drawn >= DRAWN, "only {drawn} pictures in {UNDISTURBED:?}: {}", viewer.stderr());
    }
    drawn
}

fn lookers(sandbox: &Sandbox, run: &RunDir, kind: Kind) -> Vec<Looker> {
    let start = |number: usize| match kind {
        Kind::Readers => Looker::Reader(Viewer::start(run)),
        Kind::Viewers { drawing } if number < drawing => {
            let folder = sandbox.folder().join(format!("pictures-{number}-{}", monotonic_ns()));
            let name = folder.to_str().expect("a plain name");
            let arguments = ["--headless", "--frames", name, "--size", "320x180", "--quality", "fast", "--fps", "10"];
            Looker::Drawing(sandbox.start(&viewer(), &arguments), folder)
        }
        Kind::Viewers { .. } => Looker::Viewer(sandbox.start(&viewer(), &["--text", "--interval", "0.02"])),
    };
    (0..VIEWERS).map(start).collect()
}

/// A row of the table.
fn row(name: &str, ticks: &[Tick]) {
    let mut late: Vec<u64> = ticks.iter().map(|t| t.late_ns).collect();
    late.sort_unstable();
    let at = |share: f64| late[((late.len() - 1) as f64 * share) as usize] as f64 * 1e-3;
    println!("{name:<22} {:>7} {:>7.1} {:>8.1} {:>9.1} {:>9.1}", late.len(), at(0.5), at(0.99), at(0.999), at(1.0));
}

fn measure(kind: Kind) {
    let _alone = alone();
    if let Kind::Viewers { .. } = kind {
        // Built before the run is measured.
        let _built = viewer();
    }
    let sandbox = Sandbox::new();
    let file = sandbox.folder().join("run.mcap");
    let server = run(&sandbox, &["--duration", "600", "--record", file.to_str().expect("a plain name")]);
    solver_of(&server);
    let (mut watch, run) = Watch::attach_to_run(&sandbox);
    assert!(watch.until(LIMIT, |s| s.mode == 4).is_some(), "no force: {}", server.stderr());
    let mut blocks = Vec::new();
    for number in 0..BLOCKS {
        let block = if number.is_multiple_of(2) { Block::Alone } else { Block::Watched };
        let from_ns = monotonic_ns();
        if block == Block::Watched {
            let viewers = lookers(&sandbox, &run, kind);
            let pictures = work(&viewers);
            if !pictures.is_empty() {
                println!("block {number}: pictures written in {UNDISTURBED:?} by each that draws: {pictures:?}");
            }
            // The first of them draw, if any do: one is killed, one stopped.
            viewers.iter().step_by(4).for_each(|v| v.signal(Signal::KILL));
            viewers.iter().skip(1).step_by(4).for_each(|v| v.signal(Signal::STOP));
            std::thread::sleep(BLOCK - UNDISTURBED);
        } else {
            std::thread::sleep(BLOCK);
        }
        blocks.push((block, from_ns..monotonic_ns()));
    }
    server.signal(Signal::TERM);
    let summary = summary(&ended(server));
    assert_no_fault(&summary);
    let ticks = recorded(&file);
    println!("{VIEWERS} {kind:?}; degraded: {}; integrator {}", summary["degraded"], summary["integrator"]);
    println!("{:<22} {:>7} {:>7} {:>8} {:>9} {:>9}   µs late", "block", "ticks", "p50", "p99", "p99.9", "max");
    for wanted in [Block::Alone, Block::Watched] {
        let name = if wanted == Block::Alone { "alone" } else { "watched" };
        let (mut all, mut missed) = (Vec::new(), Vec::new());
        for (_, span) in blocks.iter().filter(|(block, _)| *block == wanted) {
            let within: Vec<Tick> = ticks.iter().filter(|t| span.contains(&t.time_ns)).copied().collect();
            let ends = (within.first().expect("ticks").missed, within.last().expect("ticks").missed);
            missed.push(ends.1 - ends.0);
            row(&format!("{name}, missed {}", ends.1 - ends.0), &within);
            all.extend(within);
        }
        row(&format!("{name}, all, missed {}", missed.iter().sum::<u64>()), &all);
    }
}

#[test]
#[ignore = "a minute of measurement that prints figures"]
fn twenty_readers_beside_the_servo() {
    measure(Kind::Readers);
}

#[test]
#[ignore = "a minute of measurement that prints figures and builds the viewer with its graphics crates"]
fn twenty_viewers_of_text_beside_the_servo() {
    measure(Kind::Viewers { drawing: 0 });
}

#[test]
#[ignore = "a minute of measurement that prints figures and needs an adapter to draw with"]
fn twenty_viewers_of_which_two_draw_beside_the_servo() {
    measure(Kind::Viewers { drawing: 2 });
}
