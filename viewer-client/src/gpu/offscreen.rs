//! A picture in the adapter's memory that can be read back.

use super::{Gpu, GpuError};
use std::sync::mpsc;
use wgpu::{BufferUsages, Extent3d, TextureFormat, TextureUsages, TextureView};

/// Bytes of a pixel.
const PIXEL: u32 = 4;

/// Rows of red, green, blue and alpha, from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height.
    pub size: [u32; 2],
    /// Four bytes a pixel, gamma-encoded.
    pub rgba: Vec<u8>,
}

/// A colour target with the memory for reading it back.
pub struct Offscreen {
    texture: wgpu::Texture,
    view: TextureView,
    buffer: wgpu::Buffer,
    size: [u32; 2],
    row: u32,
}

impl Offscreen {
    /// Format of the picture.
    pub const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

    /// Makes a target; each side is at least one pixel and at most what the adapter can.
    #[must_use]
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        Self::with_format(gpu, size, Self::FORMAT)
    }

    /// Makes a target of another format of four bytes a pixel.
    #[must_use]
    pub fn with_format(gpu: &Gpu, size: [u32; 2], format: TextureFormat) -> Self {
        let largest = gpu.device.limits().max_texture_dimension_2d;
        let [width, height] = size.map(|side| side.clamp(1, largest));
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("offscreen"),
            size: Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let row = (width * PIXEL).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: u64::from(row) * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view, buffer, size: [width, height], row }
    }

    /// What to draw into.
    #[must_use]
    pub fn view(&self) -> &TextureView {
        &self.view
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Hands in what was drawn and waits for the picture.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`] when the device was lost.
    pub fn read(&self, gpu: &Gpu, mut encoder: wgpu::CommandEncoder) -> Result<Picture, GpuError> {
        let [width, height] = self.size;
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.row),
                    rows_per_image: Some(height),
                },
            },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        gpu.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        let failed = |reason: String| GpuError::ReadBack { reason };
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
        match receiver.try_recv() {
            Ok(result) => result.map_err(|e| failed(e.to_string()))?,
            Err(error) => return Err(failed(error.to_string())),
        }
        let mut rgba = Vec::with_capacity((width * height * PIXEL) as usize);
        {
            let bytes = self.buffer.get_mapped_range(..).map_err(|e| failed(e.to_string()))?;
            for row in bytes.chunks_exact(self.row as usize) {
                rgba.extend_from_slice(&row[..(width * PIXEL) as usize]);
            }
        }
        self.buffer.unmap();
        Ok(Picture { size: self.size, rgba })
    }
}
