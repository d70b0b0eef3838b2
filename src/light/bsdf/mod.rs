//! Reflection and transmission of surfaces: evaluates and samples layered materials, in lanes.
//!
//! A [`Bsdf`] holds what is the same for all hits on a material: which lobes there are, so that
//! a material pays for none that it lacks. [`Looks`] hold what differs from hit to hit. Lobes
//! lie in files of their own; `layered` puts those of glTF's model together, `phong` is the
//! model of NFF and MTL.
//!
//! Directions are unit and local: z is the shading normal on the side that the ray comes from,
//! x the tangent. `out` points back along the ray, out.z > 0; `into` is where the path goes on,
//! with z < 0 if the light passes through. `eta` is the index of refraction on the far side
//! over that on the ray's side. Colours are linear Rec. 709.
//!
//! Weights are those of radiance (Veach 1997, section 5.2): a refracted ray has the factor
//! 1/eta², since radiance over the square of the index is what refraction leaves as it is.
//! Through a slab the factors cancel. Russian roulette has to undo them.
//!
//! Dispersion is the integrator's: it passes the `eta` of each lane's wavelength, from the
//! material's `dispersion`. Unlit materials and opacity are, too.
//!
//! White materials in a white furnace are 1 at any roughness, within 0.5 % and never above
//! 1.001 (tests.rs). Three are not: rough solid glass loses what is scattered twice; stretched
//! lobes are 0.97 to 1.001, for 3 % of what they lose is not given back; below a film the base is weighed by the
//! film's most reflective channel (up to 9 % dark).

mod albedo;
mod albedo_table;
mod coat;
mod diffuse;
mod film;
mod fresnel;
mod glass;
mod glass_albedo;
mod layered;
mod microfacet;
mod phong;
mod sheen;
#[cfg(test)]
mod tests;

use lanecast_model::scene::{Material, Model, Rgb};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, Mask, max};
use layered::Layered;
use phong::Phong;

/// What is the same for all hits on a material.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    /// The surface absorbs all light: there is no lobe.
    pub is_black: bool,
    /// There are only perfect mirrors and windows, for which no light can be sampled.
    pub only_delta: bool,
    /// Light may pass to the other side, by refraction or diffusely.
    pub transmits: bool,
    /// What transmits is a sheet without a volume.
    pub thin_walled: bool,
    /// The share of the surface that is there.
    pub opacity: f32,
    looks: Looks<f32>,
    model: Lobes,
}

#[derive(Clone, Copy, Debug)]
#[expect(clippy::large_enum_variant, reason = "one per material")]
enum Lobes {
    Layered(Layered),
    Phong(Phong),
}

/// What may differ from hit to hit. Materials of Phong's model have but `base_color`, which
/// they ignore.
#[derive(Clone, Copy, Debug)]
pub struct Looks<L> {
    pub base_color: [L; 3],
    pub metallic: L,
    pub roughness: L,
    /// The normal of a coat, where it has one of its own: unit, local, on the side of `out`.
    pub coat_normal: Option<Vec3<L>>,
}

/// Whether looks are the same at all hits of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variation {
    /// They are those of the material.
    Uniform,
    /// Textures scale them: each lies between 0 and what the material says.
    Textured,
}

/// The sum of all lobes that are not delta distributions, towards one direction.
#[derive(Clone, Copy, Debug)]
pub struct Evaluated<L> {
    /// BSDF · |cos|.
    pub value: [L; 3],
    /// The density by which [`Bsdf::sample`] finds the direction, per steradian.
    pub pdf: L,
}

/// A direction in which a path goes on.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<L: Lanes> {
    pub into: Vec3<L>,
    /// BSDF · |cos| / pdf.
    pub weight: [L; 3],
    /// The density per steradian; of a delta lobe the probability of its choice.
    pub pdf: L,
    pub delta: L::Mask,
    /// The path goes to the other side.
    pub through: L::Mask,
    /// The path goes on; where it does not, `weight` and `pdf` are 0.
    pub some: L::Mask,
}

impl Bsdf {
    /// Prepares a material whose looks are the same everywhere.
    pub fn new(material: &Material) -> Bsdf {
        Bsdf::varied(material, Variation::Uniform)
    }

    /// Prepares a material. Lobes that no hit can have are left out.
    pub fn varied(material: &Material, variation: Variation) -> Bsdf {
        let (metallic, roughness) = match material.model {
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => (metallic, roughness),
            Model::Phong { .. } => (0.0, 0.0),
        };
        let clamped = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let looks = Looks {
            base_color: material.base_color.map(clamped),
            metallic: clamped(metallic),
            roughness: clamped(roughness),
            coat_normal: None,
        };
        let model = match material.model {
            Model::Phong { .. } => Lobes::Phong(Phong::new(material)),
            Model::MetallicRoughness { .. } => {
                Lobes::Layered(Layered::new(material, &looks, variation))
            }
        };
        let [is_black, only_delta, transmits] = match &model {
            Lobes::Layered(it) => [it.is_black(), it.only_delta(), it.transmits()],
            Lobes::Phong(it) => [it.is_black(), it.only_delta(), it.transmits()],
        };
        Bsdf {
            is_black,
            only_delta,
            transmits,
            thin_walled: material.layers.thin_walled,
            opacity: clamped(material.layers.opacity),
            looks,
            model,
        }
    }

    /// Returns the material's own looks in all lanes.
    #[inline(always)]
    pub fn looks<L: Lanes<Scalar = f32>>(&self) -> Looks<L> {
        Looks {
            base_color: self.looks.base_color.map(L::splat),
            metallic: L::splat(self.looks.metallic),
            roughness: L::splat(self.looks.roughness),
            coat_normal: None,
        }
    }

