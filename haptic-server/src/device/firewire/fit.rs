//! From readings of a spring scale to the scale of the motors: least squares, and the refusals.
//!
//! Per joint `τ = s·n + c·sgn(n)`: s is the scale, c takes the friction of the gears, which holds back in either direction.
//! Normal equations over the readings (n_i, τ_i). Refused: too few readings or sizes, one direction only, a scale that differs by
//! more than a fifth between the directions, a largest residual above 10 % of the largest torque, no torque at all.
//! Newton metres, counts. Deliberately absent: asking for the readings (`calibrate.rs`).

use super::force_scale::WORST_RESIDUAL;

/// Sizes of a joint's counts that are needed in each direction.
const LEAST_SIZES: usize = 2;
/// Share by which the directions may differ.
const WORST_DIFFERENCE: f64 = 0.20;
/// Torques below this are nothing that a spring scale shows, newton metres.
const NOTHING_N_M: f64 = 1e-3;

/// One reading: motor of a joint, counts from zero, and the torque that the spring scale showed; positive
/// drives the joint's angle up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// 0 to 2.
    pub joint: usize,
    /// Counts.
    pub counts: i16,
    /// Newton metres.
    pub torque_n_m: f64,
}

/// The line through a joint's readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Newton metres per count.
    pub scale: f64,
    /// Newton metres that friction takes (negative) in either direction.
    pub friction: f64,
    /// Largest deviation, as a share of the largest torque.
    pub residual_share: f64,
}

/// Why readings give no scale.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few.
    #[error("joint {joint} has {sizes} sizes of counts in one direction, {LEAST_SIZES} are needed; read it again")]
    TooFew {
        /// From 1.
        joint: usize,
        /// How many there are.
        sizes: usize,
    },
    /// No torque.
    #[error("joint {joint} shows no torque (at most {torque} N·m); is the motor on, is the spring scale hooked in?")]
    Nothing {
        /// From 1.
        joint: usize,
        /// Largest torque.
        torque: f64,
    },
    /// A number that is none.
    #[error("joint {0} has a reading that is no number; read it again")]
    NotFinite(usize),
    /// Directions.
    #[error(
        "joint {joint} has {up:.3e} N·m per count in one direction and {down:.3e} in the other; check hook, lever and \
         direction, and read it again"
    )]
    Unequal {
        /// From 1.
        joint: usize,
        /// One direction.
        up: f64,
        /// The other.
        down: f64,
    },
    /// Residuals.
    #[error("joint {joint}: a reading lies {share:.0} % beside the line, {limit:.0} % are allowed; read it again")]
    Scattered {
        /// From 1.
        joint: usize,
        /// Per cent.
        share: f64,
        /// Per cent.
        limit: f64,
    },
}

/// The lines of all joints.
///
/// # Errors
/// [`FitError`] names the joint, the figure and what to do.
pub fn fit(readings: &[Reading]) -> Result<[Line; 3], FitError> {
    let mut lines = [Line { scale: 0.0, friction: 0.0, residual_share: 0.0 }; 3];
    for (joint, line) in lines.iter_mut().enumerate() {
        *line = fit_joint(joint, readings)?;
    }
    Ok(lines)
}

fn fit_joint(joint: usize, readings: &[Reading]) -> Result<Line, FitError> {
    let points: Vec<(f64, f64)> = readings
        .iter()
        .filter(|r| r.joint == joint && r.counts != 0)
        .map(|r| (f64::from(r.counts), r.torque_n_m))
        .collect();
    let joint = joint + 1;
    if !points.iter().all(|(_, t)| t.is_finite()) {
        return Err(FitError::NotFinite(joint));
    }
    let halves = [1.0, -1.0].map(|side| points.iter().copied().filter(|(n, _)| n * side > 0.0).collect::<Vec<_>>());
    for half in &halves {
        let mut sizes: Vec<f64> = half.iter().map(|(n, _)| *n).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.dedup();
        if sizes.len() < LEAST_SIZES {
            return Err(FitError::TooFew { joint, sizes: sizes.len() });
        }
    }
    let largest = points.iter().map(|(_, t)| t.abs()).fold(0.0, f64::max);
    if largest < NOTHING_N_M {
        return Err(FitError::Nothing { joint, torque: largest });
    }
    let [up, down] = halves.map(|half| straight(&half));
    if (up - down).abs() > WORST_DIFFERENCE * up.abs().max(down.abs()) {
        return Err(FitError::Unequal { joint, up, down });
    }
    let (scale, friction) = with_friction(&points);
    let worst = points.iter().map(|(n, t)| (t - scale * n - friction * n.signum()).abs()).fold(0.0, f64::max);
    let residual_share = worst / largest;
    // Not a number means the equations had no answer.
    if residual_share.is_nan() || residual_share > WORST_RESIDUAL {
        return Err(FitError::Scattered { joint, share: residual_share * 100.0, limit: WORST_RESIDUAL * 100.0 });
    }
    Ok(Line { scale, friction, residual_share })
}

