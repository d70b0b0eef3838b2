//! Data shared by all hits of a primitive, computed once: neighbouring rays usually hit
//! the same primitive.

mod places;

use super::projection::{height_at, refined};
use super::surface::{
    Surface, Surfaces, lift_onto_smooth, normal_before, normals, shading_normal, to_world,
    to_world_height,
};
use crate::accel::{PreparedCsg, World};
use crate::geom::formula::{Formula, border};
use crate::geom::primitive::Blur;
use crate::math::bounds::{LEAVING, LEAVING_CURVED, LEAVING_SLOPELESS, SLOPELESS};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Affine, Vec3, units};
use crate::plan::Precision;
use crate::scene::{CsgId, MaterialId, Shape, ShapeId, shape_bounds};
use crate::trace::{HitId, TURNED, exact_t};
use glam::DVec3;

/// Newton's steps lead to the hit from as far as this part of a shape's extent; the corners of
/// flat and bounded faces hide the right face from nearer (lemma L9, docs/numerics/leaving.md).
const NEAR_CURVED: f64 = 1.0 / 128.0;
const NEAR_FACED: f64 = 1.0 / 4096.0;

/// Roundings of f32 that t of a hit may be off by, and one for its own rounding.
const T_ROUNDINGS: f64 = 8.0;

/// What is off besides where t is denormal in f32, and the t that f32 cuts off at.
const T_LEAST: f64 = f32::MIN_POSITIVE as f64;
const T_MOST: f64 = f32::MAX as f64;

/// Unit roundoffs of the lane types.
const SINGLE: f64 = <f32 as Scalar>::UNIT_ROUNDOFF as f64;
const DOUBLE: f64 = <f64 as Scalar>::UNIT_ROUNDOFF;

/// What hits have in common that are evaluated and shaded together.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct SurfaceKey {
    instance: u64,
    /// Of a CSG solid, else 0.
    operand: u32,
    pub material: Option<MaterialId>,
}

impl SurfaceKey {
    /// Returns the key of a hit, and whether all hits of its instance have the same.
    #[inline(always)]
    pub fn of(world: &World, id: HitId) -> (SurfaceKey, bool) {
        let shape = world.entry_of(id.instance).shape;
        let of_instance = world.instances.get(&world.scene, id.instance).material;
        let (operand, material, only) = match shape {
            Shape::Csg(row) => {
                let solid = &world.csg(row).solid;
                let (number, surface) = solid.operand_of(id.primitive & !TURNED);
                let operand = &solid.operands[number as usize];
                let own = || material_of_triangle(world, operand.shape, surface);
                let material = of_instance.or(operand.material).or_else(own);
                (number, material, false)
            }
            Shape::Mesh(mesh) => {
                let own = || material_of_triangle(world, shape, id.primitive);
                let only = of_instance.is_some() || world.scene.meshes.has_one_material(mesh);
                (0, of_instance.or_else(own), only)
            }
            _ => (0, of_instance, true),
        };
        let key = SurfaceKey {
            instance: id.instance,
            operand,
            material,
        };
        (key, only)
    }

    /// Mixes the key's numbers (the multiplier of Fibonacci hashing, Knuth 1973, section 6.4).
    #[inline(always)]
    pub fn hash(&self) -> usize {
        let material = self.material.map_or(0, MaterialId::index) as u64;
        let mixed = self.instance ^ u64::from(self.operand) << 24 ^ material << 44;
        (mixed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as usize
    }
}

/// Returns the material of a triangle of a mesh that has materials of its own.
#[inline(always)]
fn material_of_triangle(world: &World, shape: Shape, triangle: u32) -> Option<MaterialId> {
    match shape {
        Shape::Mesh(id) => world.scene.meshes.row(id).material(triangle),
        _ => None,
    }
}

/// A primitive in an instance: a whole mesh, or one operand of a CSG solid.
pub struct InteractionPart<'w> {
    world: &'w World,
    precision: Precision,
    instance: u64,
    /// Of a CSG solid: the operand that was hit; the surface is evaluated in its
    /// space.
    part: Option<Part<'w>>,
    shape: Shape,
    /// True if f32 lanes first test the primitive from the ray's origin.
    is_flat: bool,
    /// Map to the instance's space unless it is the world; and a mesh's centre.
    whole: Option<Affine>,
    center: DVec3,
    /// Map to the primitive's space unless it is the world.
    placed: Option<Affine>,
    /// Largest coordinate of the instance's shape, in its own space.
    size: f64,
    /// How far a point may be off the primitive so that Newton's steps find the hit, in
    /// object space; infinite for triangles and polygons, from which no distance is too far.
    near: f64,
    /// Factor from rounding errors in object space to world space.
    stretch: f64,
    material: Option<MaterialId>,
}

