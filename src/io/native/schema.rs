//! The native scene format as types: what may stand where.
//!
//! The types are the grammar and the documentation at once: serde reads them,
//! `docs/scene.schema.json` is generated from them, and the comments below are
//! its descriptions. A choice (one shape kind of many) is a struct of options,
//! so that every key keeps its place in the file; `lower` sees to it that
//! exactly one is given. Polynomial surfaces are in
//! [`schema_polynomial`](super::schema_polynomial).

use super::schema_camera::{Cameras, Shutter};
use super::schema_light::Light;
use super::schema_pattern::{ColorOrPattern, NumberOrPattern};
pub use super::schema_placement::*;
use super::schema_polynomial::{Clip, Coefficients, Parameter, Superquadric, Torus};
use super::schema_texture::{AlphaMode, Texture};
use super::source_spans::At;
use crate::roots::Solver;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::marker::PhantomData;

pub type Triple = [f64; 3];
pub type Color = [f32; 3];

/// A Lanecast scene. Right-handed, y up, radiometric units, angles in degrees,
/// colours linear Rec. 709.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Lanecast scene")]
pub struct File {
    /// The version of the format: 1. Looked at before anything else is read.
    #[serde(rename = "format")]
    #[schemars(range(min = 1, max = 1))]
    pub _format: u32,
    /// Other files of this format, relative to this one, whose materials, shapes and nodes are
    /// defined here, too.
    pub include: Option<At<Vec<At<String>>>>,
    /// Radiance where a ray meets nothing; black if absent.
    pub background: Option<At<Color>>,
    /// One camera, or cameras by name. Without any the scene gets a view that frames it.
    pub camera: Option<Cameras>,
    /// When cameras take light that say nothing of it themselves; for an instant if absent.
    pub shutter: Option<At<Shutter>>,
    /// How many seconds the motion takes, from time 0 to time 1, for `render --fps`; 1 if absent.
    pub seconds: Option<At<f64>>,
    /// Without lights the scene gets a headlight.
    pub light: Option<Vec<At<Light>>>,
    /// Materials by name.
    pub material: Option<Named<Material>>,
    /// Shapes by name. A shape is seen where an instance or a node places it.
    pub shape: Option<Named<Shape>>,
    /// Nodes by name, in any order. A node may appear under many parents.
    pub node: Option<Named<Node>>,
    /// The roots: what is seen in the world.
    pub instance: Option<Vec<At<Child>>>,
}

/// A metallic-roughness material; every key may be absent.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Linear Rec. 709, or a pattern; 0.6 grey if absent. More than 1 counts as 1.
    pub base_color: Option<At<ColorOrPattern>>,
    /// 0 (dielectric) to 1 (metal); 0 if absent.
    pub metallic: Option<f32>,
    /// 0 (mirror) to 1 (dull), or a pattern; 0.7 if absent.
    pub roughness: Option<At<NumberOrPattern>>,
    /// Phong's model in place of `metallic` and `roughness`.
    pub phong: Option<At<Phong>>,
    /// Radiance that the surface gives off, W/(sr·m²); none if absent.
    pub emission: Option<Color>,
    /// The group of lights that its emission belongs to, for `render --aov light_groups`; none if
    /// absent.
    pub group: Option<At<String>>,
    /// Fraction of light that passes through, 0 to 1; 0 if absent.
    pub transmission: Option<f32>,
    /// Index of refraction, greater than 0; 1.5 if absent.
    pub ior: Option<At<f64>>,
    /// Share of the surface that is there, 0 (a hole) to 1; 1 if absent.
    pub opacity: Option<f32>,
    /// Shows the base colour whatever the light; false if absent.
    pub unlit: Option<bool>,
    /// Roughness of the diffuse base, 0 (Lambert) to 1; 0 if absent.
    pub diffuse_roughness: Option<f32>,
    /// Strength of the reflection of a dielectric, 0 to 1; 1 if absent.
    pub specular: Option<f32>,
    /// Tint of that reflection at normal incidence; white if absent.
    pub specular_color: Option<Color>,
    /// Stretch of highlights along the tangent, 0 to 1; 0 if absent.
    pub anisotropy: Option<f32>,
    /// Turn of the stretch from the tangent, degrees; 0 if absent.
    pub anisotropy_rotation: Option<f32>,
    /// Share of a clear lacquer on top, 0 to 1; 0 if absent.
    pub clearcoat: Option<f32>,
    /// Roughness of the lacquer, 0 to 1; 0 if absent.
    pub clearcoat_roughness: Option<f32>,
    /// Colour of fibres on the surface; none if absent.
    pub sheen_color: Option<Color>,
    /// Roughness of the fibres, 0 to 1; 0 if absent.
    pub sheen_roughness: Option<f32>,
    /// Share of diffuse light that leaves on the other side, 0 to 1; 0 if absent.
    pub diffuse_transmission: Option<f32>,
    /// Colour of that light; white if absent.
    pub diffuse_transmission_color: Option<Color>,
    /// Share of a thin film, 0 to 1; 0 if absent.
    pub iridescence: Option<f32>,
    /// Index of refraction of the film; 1.3 if absent.
    pub iridescence_ior: Option<f32>,
    /// Thickness of the film, nanometres; 400 if absent.
    pub iridescence_thickness: Option<f32>,
    /// 20 divided by the Abbe number; 0, no dispersion, if absent.
    pub dispersion: Option<f32>,
    /// A sheet without a volume: light passes without refraction; false if absent.
    pub thin: Option<bool>,
    /// How the inside takes light away; clear if absent.
    pub attenuation: Option<Attenuation>,
    /// Where solids overlap, the medium of the highest priority is there; 0 if absent.
    pub priority: Option<i32>,
    /// An image that scales `base_color`; its alpha does what `alpha` says.
    pub base_color_texture: Option<Texture>,
    /// An image whose green scales `roughness`, and whose blue scales `metallic`.
    pub metallic_roughness_texture: Option<Texture>,
    /// An image that scales `emission`.
    pub emission_texture: Option<Texture>,
    /// An image of normals, red to the right and green up, by the texture coordinates of meshes.
    pub normal_texture: Option<Texture>,
    /// How much of the slope of `normal_texture` there is; 1 if absent.
    pub normal_scale: Option<At<f32>>,
    /// What the image's alpha does: `mask` shows the surface where it is no less than
    /// `alpha_cutoff`, `blend` takes it for `opacity`. Nothing if absent.
    pub alpha: Option<At<AlphaMode>>,
    /// 0.5 if absent.
    pub alpha_cutoff: Option<At<f32>>,
    /// Lets the colours of a mesh's vertices scale `base_color`; false if absent.
    pub vertex_colors: Option<bool>,
}

