//! A record of one path, for `verify`: its rays, what they meet, and its rays towards light.

use super::shadows::LightRays;
use super::state::Paths;
use crate::scene::Rgb;
use crate::trace::HitId;

/// A ray of a path, what it meets, and the ray from there towards light.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    /// The path's weight on the ray, before the medium on its way absorbs.
    pub weight: Rgb,
    /// [`HitId::NONE`] for the sky.
    pub met: HitId,
    pub light: Option<PathLight>,
}

/// A ray towards light.
#[derive(Clone, Copy, Debug)]
pub struct PathLight {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_max: f32,
    pub weight: Rgb,
    pub blocked: bool,
}

/// Records the rays of a wave of a single path.
pub(super) fn record_ray(
    wave: &Paths,
    (instance, primitive): (&[u64], &[u32]),
    record: &mut Vec<PathVertex>,
) {
    for ray in 0..wave.rays.len() {
        record.push(PathVertex {
            org: wave.rays.org(ray),
            dir: wave.rays.dir(ray),
            weight: wave.rays.weight.row(ray),
            met: HitId {
                instance: instance[ray],
                primitive: primitive[ray],
            },
            light: None,
        });
    }
}

/// Records the ray towards light of the last vertex.
pub(super) fn record_light(lights: &LightRays, record: &mut [PathVertex]) {
    if let (Some(vertex), false) = (record.last_mut(), lights.rays.is_empty()) {
        vertex.light = Some(PathLight {
            org: lights.rays.org(0),
            dir: lights.rays.dir(0),
            t_max: lights.rays.t_max[0],
            weight: lights.rays.weight.row(0),
            blocked: lights.blocked[0],
        });
    }
}
