//! Faults: what a test or a script can do to a device.
//!
//! A script is a list `SECONDS:FAULT`, separated by semicolons, seconds since the first tick:
//! `2:error=0x302;4.5:unplug;6:replug;7:warm=0.8;8:jump=20;9:garbage=4;10:freeze=30;11:uncalibrate;12:buttons=3`.
//! Faults act on device 0. Deliberately absent: what a fault does (`device.rs`, `ailments.rs`).

use crate::codes;

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// An error of this code appears on the stack at the next frame.
    Error(u32),
    /// The cable is pulled.
    Unplug,
    /// The cable is back.
    Replug,
    /// The device says that its calibration is lost; the stylus has to go into the inkwell again.
    Uncalibrate,
    /// Motors of this temperature.
    Warm(f64),
    /// The encoders slip by this way along x, millimetres, for good.
    Jump(f64),
    /// So many frames of numbers that are none.
    Garbage(u32),
    /// So many frames show the same pose, whatever the stylus does.
    Freeze(u32),
    /// These buttons are down whatever the hand does (0: none is stuck).
    Buttons(u32),
    /// The device is locked by a killed client: it cannot be opened.
    Lock,
}

impl Fault {
    /// Whether the motors are without current from then on.
    pub(crate) fn stops_motors(self) -> bool {
        match self {
            Self::Error(code) => (codes::WARM_MOTORS..=codes::FORCE_ERROR).contains(&code),
            Self::Unplug => true,
            _ => false,
        }
    }

    /// From the text of a script.
    fn parse(text: &str) -> Option<Self> {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let whole = || {
            let (digits, radix) = value.strip_prefix("0x").map_or((value, 10), |hex| (hex, 16));
            u32::from_str_radix(digits, radix).ok()
        };
        let number = || value.parse::<f64>().ok().filter(|n| n.is_finite());
        Some(match name {
            "error" => Self::Error(whole()?),
            "unplug" => Self::Unplug,
            "replug" => Self::Replug,
            "uncalibrate" => Self::Uncalibrate,
            "warm" => Self::Warm(number()?),
            "jump" => Self::Jump(number()?),
            "garbage" => Self::Garbage(whole()?),
            "freeze" => Self::Freeze(whole()?),
            "buttons" => Self::Buttons(whole()?),
            "lock" => Self::Lock,
            _ => return None,
        })
    }
}

/// Faults with their times, earliest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Script {
    entries: Vec<(f64, Fault)>,
}

impl Script {
    /// From text; entries that are not understood are left out.
    pub(crate) fn parse(text: &str) -> Self {
        let entry = |part: &str| {
            let (time, fault) = part.trim().split_once(':')?;
            Some((time.parse::<f64>().ok().filter(|t| t.is_finite())?, Fault::parse(fault)?))
        };
        let mut entries: Vec<_> = text.split(';').filter_map(entry).collect();
        entries.sort_by(|a, b| f64::total_cmp(&b.0, &a.0));
        Self { entries }
    }

    /// The next fault that is due.
    pub(crate) fn due(&mut self, time_s: f64) -> Option<Fault> {
        let is_due = self.entries.last().is_some_and(|(at, _)| *at <= time_s);
        if is_due { self.entries.pop().map(|(_, fault)| fault) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_gives_its_faults_in_the_order_of_time() {
        let mut script = Script::parse("4.5:unplug; 2:error=0x302;nonsense;7:warm=0.8;x:lock;9:jump=nan");
        assert_eq!(script.due(1.9), None);
        assert_eq!(script.due(2.0), Some(Fault::Error(0x302)));
        assert_eq!(script.due(2.0), None);
        assert_eq!(script.due(9.0), Some(Fault::Unplug));
        assert_eq!(script.due(9.0), Some(Fault::Warm(0.8)));
        assert_eq!(script.due(9e9), None);
    }
}
