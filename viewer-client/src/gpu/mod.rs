//! The graphics adapter: any that Vulkan or GL offers, the software ones included; `WGPU_BACKEND` narrows the choice.
//!
//! [`Gpu::headless`] needs no display, [`Gpu::for_surface`] takes an adapter that can show on a window.
//! [`Offscreen`] is a picture that can be read back, [`png`] writes it to a file. Colours are stored as a screen takes
//! them (gamma-encoded in a plain format), since egui blends in that space.

mod adapter;
mod offscreen;
pub mod png;

pub use adapter::{Gpu, GpuError};
pub use offscreen::{Offscreen, Picture};

use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Runs a future of wgpu to its end. On this kind of machine they are ready at once or after a poll of the device.
pub fn finish<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
        std::thread::yield_now();
    }
}
