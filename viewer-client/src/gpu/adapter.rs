//! Choice of the adapter and its device.

use super::finish;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use wgpu::{Adapter, Backend, Backends, Device, DeviceType, Instance, InstanceDescriptor, Limits, Queue, Surface};

/// Buffers that the making of the vertices binds at once.
const STORAGE_BUFFERS: u32 = 6;

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// Nothing that draws was found.
    #[error(
        "no graphics adapter was found ({reason}); install a driver, or the software adapter with \
         `apt install libvulkan1 mesa-vulkan-drivers` (for WGPU_BACKEND=gl: `apt install libegl1 libgl1-mesa-dri`)"
    )]
    NoAdapter {
        /// wgpu's word for it.
        reason: String,
    },
    /// The adapter cannot do what the viewer needs.
    #[error("the graphics adapter {adapter} cannot {what}; update its driver, or set WGPU_BACKEND to vulkan or gl")]
    Unable {
        /// Name and backend.
        adapter: String,
        /// What is missing.
        what: &'static str,
    },
    /// The device was refused.
    #[error("the graphics adapter {adapter} refuses a device ({reason}); close other programs that use it")]
    NoDevice {
        /// Name and backend.
        adapter: String,
        /// wgpu's word for it.
        reason: String,
    },
    /// A picture did not come back.
    #[error("the picture cannot be read back ({reason}); the graphics driver has failed, start the viewer again")]
    ReadBack {
        /// wgpu's word for it.
        reason: String,
    },
}

/// An adapter with an open device.
pub struct Gpu {
    /// Entry to the drivers.
    pub instance: Instance,
    /// What draws.
    pub adapter: Adapter,
    /// Maker of buffers, textures and pipelines.
    pub device: Device,
    /// Where work is handed in.
    pub queue: Queue,
    faults: Arc<AtomicU32>,
    /// Asked once: wgpu answers with strings.
    is_software: bool,
}

impl Gpu {
    /// Opens an adapter that need not show anything.
    ///
    /// # Errors
    /// [`GpuError`] when there is none or it cannot draw the scene.
    pub fn headless() -> Result<Self, GpuError> {
        Self::open(Instance::new(InstanceDescriptor::new_without_display_handle_from_env()), None)
    }

    /// Opens an adapter of one of these backends that need not show anything, whatever the environment says.
    ///
    /// # Errors
    /// [`GpuError`] when there is none or it cannot draw the scene.
    pub fn headless_on(backends: Backends) -> Result<Self, GpuError> {
        let descriptor = InstanceDescriptor { backends, ..InstanceDescriptor::new_without_display_handle() };
        Self::open(Instance::new(descriptor), None)
    }

    /// Opens an adapter that can show on this surface of this instance.
    ///
    /// # Errors
    /// [`GpuError`] when there is none or it cannot draw the scene.
    pub fn for_surface(instance: Instance, surface: &Surface<'_>) -> Result<Self, GpuError> {
        Self::open(instance, Some(surface))
    }

    fn open(instance: Instance, surface: Option<&Surface<'_>>) -> Result<Self, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter = finish(instance.request_adapter(&options))
            .map_err(|error| GpuError::NoAdapter { reason: one_line(&error.to_string()) })?;
        let name = describe(&adapter);
        if adapter.limits().max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
            return Err(GpuError::Unable { adapter: name, what: "bind six buffers at once, which make the normals" });
        }
        if !adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
            return Err(GpuError::Unable { adapter: name, what: "run compute shaders, which make the normals" });
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("viewer"),
            required_features: wgpu::Features::empty(),
            required_limits: limits(&adapter),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            trace: wgpu::Trace::Off,
        };
        let (device, queue) = finish(adapter.request_device(&descriptor))
            .map_err(|error| GpuError::NoDevice { adapter: name, reason: one_line(&error.to_string()) })?;
        let faults = Arc::new(AtomicU32::new(0));
        let counted = Arc::clone(&faults);
        // A driver's fault costs a picture, not the viewer; only the first is said.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            if counted.fetch_add(1, Ordering::Relaxed) == 0 {
                eprintln!("viewer-client: the graphics device reports: {}", one_line(&error.to_string()));
            }
        }));
        let is_software = is_software(&adapter);
        Ok(Self { instance, adapter, device, queue, faults, is_software })
    }

    /// Name and backend of the adapter, for a person.
    #[must_use]
    pub fn describe(&self) -> String {
        describe(&self.adapter)
    }

    /// Faults that the device has reported so far.
    #[must_use]
    pub fn faults(&self) -> u32 {
        self.faults.load(Ordering::Relaxed)
    }

    /// Whether a processor does the drawing.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.is_software
    }
}

fn is_software(adapter: &Adapter) -> bool {
    let info = adapter.get_info();
    // Through GL a software renderer does not always say what it is.
    info.device_type == DeviceType::Cpu || info.name.contains("llvmpipe") || info.name.contains("softpipe")
}

/// What every adapter has, and of buffers and textures as much as this one has.
fn limits(adapter: &Adapter) -> Limits {
    let own = adapter.limits();
    let mut limits = Limits::downlevel_defaults().using_resolution(own.clone());
    limits.max_buffer_size = own.max_buffer_size;
    limits.max_storage_buffer_binding_size = own.max_storage_buffer_binding_size;
    limits.max_storage_buffers_per_shader_stage = own.max_storage_buffers_per_shader_stage;
    limits.max_compute_workgroups_per_dimension = own.max_compute_workgroups_per_dimension;
    limits
}

fn describe(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    let backend = match info.backend {
        Backend::Vulkan => "Vulkan",
        Backend::Gl => "GL",
        other => other.to_str(),
    };
    format!("{} ({backend})", info.name)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
