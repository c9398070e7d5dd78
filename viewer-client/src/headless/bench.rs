//! Frame times: every picture has new nodes, is handed in and waited for; reading it back is no part of it. A running server's
//! new frame is waited for before the time of its picture begins.

use super::{Failure, LOOK_AGAIN, Source, Studio, UNAVAILABLE};
use crate::feed::{Feed, View};
use std::time::{Duration, Instant};

/// Pictures in front whose time does not count: shaders are compiled in them.
const WARM_UP: u32 = 10;
/// Time of the scene from picture to picture, seconds.
const STEP_S: f64 = 1.0 / 30.0;
/// A running server sends 60 frames a second; one that sends none for this long has nothing to time.
const NEXT_FRAME: Duration = Duration::from_secs(3);

/// Times of many pictures.
#[derive(Clone, Debug)]
pub struct Timing {
    sorted_ms: Vec<f64>,
}

impl Timing {
    /// Sorts the times.
    #[must_use]
    pub fn of(times: &[Duration]) -> Self {
        let mut sorted_ms: Vec<f64> = times.iter().map(|t| t.as_secs_f64() * 1.0e3).collect();
        sorted_ms.sort_by(f64::total_cmp);
        Self { sorted_ms }
    }

    /// The time that this share of the pictures does not exceed, milliseconds.
    #[must_use]
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let rank = (share * self.sorted_ms.len() as f64).ceil() as usize;
        self.sorted_ms.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
    }
}

pub(super) fn run(count: u32, source: &mut Source, studio: &mut Studio) -> Result<(), Failure> {
    let mut times = Vec::with_capacity(count as usize);
    let mut processor_s = None;
    let begin_s = 0.0;
    for number in 0..WARM_UP + count {
        let view = match source {
            Source::Replay(recording) => {
                let duration_s = recording.duration_s().max(STEP_S);
                recording.seek((begin_s + f64::from(number) * STEP_S) % duration_s)
            }
            Source::Live { feed, .. } => next_frame(feed, times.len())?,
        };
        if number == WARM_UP {
            processor_s = processor_time_s();
        }
        let started = Instant::now();
        let encoder = studio.draw(view);
        studio.gpu().queue.submit([encoder.finish()]);
        let waited = studio.gpu().device.poll(wgpu::PollType::wait_indefinitely());
        waited.map_err(|e| Failure::unavailable(&format!("the graphics device does not answer ({e})")))?;
        if number >= WARM_UP {
            times.push(started.elapsed());
        }
    }
    let timing = Timing::of(&times);
    let [width, height] = studio.size();
    println!("adapter    {}", studio.gpu().describe());
    println!(
        "picture    {width} x {height}, {}, {} triangles of tissue",
        studio.renderer().detail(),
        studio.renderer().triangles()
    );
    println!(
        "frame time p50 {:.1} ms, p99 {:.1} ms, {count} pictures",
        timing.quantile_ms(0.5),
        timing.quantile_ms(0.99)
    );
    if let (Some(before), Some(after)) = (processor_s, processor_time_s()) {
        println!("processor  {:.1} ms a picture, all threads", 1.0e3 * (after - before) / f64::from(count));
    }
    if let Some(mib) = resident_mib() {
        println!("memory     {mib:.0} MiB resident");
    }
    Ok(())
}

/// The view with the next frame; the same frame twice would be a picture without new nodes.
fn next_frame(feed: &mut Feed, timed: usize) -> Result<&View, Failure> {
    let (shown, began) = (feed.view().frames, Instant::now());
    while feed.look().map_err(|e| Failure::unavailable(&e))?.frames == shown {
        if began.elapsed() > NEXT_FRAME {
            let sentence = format!(
                "no new frame of the tissue came within {} s, {timed} pictures were timed; check that the server still steps \
                 (`viewer-client --text`)",
                NEXT_FRAME.as_secs()
            );
            return Err(Failure { sentence, code: UNAVAILABLE });
        }
        std::thread::sleep(LOOK_AGAIN);
    }
    Ok(feed.view())
}

/// Processor time of this process, which other programs on the machine do not lengthen much; a software adapter works in
/// this time. `None` where the system does not say.
fn processor_time_s() -> Option<f64> {
    const TICKS_PER_S: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS_PER_S)
}

/// Memory of this process; `None` where the system does not say.
fn resident_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_one_of_the_times() {
        let times: Vec<Duration> = (1..=100).rev().map(Duration::from_millis).collect();
        let timing = Timing::of(&times);
        assert_eq!([0.5, 0.99, 1.0].map(|q| timing.quantile_ms(q).round()), [50.0, 99.0, 100.0]);
        assert_eq!(Timing::of(&[]).quantile_ms(0.5), 0.0);
    }
}
