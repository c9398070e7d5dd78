//! Support of the viewer's tests: small scenes made in code, adapters, comparison of pictures.

pub mod compare;
pub mod finer;
pub mod scene;

use viewer_client::camera::FixedView;
use viewer_client::gpu::Gpu;
use viewer_client::headless::Studio;
use viewer_client::render::Look;

/// Size of the stored pictures.
pub const SIZE: [u32; 2] = [160, 120];

/// An adapter of each backend that this machine has. A machine without one says so, and its tests count as skipped.
#[must_use]
pub fn adapters() -> Vec<Gpu> {
    let backends = [wgpu::Backends::VULKAN, wgpu::Backends::GL];
    let found: Vec<Gpu> = backends
        .into_iter()
        .filter_map(|backend| match Gpu::headless_on(backend) {
            Ok(gpu) => Some(gpu),
            Err(error) => {
                println!("skipped: {error}");
                None
            }
        })
        .collect();
    found
}

/// A studio of small pictures.
#[must_use]
pub fn studio(gpu: Gpu, look: Look) -> Studio {
    Studio::on(gpu, SIZE, FixedView::Surgeon, look)
}