/// An operand of a CSG solid.
#[derive(Clone, Copy)]
struct Part<'w> {
    csg: &'w PreparedCsg,
    number: u32,
    /// Map from the CSG solid's space, unless it is the same.
    map: Option<&'w Affine>,
    /// Largest extent of the operand, or 0 without bounds.
    extent: f64,
    /// Least extent of the operand, infinite without bounds.
    least: f64,
    /// [`PreparedCsg::widening`] in f64: the share per unit of reach, and the constant.
    widening: [f64; 2],
    /// Planes only: bound on their placement error, in the CSG solid's space.
    slack: f64,
    material: Option<MaterialId>,
}

impl<'w> InteractionPart<'w> {
    pub fn of(world: &'w World, precision: Precision, id: HitId) -> InteractionPart<'w> {
        let instance = world.instances.get(&world.scene, id.instance);
        let entry = world.entry_of(id.instance);
        let whole = entry.placed.then_some(instance.object_from_world);
        let center = match entry.shape {
            Shape::Mesh(mesh) if entry.placed => world.scene.meshes.center[mesh.index()],
            _ => DVec3::ZERO,
        };
        // Boxes are f32: the box of a shape beyond that range is not finite.
        let size = if entry.size.is_finite() {
            entry.size
        } else {
            let bounds = shape_bounds(&world.scene, instance.shape);
            bounds.map_or(0.0, |own| own.max_abs())
        };
        let mut interaction = InteractionPart {
            world,
            precision,
            instance: id.instance,
            part: None,
            shape: entry.shape,
            is_flat: entry.shape.is_flat(),
            whole,
            center,
            placed: whole,
            size,
            near: f64::INFINITY,
            stretch: entry.stretch,
            material: instance.material,
        };
        if let Shape::Csg(row) = entry.shape {
            interaction.enter(row, id.primitive);
        }
        interaction.near = interaction.nearness(instance.shape);
        interaction
    }

    /// Computes [`near`](Self::near); `whole` is the instance's shape.
    fn nearness(&self, whole: ShapeId) -> f64 {
        let share = match self.shape.blur() {
            _ if self.shape.is_flat() => return f64::INFINITY,
            Blur::Planar | Blur::HalfSpaces => NEAR_FACED,
            _ => match self.shape {
                Shape::Cylinder(_) | Shape::Cone(_) | Shape::Prism(_) => NEAR_FACED,
                _ => NEAR_CURVED,
            },
        };
        let least = |own: Aabb| own.extent().min_element();
        let own = || shape_bounds(&self.world.scene, whole).map_or(f64::INFINITY, least);
        share * self.part.map_or_else(own, |part| part.least)
    }

    fn enter(&mut self, row: CsgId, primitive: u32) {
        let csg = self.world.csg(row);
        let solid = &csg.solid;
        let (number, _) = solid.operand_of(primitive & !TURNED);
        let operand = &solid.operands[number as usize];
        let frame = &solid.frames[operand.frame as usize];
        let map = (operand.frame != 0).then_some(&frame.operand_from_solid);
        let norms = [&frame.operand_from_solid, &frame.solid_from_operand].map(Affine::norm);
        let bounds = shape_bounds(&self.world.scene, operand.id);
        self.shape = operand.shape;
        self.stretch *= norms[0] * norms[1];
        self.placed = match (&self.whole, map) {
            (Some(whole), Some(part)) => Some(part.then_after(whole)),
            (whole, part) => part.or(whole.as_ref()).copied(),
        };
        let is_flat = self.shape.blur() == Blur::HalfSpaces;
        // A hit's coordinates are no larger than the CSG solid's.
        let slack = 2.0 * csg.placement_per_reach(operand.frame)[1];
        let many = is_flat && solid.frames.len() > 1 && slack.is_finite();
        self.part = Some(Part {
            csg,
            slack: if many { slack } else { 0.0 },
            widening: csg.widening_per_reach(DOUBLE),
            number,
            map,
            extent: bounds.map_or(0.0, |own| own.extent().max_element()),
            least: bounds.map_or(f64::INFINITY, |own| own.extent().min_element()),
            material: operand.material,
        });
    }

    /// Returns whether a hit belongs to this interaction.
    #[inline(always)]
    pub fn has(&self, id: HitId) -> bool {
        let operand = |part: &Part| part.csg.solid.operand_of(id.primitive & !TURNED).0;
        let same = |part: &Part| operand(part) == part.number;
        self.instance == id.instance && self.part.as_ref().is_none_or(same)
    }

    /// Returns the material of one of the interaction's primitives.
    #[inline(always)]
    pub fn material(&self, primitive: u32) -> Option<MaterialId> {
        let part = self.part.as_ref();
        let own = || {
            let triangle = part.map_or(primitive, |part| part.surface(primitive));
            material_of_triangle(self.world, self.shape, triangle)
        };
        let of_part = || part.and_then(|part| part.material);
        self.material.or_else(of_part).or_else(own)
    }

    /// Says whether the surface is one of triangles with vertex normals.
    #[inline(always)]
    pub fn is_smooth(&self) -> bool {
        let normals = |id| self.world.scene.meshes.row(id).normals.is_some();
        self.part.is_none() && matches!(self.shape, Shape::Mesh(id) if normals(id))
    }

    /// Returns the world vectors that lift points of a smooth mesh off its facets
    /// ([`lift_onto_smooth`]).
    #[inline(never)]
    pub fn lift<D: Lanes<Scalar = f64>>(
        &self,
        surfaces: &Surfaces<D>,
        primitives: &[u32],
    ) -> Vec3<D> {
        let Shape::Mesh(id) = self.shape else {
            return Vec3::splat([0.0; 3]);
        };
        let mut at = surfaces.point;
        if let Some(map) = &self.whole {
            at = map.points(at) - Vec3::splat(self.center.to_array());
        }
        let one = D::splat(1.0);
        let side = D::select(surfaces.front, one, -one);
        let lift = lift_onto_smooth(&self.world.scene.meshes.row(id), (at, primitives), side);
        match &self.whole {
            None => lift,
            Some(_) => {
                let instance = self.world.instances.get(&self.world.scene, self.instance);
                instance.world_from_object.vectors(lift)
            }
        }
    }

    /// Evaluates one hit of a world ray.
    pub fn surface(&self, (org, dir): (DVec3, DVec3), t: f64, primitive: u32) -> Surface {
        let [org, dir] = [org, dir].map(Vec3::<f64>::from);
        let one = self.surfaces((org, dir), t, &[primitive]);
        Surface {
            point: one.point.into(),
            ng: one.ng.into(),
            ns: one.ns.into(),
            front: one.front.any(),
            offset: one.offset,
            material: self.material(primitive),
        }
    }

    /// Evaluates the hits of world rays, one per lane, from origins, directions, t and
    /// primitives.
    #[inline(always)]
    pub fn surfaces<D: Lanes<Scalar = f64>>(
        &self,
        (world_org, world_dir): (Vec3<D>, Vec3<D>),
        mut t: D,
        primitives: &[u32],
    ) -> Surfaces<D> {
        let (mut object_org, mut object_dir) = (world_org, world_dir);
        if let Some(map) = &self.whole {
            object_org = map.points(world_org) - Vec3::splat(self.center.to_array());
            object_dir = map.vectors(world_dir);
        }
        let (mut turned, mut wider) = (D::Mask::splat(false), D::splat(1.0));
        let mut own = D::ids(0);
        own.as_mut().copy_from_slice(&primitives[..D::COUNT]);
        if let Some(part) = &self.part {
            let mut bits = 0;
            for (i, primitive) in own.as_mut().iter_mut().enumerate() {
                bits |= u32::from(*primitive & TURNED != 0) << i;
                *primitive = part.surface(*primitive);
            }
            turned = D::Mask::from_bits(bits);
            let at = object_org + object_dir * t;
            let [share, more] = part.widening;
            wider = wider + (at.max_abs() * D::splat(share) + D::splat(more));
            if let Some(map) = part.map {
                object_org = map.points(object_org);
                object_dir = map.vectors(object_dir);
            }
        }
        let own = own.as_ref();
        let placed = self.placed.as_ref();
        let infinity = D::splat(f64::INFINITY);
        let (mut left, mut roundoff, mut blurred) = (D::zero(), SINGLE, [D::zero(); 2]);
        let mut known = None;
        if self.precision != Precision::Fast {
            let off = t.abs() * D::splat(T_ROUNDINGS * SINGLE) + D::splat(T_LEAST);
            let off = D::select(t.lt(D::splat(T_MOST)), off, D::splat(f64::INFINITY));
            let far = !(object_dir.max_abs() * off).le(D::splat(self.near));
            if far.any() {
                t = self.t_from_afar(far, (world_org, world_dir), t, primitives);
            }
        }
        let met = t;
        if self.precision != Precision::Fast {
            let rays = (object_org, object_dir);
            let (refined, height) = refined(self.world, self.shape, own, rays, t);
            t = refined;
            known = Some(height);
            // Error of the point in object space, converted to world space.
            left = to_world_height(placed, &height).abs();
            left = D::select(left.lt(infinity), left, D::zero());
            // Triangles are tested from the ray's origin in lanes of any type, which
            // must be certain that the triangle lies behind the leaving ray. Solids are
            // tested in f64 first.
            if !self.is_flat {
                roundoff = DOUBLE;
            }
            blurred = self.blurred(wider);
        }
        let borders = match self.shape {
            Shape::LevelSet(id) => {
                let formula = &self.world.scene.level_sets.formula[id.index()];
                self.borders(formula, (object_org, object_dir), (met, &mut t))
            }
            _ => None,
        };
        let point = world_org + world_dir * t;
        let at = object_org + object_dir * t;
        // Slope and normal come from one evaluation.
        if let (None, Shape::Implicit(_)) = (known, self.shape) {
            known = Some(height_at(self.world, self.shape, at));
        }
        let unit = known.map(|height| height.normal);
        let mut is_unit = unit.is_some();
        let (mut ng, mut smooth) = normals(self.world, self.shape, (at, own), unit);
        // Rounding on a polynomial without a slope moves the ray's start no farther
        // than this.
        let local = D::splat(self.size).max(at.max_abs());
        let farthest = local * D::splat(LEAVING_SLOPELESS);
        // A polynomial's values are f64 whatever the lanes; only t has the lanes' type.
        let of_values = match self.shape {
            Shape::Implicit(_) => DOUBLE,
            _ => roundoff,
        };
        let most = farthest * D::splat(1.0 / (LEAVING * of_values));
        let slope = known.map(|height| height.slope);
        let mut blur = self.world.scene.blur(self.shape, at, slope);
        let slopeless = !blur.lt(most);
        if slopeless.any() {
            left = D::select(slopeless, left.min(D::splat(self.stretch) * farthest), left);
        }
        if let Shape::Implicit(_) | Shape::LevelSet(_) = self.shape {
            if !is_unit {
                (ng, is_unit) = (units(ng), true);
            }
            // The gradient's direction is rounding noise, or the gradient left f64's
            // range.
            let lost = !(blur * D::splat(DOUBLE)).lt(local);
            let lost = lost | !ng.length_squared().gt(D::splat(0.5));
            if lost.any() {
                let scene = &self.world.scene;
                let bounds = match self.shape {
                    Shape::Implicit(id) => scene.implicits.bounds[id.index()],
                    Shape::LevelSet(id) => scene.level_sets.region[id.index()],
                    _ => None,
                };
                let extent = |own: Aabb| D::splat(own.extent().max_element());
                let back = bounds.map_or(local, extent) * D::splat(SLOPELESS);
                let other = normal_before((scene, self.shape), at, object_dir, back);
                ng = Vec3::select(lost, other, ng);
            }
        }
        blur = D::select(slopeless, most, blur);
        if let Some((there, normals)) = borders {
            ng = Vec3::select(there, units(normals), ng);
            left = D::select(there, D::zero(), left);
            blur = D::select(there, local, blur);
        }
        if turned.any() {
            let outward = |n: Vec3<D>| Vec3::select(turned, -n, n);
            (ng, smooth) = (outward(ng), smooth.map(outward));
        }
        let ng = match placed {
            None if is_unit => ng,
            _ => to_world(placed, ng),
        };
        let front = world_dir.dot(ng).le(D::zero());
        let facing = Vec3::select(front, ng, -ng);
        let ns = match smooth {
            None => facing,
            Some(n) => shading_normal(to_world(placed, n), facing, front, world_dir),
        };
        // The magnitudes whose rounding the hit carries, in world units: in object
        // space as the kernel rounds them; world rays are f64.
        let object_size = D::splat(self.size).max(object_org.max_abs());
        let object = (D::splat(roundoff) * object_size).max(D::splat(of_values) * blur);
        let world_size = world_org.max_abs().max(point.max_abs());
        let rounded =
            D::splat(self.stretch) * (object + blurred[0]) + D::splat(DOUBLE) * world_size;
        let most = D::splat(f64::MAX / LEAVING);
        let offset = D::splat(LEAVING) * rounded.min(most) + left;
        let more = D::splat(self.stretch) * blurred[1];
        Surfaces {
            point,
            ng,
            ns,
            front,
            offset,
            shadow_offset: offset + D::splat(LEAVING) * more.min(most),
        }
    }

    /// Replaces t of the lanes in `far` by the f64 nearest to the exact one, where f32 has it
    /// too coarsely for Newton's steps to begin from.
    #[cold]
    #[inline(never)]
    fn t_from_afar<D: Lanes<Scalar = f64>>(
        &self,
        far: D::Mask,
        (org, dir): (Vec3<D>, Vec3<D>),
        mut t: D,
        primitives: &[u32],
    ) -> D {
        let mut bits = far.bits();
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let of = |v: Vec3<D>| [v.x.lane(i), v.y.lane(i), v.z.lane(i)];
            let id = HitId {
                instance: self.instance,
                primitive: primitives[i],
            };
            if let Some(exact) = exact_t(self.world, of(org), of(dir), id) {
                t = t.with_lane(i, exact);
            }
        }
        t
    }

