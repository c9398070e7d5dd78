//! The side channel as C symbols, for a process that has loaded the shared library: names begin with `virtual_`.
//!
//! Faults are the words of a script ([`crate::faults`]), so that no second list of numbers exists.
#![expect(unsafe_code, reason = "a C interface exports names and takes pointers from its client")]

use crate::control;
use crate::faults::Script;
use crate::world::Setup;
use sim_core::vector::Vec3;
use std::ffi::{CStr, c_char};
use std::panic::catch_unwind;

macro_rules! exports {
    ($(fn $name:ident($($arg:ident: $ty:ty),*) -> $ret:ty = $fallback:expr; $body:block)*) => { $(
        // SAFETY: no other object of a process that loads this one exports these names.
        #[unsafe(no_mangle)]
        pub(crate) extern "C" fn $name($($arg: $ty),*) -> $ret {
            catch_unwind(move || $body).unwrap_or($fallback)
        }
    )* };
}

fn vector(pointer: *const f64) -> Vec3 {
    if pointer.is_null() {
        return Vec3::zeros();
    }
    // SAFETY: the client gives three numbers, or null.
    let numbers = unsafe { std::slice::from_raw_parts(pointer, 3) };
    Vec3::from_column_slice(numbers)
}

exports! {
    fn virtual_reset() -> u8 = 0; {
        control::reset(&Setup::default());
        1
    }
    fn virtual_step(ticks: u32) -> u8 = 0; {
        control::step(ticks);
        1
    }
    fn virtual_lead(device: u32, position_mm: *const f64) -> u8 = 0; {
        control::lead(device, vector(position_mm));
        1
    }
    fn virtual_press(device: u32, buttons: u32) -> u8 = 0; {
        control::press(device, buttons);
        1
    }
    fn virtual_inject(device: u32, fault: *const c_char) -> u8 = 0; {
        if fault.is_null() {
            return 0;
        }
        // SAFETY: the client gives a string with an end.
        let text = unsafe { CStr::from_ptr(fault) }.to_string_lossy();
        let fault = Script::parse(&format!("0:{text}")).due(0.0);
        fault.map_or(0, |fault| { control::inject(device, fault); 1 })
    }
    fn virtual_arrived_n(device: u32, out: *mut f64) -> u8 = 0; {
        let force = control::arrived_n(device);
        if out.is_null() {
            return 0;
        }
        // SAFETY: the client gives room for three numbers.
        unsafe { std::ptr::copy_nonoverlapping(force.as_ptr(), out, 3) };
        1
    }
}
