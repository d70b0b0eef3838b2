use crate::math::Aabb;
use glam::DVec3;

/// A truncated circular cone from `base` to `top`; one radius may be 0 (an
/// apex), and equal radii make a cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    pub base: DVec3,
    pub top: DVec3,
    /// ≥ 0.
    pub base_radius: f64,
    /// ≥ 0, not both 0.
    pub top_radius: f64,
    /// Without caps: a surface, no inside.
    pub open: bool,
}

impl Cone {
    pub fn bounds(&self) -> Aabb {
        frustum_bounds(self.base, self.base_radius, self.top, self.top_radius)
    }
}

/// The box around two coaxial discs: along axis k a disc with unit normal n
/// reaches r·√(1 − n_k²).
pub(super) fn frustum_bounds(base: DVec3, base_radius: f64, top: DVec3, top_radius: f64) -> Aabb {
    let axis = top - base;
    let size = axis.abs().max_element();
    let n = (axis / size).normalize();
    // As the other two components' length: 1 − n_k² would cancel.
    let reach = DVec3::new(n.y.hypot(n.z), n.x.hypot(n.z), n.x.hypot(n.y));
    // One part in 10^15 outward for the rounding of this very computation.
    let disc =
        |c: DVec3, r: f64| Aabb::new(c, c).grown(reach * r * (1.0 + 1e-15) + (c.abs() + r) * 4e-16);
    disc(base, base_radius).union(&disc(top, top_radius))
}
