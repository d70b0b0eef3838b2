//! Where hits lie on images and in patterns.

use super::InteractionPart;
use crate::math::lanes::Lanes;
use crate::math::{Affine, Vec3, length, unit};
use crate::scene::{MeshId, Shape, TexturedMaterial};
use crate::shade::columns::{Doubles, STEP};
use crate::shade::patterns::Spot;
use crate::shade::surface::{Surfaces, facets, weights};
use crate::shade::textures::{Place, mirrors};
use crate::trace::TURNED;
use glam::DVec3;

/// How far inside the surface patterns are looked at, relative to the point's largest coordinate:
/// far beyond the rounding of f32, so that a face in a plane between two cells shows the cell
/// inside, and too little to be seen.
const INSIDE: f64 = 1.0 / (1 << 20) as f64;

/// A point of a surface in another space than the world's.
struct Seat {
    point: DVec3,
    normal: DVec3,
    /// The area in that space of a unit of area along the surface in world space.
    area: f64,
}

impl Seat {
    fn of(map: Option<&Affine>, point: DVec3, normal: DVec3) -> Seat {
        let Some(map) = map else {
            return Seat {
                point,
                normal,
                area: 1.0,
            };
        };
        let (right, up) = normal.any_orthonormal_pair();
        let [right, up] = [right, up].map(|v| DVec3::from(map.vector(v.to_array())));
        let across = right.cross(up);
        let side = if mirrors(map) { -1.0 } else { 1.0 };
        Seat {
            point: map.point(point.to_array()).into(),
            normal: unit(across) * side,
            area: length(across),
        }
    }
}

