//! Paths that wait to be continued: rays in columns, and what each remembers of its way.

use super::layers::Trail;
use crate::math::Vec3;
use crate::shade::columns::{Column3, Doubles, STEP, Singles, each_lane, gather, keep};
use crate::shade::ray_queue::{BATCH, RayQueue};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// The rays of one depth, one a path, and the paths' states in columns of the same length.
pub(super) struct Paths<'b> {
    pub rays: RayQueue<'b>,
    /// The key of the pixel's random numbers.
    pub key: ArenaVec<'b, u32>,
    /// The density, over solid angle, with which the last scattering chose the ray's
    /// direction; infinite for mirrors and camera rays, which no light sampling competes with.
    pub pdf: ArenaVec<'b, f32>,
    /// The shading normal where the ray left, for the density of light sampling there; zero
    /// where light from both sides counts.
    pub normal: Column3<'b, Singles>,
    /// Whether the path has come straight from the camera, through holes and panes: what it
    /// meets is seen through them.
    pub straight: ArenaVec<'b, bool>,
    /// What paths know of media, if materials have any.
    interior: Option<Interior<'b>>,
    /// Where the path was last scattered, from where light was sampled that it may meet; kept
    /// where it may have passed holes and panes since.
    origin: Option<Column3<'b, Doubles>>,
    /// The factors of the path's weight from its next scattering on: what an irradiance cache
    /// has given is not found again. Kept where there is a cache.
    onward: Option<Column3<'b, Singles>>,
    /// The rays' cones, if textures are looked up.
    pub cones: Option<ArenaVec<'b, Cone>>,
    /// The paths' ways, if layers of light are kept.
    pub trails: Option<ArenaVec<'b, Trail>>,
    /// Whether the path has come from the camera through holes alone, if mattes are kept.
    pub open: Option<ArenaVec<'b, bool>>,
    /// The pixel filter's weight of paths that still look for a denoiser's guides, 0 of others, if
    /// they are kept.
    pub guiding: Option<ArenaVec<'b, f32>>,
}

/// The columns of paths that may be in media.
struct Interior<'b> {
    /// The media around the ray's origin.
    media: ArenaVec<'b, Media>,
    /// The factor by which refraction has compressed radiance; Russian roulette ignores it.
    compression: ArenaVec<'b, f32>,
}

/// What the paths of a picture may meet, and so have to remember.
#[derive(Clone, Copy, Debug)]
pub struct PathKinds {
    /// Meshes with vertex normals.
    pub smooth: bool,
    /// Surfaces that paths pass.
    pub holes: bool,
    /// An irradiance cache.
    pub cache: bool,
    /// Materials that vary from hit to hit.
    pub textures: bool,
    /// Media inside of surfaces.
    pub media: bool,
}

