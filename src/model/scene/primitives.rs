//! Dispatch of [`Primitive`]'s functions by a shape's kind. Each function is one match over the
//! kinds, made by [`for_each_kind`].

use super::conditioning::Conditioning;
use super::ids::ShapeId;
use super::{Shape, Tables};
use crate::geom::Chart;
use crate::geom::exact::Solid;
use crate::geom::face::Face;
use crate::geom::guarded::{Ends, ObjectRay};
use crate::geom::kinds::for_each_kind;
use crate::geom::primitive::{Blur, Boundaries, Flaw, Height, Primitive};
use crate::geom::{self, Meet, Scratch};
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

macro_rules! dispatch {
    ($d:tt $([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        /// Evaluates an expression with the table and the id of a primitive, or another for a
        /// mesh or a CSG solid.
        macro_rules! of_primitive {
            ($d tables:expr, $d shape:expr, ($d table:ident, $d id:ident) => $d answer:expr, $d other:expr) => {
                match $d shape {
                    $(Shape::$kind($d id) => {
                        let $d table = &$d tables.$field;
                        $d answer
                    })*
                    Shape::Mesh(_) | Shape::Csg(_) => $d other,
                }
            };
        }

        impl Shape {
            /// Returns how the boundaries of an operand are found. A mesh has any number of
            /// crossings. CSG solids are unfolded and never operands themselves.
            #[inline(always)]
            pub fn boundaries(self) -> Boundaries {
                match self {
                    $(Shape::$kind(_) => <geom::$table as Primitive>::BOUNDARIES,)*
                    Shape::Mesh(_) | Shape::Csg(_) => Boundaries::Crossings,
                }
            }

            /// Returns the kind of bound on an operand's hit points in lanes.
            #[inline(always)]
            pub fn blur(self) -> Blur {
                match self {
                    $(Shape::$kind(_) => <geom::$table as Primitive>::BLUR,)*
                    Shape::Mesh(_) => Blur::Apart,
                    Shape::Csg(_) => Blur::Curved,
                }
            }

            /// Returns whether lanes trace the shape from the ray's own start.
            #[inline(always)]
            pub fn is_flat(self) -> bool {
                match self {
                    $(Shape::$kind(_) => <geom::$table as Primitive>::IS_FLAT,)*
                    Shape::Mesh(_) => true,
                    Shape::Csg(_) => false,
                }
            }
        }

        impl Tables {
            /// Returns a primitive's row for exact arithmetic; `None` for meshes and CSG solids.
            #[inline(always)]
            pub fn solid(&self, shape: Shape) -> Option<Solid<'_>> {
                Some(match shape {
                    $(Shape::$kind(id) => Solid::$kind(Primitive::exact(&self.$field, id)),)*
                    Shape::Mesh(_) | Shape::Csg(_) => return None,
                })
            }
        }
    };
}

for_each_kind!(dispatch $);

/// Returns a box in object space that contains every point of a shape; `None` if the shape has
/// no bounds.
pub fn shape_bounds(tables: &Tables, shape: ShapeId) -> Option<Aabb> {
    match tables.shapes.row(shape) {
        Shape::Mesh(id) => Some(geom::primitive::outward(tables.meshes.row(id).bounds())),
        Shape::Csg(id) => tables.csg.bounds.get(id.index()).copied()?,
        shape => of_primitive!(tables, shape, (table, id) => Primitive::bounds(table, id), None),
    }
}

/// Returns the point that a shape's own numbers count from: a mesh's centre, or the origin.
pub fn shape_center(tables: &Tables, shape: Shape) -> DVec3 {
    match shape {
        Shape::Mesh(id) => tables.meshes.center[id.index()],
        _ => DVec3::ZERO,
    }
}

/// Returns the faces of a solid, numbered as by [`Ends`]; `None` for a face that is only a
/// point.
pub fn faces_of(tables: &Tables, shape: Shape) -> Vec<Option<Face>> {
    of_primitive!(tables, shape, (table, id) => table.faces(id), Vec::new())
}

/// Returns a certain miss, for meshes and CSG solids, which no primitive's kernel traces.
fn nothing<L: Lanes>() -> Meet<L> {
    Meet::certain(L::Mask::splat(false), L::zero())
}

impl Tables {
    /// Returns the amplification in a shape's own inner spaces: those of a CSG solid's
    /// operands.
    pub fn conditioning_of(&self, shape: ShapeId) -> Conditioning {
        match self.shapes.row(shape) {
            Shape::Csg(id) => self.csg.conditioning[id.index()],
            _ => Conditioning::NONE,
        }
    }

    /// Checks the row of a primitive.
    pub(super) fn flaw(&self, shape: Shape) -> Result<(), Flaw> {
        of_primitive!(self, shape, (table, id) => table.check(id), Ok(()))
    }

    /// Returns why a shape cannot be an operand of CSG, as far as its row tells.
    pub fn no_inside(&self, shape: Shape) -> Option<&'static str> {
        match shape {
            Shape::Mesh(id) if self.deformations.has(id) => {
                Some("it deforms, and nobody follows its inside")
            }
            Shape::Mesh(id) => self.meshes.open[id.index()].then_some(geom::primitive::OPEN),
            shape => of_primitive!(self, shape, (table, id) => table.no_inside(id), None),
        }
    }

    /// Returns the normals of the planes that bound a shape.
    pub fn plane_normals(&self, shape: Shape) -> Vec<DVec3> {
        of_primitive!(self, shape, (table, id) => table.plane_normals(id), Vec::new())
    }

    /// Returns rings of corners along which a ray's answer changes.
    pub fn outlines(&self, shape: Shape) -> Vec<Vec<DVec3>> {
        of_primitive!(self, shape, (table, id) => table.outlines(id), Vec::new())
    }

    /// Returns the least extent of a shape, if bounds in lanes are relative to it
    /// (docs/numerics/csg.md, K3).
    pub fn thickness(&self, shape: ShapeId) -> Option<f64> {
        let least = |b: Aabb| b.extent().min_element();
        let of_box = || Some(shape_bounds(self, shape).map_or(1.0, least));
        let row = self.shapes.row(shape);
        of_primitive!(self, row, (table, id) => table.thickness(id), of_box())
    }

    /// [`Primitive::meet_fast`].
    #[inline(always)]
    pub fn meet_fast<L: Lanes>(
        &self,
        shape: Shape,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        of_primitive!(self, shape, (table, id) => table.meet_fast(id, object, active, scratch), nothing())
    }

    /// [`Primitive::meet`].
    #[inline(always)]
    pub fn meet<L: Lanes>(
        &self,
        shape: Shape,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        of_primitive!(self, shape, (table, id) => table.meet(id, extent, object, active, scratch), nothing())
    }

    /// [`Primitive::meet_again`].
    #[inline(always)]
    pub fn meet_again<L: Lanes>(
        &self,
        shape: Shape,
        extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        of_primitive!(self, shape, (table, id) => table.meet_again(id, extent, object, active, scratch), nothing())
    }

    /// [`Primitive::ends_fast`].
    #[inline(always)]
    pub fn ends_fast<L: Lanes>(&self, shape: Shape, object: &ObjectRay<L>) -> Ends<L> {
        let none = || unreachable!("meshes are not met in lanes");
        of_primitive!(self, shape, (table, id) => table.ends_fast(id, object), none())
    }

    /// [`Primitive::ends`].
    #[inline(always)]
    pub fn ends<L: Lanes>(
        &self,
        shape: Shape,
        object: &ObjectRay<L>,
        astray: L::Double,
    ) -> Ends<L> {
        let none = || unreachable!("meshes are not met in lanes");
        of_primitive!(self, shape, (table, id) => table.ends(id, object, astray), none())
    }

    /// [`Primitive::nearest`]; 0 and +y for other shapes.
    #[inline(always)]
    pub fn nearest<D: Lanes<Scalar = f64>>(&self, shape: Shape, p: Vec3<D>) -> (D, Vec3<D>) {
        let up = || (D::zero(), Vec3::splat(DVec3::Y.to_array()));
        of_primitive!(self, shape, (table, id) => table.nearest(id, p), up())
    }

    /// [`Primitive::height`].
    #[inline(always)]
    pub fn height<D: Lanes<Scalar = f64>>(
        &self,
        shape: Shape,
        (above, normal): (D, Vec3<D>),
    ) -> Height<D> {
        let slope = D::splat(1.0);
        let flat = || Height {
            above,
            normal,
            slope,
        };
        of_primitive!(self, shape, (table, _id) => table.height((above, normal)), flat())
    }

    /// [`Primitive::normals`]; +y for other shapes.
    #[inline(always)]
    pub fn normals<D: Lanes<Scalar = f64>>(&self, shape: Shape, p: Vec3<D>) -> Vec3<D> {
        let up = || Vec3::splat(DVec3::Y.to_array());
        of_primitive!(self, shape, (table, id) => Primitive::normals(table, id, p), up())
    }

    /// [`Primitive::chart`]; along the axes for other shapes.
    pub fn chart(&self, shape: Shape, p: DVec3, normal: DVec3) -> Chart {
        let other = || Chart::along_axes(p, normal);
        of_primitive!(self, shape, (table, id) => table.chart(id, p, normal), other())
    }

    /// [`Primitive::blur`].
    #[inline(always)]
    pub fn blur<D: Lanes<Scalar = f64>>(&self, shape: Shape, at: Vec3<D>, slope: Option<D>) -> D {
        of_primitive!(self, shape, (table, id) => table.blur(id, at, slope), D::zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{HalfSpace, Sphere};
    use crate::scene::SceneBuilder;

    #[test]
    fn a_box_holds_what_rounding_would_lose() {
        let mut scene = SceneBuilder::default();
        let center = DVec3::splat(1.0);
        let ball = scene.sphere(
            "",
            Sphere {
                center,
                radius: 1e-20,
            },
        );
        let ground = scene.half_space(
            "",
            HalfSpace {
                normal: DVec3::Y,
                offset: 0.0,
            },
        );
        let bounds = shape_bounds(scene.tables(), ball).unwrap();
        assert!(bounds.min.x < 1.0 && bounds.max.x > 1.0);
        assert_eq!(shape_bounds(scene.tables(), ground), None);
    }
}