/// Absorption in a medium, by the law of Beer and Lambert.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Attenuation {
    /// Colour that white light takes on over `distance`.
    pub color: Color,
    /// World units, greater than 0.
    pub distance: f32,
}

/// Phong's model, as NFF and MTL have it, with constant coefficients.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Phong {
    /// The share that is reflected to all sides; black if absent.
    pub diffuse: Option<Color>,
    /// The highlight of lights; black if absent.
    pub specular: Option<Color>,
    /// The power of the highlight's cosine; 1 if absent.
    pub exponent: Option<f32>,
    /// The weight of what is mirrored; black if absent.
    pub mirror: Option<Color>,
}

/// A run of a mesh's triangles, up to the next.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshPart {
    /// The number of its first triangle, from 0; above that of the part before.
    pub first: At<u32>,
    /// The name of a material; none of its own if absent.
    pub material: Option<At<String>>,
}

/// The vertices of a mesh at a time. Between keys they go straight.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshKey {
    /// Above 0 and the key before, at most 1.
    pub at: At<f64>,
    /// A mesh file of as many vertices and the same triangles.
    pub mesh: At<String>,
}

/// A shape; exactly one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    pub sphere: Option<Sphere>,
    pub ellipsoid: Option<Ellipsoid>,
    pub half_space: Option<HalfSpace>,
    #[serde(rename = "box")]
    pub cuboid: Option<Cuboid>,
    pub cylinder: Option<Cylinder>,
    pub cone: Option<Cone>,
    pub polyhedron: Option<At<Polyhedron>>,
    pub polygon: Option<Polygon>,
    pub prism: Option<Prism>,
    pub lathe: Option<At<Lathe>>,
    pub quadric: Option<Quadric>,
    pub torus: Option<Torus>,
    pub superquadric: Option<Superquadric>,
    /// The solid where a polynomial of degree 3 is 0 or less.
    pub cubic: Option<Coefficients>,
    /// The solid where a polynomial of degree 4 is 0 or less.
    pub quartic: Option<Coefficients>,
    /// The solid where a function of x, y and z is 0 or less, as an expression such as
    /// "x^2 + y^2 - a*z" or "sin(x)*cos(y) + z". Polynomials have degree 24 at most.
    pub implicit: Option<At<String>>,
    /// A mesh file (.obj, .ply, .stl, .3mf, .gltf, .glb), relative to this file.
    pub mesh: Option<At<String>>,
    /// Of a mesh: materials of runs of triangles, in place of the file's own.
    pub parts: Option<At<Vec<At<MeshPart>>>>,
    /// Of a mesh: files of its vertices at later times, at least one key.
    pub motion: Option<At<Vec<At<MeshKey>>>>,
    /// Solids made of solids: of all points that are in any operand.
    pub union: Option<Vec<At<Operand>>>,
    /// Of all points that are in every operand.
    pub intersection: Option<Vec<At<Operand>>>,
    /// Of the first operand without all others.
    pub difference: Option<Vec<At<Operand>>>,
    /// Of all points that are in an odd number of operands.
    pub xor: Option<Vec<At<Operand>>>,
    /// Of all points that are not in the one operand.
    pub complement: Option<At<Operand>>,
    /// A surface without inside: a cylinder or cone without caps, a mesh that
    /// does not enclose anything, the surface alone of a torus, superquadric, cubic,
    /// quartic or implicit. False if absent.
    pub open: Option<At<bool>>,
    /// Of an implicit: constants by name.
    pub parameters: Option<At<Named<At<Parameter>>>>,
    /// Of a torus, superquadric, cubic, quartic or implicit: what of it there is; of
    /// open ones without caps.
    pub clip: Option<At<Clip>>,
    /// Of a torus, superquadric, cubic, quartic or implicit polynomial: what finds where
    /// rays meet it in the precision `fast`; "auto" if absent. Other precisions are exact.
    pub solver: Option<At<Solver>>,
    /// Of a solid made of solids: the name of a material for all its surfaces,
    /// whatever the operands say.
    pub material: Option<At<String>>,
    /// Of a solid made of solids: boundaries of different operands that are no
    /// farther from each other than this are one, 0 or greater; 0 if absent.
    pub tolerance: Option<At<f64>>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    pub center: Triple,
    /// Greater than 0.
    pub radius: f64,
}

