//! Loads scene files: TOML text to a [`SceneSource`] with the mesh it names.
//!
//! Order: size cap, then read, then UTF-8, then TOML, then the mesh, which must lie in the scene's folder.
//! Every refusal is one sentence with file:line:column and the remedy; an unknown key names the nearest
//! known one. Deliberately absent: range checks of the values, which `sim_core::scene` makes.

use crate::cli::SceneArgs;
use crate::cli::choice::{ControlChoice, ProcedureChoice, SceneChoice};
use crate::error::ServerError;
use crate::servo::params::ServoConfig;
use crate::solver::mesh_obj::{ObjLimits, read_obj};
use serde::de::DeserializeOwned;
use sim_core::scene::build::SceneError;
use sim_core::scene::config::{ControlReading, SceneConfig, TissueConfig};
use sim_core::scene::presets;
use sim_core::scene::procedure::{Procedure, SceneSource};
use sim_core::tissue::triangle_mesh::TriangleMesh;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Largest scene file, bytes.
const LARGEST_SCENE_BYTES: u64 = 1 << 20;
/// Edits after which a key is no longer taken for a misspelling.
const NEAREST_KEY_EDITS: usize = 6;
/// Millimetres to metres.
const M_PER_MM: f64 = 1e-3;

/// The scenes that the command line chose, in order, with its choice of control.
///
/// # Errors
/// 66 or 65 for a scene file that cannot be used.
pub fn chosen(args: &SceneArgs) -> Result<Vec<SceneSource>, ServerError> {
    let preset = |config| SceneSource { config, mesh: None };
    let mut scenes = match (args.procedure, &args.scene) {
        (Some(ProcedureChoice::LiverSurgery), _) => Procedure::liver_surgery(),
        (None, SceneChoice::Skin) => vec![preset(presets::skin())],
        (None, SceneChoice::Liver) => vec![preset(presets::liver())],
        (None, SceneChoice::Vessel) => vec![preset(presets::vessel())],
        (None, SceneChoice::File(path)) => vec![load(path)?],
    };
    if let Some(radius_mm) = args.capture_radius_mm {
        scenes.iter_mut().for_each(|s| s.config.suture.capture_radius_mm = radius_mm);
    }
    for control in scenes.iter_mut().filter_map(|s| s.config.control.as_mut()) {
        control.mode = match args.control {
            None => control.mode,
            Some(ControlChoice::On) => ControlReading::On,
            Some(ControlChoice::Off) => ControlReading::Off,
            Some(ControlChoice::Paper) => ControlReading::Paper,
        };
    }
    Ok(scenes)
}

/// A scene that cannot be built, as an error: in a scene file the place of the key at fault is named.
#[must_use]
pub fn refused(args: &SceneArgs, error: &SceneError) -> ServerError {
    match (&args.scene, args.procedure) {
        (SceneChoice::File(path), None) => ServerError::BadData(placed(path, error)),
        _ => ServerError::BadData(format!("{}: {error}", args.label())),
    }
}

/// The error with file:line:column of the key that it names, if it names one.
fn placed(path: &Path, error: &SceneError) -> String {
    let key = match error {
        SceneError::Value { key, .. } | SceneError::Unit { key, .. } | SceneError::Reading { key, .. } => Some(*key),
        _ => None,
    };
    let place = key.and_then(|key| {
        let bytes = read_capped(path, LARGEST_SCENE_BYTES).ok()?;
        line_of(&String::from_utf8_lossy(&bytes), key)
    });
    // The others end with a remedy of their own.
    let remedy = if matches!(error, SceneError::Value { .. }) { "; correct the value" } else { "" };
    match place {
        Some(line) => format!("{}:{line}:1: {error}{remedy}", path.display()),
        None => format!("{}: {error}{remedy}", path.display()),
    }
}

/// Line, from 1, on which a scene file gives a value to `section.name`.
fn line_of(text: &str, key: &str) -> Option<usize> {
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    let mut within = String::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim_start();
        if let Some((title, _)) = line.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            title.trim().clone_into(&mut within);
        } else if within == section && line.split('=').next().is_some_and(|k| k.trim() == name) {
            return Some(number);
        }
    }
    None
}

/// Reads servo constants; what the file leaves out keeps its default.
///
/// # Errors
/// 66 or 65 with file:line:column.
pub fn servo_config(path: &Path) -> Result<ServoConfig, ServerError> {
    from_toml(&read_capped(path, LARGEST_SCENE_BYTES)?, &path.display().to_string())
}

