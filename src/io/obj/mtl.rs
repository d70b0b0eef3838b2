//! Importer of MTL, the material library of an OBJ file.
//!
//! A material becomes a Phong row: Kd is the diffuse part, Ks and Ns the highlight;
//! illumination models from 3 on reflect with Ks. A material with Pr or Pm (the PBR
//! extension) becomes a metallic-roughness row. Values out of range, which are common, are
//! clamped, and statements with NaN or infinity count as missing. Images make the colour (map_Kd, which Kd scales unless it is black) and say how much
//! of the surface is there (map_d); others are left out.
//!
//! d, the dissolve, is the fraction of the surface that is there: the surface's light times
//! d, and what is behind it times 1 - d. Illumination models 4, 6, 7 and 9 are glass: light
//! that passes is refracted by Ni, and reflections keep their strength. A surface with d 0
//! that is not glass is invisible.
//!
//! Tr is 1 - d, but some programs write d by that name. d counts if a material has both, and
//! a file is opaque whose every Tr is 1 and that has no d.

use super::maps::{Map, MtlMaterial};
use super::{keyword, logical_lines, syntax, without_comment};
use crate::scene::{Layers, Material, Model, Rgb, Slot};
use crate::shared::messages::one_line;
use crate::shared::text::{decode, number};
use crate::{Folder, ImportReport, LoadError};
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
    transparency: Option<f32>,
    maps: Vec<Map>,
    illum: Option<f32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
}

impl Statements {
    /// Takes an image; a later one of a use replaces an earlier one.
    fn map(&mut self, map: Map) {
        self.maps.retain(|earlier| earlier.slot != map.slot);
        self.maps.push(map);
    }
}

/// Adds the materials of a file, `None` for invisible ones; a later material of a name
/// replaces an earlier one. Fails for statements without a number, with their line and
/// column.
pub(super) fn read(
    path: &Path,
    folder: &Folder,
    materials: &mut HashMap<String, Option<MtlMaterial>>,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = crate::shared::folder::read_file(path)?;
    let text = decode(path, &bytes)?;
    let mut all: Vec<(String, Statements)> = Vec::new();
    let mut not_finite = 0;
    for (row, line) in logical_lines(&text) {
        let line = (row, &*line);
        let mut words = line.1.split_whitespace();
        let Some(key) = words.next() else { continue };
        let lower = keyword(key);
        if lower == "newmtl" {
            let name = line.1.trim_start()[key.len()..].trim().to_string();
            all.push((name, Statements::default()));
            continue;
        }
        let Some((_, m)) = all.last_mut() else {
            continue;
        };
        // `None` for what is no finite f32: the statement counts as missing.
        let mut one = || {
            let word = words.next().unwrap_or_default();
            let x = number(word).ok_or_else(|| {
                let message = format!("'{key}' needs a number, not '{}'", one_line(word));
                let place = if word.is_empty() { line.1 } else { word };
                syntax(path, line, place, message)
            })? as f32;
            not_finite += usize::from(!x.is_finite());
            Ok::<_, LoadError>(Some(x).filter(|x| x.is_finite()))
        };
        match &*lower {
            "kd" => m.kd = color(path, line, (&mut not_finite, report))?.or(m.kd),
            "ks" => m.ks = color(path, line, (&mut not_finite, report))?.or(m.ks),
            "ke" => m.ke = color(path, line, (&mut not_finite, report))?.or(m.ke),
            "ns" => m.ns = one()?.or(m.ns),
            "ni" => m.ni = one()?.or(m.ni),
            "d" if line.1.contains("-halo") => report.add("halo"),
            "d" => m.dissolve = one()?.or(m.dissolve),
            "tr" => m.transparency = one()?.or(m.transparency),
            "illum" => m.illum = one()?.or(m.illum),
            "pr" => m.roughness = one()?.or(m.roughness),
            "pm" => m.metallic = one()?.or(m.metallic),
            "map_kd" => m.map(Map::read(Slot::BaseColor, line.1, folder)),
            "map_d" => m.map(Map::read(Slot::Opacity, line.1, folder)),
            "bump" | "disp" | "decal" | "refl" | "norm" => report.add("texture"),
            key if key.starts_with("map_") => report.add("texture"),
            _ => {}
        }
    }
    report.repair(
        "material statement that is not finite, as missing",
        not_finite,
    );
    let opaque = |m: &Statements| m.dissolve.is_none() && m.transparency.is_none_or(|t| t == 1.0);
    if all.iter().all(|(_, m)| opaque(m)) {
        let named = all.iter_mut().filter_map(|(_, m)| m.transparency.take());
        report.repair("Tr 1 of a file without d, as opaque", named.count());
    }
    for (name, m) in all {
        let made = convert(&m).map(|material| MtlMaterial {
            material,
            is_uncolored: m.kd.is_none_or(|kd| kd == [0.0; 3]),
            maps: m.maps,
        });
        materials.insert(name, made);
    }
    Ok(())
}

