//! Scalar parameters with their unit and their allowed range: a value of one of these types is
//! finite, inside its range, and SI.
//!
//! The only place where N/mm becomes N/m (×1000) and mm becomes m (÷1000). Table 2 of Zhang et al.
//! mixes k in N/mm with c in N·s/m; [`NewtonsPerMetre::from_n_per_mm`] is where that ends.
//! Deliberately absent: arithmetic between units. Formulas work on `f64` taken out by `get`.

/// Why a number is not a usable parameter.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{quantity} is {found} {unit}, outside {low} to {high} {unit}: give a value in that range")]
pub struct UnitError {
    /// What the number stands for.
    pub quantity: &'static str,
    /// The number found, in `unit`.
    pub found: f64,
    /// SI unit.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
}

macro_rules! unit {
    ($(#[$doc:meta])* $name:ident, $quantity:literal, $unit:literal, $low:expr, $high:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
        pub struct $name(f64);

        impl $name {
            /// Smallest allowed value.
            pub const LOW: f64 = $low;
            /// Largest allowed value.
            pub const HIGH: f64 = $high;

            /// Takes a value in SI units.
            ///
            /// # Errors
            /// [`UnitError`] when the value is not finite or outside the range.
            pub fn new(value: f64) -> Result<Self, UnitError> {
                if (Self::LOW..=Self::HIGH).contains(&value) {
                    return Ok(Self(value));
                }
                Err(UnitError { quantity: $quantity, found: value, unit: $unit, low: $low, high: $high })
            }

            /// The value in SI units.
            #[must_use]
            pub const fn get(self) -> f64 {
                self.0
            }
        }
    };
}

unit!(/// A length, at least 0.
    Metres, "length", "m", 0.0, 100.0);
unit!(/// A spring stiffness, at least 0.
    NewtonsPerMetre, "stiffness", "N/m", 0.0, 1.0e9);
unit!(/// A drag to ground of one node, at least 0.
    NewtonSecondsPerMetre, "drag", "N·s/m", 0.0, 1.0e6);
unit!(/// A mass, above 0.
    Kilograms, "mass", "kg", 1.0e-12, 1.0e4);
unit!(/// A density, above 0.
    KilogramsPerCubicMetre, "density", "kg/m³", 1.0e-3, 1.0e5);
unit!(/// A duration, above 0.
    Seconds, "duration", "s", 1.0e-9, 1.0e6);
unit!(/// The relaxation parameter β of Eq. (1): 0 is a hard tether, 1 none at all.
    Relaxation, "relaxation β", "(no unit)", 0.0, 1.0);

impl Metres {
    /// Takes millimetres.
    ///
    /// # Errors
    /// [`UnitError`] when the value is not finite or outside the range.
    pub fn from_mm(value: f64) -> Result<Self, UnitError> {
        Self::new(value / 1000.0)
    }
}

impl NewtonsPerMetre {
    /// Takes newtons per millimetre, the unit of Table 2.
    ///
    /// # Errors
    /// [`UnitError`] when the value is not finite or outside the range.
    pub fn from_n_per_mm(value: f64) -> Result<Self, UnitError> {
        Self::new(value * 1000.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn table2_stiffness_becomes_newtons_per_metre() {
        assert_eq!(NewtonsPerMetre::from_n_per_mm(0.16).unwrap().get(), 160.0);
        assert_eq!(Metres::from_mm(2.5).unwrap().get(), 0.0025);
    }

    #[test]
    fn refusal_names_value_and_range() {
        let error = Relaxation::new(1.2).unwrap_err();
        assert_eq!(error.found, 1.2);
        let text = error.to_string();
        assert!(text.contains("relaxation β is 1.2") && text.contains("0 to 1"), "{text}");
        assert!(Metres::new(f64::NAN).is_err() && Seconds::new(0.0).is_err());
    }

    proptest! {
        #[test]
        fn accepted_values_are_in_range(value in proptest::num::f64::ANY) {
            let accepted = (Metres::LOW..=Metres::HIGH).contains(&value);
            prop_assert_eq!(Metres::new(value).ok().map(Metres::get), accepted.then_some(value));
        }
    }
}
