//! Reads triangle surfaces from Wavefront OBJ text.
//!
//! Understood: `v`, and `f` with `v`, `v/vt`, `v//vn`, `v/vt/vn`, counted from 1 or backwards from −1;
//! polygons are cut into a fan (k corners → k − 2 triangles). Names, groups, materials, normals and texture
//! coordinates are skipped. Coordinates become metres by the scene's `metres_per_unit`. Nothing is welded,
//! repaired or dropped: what cannot be used is refused with file:line:column and the remedy.
//! Counts are bounded by [`ObjLimits`], and growth by the text itself, so a small file never asks for
//! much memory. Deliberately absent: free-form surfaces, lines continued by a backslash.

use sim_core::tissue::triangle_mesh::TriangleMesh;
use sim_core::vector::Vec3;

/// Largest coordinate after scaling, metres: nothing a hand can suture is larger.
const LARGEST_COORDINATE_M: f64 = 10.0;

/// Bounds on a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjLimits {
    /// Bytes of text.
    pub bytes: usize,
    /// Vertices.
    pub vertices: usize,
    /// Triangles after fanning.
    pub triangles: usize,
}

impl Default for ObjLimits {
    fn default() -> Self {
        Self { bytes: 64 << 20, vertices: 200_000, triangles: 400_000 }
    }
}

/// What is wrong with a mesh file, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}:{column}: {what}")]
pub struct ObjError {
    /// Name of the file as the user gave it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in bytes, from 1.
    pub column: usize,
    /// What is wrong and what to do.
    pub what: String,
}

/// Statements that carry nothing a tissue needs.
const SKIPPED: [&str; 12] = ["vt", "vn", "vp", "g", "o", "s", "usemtl", "mtllib", "usemap", "maplib", "l", "p"];

/// A word and the column where it starts.
#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    column: usize,
}

fn words(line: &str) -> impl Iterator<Item = Word<'_>> {
    line.split_ascii_whitespace().map(|text| Word { text, column: text.as_ptr() as usize - line.as_ptr() as usize + 1 })
}

/// What is wrong within one line.
struct Fault {
    column: usize,
    what: String,
}

fn fault<T>(word: Word<'_>, what: String) -> Result<T, Fault> {
    Err(Fault { column: word.column, what })
}

/// Reads a surface; `file` is used in messages only.
///
/// # Errors
/// [`ObjError`] says what is wrong, where, and how to mend it.
pub fn read_obj(bytes: &[u8], file: &str, metres_per_unit: f64, limits: ObjLimits) -> Result<TriangleMesh, ObjError> {
    let at =
        |line: usize, fault: Fault| ObjError { file: file.to_owned(), line, column: fault.column, what: fault.what };
    if bytes.len() > limits.bytes {
        let what = format!("the file has {} bytes, at most {} are read; coarsen the mesh", bytes.len(), limits.bytes);
        return Err(at(1, Fault { column: 1, what }));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let before = &bytes[..e.valid_up_to()];
        let line = 1 + before.iter().filter(|&&b| b == b'\n').count();
        let column = 1 + before.iter().rev().take_while(|&&b| b != b'\n').count();
        at(line, Fault { column, what: "not UTF-8 text; export the mesh as a text OBJ".to_owned() })
    })?;
    let mut mesh = TriangleMesh { vertices_m: Vec::new(), faces: Vec::new() };
    let mut vertex_lines: Vec<usize> = Vec::new();
    let mut used: Vec<bool> = Vec::new();
    let mut last_line = 1;
    for (number, line) in (1..).zip(text.lines()) {
        last_line = number;
        let line = line.split_once('#').map_or(line, |(before, _)| before);
        let mut words = words(line);
        let Some(keyword) = words.next() else { continue };
        let result = match keyword.text {
            "v" => vertex(keyword, words, metres_per_unit, limits, &mut mesh),
            "f" => face(keyword, words, limits, &mut mesh, &mut used),
            other if SKIPPED.contains(&other) => Ok(()),
            other => fault(
                keyword,
                format!(
                    "statement {other:?} is not understood; export polygons only (v and f statements), one per line"
                ),
            ),
        };
        result.map_err(|f| at(number, f))?;
        vertex_lines.resize(mesh.vertices_m.len(), number);
    }
    if mesh.faces.is_empty() {
        let what = "the file ends without a face; export the surface as polygons (f statements)".to_owned();
        return Err(at(last_line, Fault { column: 1, what }));
    }
    used.resize(mesh.vertices_m.len(), false);
    if let Some(loose) = used.iter().position(|u| !u) {
        let what = format!("vertex {} belongs to no face; remove loose vertices in the modelling program", loose + 1);
        return Err(at(vertex_lines[loose], Fault { column: 1, what }));
    }
    Ok(mesh)
}

