//! Files in and out: scenes, meshes, pictures, ray sets.
//!
//! [`load`] reads a scene of any format, which the file's extension tells. Importers fill a
//! [`SceneBuilder`]; what they leave out is counted in an [`ImportReport`] and becomes one
//! summarised warning. Input is not trusted: every length is checked before it is used,
//! every file that a scene names must lie in the scene's folder ([`Folder`]), and every
//! error names the file, the place in it and the remedy.
//!
//! Each format has one file or folder beside this one; what formats share is in `shared/`.
//! A new scene format takes three steps:
//! 1. write `NAME.rs` or `NAME/mod.rs` with `import(path, options, scene, report)`, as `obj` has;
//! 2. add its extension to the `match` in `import` below, and to the lists of known formats
//!    in [`load`], in [`LoadError`] and in the command's help (`cli/args`); a mesh format also
//!    goes into `shared/merge_meshes.rs`;
//! 3. add its good and bad files to `tests/formats`.
//!
//! Picture formats are in `shared/picture.rs`, those of environment maps in `environment_map.rs`.
//!
//! This crate is a part of Lanecast that may change with any version; the stable interface
//! is the crate `lanecast`.

use lanecast_model::{geom, scene};
use lanecast_numerics::{math, roots};

mod animated;
mod channels;
mod environment_map;
mod error;
mod exr_bands;
mod exr_header;
mod given;
mod gltf;
mod jpeg;
mod light_records;
mod mattes;
mod mitsuba;
mod native;
mod nff;
mod obj;
mod openexr;
mod parts;
mod ply;
mod png;
mod polynomials;
mod pov;
mod radiance;
mod rays;
mod scad;
mod section;
mod shared;
mod stl;
mod threemf;
mod tiles;

pub use animated::Animated;
pub use channels::{Channel, ChannelPicture, Encoding, read_channels};
pub use error::{LoadError, SaveError};
pub use exr_bands::ExrBands;
pub use exr_header::{Attribute, Metadata};
pub use given::{FORMATS, Given, format_of};
pub use light_records::{LightRecords, NUMBERS as RECORD_NUMBERS, RecordsOf};
pub use mattes::{Matte, matte_id};
pub use mitsuba::{MitsubaError, MitsubaPicture, MitsubaScene, mitsuba_scene};
pub use native::{NativeError, NativeScene, json_schema, native_scene};
pub use parts::{Part, PartHeader};
pub use png::{
    encode as png_bytes, mask as mask_png, numbers as number_png, triples as triple_png,
};
pub use polynomials::{KnownRoot, Listed, load_polynomials};
pub use pov::{PovError, text as pov_text, warning as pov_warning};
pub use rays::{RaySet, TriangleSet};
pub use scad::Curves;
pub use section::clipped;
pub use shared::aovs::AovSet;
pub use shared::child::end_children;
pub use shared::folder::{Folder, ReadLog};
pub use shared::import_report::ImportReport;
pub use shared::leftovers::sweep;
pub use shared::merge_meshes::import_mesh;
pub use shared::outputs::{Outputs, check_writable, discard_unfinished};
pub use shared::picture::{Layer, Picture, PictureFile, picture_files};
pub use shared::srgb::{SrgbEncoder, linear_from_srgb};
pub use shared::view_transform::{Bits, Development, Tone};
pub use tiles::{PictureTile, TileHeader};

use crate::geom::HalfSpace;
use crate::scene::{Edge, Hatch, MeshData, Scene, SceneBuilder, SceneError};
use shared::points::add_points;
use std::path::{Path, PathBuf};

/// A checked scene, and a warning about what its file has and the scene has not.
#[derive(Debug)]
pub struct Loaded {
    pub scene: Scene,
    /// One line for people, such as `not imported: 3 × texture`; `None` if nothing was left
    /// out.
    pub warning: Option<String>,
}

/// Which files a scene may name, and what importers may be told.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Allows files outside the scene's folder.
    pub allow_outside: bool,
    /// Files that the program will write later. A scene that names one of them is refused,
    /// because writing would replace its own input.
    pub outputs: Vec<PathBuf>,
    /// Keeps texture coordinates of mesh files even where no material of theirs has textures.
    pub keeps_uvs: bool,
    /// Gives native meshes with texture coordinates tangents, which normal maps need.
    pub keeps_tangents: bool,
    /// The variant of a glTF file's materials to show, by its name.
    pub variant: Option<String>,
    /// The animation of a glTF file to show; without one it is as at rest.
    pub animation: Option<Animated>,
    /// The radius, in units of the file's world, of the balls that its points and the ends of its
    /// lines are drawn as; without one they are left out.
    pub point_radius: Option<f64>,
    /// Which files are turned about x because z is up in them.
    pub z_up: ZUp,
    /// How the curves of OpenSCAD's files are drawn.
    pub scad_curves: Curves,
    /// Half-spaces of the world that the scene is cut to.
    pub clip: Vec<HalfSpace>,
    /// Gets the files that the scene names.
    pub reads: ReadLog,
    /// How the faces of these cuts are hatched, if they are.
    pub hatch: Option<Hatch>,
    /// What is known of the file that [`load`] is called with.
    pub given: Option<Given>,
}

