//! Containment of non-finite values: a state is never left with a NaN or an infinity in it.
//!
//! Rule: the offending node goes back to its last good position and stands still, and the event is
//! counted; every other node keeps its bits. Inputs from outside (handle targets, forces) that are
//! not finite are replaced by the last good value, or by zero where there is none.
//! Deliberately absent: any decision about what to do next; callers report the counts.

use crate::vector::Vec3;

/// True when all three components are finite.
#[must_use]
#[inline]
pub fn is_finite(v: &Vec3) -> bool {
    // 0·x is 0 for every finite x and NaN for an infinity or a NaN: one compare instead of three.
    (v.x * 0.0 + v.y * 0.0 + v.z * 0.0) == 0.0
}

/// `value` where it is finite, else `good`, with the event counted.
#[must_use]
#[inline]
pub fn finite_or(value: Vec3, good: Vec3, contained: &mut u32) -> Vec3 {
    if is_finite(&value) {
        return value;
    }
    *contained += 1;
    good
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_component_counts() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for axis in 0..3 {
                let mut v = Vec3::new(1e300, -1e300, 5e-324);
                assert!(is_finite(&v));
                v[axis] = bad;
                assert!(!is_finite(&v), "{bad} on axis {axis}");
            }
        }
    }

    #[test]
    fn a_bad_value_gives_way_to_the_last_good_one() {
        let good = Vec3::new(1.0, 2.0, 3.0);
        let mut count = 0;
        assert_eq!(finite_or(Vec3::new(f64::NAN, 0.0, 0.0), good, &mut count), good);
        assert_eq!(finite_or(Vec3::zeros(), good, &mut count), Vec3::zeros());
        assert_eq!(count, 1);
    }
}