/// Axis-parallel; turn it with a transform.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ellipsoid {
    pub center: Triple,
    /// Along x, y and z, each greater than 0.
    pub radii: Triple,
}

/// The solid of all points x with normal·x ≤ offset; unbounded.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// Outward, of any length but 0.
    pub normal: Triple,
    pub offset: f64,
}

/// An axis-parallel box.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cuboid {
    pub min: Triple,
    /// Greater than `min` on every axis.
    pub max: Triple,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    pub base: Triple,
    pub top: Triple,
    /// Greater than 0.
    pub radius: f64,
}

/// A cone, or a piece of one.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cone {
    pub base: Triple,
    pub top: Triple,
    /// 0 or greater; one of the two radii may be 0.
    pub base_radius: f64,
    /// 0 or greater; 0 makes an apex.
    pub top_radius: f64,
}

/// A convex polyhedron: where the half-spaces of `planes` meet, or the hull of
/// `points`; exactly one of the two.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Polyhedron {
    pub planes: Option<At<Vec<HalfSpace>>>,
    pub points: Option<At<Vec<Triple>>>,
}

/// A flat polygon of three corners or more, convex or not; a surface.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Polygon {
    /// The corners in turn, in one plane.
    pub points: Vec<Triple>,
    /// Shading normals, one at each corner, which smooth what is seen; flat if absent.
    pub normals: Option<Vec<Triple>>,
}

/// The solid that an outline with holes in the plane z = 0 sweeps along z, from 0 to a
/// height.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prism {
    /// The corners of the outline in turn, either way round, three or more; need not be
    /// convex. No edge may cross another.
    pub points: Vec<[f64; 2]>,
    /// The corners of each hole, inside the outline.
    pub holes: Option<Vec<Vec<[f64; 2]>>>,
    pub height: f64,
}

/// The solid that an outline with holes sweeps when it is turned about the y axis.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lathe {
    /// The corners of the outline in turn, either way round, three or more: distance from the
    /// y axis, 0 or greater, and y.
    pub points: Vec<[f64; 2]>,
    /// The corners of each hole, inside the outline.
    pub holes: Option<Vec<Vec<[f64; 2]>>>,
}

/// The solid of all points with Ax² + By² + Cz² + Dxy + Exz + Fyz + Gx + Hy + Iz + J
/// ≤ 0.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Quadric {
    /// A to J: of x², y², z², xy, xz, yz, x, y, z and 1.
    pub coefficients: [f64; 10],
}

/// What a solid is made of: the name of a shape, or a shape with more.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum Operand {
    Name(String),
    Placed(PlacedOperand),
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacedOperand {
    /// The name of a shape that has an inside.
    pub shape: At<String>,
    /// Applied first to last; nothing if absent.
    pub transform: Option<Vec<At<Step>>>,
    /// The name of a material for the surfaces that come from this operand and
    /// have none nearer.
    pub material: Option<At<String>>,
}

impl<'de> Deserialize<'de> for Operand {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Operand, D::Error> {
        struct NameOrTable;
        impl<'de> Visitor<'de> for NameOrTable {
            type Value = Operand;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("one operand, the name of a shape or { shape = \"NAME\", … }")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Operand, E> {
                Ok(Operand::Name(name.into()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Operand, A::Error> {
                let mut count = 0;
                while seq.next_element::<IgnoredAny>()?.is_some() {
                    count += 1;
                }
                let message = format!(
                    "expected one operand, found a list of {count}; make them one solid, \
                     such as a union, and name that"
                );
                Err(de::Error::custom(message))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Operand, A::Error> {
                PlacedOperand::deserialize(MapAccessDeserializer::new(map)).map(Operand::Placed)
            }
        }
        deserializer.deserialize_any(NameOrTable)
    }
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Node {
    pub children: Vec<At<Child>>,
}

/// Rows by name, in the order of the file.
#[derive(Debug)]
pub struct Named<T>(pub Vec<(At<String>, T)>);

impl<T> Default for Named<T> {
    fn default() -> Named<T> {
        Named(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Named<T>, D::Error> {
        struct Rows<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Rows<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a table of tables by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut rows = Vec::new();
                while let Some(row) = map.next_entry()? {
                    rows.push(row);
                }
                Ok(Named(rows))
            }
        }
        deserializer.deserialize_map(Rows(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Named_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        BTreeMap::<String, T>::json_schema(generator)
    }
}