/// Reads a colour of one number (a grey) or three; negative ones become 0. A spectral or
/// xyz colour, and one that is not finite, is counted and gives `None`.
fn color(
    path: &Path,
    line: (usize, &str),
    (not_finite, report): (&mut usize, &mut ImportReport),
) -> Result<Option<Rgb>, LoadError> {
    let words: Vec<&str> = without_comment(line.1).split_whitespace().collect();
    if matches!(words.get(1), Some(&("spectral" | "xyz"))) {
        report.add("spectral or xyz colour");
        return Ok(None);
    }
    let mut values = [0.0; 3];
    for (value, word) in values.iter_mut().zip(&words[1..]) {
        *value = number(word).ok_or_else(|| {
            let message = format!("'{}' is not a number", one_line(word));
            syntax(path, line, word, message)
        })? as f32;
    }
    if matches!(words.len(), 2 | 4..) && !values.iter().all(|x| x.is_finite()) {
        *not_finite += 1;
        return Ok(None);
    }
    values = values.map(|x| x.max(0.0));
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

/// Converts the statements to a material, with defaults for missing ones; `None` if it is
/// invisible.
fn convert(m: &Statements) -> Option<Material> {
    let plain = Material::default();
    let illum = m.illum.unwrap_or(2.0);
    let is_glass = [4.0, 6.0, 7.0, 9.0].contains(&illum);
    let dissolve = m.dissolve.or(m.transparency.map(|t| 1.0 - t));
    let there = dissolve.unwrap_or(1.0).clamp(0.0, 1.0);
    if there == 0.0 && !is_glass {
        return None;
    }
    let has_image = m.maps.iter().any(|map| map.slot == Slot::BaseColor);
    let black = has_image && m.kd == Some([0.0; 3]);
    let base_color = m.kd.filter(|_| !black).unwrap_or(plain.base_color);
    let times = |color: Rgb, share: f32| color.map(|c| c * share);
    let model = if m.roughness.is_some() || m.metallic.is_some() {
        Model::MetallicRoughness {
            metallic: m.metallic.unwrap_or(0.0).clamp(0.0, 1.0),
            roughness: m.roughness.unwrap_or(1.0).clamp(0.0, 1.0),
        }
    } else {
        let share = if is_glass { 1.0 } else { there };
        let ks = times(m.ks.unwrap_or_default(), share);
        Model::Phong {
            diffuse: times(base_color, there),
            specular: if illum >= 2.0 { ks } else { [0.0; 3] },
            exponent: m.ns.unwrap_or(0.0).max(0.0),
            mirror: if illum >= 3.0 { ks } else { [0.0; 3] },
        }
    };
    // Exporters write 0 or less if they do not know the index.
    let ior = m.ni.filter(|n| *n > 0.0).unwrap_or(plain.ior);
    Some(Material {
        base_color,
        emission: times(m.ke.unwrap_or_default(), there),
        transmission: 1.0 - there,
        ior: if is_glass || there == 1.0 { ior } else { 1.0 },
        model,
        layers: Layers::default(),
    })
}
