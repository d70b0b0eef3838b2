//! Importer of MTL, the material library of an OBJ file.
//!
//! A material becomes a Phong row: Kd is the diffuse part, Ks and Ns the highlight;
//! illumination models from 3 on reflect with Ks; d (or 1 - Tr) below 1 is transmission,
//! with Ni as index of refraction. A material with Pr or Pm (the PBR extension) becomes a
//! metallic-roughness row. Values out of range, which are common, are clamped.

use super::{finite, logical_lines, syntax};
use crate::scene::{Material, Model, Rgb};
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use std::collections::HashMap;
use std::path::Path;

/// The statements of one `newmtl` that are used.
#[derive(Default)]
struct Statements {
    kd: Option<Rgb>,
    ks: Option<Rgb>,
    ke: Option<Rgb>,
    ns: Option<f32>,
    ni: Option<f32>,
    dissolve: Option<f32>,
    illum: Option<f32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
}

/// Adds the materials of a file; a later material of a name replaces an earlier one.
/// Fails for statements without a finite number, with their line and column.
pub(super) fn read(
    path: &Path,
    materials: &mut HashMap<String, Material>,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = crate::shared::folder::read_file(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut current: Option<(String, Statements)> = None;
    for (number, line) in logical_lines(&text) {
        let line = (number, &*line);
        let mut words = line.1.split_whitespace();
        let Some(key) = words.next() else { continue };
        if key == "newmtl" {
            let name = line.1.trim_start()[key.len()..].trim().to_string();
            if let Some((name, done)) = current.replace((name, Statements::default())) {
                materials.insert(name, convert(&done));
            }
            continue;
        }
        let Some((_, m)) = &mut current else { continue };
        let mut number = || {
            let word = words.next().unwrap_or_default();
            finite(word).map(|x| x as f32).ok_or_else(|| {
                let message = format!("'{key}' needs a finite number, not '{}'", one_line(word));
                syntax(
                    path,
                    line,
                    if word.is_empty() { line.1 } else { word },
                    message,
                )
            })
        };
        match key {
            "Kd" => m.kd = color(path, line, report)?.or(m.kd),
            "Ks" => m.ks = color(path, line, report)?.or(m.ks),
            "Ke" => m.ke = color(path, line, report)?.or(m.ke),
            "Ns" => m.ns = Some(number()?),
            "Ni" => m.ni = Some(number()?),
            "d" if line.1.contains("-halo") => report.add("halo"),
            "d" => m.dissolve = Some(number()?),
            "Tr" => m.dissolve = Some(1.0 - number()?),
            "illum" => m.illum = Some(number()?),
            "Pr" => m.roughness = Some(number()?),
            "Pm" => m.metallic = Some(number()?),
            "bump" | "disp" | "decal" | "refl" | "norm" => report.add("texture"),
            key if key.starts_with("map_") => report.add("texture"),
            _ => {}
        }
    }
    if let Some((name, done)) = current {
        materials.insert(name, convert(&done));
    }
    Ok(())
}

/// Reads a colour of one number (a grey) or three; negative ones become 0. A spectral or
/// xyz colour is counted and gives `None`.
fn color(
    path: &Path,
    line: (usize, &str),
    report: &mut ImportReport,
) -> Result<Option<Rgb>, LoadError> {
    let words: Vec<&str> = line
        .1
        .split('#')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .collect();
    if matches!(words.get(1), Some(&("spectral" | "xyz"))) {
        report.add("spectral or xyz colour");
        return Ok(None);
    }
    let mut values = [0.0; 3];
    for (value, word) in values.iter_mut().zip(&words[1..]) {
        *value = finite(word).map(|x| (x as f32).max(0.0)).ok_or_else(|| {
            let message = format!("'{}' is not a finite number", one_line(word));
            syntax(path, line, word, message)
        })?;
    }
    match words.len() {
        2 => Ok(Some([values[0]; 3])),
        4.. => Ok(Some(values)),
        n => {
            let message = format!(
                "'{}' needs one or three numbers, but there are {}",
                words[0],
                n - 1
            );
            Err(syntax(path, line, line.1, message))
        }
    }
}

/// Converts the statements to a material, with defaults for missing ones.
fn convert(m: &Statements) -> Material {
    let plain = Material::default();
    let illum = m.illum.unwrap_or(2.0);
    let base_color = m.kd.unwrap_or(plain.base_color);
    let model = if m.roughness.is_some() || m.metallic.is_some() {
        Model::MetallicRoughness {
            metallic: m.metallic.unwrap_or(0.0).clamp(0.0, 1.0),
            roughness: m.roughness.unwrap_or(1.0).clamp(0.0, 1.0),
        }
    } else {
        let ks = m.ks.unwrap_or_default();
        Model::Phong {
            diffuse: base_color,
            specular: if illum >= 2.0 { ks } else { [0.0; 3] },
            exponent: m.ns.unwrap_or(0.0).max(0.0),
            mirror: if illum >= 3.0 { ks } else { [0.0; 3] },
        }
    };
    Material {
        base_color,
        emission: m.ke.unwrap_or_default(),
        transmission: 1.0 - m.dissolve.unwrap_or(1.0).clamp(0.0, 1.0),
        // Exporters write 0 or less if they do not know the index.
        ior: m.ni.filter(|n| *n > 0.0).unwrap_or(plain.ior),
        model,
    }
}
