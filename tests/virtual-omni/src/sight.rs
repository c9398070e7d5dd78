//! What the virtual hand sees, as lines: from a process of its own that reads the tissue port as any viewer would.
//!
//! The hand lives inside the server's servo process, behind the device's interface. Reading shared memory there would put a second
//! copy of the transport into that process, and two copies of it take each other's participants for dead (their file locks
//! belong to the process, not to the copy). So a helper process reads, and writes one line of numbers per port; an empty line
//! every 100 ms tells it when nobody listens any more. Metres, scene frame.

use haptic_server::device::HandView;
use protocol::ports::{PortNode, TissuePortSubscriber};
use protocol::run::{Environment, RunRoot};
use sim_core::vector::Vec3;
use std::io::Write;
use std::time::Duration;

/// Time between two looks.
const LOOK_PERIOD: Duration = Duration::from_millis(2);
/// Time between two attempts to find a server.
const SEARCH_PERIOD: Duration = Duration::from_millis(50);
/// Looks between two empty lines.
const LOOKS_PER_SIGN: u32 = 50;
/// Numbers of a line.
const NUMBERS: usize = 16;

/// Looks for a server and tells what is seen until nobody listens.
pub fn tell(out: &mut dyn Write) {
    while writeln!(out).and_then(|()| out.flush()).is_ok() {
        // A server that is not there yet, or a port that it has not opened yet, is looked for again.
        let _not_yet = look(out);
        std::thread::sleep(SEARCH_PERIOD);
    }
}

/// Looks until something breaks.
fn look(out: &mut dyn Write) -> Option<()> {
    let run = RunRoot::open(&Environment::of_process()).ok()?.attach().ok()?;
    let node = PortNode::join(&run, "virtual-hand").ok()?;
    let mut ports = TissuePortSubscriber::open(&node).ok()?;
    for looks in 1_u32.. {
        if let Some(port) = ports.newest().ok()? {
            writeln!(out, "{}", to_line(&HandView::from(&port))).and_then(|()| out.flush()).ok()?;
        } else if looks.is_multiple_of(LOOKS_PER_SIGN) {
            writeln!(out).and_then(|()| out.flush()).ok()?;
        }
        std::thread::sleep(LOOK_PERIOD);
    }
    None
}

/// A view as numbers with blanks between.
#[must_use]
pub fn to_line(view: &HandView) -> String {
    let whole = [view.stage, view.pair, view.pair_count, view.stitches, view.scene_generation].map(|n| n.to_string());
    let real = [view.target_m, view.target_normal, view.across];
    let real = real.iter().flat_map(|v| v.iter().copied()).chain([view.gap_m, view.closed_gap_m]);
    whole.into_iter().chain(real.map(|n| n.to_string())).collect::<Vec<_>>().join(" ")
}

/// The view of a line; `None` for a line that is none.
#[must_use]
pub fn from_line(line: &str) -> Option<HandView> {
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.len() != NUMBERS {
        return None;
    }
    let whole = |i: usize| words[i].parse::<u32>().ok();
    let real = |i: usize| words[i].parse::<f64>().ok();
    let vector = |i: usize| Some(Vec3::new(real(i)?, real(i + 1)?, real(i + 2)?));
    Some(HandView {
        valid: true,
        stage: whole(0)?,
        pair: whole(1)?,
        pair_count: whole(2)?,
        stitches: whole(3)?,
        scene_generation: whole(4)?,
        target_m: vector(5)?,
        target_normal: vector(8)?,
        across: vector(11)?,
        gap_m: real(14)?,
        closed_gap_m: real(15)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_view_survives_its_line_to_the_last_bit() {
        let view = HandView {
            valid: true,
            stage: 3,
            pair: 1,
            pair_count: 4,
            stitches: 2,
            scene_generation: 7,
            target_m: Vec3::new(0.1 + 0.2, -1e-9, 1.0 / 3.0),
            target_normal: Vec3::z(),
            across: Vec3::new(0.6, 0.8, 0.0),
            gap_m: 0.008_123_456_789,
            closed_gap_m: 0.001,
        };
        assert_eq!(from_line(&to_line(&view)), Some(view));
        assert_eq!(from_line(""), None);
    }

    proptest! {
        #[test]
        fn no_line_makes_the_reader_panic(line in "[0-9a-z. -]{0,80}") {
            let _ = from_line(&line);
        }
    }
}
