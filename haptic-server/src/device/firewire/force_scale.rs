//! From torque to converter counts: the file that `haptic-server calibrate-force` writes, and its limits.
//!
//! The scale of the motors' converters is not public, so without this file the device gives its pose and no force.
//! `n_i = τ_i / s_i`, with s in newton metres per count, sign included; when the largest |n| exceeds the file's own most,
//! all three shrink by one factor. The most is what was measured: nothing is extrapolated.
//! The file belongs to one device: another serial number is refused. Newtons, newton metres.

use crate::error::ServerError;
use serde::{Deserialize, Serialize};
use sim_core::vector::Vec3;
use std::path::Path;

/// Most force that a file may allow, newtons: the device's nominal peak.
const PEAK_N: f64 = 3.3;
/// A fit that leaves more than this share of the largest torque is no scale.
pub const WORST_RESIDUAL: f64 = 0.10;
/// Scales that motors of this size can have, newton metres per count: 0.01 to 4 N at 0.15 m over the whole converter.
const SCALES: [f64; 2] = [7e-7, 3e-4];

/// The file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceScaleFile {
    /// Serial number of the device.
    pub serial: String,
    /// Newton metres per count of each joint's motor, sign included.
    pub torque_n_m_per_count: [f64; 3],
    /// No motor gets more counts from zero than were measured.
    pub max_count: i16,
    /// No larger force is rendered, newtons.
    pub max_force_n: f64,
    /// Largest deviation of a reading from the fit, as a share of the largest torque of the joint.
    pub residual_share: [f64; 3],
    /// Readings that it rests upon.
    pub readings: usize,
}

/// A scale that may be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceScale {
    torque_n_m_per_count: Vec3,
    max_count: i16,
    max_force_n: f64,
}

impl ForceScaleFile {
    /// Reads it from text; the error says what is wrong and where.
    ///
    /// # Errors
    /// Unknown or missing keys, wrong types.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            format!("line {line}: {}", e.message())
        })
    }

    /// Checks it against the device.
    ///
    /// # Errors
    /// One sentence without the file's name: which value, which are allowed, what to do.
    pub fn check(&self, serial: &str) -> Result<ForceScale, String> {
        if self.serial != serial {
            return Err(format!(
                "it belongs to the device {:?}, and this is {serial:?}; run `haptic-server calibrate-force` for this one",
                self.serial
            ));
        }
        let [low, high] = SCALES;
        let measured = self.torque_n_m_per_count.into_iter().all(|s| s.abs() >= low && s.abs() <= high);
        let fits = self.residual_share.into_iter().all(|r| (0.0..=WORST_RESIDUAL).contains(&r));
        let wrong = if !measured {
            format!("torque_n_m_per_count must lie between {low} and {high} in size")
        } else if !fits {
            format!("residual_share must lie between 0 and {WORST_RESIDUAL}")
        } else if !(self.max_force_n > 0.0 && self.max_force_n <= PEAK_N) {
            format!("max_force_n must be more than 0 and at most {PEAK_N}")
        } else if !(1..=super::packet::DAC_MOST).contains(&self.max_count) {
            format!("max_count must lie between 1 and {}", super::packet::DAC_MOST)
        } else {
            return Ok(ForceScale {
                torque_n_m_per_count: Vec3::from(self.torque_n_m_per_count),
                max_count: self.max_count,
                max_force_n: self.max_force_n,
            });
        };
        Err(format!("{wrong}; run `haptic-server calibrate-force` again"))
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// 66 for one that is not there, 65 for one that cannot be used.
    pub fn load(path: &Path, serial: &str) -> Result<ForceScale, ServerError> {
        let text = std::fs::read_to_string(path).map_err(|e| ServerError::reading(path, &e))?;
        let scale = Self::parse(&text).and_then(|file| file.check(serial));
        scale.map_err(|why| ServerError::BadData(format!("{}: {why}", path.display())))
    }
}

