//! A picture as a PNG file, without alpha: what is behind a window is of no interest.

use super::Picture;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a picture to a file; an old one is replaced.
///
/// # Errors
/// One sentence with the path.
pub fn save(picture: &Picture, path: &Path) -> Result<(), String> {
    let failed = |error: &dyn std::fmt::Display| {
        format!("cannot write {} ({error}); choose another file or free some space", path.display())
    };
    let file = File::create(path).map_err(|e| failed(&e))?;
    let mut writer = BufWriter::new(file);
    encode(picture, &mut writer).map_err(|e| failed(&e))?;
    writer.flush().map_err(|e| failed(&e))
}

/// Writes a picture to a stream.
///
/// # Errors
/// What the encoder or the stream says.
pub fn encode(picture: &Picture, sink: &mut impl Write) -> Result<(), ::png::EncodingError> {
    let [width, height] = picture.size;
    let mut encoder = ::png::Encoder::new(sink, width, height);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(::png::Compression::High);
    let mut writer = encoder.write_header()?;
    let rgb: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    writer.write_image_data(&rgb)?;
    writer.finish()
}

/// Reads what [`encode`] has written.
///
/// # Errors
/// What the decoder says, or that the pixels are of another kind.
pub fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let mut reader =
        ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(|e| format!("no PNG: {e}"))?;
    let mut rgb = vec![0; reader.output_buffer_size().ok_or("the picture is too large")?];
    let info = reader.next_frame(&mut rgb).map_err(|e| e.to_string())?;
    if (info.color_type, info.bit_depth) != (::png::ColorType::Rgb, ::png::BitDepth::Eight) {
        return Err("its pixels are not three bytes of red, green and blue".to_owned());
    }
    let rgba = rgb[..info.buffer_size()].chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], u8::MAX]).collect();
    Ok(Picture { size: [info.width, info.height], rgba })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back() {
        let rgba: Vec<u8> = (0..2 * 3).flat_map(|i| [10 * i, 255 - i, 7, u8::MAX]).collect();
        let picture = Picture { size: [2, 3], rgba };
        let mut bytes = Vec::new();
        encode(&picture, &mut bytes).unwrap();
        assert_eq!(decode(&bytes), Ok(picture));
        assert!(decode(b"no picture").is_err());
    }
}
