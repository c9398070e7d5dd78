//! The picture as a file: drawn once more into a texture that can be read back, written as PNG, never over an old file.

use super::screen::four_bytes;
use crate::gpu::{Gpu, GpuError, Offscreen, png};
use crate::samples::new_file;
use std::io::Write;
use std::path::{Path, PathBuf};
use wgpu::TextureFormat;

/// Draws with `draw` and writes `screenshot-N.png`; says which file.
pub(super) fn take(
    gpu: &Gpu,
    format: TextureFormat,
    size: [u32; 2],
    folder: &Path,
    draw: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::TextureView),
) -> Result<PathBuf, String> {
    if !four_bytes(format) {
        return Err(format!("this window's pixels are of a kind that is not read back ({format:?})"));
    }
    let target = Offscreen::with_format(gpu, size, format);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("screenshot") });
    draw(&mut encoder, target.view());
    let mut picture = target.read(gpu, encoder).map_err(|e: GpuError| e.to_string())?;
    if matches!(format, TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb) {
        for pixel in picture.rgba.chunks_exact_mut(4) {
            pixel.swap(0, 2);
        }
    }
    // Encoded before there is a file: a viewer that is ended meanwhile leaves no empty one.
    let mut bytes = Vec::new();
    png::encode(&picture, &mut bytes).map_err(|e| e.to_string())?;
    let (path, mut file) = new_file(folder, "screenshot", "png").map_err(|e| format!("{}: {e}", folder.display()))?;
    file.write_all(&bytes).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}
