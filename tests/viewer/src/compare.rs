//! How alike two pictures are, and where the stored ones lie.

use std::path::PathBuf;
use viewer_client::gpu::{Picture, png};

/// A pixel counts as different beyond this step of a colour (of 255): drivers round and filter differently by a few
/// steps, and a seam of noise may fall on the next pixel.
const PIXEL_STEPS: u8 = 24;
/// Share of different pixels that two drivers may have: edges of triangles may lie on other samples. Vulkan and GL of
/// Mesa 22.3 differ in none.
pub const SHARE_TOLERANCE: f64 = 0.010;
/// Mean difference of a colour in steps: the same, over flat parts. Vulkan and GL of Mesa 22.3 differ by 0.004.
pub const MEAN_TOLERANCE: f64 = 1.0;

/// Difference of two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean over all colours, in steps of 255.
    pub mean: f64,
    /// Share of pixels beyond [`PIXEL_STEPS`].
    pub share: f64,
}

impl Difference {
    /// Compares; pictures of different sizes are as different as can be.
    #[must_use]
    pub fn of(a: &Picture, b: &Picture) -> Self {
        if a.size != b.size {
            return Self { mean: 255.0, share: 1.0 };
        }
        let steps = a.rgba.iter().zip(&b.rgba).map(|(x, y)| x.abs_diff(*y));
        // Three colours a pixel differ, the fourth number never does.
        let mean = steps.clone().map(f64::from).sum::<f64>() / (0.75 * a.rgba.len().max(1) as f64);
        let largest: Vec<u8> = steps.collect();
        let pixels = largest.chunks_exact(4);
        let count = pixels.len().max(1) as f64;
        let different = pixels.filter(|p| p.iter().any(|step| *step > PIXEL_STEPS)).count();
        Self { mean, share: different as f64 / count }
    }

    /// Whether both pictures count as the same.
    #[must_use]
    pub fn is_small(&self) -> bool {
        self.mean <= MEAN_TOLERANCE && self.share <= SHARE_TOLERANCE
    }
}

/// Path of a stored picture.
#[must_use]
pub fn stored_path(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/golden")).join(format!("{name}.png"))
}

/// Compares with the stored picture; with `VIEWER_GOLDEN=write` in the environment it is stored instead.
///
/// # Panics
/// When the stored picture is missing, or the pictures differ.
pub fn assert_stored(name: &str, adapter: &str, picture: &Picture) {
    let path = stored_path(name);
    if std::env::var_os("VIEWER_GOLDEN").is_some_and(|v| v == "write") {
        png::save(picture, &path).unwrap_or_else(|e| panic!("{e}"));
        return;
    }
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let stored = png::decode(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let difference = Difference::of(picture, &stored);
    println!("{name} on {adapter}: {difference:?}");
    if !difference.is_small() {
        let seen = std::env::temp_dir().join(format!("{name}-seen.png"));
        // The assertion below says what matters.
        let _ = png::save(picture, &seen);
        panic!("{name} on {adapter} differs from its stored picture: {difference:?}; see {}", seen.display());
    }
}