    /// Finds the places near `met` where a level set's function ends or jumps: the
    /// lanes that have one, and the normals there. Sets those lanes' t to the place,
    /// since Newton steps lead away from poles.
    fn borders<D: Lanes<Scalar = f64>>(
        &self,
        formula: &Formula,
        (org, dir): (Vec3<D>, Vec3<D>),
        (met, t): (D, &mut D),
    ) -> Option<(D::Mask, Vec3<D>)> {
        let (mut bits, mut normals) = (0, [[0.0; 3]; 16]);
        for (i, normal) in normals.iter_mut().enumerate().take(D::COUNT) {
            let of = |v: Vec3<D>| [v.x.lane(i), v.y.lane(i), v.z.lane(i)];
            if let Some(border) = border(formula, (of(org), of(dir)), met.lane(i), SINGLE) {
                (*t, *normal) = (t.with_lane(i, border.t), border.normal);
                bits |= 1 << i;
            }
        }
        (bits != 0).then(|| (D::Mask::from_bits(bits), Vec3::of_lanes(|i| normals[i])))
    }

    /// Returns the extra rounding of a CSG solid's operands, as a length in the operand's
    /// space; and what is added to it for f32 lanes. Except meshes, quadrics, implicits and
    /// level sets, operands are tested at their own size; no operand is more accurate than its
    /// placement.
    #[inline(always)]
    fn blurred<D: Lanes<Scalar = f64>>(&self, wider: D) -> [D; 2] {
        let Some(part) = &self.part else {
            return [D::zero(); 2];
        };
        let roundoff = (D::splat(DOUBLE) * wider).min(D::splat(SINGLE));
        let [in_double, in_single] = match self.shape.blur() {
            Blur::Apart => [0.0; 2],
            Blur::Planar | Blur::HalfSpaces => [1.0; 2],
            // In f64 axes are rounded, too.
            _ => [4.0 * LEAVING_CURVED, LEAVING_CURVED],
        };
        let extent = D::splat(part.extent);
        let double = D::splat(in_double) * roundoff * extent;
        let single = D::splat(in_single * SINGLE) * extent;
        [
            double + D::splat(part.slack * (4.0 / LEAVING)),
            (single - double).max(D::zero()),
        ]
    }
}

impl Part<'_> {
    /// Returns the operand's surface number of a hit's primitive.
    #[inline(always)]
    fn surface(&self, primitive: u32) -> u32 {
        self.csg.solid.operand_of(primitive & !TURNED).1
    }
}

#[cfg(test)]
mod tests;