/// Slope of the straight line with offset through the points of one direction.
fn straight(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean_n = points.iter().map(|(n, _)| n).sum::<f64>() / count;
    let mean_t = points.iter().map(|(_, t)| t).sum::<f64>() / count;
    let above: f64 = points.iter().map(|(n, t)| (n - mean_n) * (t - mean_t)).sum();
    let below: f64 = points.iter().map(|(n, _)| (n - mean_n) * (n - mean_n)).sum();
    above / below
}

/// Scale and friction by the normal equations of `τ = s·n + c·sgn(n)`.
fn with_friction(points: &[(f64, f64)]) -> (f64, f64) {
    let sum = |f: fn(f64, f64) -> f64| points.iter().map(|(n, t)| f(*n, *t)).sum::<f64>();
    let (nn, n1, one) = (sum(|n, _| n * n), sum(|n, _| n.abs()), points.len() as f64);
    let (nt, st) = (sum(|n, t| n * t), sum(|n, t| n.signum() * t));
    let determinant = nn * one - n1 * n1;
    ((nt * one - st * n1) / determinant, (nn * st - n1 * nt) / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn readings(of: impl Fn(usize, f64) -> f64) -> Vec<Reading> {
        let mut all = Vec::new();
        for joint in 0..3 {
            for counts in [100_i16, 200, 300, -100, -200, -300] {
                all.push(Reading { joint, counts, torque_n_m: of(joint, f64::from(counts)) });
            }
        }
        all
    }

    #[test]
    fn exact_readings_with_friction_give_scale_and_friction() {
        let scales = [2e-4, -1e-4, 1.5e-4];
        let lines = fit(&readings(|j, n| scales[j] * n - 0.004 * (scales[j] * n).signum())).expect("a clean rig");
        for (line, scale) in lines.iter().zip(scales) {
            assert!((line.scale - scale).abs() < 1e-15, "{line:?}");
            assert!((line.friction + 0.004 * scale.signum()).abs() < 1e-12 && line.residual_share < 1e-9);
        }
    }

    #[test]
    fn bad_readings_are_refused_by_their_fault() {
        let clean = |j: usize, n: f64| [2e-4, 1e-4, 1e-4][j] * n;
        let told = |all: &[Reading]| fit(all).expect_err("bad").to_string();
        let one_sided: Vec<Reading> = readings(clean).into_iter().filter(|r| r.counts > 0 || r.joint != 1).collect();
        assert!(told(&one_sided).contains("joint 2 has 0 sizes"));
        let dead = readings(|j, n| if j == 2 { 0.0 } else { clean(j, n) });
        assert!(told(&dead).contains("joint 3 shows no torque"));
        let unequal = readings(|j, n| if n < 0.0 && j == 0 { 0.7 * clean(j, n) } else { clean(j, n) });
        assert!(told(&unequal).contains("joint 1 has"));
        let scattered = readings(|j, n| clean(j, n) + if n.abs() == 200.0 { 0.012 * n.signum() } else { 0.0 });
        assert!(told(&scattered).contains("beside the line"), "{}", told(&scattered));
        let broken = readings(|j, n| if n > 200.0 { f64::NAN } else { clean(j, n) });
        assert!(told(&broken).contains("no number"));
    }

    proptest! {
        #[test]
        fn a_little_noise_moves_the_scale_by_as_little(scale in 5e-5..3e-4, noise in prop::array::uniform6(-0.001..0.001)) {
            let all: Vec<Reading> = readings(|_, n| scale * n)
                .into_iter()
                .zip(noise.into_iter().cycle())
                .map(|(r, e)| Reading { torque_n_m: r.torque_n_m + e, ..r })
                .collect();
            match fit(&all) {
                // Six readings within a thousandth of a newton metre, spread over ±300 counts: below 0.001/(√2·100).
                Ok(lines) => for line in lines {
                    let off: f64 = line.scale - scale;
                    prop_assert!(off.abs() < 1e-5, "{} for {}", line.scale, scale);
                },
                // The smallest scales drown in it: they are refused, not bent.
                Err(_) => prop_assert!(scale < 1.5e-4),
            }
        }
    }
}