/// Which files of the formats that do not say which way is up (`.stl`, `.ply`, `.obj`) have z up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ZUp {
    #[default]
    Never,
    /// The file that is read; one of another format is refused.
    Asked,
    /// Every such file; those of other formats are read as they are.
    WhereUnsaid,
}

/// Reads, checks and completes a scene file: `.toml`, `.json`, `.gltf`, `.glb`,
/// `.nff`, `.csg`, `.scad`, `.obj`, `.ply`, `.stl`, `.3mf`; or bytes that were read elsewhere
/// ([`LoadOptions::given`]).
///
/// Fails if a file cannot be read, is malformed, uses what is not supported or names a file
/// that [`LoadOptions`] excludes, and if the scene fails its own check.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut scene = SceneBuilder::default();
    let mut report = ImportReport::default();
    let mut files = native::Files::of(path);
    let options = &options.of_file(path)?;
    import(path, options, &mut files, &mut scene, &mut report)?;
    let warning = report.summary();
    let scene = scene.finish().map_err(|source| match (&source, &warning) {
        (SceneError::NothingToSee, Some(left_out)) => LoadError::Empty {
            path: path.into(),
            left_out: left_out.clone(),
        },
        _ => {
            let known = source.entity().and_then(|what| files.find(what));
            let (path, place) = known.unwrap_or((path, None));
            LoadError::Scene {
                path: path.into(),
                place,
                source,
            }
        }
    })?;
    section::clipped(scene, options, path, warning)
}

/// Fills the builder by the importer of the file's extension.
fn import(
    path: &Path,
    options: &LoadOptions,
    files: &mut native::Files,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let animation = options.animation.as_ref();
    let named = animation.is_some_and(|animation| animation.name.is_some());
    if named && !matches!(&*options.format(path), "gltf" | "glb") {
        return Err(LoadError::Unsupported {
            path: path.into(),
            what: "--animation of a file that is no .gltf or .glb".into(),
            remedy: Some("leave it out; the motion of other scenes needs no name".into()),
        });
    }
    if options.variant.is_some() && !matches!(&*options.format(path), "gltf" | "glb") {
        return Err(LoadError::Unsupported {
            path: path.into(),
            what: "--variant of a file that is no .gltf or .glb".into(),
            remedy: Some("leave it out".into()),
        });
    }
    let format = options.format(path);
    let is_unsaid = matches!(&*format, "stl" | "ply" | "obj");
    if options.z_up == ZUp::Asked && !is_unsaid {
        return Err(LoadError::Unsupported {
            path: path.into(),
            what: "--z-up of a file that is no .stl, .ply or .obj".into(),
            remedy: Some(
                "leave it out; other formats say which way is up, and are turned as they are read"
                    .into(),
            ),
        });
    }
    match &*format {
        "toml" => native::import(path, native::Syntax::Toml, options, files, scene, report),
        "json" => native::import(path, native::Syntax::Json, options, files, scene, report),
        "nff" => nff::import(path, options, scene, report),
        "csg" => scad::import(path, options, scene, report),
        "scad" => scad::import_program(path, options, scene, report),
        "gltf" | "glb" => gltf::import(path, options, &mut files.images, scene, report),
        "obj" => obj::import(path, options, &mut files.images, scene, report),
        "3mf" => threemf::import(path, options, &mut files.images, scene, report),
        "ply" => {
            let file = ply::read(path, options, options.point_radius.is_some(), report)?;
            let (mesh, points) = file.add_with_points(scene);
            add_mesh_instance(scene, &mesh);
            add_points(path, &points, options, scene, report)
        }
        "stl" => stl::read(path, options, report).map(|mesh| add_mesh_instance(scene, &mesh)),
        other => Err(LoadError::unknown_format(path, other)),
    }?;
    if options.z_up != ZUp::Never && is_unsaid {
        scene.place_roots(&y_from_z());
    }
    Ok(())
}

/// Returns the turn from z up to y up: (x, y, z) becomes (x, z, -y).
fn y_from_z() -> math::Affine {
    math::Affine::new(
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [0.0; 3],
    )
}

/// Adds a mesh and one instance of it, for files that hold nothing else; adds nothing if the
/// mesh has no triangles.
fn add_mesh_instance(scene: &mut SceneBuilder, mesh: &MeshData) {
    if !mesh.triangles.is_empty() {
        let shape = scene.mesh("", mesh);
        scene.instance("", Edge::shape(shape));
    }
}

/// The extension of a file name in lower case, without the dot; empty if there is none.
fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}