/// Loads a scene file and its mesh.
///
/// # Errors
/// 66 when a file is missing, 65 when its contents cannot be used.
pub fn load(path: &Path) -> Result<SceneSource, ServerError> {
    let bytes = read_capped(path, LARGEST_SCENE_BYTES)?;
    let config = parse(&bytes, &path.display().to_string())?;
    let mesh = match &config.tissue {
        TissueConfig::Vosm { mesh: Some(name), mesh_unit_mm, .. } => {
            if !(mesh_unit_mm.is_finite() && *mesh_unit_mm > 0.0) {
                let what = format!("{}: mesh_unit_mm is {mesh_unit_mm}; give a positive number", path.display());
                return Err(ServerError::BadData(what));
            }
            Some(load_mesh(path, name, mesh_unit_mm * M_PER_MM)?)
        }
        _ => None,
    };
    Ok(SceneSource { config, mesh })
}

/// Parses the text of a scene file; `file` is used in messages only.
///
/// # Errors
/// 65 with file:line:column.
pub fn parse(bytes: &[u8], file: &str) -> Result<SceneConfig, ServerError> {
    from_toml(bytes, file)
}

fn from_toml<T: DeserializeOwned>(bytes: &[u8], file: &str) -> Result<T, ServerError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.valid_up_to());
        ServerError::BadData(format!("{file}:{line}:{column}: not UTF-8 text; save the scene file as UTF-8"))
    })?;
    toml::from_str::<T>(text).map_err(|e| {
        let (line, column) = line_and_column(bytes, e.span().map_or(0, |s| s.start));
        ServerError::BadData(format!("{file}:{line}:{column}: {}", sentence(e.message())))
    })
}

/// Reads a file of at most `cap` bytes without trusting its length.
///
/// # Errors
/// 66 when it cannot be read, 65 when it is larger.
pub fn read_capped(path: &Path, cap: u64) -> Result<Vec<u8>, ServerError> {
    let file = std::fs::File::open(path).map_err(|e| ServerError::reading(path, &e))?;
    let mut bytes = Vec::new();
    file.take(cap + 1).read_to_end(&mut bytes).map_err(|e| ServerError::reading(path, &e))?;
    if bytes.len() as u64 > cap {
        let what = format!("{}: larger than {cap} bytes; give a smaller file", path.display());
        return Err(ServerError::BadData(what));
    }
    Ok(bytes)
}

fn load_mesh(scene: &Path, name: &str, metres_per_unit: f64) -> Result<TriangleMesh, ServerError> {
    let path = resolve_beneath(scene, name)?;
    let limits = ObjLimits::default();
    let bytes = read_capped(&path, limits.bytes as u64)?;
    read_obj(&bytes, &path.display().to_string(), metres_per_unit, limits)
        .map_err(|e| ServerError::BadData(e.to_string()))
}

/// The mesh file beneath the scene's folder; absolute paths, `..` and links that lead out are refused.
fn resolve_beneath(scene: &Path, name: &str) -> Result<PathBuf, ServerError> {
    let refuse = || {
        ServerError::BadData(format!(
            "{}: mesh {name:?} is not within the scene's folder; put the mesh beside the scene file and name it \
             relative to it",
            scene.display()
        ))
    };
    let relative = Path::new(name);
    if name.is_empty() || !relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
        return Err(refuse());
    }
    let folder = match scene.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let joined = folder.join(relative);
    let folder = folder.canonicalize().map_err(|e| ServerError::reading(folder, &e))?;
    let real = joined.canonicalize().map_err(|e| ServerError::reading(&joined, &e))?;
    if real.starts_with(&folder) { Ok(joined) } else { Err(refuse()) }
}

/// Line and column (in characters), from 1, of a byte offset.
fn line_and_column(bytes: &[u8], offset: usize) -> (usize, usize) {
    let before = &bytes[..offset.min(bytes.len())];
    let start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    (1 + before.iter().filter(|&&b| b == b'\n').count(), 1 + String::from_utf8_lossy(&before[start..]).chars().count())
}

/// The parser's message as one sentence with a remedy.
fn sentence(message: &str) -> String {
    let message = message.trim().replace('\n', ", ");
    let mut quoted = message.split('`').skip(1).step_by(2);
    let Some(remainder) = message.strip_prefix("unknown field ") else {
        let remedy = if message.starts_with("missing field") { "add it" } else { "correct the value or its spelling" };
        return format!("{message}; {remedy}");
    };
    let unknown = quoted.next().unwrap_or(remainder);
    match quoted.map(|known| (edits(unknown, known), known)).min() {
        Some((distance, known)) if distance <= NEAREST_KEY_EDITS.min(unknown.len()) => {
            format!("unknown key `{unknown}`; did you mean `{known}`?")
        }
        _ => format!("unknown key `{unknown}`; remove it (the keys here are {})", known_keys(&message)),
    }
}

fn known_keys(message: &str) -> String {
    message.split('`').skip(3).step_by(2).collect::<Vec<_>>().join(", ")
}

/// Levenshtein distance in bytes; both words are short keys, longer ones are cut.
fn edits(a: &str, b: &str) -> usize {
    let a = &a.as_bytes()[..a.len().min(64)];
    let b = &b.as_bytes()[..b.len().min(64)];
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests;
