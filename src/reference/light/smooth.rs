//! Normals that meshes and polygons interpolate, and the surface that those of a mesh suggest.

use super::LightReference;
use crate::math::Affine;
use crate::scene::{Shape, ShapeId};
use crate::{Hit, TURNED};
use glam::DVec3;

/// The cosine between a facet and the normals at its corners beyond which these describe no
/// surface near it (S77).
const AGREEING: f64 = 0.7;

/// What vertex normals say of a hit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Smooth {
    /// Unit, in world space; none where the shape interpolates none.
    pub normal: Option<DVec3>,
    /// From the hit to the surface that the normals suggest, in world space (S77).
    pub lift: DVec3,
}

/// A triangle or polygon with normals at its corners, and the map from the world to its space.
struct Facet {
    corners: Vec<DVec3>,
    normals: Vec<DVec3>,
    map: Affine,
    /// Its surface is turned inside out.
    turned: bool,
    /// Of a mesh that is no operand of a solid.
    lifts: bool,
}

impl LightReference<'_> {
    /// Interpolates what vertex normals say of a hit; `front`: the ray comes from outside.
    pub(super) fn smooth(&self, hit: &Hit, point: DVec3, front: bool) -> Smooth {
        let Some(facet) = self.facet(hit) else {
            return Smooth::default();
        };
        let at = DVec3::from_array(facet.map.point(point.to_array()));
        let Some(([i, j, k], shares)) = facet.shares(at) else {
            return Smooth::default();
        };
        let around = [(i, shares[0]), (j, shares[1]), (k, shares[2])];
        let sum: DVec3 = around
            .iter()
            .map(|(of, share)| facet.normals[*of] * *share)
            .sum();
        let outward = if facet.turned { -sum } else { sum };
        let normal = DVec3::from_array(facet.map.transposed_vector(outward.to_array()));
        let mut smooth = Smooth {
            normal: Some(normal.normalize_or_zero()),
            lift: DVec3::ZERO,
        };
        if facet.lifts {
            let lift = facet.lift(at, around, front);
            let row = &self.reference.rows[hit.instance as usize];
            smooth.lift = DVec3::from_array(row.world_from_object.vector(lift.to_array()));
        }
        smooth
    }

    /// Looks up the facet of a hit, if it has normals at its corners.
    fn facet(&self, hit: &Hit) -> Option<Facet> {
        let scene = self.reference.scene();
        let row = &self.reference.rows[hit.instance as usize];
        let map = row.object_from_world;
        match scene.shapes.row(row.shape) {
            Shape::Csg(id) => {
                let solid = &self.solids[&id.0];
                let (operand, surface) = solid.operand_of(hit.primitive & !TURNED);
                let operand = &solid.operands[operand as usize];
                let frame = &solid.frames[operand.frame as usize];
                let facet = self.facet_of(
                    operand.id,
                    surface,
                    frame.operand_from_solid.then_after(&map),
                );
                facet.map(|facet| Facet {
                    turned: hit.primitive & TURNED != 0,
                    lifts: false,
                    ..facet
                })
            }
            _ => self.facet_of(row.shape, hit.primitive, map),
        }
    }

    fn facet_of(&self, shape: ShapeId, primitive: u32, map: Affine) -> Option<Facet> {
        let scene = self.reference.scene();
        let (corners, normals, lifts) = match scene.shapes.row(shape) {
            Shape::Mesh(id) => {
                let mesh = scene.meshes.row(id);
                let normals = mesh.normals?;
                let vertices = mesh.triangles[primitive as usize].map(|vertex| vertex as usize);
                let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
                let corner = |vertex: usize| mesh.center + wide(mesh.positions[vertex]);
                let corners = vertices.map(corner).to_vec();
                (
                    corners,
                    vertices.map(|vertex| wide(normals[vertex])).to_vec(),
                    true,
                )
            }
            Shape::Polygon(id) => {
                let normals = scene.polygons.normals(id)?;
                let corners = scene.polygons.row(id).points.to_vec();
                (corners, normals.to_vec(), false)
            }
            _ => return None,
        };
        Some(Facet {
            corners,
            normals,
            map,
            turned: false,
            lifts,
        })
    }
}

impl Facet {
    /// Finds the triangle of the fan about the first corner that a point of the plane lies in, or
    /// nearest to, and the point's barycentric coordinates there.
    fn shares(&self, at: DVec3) -> Option<([usize; 3], [f64; 3])> {
        let fan = (1..self.corners.len() - 1).filter_map(|i| {
            let of = [0, i, i + 1];
            let [a, b, c] = of.map(|corner| self.corners[corner] - at);
            let across = (b - a).cross(c - a);
            let twice = across.length_squared();
            let share = |p: DVec3, q: DVec3| p.cross(q).dot(across) / twice;
            let shares = [share(b, c), share(c, a), share(a, b)];
            (twice > 0.0).then_some((of, shares, across))
        });
        // How deep inside: in shares of area, which parts of a polygon compare alike.
        let depth = |shares: &[f64; 3], across: DVec3| {
            shares.iter().copied().fold(f64::INFINITY, f64::min) * across.length()
        };
        fan.max_by(|a, b| depth(&a.1, a.2).total_cmp(&depth(&b.1, b.2)))
            .map(|(of, shares, _)| (of, shares))
    }

    /// Moves a point of a triangle to the mean of its corners' tangent planes, where these lie
    /// above it (Hanika, "Hacking the Shadow Terminator", 2021), in the space of the mesh.
    fn lift(&self, at: DVec3, around: [(usize, f64); 3], front: bool) -> DVec3 {
        let [a, b, c] = around.map(|(corner, _)| self.corners[corner]);
        let side = if front { 1.0 } else { -1.0 };
        let facing = (b - a).cross(c - a).normalize_or_zero() * side;
        let mut lift = DVec3::ZERO;
        for (corner, share) in around {
            let normal = self.normals[corner].normalize_or_zero() * side;
            if normal.dot(facing) <= AGREEING {
                return DVec3::ZERO;
            }
            let below = (at - self.corners[corner]).dot(normal).min(0.0);
            lift -= normal * (share.clamp(0.0, 1.0) * below);
        }
        lift
    }
}

/// Corrects an interpolated normal that is zero or lies on the other side of the facet. One that
/// faces the viewer on the outer side is right: it is the triangle that is wound against it.
pub fn corrected(normal: DVec3, facing: DVec3, (front, dir): (bool, DVec3)) -> DVec3 {
    let cos = normal.dot(facing);
    if cos > 0.0 || cos < 0.0 && front && normal.dot(dir) < 0.0 {
        normal
    } else if cos < 0.0 {
        -normal
    } else {
        facing
    }
}
