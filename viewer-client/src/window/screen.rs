//! The window's surface: its format, its size, and what to do when it is outdated, lost or hidden.
//!
//! Vertical synchronisation (Fifo) paces real displays. A plain format is preferred to an sRGB one, because the panels are
//! blended in that space; the renderer takes either.

use crate::gpu::{Gpu, GpuError};
use std::sync::Arc;
use wgpu::{CurrentSurfaceTexture, Instance, InstanceDescriptor, PresentMode, Surface, SurfaceConfiguration};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Why there is nothing to draw on.
#[derive(Debug, thiserror::Error)]
pub(super) enum ScreenError {
    /// The window system gives no surface.
    #[error(
        "no graphics adapter can draw on the window ({reason}); install a driver, or the software adapter with \
         `apt install libvulkan1 mesa-vulkan-drivers`, or try WGPU_BACKEND=gl or vulkan"
    )]
    NoSurface {
        /// wgpu's word for it.
        reason: String,
    },
    /// No adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Adapter and window do not fit.
    #[error("the graphics adapter {adapter} cannot show on this window; try WGPU_BACKEND=gl or vulkan")]
    Unfit {
        /// Name and backend.
        adapter: String,
    },
}

/// A window's surface.
pub(super) struct Screen {
    window: Arc<Window>,
    surface: Surface<'static>,
    config: SurfaceConfiguration,
}

/// What became of asking for the next picture's target.
pub(super) enum Next {
    /// Draw into this.
    Target(wgpu::SurfaceTexture),
    /// Not now; ask again at the next picture.
    Later,
}

impl Screen {
    /// Opens an adapter for this window and makes the window's surface.
    pub(super) fn open(event_loop: &ActiveEventLoop, window: &Arc<Window>) -> Result<(Self, Gpu), ScreenError> {
        let display = Box::new(event_loop.owned_display_handle());
        let instance = Instance::new(InstanceDescriptor::new_with_display_handle_from_env(display));
        let surface = make(&instance, window)?;
        let gpu = Gpu::for_surface(instance, &surface)?;
        let size = window.inner_size();
        let config = surface.get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1));
        let mut config = config.ok_or_else(|| ScreenError::Unfit { adapter: gpu.describe() })?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        let plain = formats.iter().find(|format| !format.is_srgb() && four_bytes(**format));
        config.format = plain.copied().unwrap_or(config.format);
        config.present_mode = PresentMode::Fifo;
        surface.configure(&gpu.device, &config);
        Ok((Self { window: window.clone(), surface, config }, gpu))
    }

    pub(super) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// The window has another size; a minimised window keeps its last one.
    pub(super) fn resize(&mut self, gpu: &Gpu, width: u32, height: u32) {
        if width > 0 && height > 0 {
            let largest = gpu.device.limits().max_texture_dimension_2d;
            (self.config.width, self.config.height) = (width.min(largest), height.min(largest));
            self.surface.configure(&gpu.device, &self.config);
        }
    }

    /// The target of the next picture.
    pub(super) fn next(&mut self, gpu: &Gpu) -> Result<Next, ScreenError> {
        match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) => Ok(Next::Target(texture)),
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded | CurrentSurfaceTexture::Validation => {
                Ok(Next::Later)
            }
            CurrentSurfaceTexture::Suboptimal(texture) => {
                // It must be let go before the surface is set up anew.
                drop(texture);
                self.surface.configure(&gpu.device, &self.config);
                Ok(Next::Later)
            }
            CurrentSurfaceTexture::Outdated => {
                self.surface.configure(&gpu.device, &self.config);
                Ok(Next::Later)
            }
            CurrentSurfaceTexture::Lost => {
                self.surface = make(&gpu.instance, &self.window)?;
                self.surface.configure(&gpu.device, &self.config);
                Ok(Next::Later)
            }
        }
    }
}

fn make(instance: &Instance, window: &Arc<Window>) -> Result<Surface<'static>, ScreenError> {
    instance
        .create_surface(window.clone())
        .map_err(|e| ScreenError::NoSurface { reason: e.to_string().trim_end_matches(": {}").to_owned() })
}

/// Formats that a screenshot can read back.
pub(super) fn four_bytes(format: wgpu::TextureFormat) -> bool {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba8UnormSrgb};
    matches!(format, Bgra8Unorm | Bgra8UnormSrgb | Rgba8Unorm | Rgba8UnormSrgb)
}