impl ForceScale {
    /// Largest force, newtons.
    #[must_use]
    pub fn max_force_n(&self) -> f64 {
        self.max_force_n
    }

    /// A force, at most the largest; nothing if it is not finite.
    #[must_use]
    pub fn within(&self, force_n: Vec3) -> Vec3 {
        let size = force_n.norm();
        if !size.is_finite() {
            Vec3::zeros()
        } else if size > self.max_force_n {
            force_n * (self.max_force_n / size)
        } else {
            force_n
        }
    }

    /// Counts from zero for joint torques.
    #[must_use]
    pub fn counts(&self, torque_n_m: Vec3) -> [i16; 3] {
        let counts = torque_n_m.component_div(&self.torque_n_m_per_count);
        let (largest, most) = (counts.amax(), f64::from(self.max_count));
        if !counts.iter().all(|n| n.is_finite()) {
            return [0; 3];
        }
        let share = if largest > most { most / largest } else { 1.0 };
        std::array::from_fn(|i| (counts[i] * share).trunc() as i16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn file() -> ForceScaleFile {
        ForceScaleFile {
            serial: "51231700321".to_owned(),
            torque_n_m_per_count: [2e-4, -1e-4, 1e-4],
            max_count: 400,
            max_force_n: 0.4,
            residual_share: [0.02, 0.03, 0.01],
            readings: 24,
        }
    }

    #[test]
    fn a_file_is_read_back_and_refused_for_another_device_or_with_wild_values() {
        let text = toml::to_string(&file()).expect("plain values");
        assert_eq!(ForceScaleFile::parse(&text), Ok(file()));
        assert!(file().check("51231700321").is_ok());
        let other = file().check("51231700322").expect_err("another device");
        assert!(other.contains("51231700321") && other.contains("calibrate-force"), "{other}");
        let wild: [(&str, ForceScaleFile); 5] = [
            ("torque_n_m_per_count", ForceScaleFile { torque_n_m_per_count: [0.0, 1e-4, 1e-4], ..file() }),
            ("torque_n_m_per_count", ForceScaleFile { torque_n_m_per_count: [f64::NAN, 1e-4, 1e-4], ..file() }),
            ("residual_share", ForceScaleFile { residual_share: [0.0, 0.2, 0.0], ..file() }),
            ("max_force_n", ForceScaleFile { max_force_n: 4.0, ..file() }),
            ("max_count", ForceScaleFile { max_count: 0, ..file() }),
        ];
        for (key, broken) in wild {
            let why = broken.check("51231700321").expect_err(key);
            assert!(why.contains(key), "{why}");
        }
        let why = ForceScaleFile::parse("serial = \"1\"\nmax_count = \"many\"\n").expect_err("a text is no count");
        assert!(why.starts_with("line 2"), "{why}");
    }

    #[test]
    fn a_missing_file_is_no_input() {
        let error = ForceScaleFile::load(Path::new("no/such/file.toml"), "1").expect_err("missing");
        assert_eq!(error.exit_code(), crate::exit::NO_INPUT);
        assert!(error.to_string().contains("no/such/file.toml"));
    }

    proptest! {
        #[test]
        fn never_more_counts_than_were_measured(x in -10.0..10.0, y in -10.0..10.0, z in -10.0..10.0) {
            let scale = file().check("51231700321").expect("sound");
            let asked = Vec3::new(x, y, z);
            prop_assert!(scale.within(asked).norm() <= 0.4 + 1e-12);
            let counts = scale.counts(asked);
            prop_assert!(counts.iter().all(|n| n.abs() <= 400));
            // Same direction: what went out, as torque, is along what was asked, but for whole counts.
            let given = Vec3::new(f64::from(counts[0]) * 2e-4, f64::from(counts[1]) * -1e-4, f64::from(counts[2]) * 1e-4);
            prop_assert!(given.cross(&asked.normalize()).norm() < 4e-4 || asked.norm() < 1e-3);
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in ".{0,80}") {
            let _ = ForceScaleFile::parse(&text);
        }
    }
}