    /// Returns the share of light that passes the surface straight on, through holes and smooth
    /// sheets, at the cosine to its normal.
    pub fn straight(&self, cos: f32) -> Rgb {
        let sheet = match &self.model {
            Lobes::Layered(it) => it.straight(&self.looks, cos.min(1.0)),
            Lobes::Phong(_) => [0.0; 3],
        };
        sheet.map(|share| (1.0 - self.opacity) + self.opacity * share)
    }

    /// Returns the albedo, towards `out`, of the lobe that reflects alike into all directions:
    /// its value is albedo · cos/π. It is 0 for lobes of rough diffuse reflection, which do not.
    #[inline]
    pub fn lambert<L: Lanes<Scalar = f32>>(
        &self,
        looks: &Looks<L>,
        eta: L,
        out: Vec3<L>,
    ) -> [L; 3] {
        if self.is_black || self.only_delta {
            return [L::zero(); 3];
        }
        let (out, eta) = (above(out), glass::clamped_eta(eta));
        match &self.model {
            Lobes::Layered(it) => it.lambert(&it.prepare(looks, eta, out)),
            Lobes::Phong(it) => it.lambert(),
        }
    }

    /// Evaluates all lobes but delta distributions.
    #[inline]
    pub fn eval<L: Lanes<Scalar = f32>>(
        &self,
        looks: &Looks<L>,
        eta: L,
        out: Vec3<L>,
        into: Vec3<L>,
    ) -> Evaluated<L> {
        if self.is_black || self.only_delta {
            return Evaluated::none();
        }
        let (out, eta) = (above(out), glass::clamped_eta(eta));
        match &self.model {
            Lobes::Layered(it) => it.eval(&it.prepare(looks, eta, out), into),
            Lobes::Phong(it) => it.eval(out, into),
        }
    }

    /// Returns the share of [`Bsdf::eval`] that diffuse lobes and fibres make, by channel; 0
    /// where nothing is scattered.
    pub fn diffuse_share<L: Lanes<Scalar = f32>>(
        &self,
        looks: &Looks<L>,
        eta: L,
        out: Vec3<L>,
        into: Vec3<L>,
    ) -> [L; 3] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        if self.is_black || self.only_delta {
            return [zero; 3];
        }
        let (out, eta) = (above(out), glass::clamped_eta(eta));
        let (all, diffuse) = match &self.model {
            Lobes::Layered(it) => {
                let hit = it.prepare(looks, eta, out);
                (it.eval(&hit, into).value, it.diffuse_part(&hit, into))
            }
            Lobes::Phong(it) => (it.eval(out, into).value, it.diffuse_part(into)),
        };
        std::array::from_fn(|k| {
            let some = all[k].gt(zero);
            let share = diffuse[k] / L::select(some, all[k], one);
            L::select(some, share.max(zero).min(one), zero)
        })
    }

    /// Samples a direction by three random numbers in [0, 1).
    #[inline]
    pub fn sample<L: Lanes<Scalar = f32>>(
        &self,
        looks: &Looks<L>,
        eta: L,
        out: Vec3<L>,
        u: [L; 2],
        lobe: L,
    ) -> Sampled<L> {
        if self.is_black {
            return Sampled::none(out);
        }
        let (out, eta) = (above(out), glass::clamped_eta(eta));
        match &self.model {
            Lobes::Layered(it) => it.sample(&it.prepare(looks, eta, out), u, lobe),
            Lobes::Phong(it) => it.sample(eta, out, u, lobe),
        }
    }
}

/// Lifts a direction from the horizon or below, where interpolated normals may see it.
#[inline(always)]
fn above<L: Lanes<Scalar = f32>>(out: Vec3<L>) -> Vec3<L> {
    Vec3::new(out.x, out.y, max(out.z, L::splat(1e-6)))
}

impl<L: Lanes<Scalar = f32>> Evaluated<L> {
    #[inline(always)]
    fn none() -> Evaluated<L> {
        Evaluated {
            value: [L::zero(); 3],
            pdf: L::zero(),
        }
    }
}

impl<L: Lanes<Scalar = f32>> Sampled<L> {
    #[inline(always)]
    fn none(out: Vec3<L>) -> Sampled<L> {
        let no = L::Mask::splat(false);
        Sampled {
            into: out,
            weight: [L::zero(); 3],
            pdf: L::zero(),
            delta: no,
            through: no,
            some: no,
        }
    }

    /// Makes the sample of a direction that is `delta`, with the value and the probability of
    /// its choice in these lanes, or else is to be weighed by what all lobes say of it.
    #[inline(always)]
    fn of(into: Vec3<L>, all: Evaluated<L>, delta: L::Mask, single: Evaluated<L>) -> Sampled<L> {
        let zero = L::zero();
        let pdf = L::select(delta, single.pdf, all.pdf);
        let some = pdf.gt(zero);
        let divisor = L::select(some, pdf, L::splat(1.0));
        let weight = std::array::from_fn(|k| {
            let value = L::select(delta, single.value[k], all.value[k]);
            L::select(some, value / divisor, zero)
        });
        Sampled {
            into,
            weight,
            pdf: L::select(some, pdf, zero),
            delta: delta & some,
            through: into.z.lt(zero) & some,
            some,
        }
    }
}

/// Returns the mean of three channels, by which lobes are chosen.
#[inline(always)]
fn mean<L: Lanes<Scalar = f32>>(c: [L; 3]) -> L {
    (c[0] + c[1] + c[2]) * L::splat(1.0 / 3.0)
}