impl InteractionPart<'_> {
    /// Returns where hits lie on images, if their materials have any.
    #[inline(never)]
    pub fn places(
        &self,
        surfaces: &Surfaces<Doubles>,
        primitives: &[u32; STEP],
    ) -> Option<[Place; STEP]> {
        if let Some((id, attributes)) = self.textured_mesh()
            && self.part.is_none()
        {
            return Some(self.mesh_places((id, attributes), surfaces, primitives));
        }
        self.some_varies(primitives, |row| !row.refs.is_empty())
            .then(|| {
                std::array::from_fn(|i| {
                    let at = |v: Vec3<Doubles>| [v.x, v.y, v.z].map(|x| x.lane(i));
                    let [point, ng] = [surfaces.point, surfaces.ng].map(|v| DVec3::from(at(v)));
                    self.place(point, ng, primitives[i])
                })
            })
    }

    /// Returns where hits lie in patterns, if their materials have any.
    #[inline(never)]
    pub fn spots(
        &self,
        surfaces: &Surfaces<Doubles>,
        primitives: &[u32; STEP],
    ) -> Option<[Spot; STEP]> {
        self.some_varies(primitives, |row| row.patterns().next().is_some())
            .then(|| {
                std::array::from_fn(|i| {
                    let at = |v: Vec3<Doubles>| [v.x, v.y, v.z].map(|x| x.lane(i));
                    let [point, ng] = [surfaces.point, surfaces.ng].map(|v| DVec3::from(at(v)));
                    self.spot(point, ng)
                })
            })
    }

    /// Returns where a point of the surface lies in patterns: in the space of the instance's
    /// shape, so that they run through a CSG solid as through one block.
    pub fn spot(&self, point: DVec3, ng: DVec3) -> Spot {
        let seat = Seat::of(self.whole.as_ref(), point, ng);
        let reach = seat.point.abs().max_element();
        Spot {
            point: (seat.point - seat.normal * (reach * INSIDE)).into(),
            normal: seat.normal.as_vec3().into(),
            scale: seat.area.sqrt() as f32,
        }
    }

    /// Returns where a point of the surface lies on images, from its outward normal. The space is
    /// the shape's own, of an operand of CSG that of the operand.
    pub fn place(&self, point: DVec3, ng: DVec3, primitive: u32) -> Place {
        let mut seat = Seat::of(self.placed.as_ref(), point, ng);
        let mut triangle = primitive;
        if let Some(part) = &self.part {
            triangle = part.surface(primitive);
            if primitive & TURNED != 0 {
                seat.normal = -seat.normal;
            }
            if let Some((id, attributes)) = self.textured_mesh() {
                return self.operand_place((id, attributes), triangle, &seat);
            }
        }
        if let (Shape::Mesh(id), Some(_)) = (self.shape, &self.part) {
            // The frames of meshes that are operands count from their centres.
            seat.point += self.world.scene.meshes.center[id.index()];
        }
        let chart = self.world.scene.chart(self.shape, seat.point, seat.normal);
        let density = chart.density(seat.normal) * seat.area;
        Place {
            triangle,
            weights: chart.uv,
            area: (1.0 / density) as f32,
            ..Place::NOWHERE
        }
    }

    /// Returns the mesh, and its row of attributes, if it has texture coordinates or colours.
    fn textured_mesh(&self) -> Option<(MeshId, u32)> {
        let Shape::Mesh(id) = self.shape else {
            return None;
        };
        let attributes = &self.world.scene.meshes.attributes;
        let row = attributes.of(id)?;
        let has = &attributes.rows[row as usize];
        (has.sets > 0 || has.colors.is_some()).then_some((id, row))
    }

    /// Says whether the material of some hit varies in this way.
    fn some_varies(&self, primitives: &[u32], how: impl Fn(&TexturedMaterial) -> bool) -> bool {
        let textures = &self.world.scene.textures;
        let varies = |primitive: &u32| {
            let row = self.material(*primitive).and_then(|id| textures.of(id));
            row.is_some_and(|row| how(&row))
        };
        match self.shape {
            Shape::Mesh(_) => primitives.iter().any(varies),
            // Its material is one.
            _ => varies(&primitives[0]),
        }
    }

    /// Returns where hits lie on the triangles of a mesh that is no operand.
    fn mesh_places(
        &self,
        (id, attributes): (MeshId, u32),
        surfaces: &Surfaces<Doubles>,
        primitives: &[u32; STEP],
    ) -> [Place; STEP] {
        let scene = &self.world.scene;
        let mesh = scene.meshes.row(id);
        let mut at = surfaces.point;
        let mut world_from_object = None;
        if let Some(map) = &self.whole {
            at = map.points(at) - Vec3::splat(self.center.to_array());
            let instance = self.world.instances.get(scene, self.instance);
            world_from_object = Some(instance.world_from_object);
        }
        let [a, b, c] = facets::<Doubles>(&mesh, primitives);
        let [one, other] = [b - a, c - a];
        let all = weights([a, b, c], one.cross(other), at);
        let zero = Doubles::zero();
        let all = all.map(|weight| weight.max(zero));
        let sum = all[0] + all[1] + all[2];
        let some = sum.gt(zero);
        let sum = Lanes::select(some, sum, Doubles::splat(1.0));
        let [u, v] = [1, 2].map(|k| (all[k] / sum).to_array());
        let vectors = |v: Vec3<Doubles>| match &world_from_object {
            None => v,
            Some(map) => map.vectors(v),
        };
        let area = vectors(one).cross(vectors(other)).length().to_array();
        let mut places: [Place; STEP] = std::array::from_fn(|i| Place {
            attributes,
            triangle: primitives[i],
            weights: [u[i], v[i]],
            area: area[i] as f32,
            tangent: [0.0; 3],
            bitangent: 0.0,
        });
        if let Some(first) = scene.meshes.attributes.rows[attributes as usize].tangents {
            let tangents = &scene.meshes.attributes.tangents[first..];
            let mirrored = world_from_object.as_ref().is_some_and(mirrors);
            for place in &mut places {
                place.set_tangent(tangents, mirrored, |v| match &world_from_object {
                    None => v,
                    Some(map) => map.vector(v),
                });
            }
        }
        places
    }

    /// Returns where a hit lies on a triangle of a mesh that is an operand, without a tangent.
    fn operand_place(&self, (id, attributes): (MeshId, u32), triangle: u32, seat: &Seat) -> Place {
        let mesh = self.world.scene.meshes.row(id);
        let corners = mesh.corners(triangle as usize);
        let [a, b, c] = corners.map(|p| Vec3::<f64>::splat(p.map(f64::from)));
        let across = (b - a).cross(c - a);
        let all = weights([a, b, c], across, seat.point.into()).map(|weight| weight.max(0.0));
        let sum = all[0] + all[1] + all[2];
        let sum = if sum > 0.0 { sum } else { 1.0 };
        Place {
            attributes,
            triangle,
            weights: [all[1] / sum, all[2] / sum],
            area: (DVec3::from(across).length() / seat.area) as f32,
            ..Place::NOWHERE
        }
    }
}