impl<'b> Paths<'b> {
    pub fn new(arena: &'b Bump, kinds: PathKinds) -> Paths<'b> {
        let numbers = || ArenaVec::with_capacity_in(BATCH, arena);
        Paths {
            rays: RayQueue::with_capacity(BATCH, arena),
            key: ArenaVec::with_capacity_in(BATCH, arena),
            pdf: numbers(),
            normal: Column3::with_capacity(BATCH, arena),
            straight: ArenaVec::with_capacity_in(BATCH, arena),
            interior: kinds.media.then(|| Interior {
                media: ArenaVec::with_capacity_in(BATCH, arena),
                compression: numbers(),
            }),
            origin: (kinds.holes).then(|| Column3::with_capacity(BATCH, arena)),
            onward: (kinds.cache).then(|| Column3::with_capacity(BATCH, arena)),
            cones: (kinds.textures).then(|| ArenaVec::with_capacity_in(BATCH, arena)),
            trails: None,
            open: None,
            guiding: None,
        }
    }

    /// Returns the way of a path, if layers of light are kept.
    pub fn trail(&self, ray: u32) -> Trail {
        let trails = self.trails.as_ref();
        trails.map_or_else(Trail::default, |trails| trails[ray as usize])
    }

    /// Returns the way of a path that is scattered again, of which a cache may have given a part.
    pub fn trail_on(&self, ray: u32) -> Trail {
        let trail = self.trail(ray);
        match (&self.onward, &self.trails) {
            (Some(onward), Some(_)) => trail.without_cached(onward.row(ray as usize)),
            _ => trail,
        }
    }

    /// Returns the media around the origin of a path's ray.
    pub fn media(&self, ray: u32) -> Media {
        let interior = self.interior.as_ref();
        interior.map_or_else(Media::default, |all| all.media[ray as usize])
    }

    /// Returns the media around the origins of some paths' rays.
    #[inline(always)]
    pub fn media_of(&self, rows: &[u32; STEP]) -> [Media; STEP] {
        match &self.interior {
            Some(interior) => each_lane(|i| interior.media[rows[i] as usize]),
            None => [Media::default(); STEP],
        }
    }

    /// Returns the factors by which refraction has compressed some paths' radiance.
    #[inline(always)]
    pub fn compression(&self, rows: &[u32; STEP]) -> Singles {
        match &self.interior {
            Some(interior) => gather(&interior.compression, rows),
            None => Singles::splat(1.0),
        }
    }

    /// Appends what paths know of media, in some lanes of a step.
    #[inline(always)]
    pub fn push_interior(
        &mut self,
        media: impl FnOnce() -> [Media; STEP],
        compression: Singles,
        rows: u32,
    ) {
        if let Some(interior) = &mut self.interior {
            keep(&mut interior.media, &media(), rows);
            keep(
                &mut interior.compression,
                compression.to_array().as_ref(),
                rows,
            );
        }
    }

    /// Returns where a path was last scattered.
    pub fn origin(&self, ray: usize) -> DVec3 {
        DVec3::from_array(match &self.origin {
            Some(origin) => origin.row(ray),
            None => self.rays.org(ray),
        })
    }

    /// Returns where some paths were last scattered; `org` are the origins of their rays.
    pub fn origins(&self, rows: &[u32; STEP], org: Vec3<Doubles>) -> Vec3<Doubles> {
        match &self.origin {
            Some(origin) => origin.gather(rows),
            None => org,
        }
    }

    /// Appends where paths were last scattered, in some lanes of a step.
    pub fn push_origins(&mut self, origins: Vec3<Doubles>, rows: u32) {
        if let Some(column) = &mut self.origin {
            column.push_some(origins, rows);
        }
    }

    /// Returns the factors of some paths' weights from their next scattering on, if any.
    pub fn onward(&self, rows: &[u32; STEP]) -> Option<Vec3<Singles>> {
        self.onward.as_ref().map(|onward| onward.gather(rows))
    }

    /// Appends the factors of paths' weights, 1 if nothing is left out, in some lanes of a step.
    pub fn push_onward(&mut self, onward: Option<Vec3<Singles>>, rows: u32) {
        if let Some(column) = &mut self.onward {
            column.push_some(onward.unwrap_or(Vec3::splat([1.0; 3])), rows);
        }
    }

    pub fn clear(&mut self) {
        self.rays.truncate(0);
        self.key.clear();
        self.pdf.clear();
        self.normal.truncate(0);
        self.straight.clear();
        if let Some(interior) = &mut self.interior {
            interior.media.clear();
            interior.compression.clear();
        }
        if let Some(origin) = &mut self.origin {
            origin.truncate(0);
        }
        if let Some(onward) = &mut self.onward {
            onward.truncate(0);
        }
        if let Some(cones) = &mut self.cones {
            cones.clear();
        }
        if let Some(trails) = &mut self.trails {
            trails.clear();
        }
        if let Some(open) = &mut self.open {
            open.clear();
        }
        if let Some(guiding) = &mut self.guiding {
            guiding.clear();
        }
    }

    /// Gives camera rays, which are in the queue already, the state of paths that begin.
    pub fn begin(&mut self, media: Media, [width, spread]: [f32; 2]) {
        let paths = self.rays.len();
        self.pdf.resize(paths, f32::INFINITY);
        self.normal.resize(paths, [0.0; 3]);
        self.straight.resize(paths, true);
        if let Some(interior) = &mut self.interior {
            interior.media.resize(paths, media);
            interior.compression.resize(paths, 1.0);
        }
        // Nothing competes with camera rays.
        if let Some(origin) = &mut self.origin {
            origin.resize(paths, [0.0; 3]);
        }
        if let Some(onward) = &mut self.onward {
            onward.resize(paths, [1.0; 3]);
        }
        if let Some(cones) = &mut self.cones {
            cones.resize(paths, Cone { width, spread });
        }
        if let Some(trails) = &mut self.trails {
            trails.resize(paths, Trail::default());
        }
        if let Some(open) = &mut self.open {
            open.resize(paths, true);
        }
        if let Some(guiding) = &mut self.guiding {
            guiding.extend((0..paths).map(|ray| self.rays.weight.row(ray)[0]));
        }
    }
}

/// What a ray stands for: its width at its origin, and how much wider it gets per unit of way
/// (Akenine-Möller et al. 2021).
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    pub width: f32,
    pub spread: f32,
}

/// The media that a point is in, by number of their material plus one, 0 for none: at most
/// four overlap (a list as in Lee et al., "Vectorized Production Path Tracing", 2017).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Media([u32; 4]);

impl Media {
    /// Adds a medium. A fifth is not remembered.
    pub fn enter(&mut self, material: u32) {
        if let Some(free) = self.0.iter_mut().find(|m| **m == 0) {
            *free = material + 1;
        }
    }

    /// Removes a medium once, if it is there.
    pub fn leave(&mut self, material: u32) {
        if let Some(here) = self.0.iter_mut().find(|m| **m == material + 1) {
            *here = 0;
        }
    }

    /// Crosses the surface of a medium, from its front or from inside.
    pub fn cross(&mut self, material: u32, front: bool) {
        match front {
            true => self.enter(material),
            false => self.leave(material),
        }
    }

    /// Returns the materials of all media.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.0.into_iter().filter(|m| *m != 0).map(|m| m - 1)
    }

    pub fn has(&self, material: u32) -> bool {
        self.0.contains(&(material + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn media_are_a_bag_of_four() {
        let mut media = Media::default();
        assert_eq!(media.iter().count(), 0);
        for material in [3, 0, 3] {
            media.enter(material);
        }
        media.leave(3);
        media.leave(7);
        assert!(media.has(3) && media.has(0) && !media.has(7));
        media.leave(3);
        assert_eq!(media.iter().collect::<Vec<_>>(), [0]);
        for material in 10..20 {
            media.enter(material);
        }
        assert_eq!(media.iter().count(), 4);
    }
}
