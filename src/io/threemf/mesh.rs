//! The mesh of an object, and the materials of its triangles.
//!
//! A triangle whose corners have one colour has a material of it. Where colours differ from corner
//! to corner they are colours of vertices, and so they are if there are too many for materials.
//! Vertices are repeated for each colour and each place of a texture that triangles give them.

use super::model::{Model, Object, Property, Role};
use super::package::Package;
use super::properties::{Color, Group};
use crate::ImportReport;
use crate::scene::{
    Alpha, Layers, Material, MaterialId, MeshData, SceneBuilder, Slot, TextureRef, Texturing,
};
use crate::shared::images::ImageStore;
use crate::shared::mesh_cleanup::compact;
use crate::shared::messages::one_line;
use crate::shared::texels::ImageUse;
use std::collections::HashMap;

/// Materials that the colours of colour groups may become; those of further ones are colours of
/// vertices.
const MOST_MATERIALS: usize = 1 << 16;

/// The materials made so far, and what pictures are read from.
pub(super) struct Looks<'l, 'p> {
    pub package: &'l mut Package<'p>,
    pub images: &'l mut ImageStore,
    /// Whether texture coordinates are kept without a texture.
    pub keeps_uvs: bool,
    /// By part, group and row.
    of_row: HashMap<(usize, u32, usize), MaterialId>,
    /// By name and bits of the colour.
    of_color: HashMap<(String, [u32; 4]), MaterialId>,
    /// By part and texture; `None` if it cannot be read.
    of_texture: HashMap<(usize, u32), Option<MaterialId>>,
    /// That of colours of vertices.
    colored: Option<MaterialId>,
}

/// What a triangle looks like.
enum Look {
    Plain,
    Uniform(MaterialId),
    /// Colours of the corners.
    Colored(MaterialId, [Color; 3]),
    /// Texture coordinates of the corners.
    Textured(Option<MaterialId>, [[f32; 2]; 3]),
}

/// Vertices that are repeated with an attribute: the vertex, and the attribute's bits.
type Repeated = HashMap<(u32, [u32; 2]), u32>;

impl<'l, 'p> Looks<'l, 'p> {
    pub fn new(
        package: &'l mut Package<'p>,
        images: &'l mut ImageStore,
        keeps_uvs: bool,
    ) -> Looks<'l, 'p> {
        Looks {
            package,
            images,
            keeps_uvs,
            of_row: HashMap::new(),
            of_color: HashMap::new(),
            of_texture: HashMap::new(),
            colored: None,
        }
    }

    /// Makes the mesh of an object of the model `part`, whose columns it takes. Fails if a
    /// triangle names a vertex that the object does not have.
    pub fn mesh(
        &mut self,
        (part, model): (usize, &mut Model),
        row: usize,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Result<MeshData, String> {
        let object = &mut model.objects[row];
        let mut mesh = MeshData {
            positions: std::mem::take(&mut object.positions),
            triangles: std::mem::take(&mut object.triangles),
            open: object.role == Role::Surface,
            ..MeshData::default()
        };
        let count = mesh.positions.len();
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            if let Some(v) = triangle.iter().find(|v| **v as usize >= count) {
                return Err(format!(
                    "object {}: triangle {i} has vertex {v}, but there are only {count}",
                    object.id
                ));
            }
        }
        let properties = std::mem::take(&mut object.properties);
        let model = &*model;
        let object = &model.objects[row];
        let mut repeated = Repeated::new();
        for i in 0..mesh.triangles.len() {
            let property = properties.get(i).copied().unwrap_or(object.property);
            let look = self.look((part, model), property, scene, report);
            let material = match look {
                Look::Plain => None,
                Look::Uniform(material) => Some(material),
                Look::Colored(material, colors) => {
                    mesh.colors.resize(mesh.positions.len(), [u16::MAX; 4]);
                    for (k, color) in colors.iter().enumerate() {
                        let code = color.map(|x| (x * 65_535.0 + 0.5) as u16);
                        let [r, g, b, a] = code.map(u32::from);
                        let key = [r << 16 | g, b << 16 | a];
                        if let Some(v) = repeat(&mut mesh, &mut repeated, (i, k), key) {
                            mesh.colors[v] = code;
                        }
                    }
                    Some(material)
                }
                Look::Textured(material, uvs) => {
                    if mesh.uvs.is_empty() {
                        mesh.uvs.push(Vec::new());
                    }
                    mesh.uvs[0].resize(mesh.positions.len(), [0.0; 2]);
                    for (k, uv) in uvs.iter().enumerate() {
                        let key = uv.map(f32::to_bits);
                        if let Some(v) = repeat(&mut mesh, &mut repeated, (i, k), key) {
                            mesh.uvs[0][v] = *uv;
                        }
                    }
                    material
                }
            };
            let last = mesh.parts.last().map(|(_, material)| *material);
            if last.unwrap_or(None) != material {
                mesh.parts.push((i as u32, material));
            }
        }
        compact(&mut mesh);
        let tables = &scene.tables().meshes;
        let most = u32::MAX as usize;
        if tables.positions.len() + mesh.positions.len() > most
            || tables.triangles.len() + mesh.triangles.len() > most
        {
            return Err("the scene has more triangles than u32 can count".into());
        }
        Ok(mesh)
    }