fn vertex<'a>(
    keyword: Word<'a>,
    mut words: impl Iterator<Item = Word<'a>>,
    metres_per_unit: f64,
    limits: ObjLimits,
    mesh: &mut TriangleMesh,
) -> Result<(), Fault> {
    if mesh.vertices_m.len() >= limits.vertices {
        return fault(keyword, format!("more than {} vertices; coarsen the mesh", limits.vertices));
    }
    let mut position = Vec3::zeros();
    for axis in 0..3 {
        let Some(word) = words.next() else {
            return fault(keyword, format!("a vertex needs 3 coordinates, here are {axis}; complete the line"));
        };
        position[axis] = match word.text.parse::<f64>() {
            Ok(x) if (x * metres_per_unit).abs() <= LARGEST_COORDINATE_M => x * metres_per_unit,
            Ok(x) => {
                return fault(
                    word,
                    format!(
                        "coordinate {x} is not within {LARGEST_COORDINATE_M} m at {metres_per_unit} metres per unit; \
                         correct it or the unit in the scene file"
                    ),
                );
            }
            Err(_) => return fault(word, format!("{:?} is not a number; give a decimal coordinate", word.text)),
        };
    }
    mesh.vertices_m.push(position);
    Ok(())
}

fn face<'a>(
    keyword: Word<'a>,
    words: impl Iterator<Item = Word<'a>>,
    limits: ObjLimits,
    mesh: &mut TriangleMesh,
    used: &mut Vec<bool>,
) -> Result<(), Fault> {
    let mut first: Option<u32> = None;
    let mut previous: Option<u32> = None;
    let mut triangles = 0;
    for word in words {
        let corner = corner(word, mesh.vertices_m.len())?;
        used.resize(mesh.vertices_m.len(), false);
        used[corner as usize] = true;
        let (Some(a), Some(b)) = (first, previous) else {
            (previous, first) = (first.map(|_| corner), first.or(Some(corner)));
            if previous == first && previous.is_some() {
                return fault(
                    word,
                    format!("vertex {} stands twice in this face; remove the degenerate face", corner + 1),
                );
            }
            continue;
        };
        if corner == a || corner == b {
            return fault(word, format!("vertex {} stands twice in this face; remove the degenerate face", corner + 1));
        }
        if mesh.faces.len() >= limits.triangles {
            return fault(word, format!("more than {} triangles; coarsen the mesh", limits.triangles));
        }
        mesh.faces.push([a, b, corner]);
        previous = Some(corner);
        triangles += 1;
    }
    if triangles == 0 {
        return fault(keyword, "a face needs at least 3 corners; complete or remove the line".to_owned());
    }
    Ok(())
}

/// Vertex index of one corner `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn corner(word: Word<'_>, vertex_count: usize) -> Result<u32, Fault> {
    let mut parts = word.text.split('/');
    let index = parts.next().unwrap_or_default();
    let rest_is_sound = parts.clone().count() <= 2 && parts.all(|p| p.is_empty() || p.parse::<i64>().is_ok());
    let (Ok(index), true) = (index.parse::<i64>(), rest_is_sound) else {
        return fault(word, format!("{:?} is not a corner; give v, v/vt, v//vn or v/vt/vn", word.text));
    };
    let count = i64::try_from(vertex_count).unwrap_or(i64::MAX);
    let from_zero = if index < 0 { count.checked_add(index) } else { index.checked_sub(1) };
    match from_zero.and_then(|i| u32::try_from(i).ok()).filter(|&i| (i as usize) < vertex_count) {
        Some(i) if index != 0 => Ok(i),
        _ => fault(
            word,
            format!(
                "vertex {index} does not exist, {vertex_count} are defined above; count from 1, or from −1 backwards"
            ),
        ),
    }
}

#[cfg(test)]
mod tests;
