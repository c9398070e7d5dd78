//! The picture as a file: drawn once more into a texture that can be read back, written as PNG, never over an old file.

use super::screen::four_bytes;
use crate::gpu::{Gpu, GpuError, Offscreen, png};
use crate::samples::new_file;
use std::io::{BufWriter, Write};
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
    let (path, file) = new_file(folder, "screenshot", "png").map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut writer = BufWriter::new(file);
    let failed = |reason: String| format!("{}: {reason}", path.display());
    png::encode(&picture, &mut writer).map_err(|e| failed(e.to_string()))?;
    writer.flush().map_err(|e| failed(e.to_string()))?;
    Ok(path)
}
