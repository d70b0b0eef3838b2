//! Importer of glTF 2.0 and GLB: scene graph, triangle meshes, materials, cameras, lights.
//!
//! A glTF node becomes a node or, if it only carries a mesh, an edge to the shape. A mesh is
//! stored once, however many nodes refer to it. Triangle ids follow the file: primitives one
//! after the other, and the triangles of each in the order of its mode. Morph targets and skins are
//! applied: in the pose that the file has, or at the times of an animation.
//!
//! `container` parses, `buffers` and `accessor` check every length and range, `meshopt` decodes views and `draco` primitives, `mesh`, `morph`,
//! `skin`, `material`, `camera` and `light` fill rows, `placement` reads transforms, `animation`
//! reads curves, of which `motion` makes keys, `nodes` walks the graph. Specification: Khronos
//! glTF 2.0.1.
//! tests/formats/io_bad.rs compares the refusals with those of the Khronos validator.

mod accessor;
mod animation;
mod buffers;
mod camera;
mod container;
#[cfg(feature = "draco")]
mod draco;
mod environment;
mod light;
mod material;
mod mesh;
mod meshes;
mod meshopt;
mod morph;
mod motion;
mod nodes;
mod placement;
mod points;
mod skin;
mod texture;
mod variant;

use crate::scene::SceneBuilder;
use crate::shared::images::ImageStore;
use crate::shared::messages::one_line;
use crate::shared::points::add_points;
use crate::{Folder, ImportReport, LoadError, LoadOptions};
use accessor::Accept;
use buffers::Buffers;
use gltf::json::Root;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use motion::Motion;
use std::cell::Cell;
use std::path::Path;

/// A parsed file during its import.
struct File<'a> {
    path: &'a Path,
    root: Root,
    sources: texture::Sources,
    buffers: Buffers<'a>,
    /// The views that are compressed, decoded, and those made of streams of Draco; a row for each view,
    /// or none at all.
    decoded: Vec<Option<Vec<u8>>>,
    /// Whether the first set of texture coordinates is read in any case.
    keeps_uvs: bool,
    /// Whether points and lines are drawn.
    wants_points: bool,
    /// The number of the variant of materials to show.
    variant: Option<u64>,
    /// The number of elements that may still be decoded.
    budget: Cell<u64>,
}

/// Number of elements that a file of any size may decode. With the elements that its size
/// allows (see [`File::spend`]) it bounds memory, at some 100 bytes an element.
const FREE_ELEMENTS: u64 = 1 << 22;

impl File<'_> {
    /// Makes an error of the entity `place`.
    fn invalid(&self, place: &str, message: &str) -> LoadError {
        LoadError::Invalid {
            path: self.path.into(),
            place: place.into(),
            message: message.into(),
        }
    }

    /// Returns what vertices may be: floats, unless the file requires quantization, which allows
    /// `quantized`.
    fn vertex_types(&self, quantized: Accept) -> Accept {
        let mut required = self.root.extensions_required.iter();
        match required.any(|name| name == "KHR_mesh_quantization") {
            true => quantized,
            false => Accept::Float,
        }
    }

    /// Takes `count` elements from the budget; fails if it is exhausted.
    ///
    /// Accessors may overlap, be shared by any number of meshes, or have no bytes at all, so
    /// without a limit a small file could ask for any amount of memory. A file that decodes
    /// each of its bytes four times stays within the limit.
    fn spend(&self, count: u64, place: &str) -> Result<(), LoadError> {
        let left = self.budget.get().checked_sub(count).ok_or_else(|| {
            self.invalid(
                place,
                &format!("{count} elements are more than the size of the file justifies"),
            )
        })?;
        self.budget.set(left);
        Ok(())
    }
}

/// Reads a glTF or GLB file into the builder. Fails if the file or one of its buffers cannot
/// be read, is malformed, or requires an extension that is not supported.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    images: &mut ImageStore,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let bytes = options.read(path)?;
    let chunks = container::split(path, &bytes)?;
    let container::Document {
        root,
        placements,
        sources,
        animations,
        unread,
    } = container::parse(path, chunks.json.as_bytes())?;
    let folder = Folder::new(path, options);
    let buffers = Buffers::read(path, &root, chunks.bin, &folder)?;
    let decoded = meshopt::decoded(path, &root, &buffers)?;
    let variant = variant::pick(path, &root, options.variant.as_deref())?;
    let size = bytes.len() as u64 + buffers.total();
    #[cfg_attr(not(feature = "draco"), expect(unused_mut))]
    let mut file = File {
        path,
        root,
        sources,
        keeps_uvs: options.keeps_uvs,
        wants_points: options.point_radius.is_some(),
        variant,
        buffers,
        decoded,
        budget: Cell::new(FREE_ELEMENTS + 4 * size),
    };
    #[cfg(feature = "draco")]
    draco::decode(&mut file, report)?;
    for (what, count) in unread {
        report.add_many(what, count);
    }
    left_out(&file.root, report);
    let materials = material::import(&file, (&folder, images), scene, report)?;
    let asked = options.animation.as_ref();
    let animation = match asked {
        Some(asked) => animation::import(&file, &animations, asked, &placements, report)?,
        None => {
            report.add_many("animation (see --animation)", animations.len());
            None
        }
    };
    if let Some(animation) = &animation {
        scene.motion_takes(animation.seconds);
    }
    let motion = Motion::new(placements, animation, asked);
    let points = nodes::import(&file, &motion, &materials, scene, report)?;
    add_points(path, &points, options, scene, report)
}

/// Counts the parts of meshes, and the extensions, that this importer does not read.
fn left_out(root: &Root, report: &mut ImportReport) {
    for primitive in root.meshes.iter().flat_map(|m| &m.primitives) {
        let colors = primitive.attributes.keys();
        let more = colors.filter(|k| matches!(k, Checked::Valid(Semantic::Colors(1..))));
        report.add_many("second vertex colour set", more.count());
    }
    let views = root.buffer_views.iter();
    let tight = views.filter(|view| view.byte_stride.is_some_and(|s| s.0 == 0));
    report.repair("byteStride of 0", tight.count());
    for name in &root.extensions_used {
        if !container::is_known_extension(name) {
            report.add(&format!("extension {}", one_line(name)));
        }
    }
}