    /// Finds what a triangle with this property looks like.
    fn look(
        &mut self,
        (part, model): (usize, &Model),
        property: Property,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Look {
        if property.group == 0 {
            return Look::Plain;
        }
        let found = resolved(model, property);
        let Some((id, group, rows)) = found else {
            report.add("triangle's property that the file does not have");
            return Look::Plain;
        };
        match group {
            Group::Materials(all) => {
                let key = (part, id, rows[0]);
                if let Some(known) = self.of_row.get(&key) {
                    return Look::Uniform(*known);
                }
                let (name, color) = &all[rows[0]];
                let material = self.color(name, *color, scene);
                self.of_row.insert(key, material);
                Look::Uniform(material)
            }
            Group::Colors(all) => {
                let colors = rows.map(|row| all[row]);
                let is_one = colors[1..].iter().all(|color| *color == colors[0]);
                if is_one && self.of_color.len() < MOST_MATERIALS {
                    return Look::Uniform(self.color("", colors[0], scene));
                }
                Look::Colored(self.colored(scene), colors)
            }
            Group::Coordinates(texture, all) => {
                let material = self.texture((part, model), *texture, scene, report);
                match material.is_some() || self.keeps_uvs {
                    true => Look::Textured(
                        material,
                        rows.map(|row| {
                            let [u, v] = all[row];
                            [u, 1.0 - v]
                        }),
                    ),
                    false => Look::Plain,
                }
            }
            Group::Several(..) => Look::Plain,
        }
    }

    /// Returns the material of a colour.
    fn color(&mut self, name: &str, color: Color, scene: &mut SceneBuilder) -> MaterialId {
        let key = (name.to_string(), color.map(f32::to_bits));
        let known = self.of_color.entry(key);
        *known.or_insert_with(|| {
            let [r, g, b, opacity] = color;
            scene.material(name, plain([r, g, b], opacity))
        })
    }

    /// Returns the material of colours of vertices.
    fn colored(&mut self, scene: &mut SceneBuilder) -> MaterialId {
        *self.colored.get_or_insert_with(|| {
            let id = scene.material("", plain([1.0; 3], 1.0));
            let texturing = Texturing {
                alpha: Alpha::Blend,
                vertex_color: true,
                ..Texturing::default()
            };
            scene.texture(id, texturing, &[]);
            id
        })
    }

    /// Returns the material of a texture. What cannot be read is counted as left out.
    fn texture(
        &mut self,
        (part, model): (usize, &Model),
        id: u32,
        scene: &mut SceneBuilder,
        report: &mut ImportReport,
    ) -> Option<MaterialId> {
        if let Some(known) = self.of_texture.get(&(part, id)) {
            return *known;
        }
        let made = self.read_texture(model, id, scene);
        let made = made.map_err(|why| report.add(&format!("texture ({why})")));
        self.of_texture.insert((part, id), made.ok());
        made.ok()
    }

    fn read_texture(
        &mut self,
        model: &Model,
        id: u32,
        scene: &mut SceneBuilder,
    ) -> Result<MaterialId, String> {
        let texture = model.textures.get(&id);
        let texture = texture.ok_or_else(|| format!("there is no texture2d {id}"))?;
        let place = one_line(&texture.path);
        let bytes = self.package.picture(&texture.path);
        let bytes = bytes.map_err(|why| format!("{place}: {why}"))?;
        let image = self.images.bytes(&bytes, ImageUse::ColorAndAlpha, &place);
        let image = image.map_err(|broken| broken.to_string())?;
        let texturing = Texturing {
            alpha: match image.channels.is_multiple_of(2) {
                true => Alpha::Blend,
                false => Alpha::Opaque,
            },
            ..Texturing::default()
        };
        let image = scene.shared_image(image);
        let material = scene.material("", plain([1.0; 3], 1.0));
        let of = TextureRef {
            wrap: texture.wrap,
            nearest: texture.nearest,
            ..TextureRef::plain(image)
        };
        scene.texture(material, texturing, &[(Slot::BaseColor, of)]);
        Ok(material)
    }
}

/// Makes a material of a colour: that of a dull plastic, for files do not tell.
fn plain(color: [f32; 3], opacity: f32) -> Material {
    let layers = Layers {
        opacity,
        ..Layers::default()
    };
    let base = Material::metallic_roughness(color, 0.0, 0.5);
    Material { layers, ..base }
}

/// Finds the group of a property, its id, and the rows. `None` if there are none.
fn resolved(model: &Model, property: Property) -> Option<(u32, &Group, [usize; 3])> {
    let mut id = property.group;
    let mut group = model.groups.get(&id)?;
    let mut rows = property.rows.map(|row| row as usize);
    if let Group::Several(groups, all) = group {
        // The layer that shows most: the last one with colours or a texture, or else the first.
        let is_seen = |id: &u32| {
            let of = model.groups.get(id);
            matches!(of, Some(Group::Colors(_) | Group::Coordinates(..)))
        };
        let layer = groups.iter().rposition(is_seen).unwrap_or(0);
        id = *groups.get(layer)?;
        group = model.groups.get(&id)?;
        for row in &mut rows {
            // A row may end early; what it lacks is 0.
            *row = all.get(*row)?.get(layer).copied().unwrap_or(0) as usize;
        }
    }
    let count = match group {
        Group::Materials(all) => all.len(),
        Group::Colors(all) => all.len(),
        Group::Coordinates(_, all) => all.len(),
        Group::Several(..) => 0,
    };
    let are_there = rows.iter().all(|row| *row < count);
    are_there.then_some((id, group, rows))
}

/// Repeats the vertex of a corner for an attribute, and returns its row if it is new.
fn repeat(
    mesh: &mut MeshData,
    repeated: &mut Repeated,
    (triangle, corner): (usize, usize),
    key: [u32; 2],
) -> Option<usize> {
    let vertex = mesh.triangles[triangle][corner];
    let next = mesh.positions.len();
    let row = *repeated.entry((vertex, key)).or_insert(next as u32);
    mesh.triangles[triangle][corner] = row;
    if row as usize != next {
        return None;
    }
    mesh.positions.push(mesh.positions[vertex as usize]);
    if !mesh.colors.is_empty() {
        mesh.colors.push([u16::MAX; 4]);
    }
    for set in &mut mesh.uvs {
        set.push([0.0; 2]);
    }
    Some(next)
}

/// Says whether an object has a mesh that is shown.
pub(super) fn is_shown(object: &Object) -> bool {
    matches!(object.role, Role::Model | Role::Surface) && !object.triangles.is_empty()
}
