//! The layered model: glTF's metallic-roughness (glTF 2.0, appendix B) with transmission.
//!
//! A metal and a dielectric, mixed by `metallic`, share one GGX lobe with Schlick's Fresnel
//! term. Below the dielectric's lobe lies a diffuse base, which reflects (or transmits) what
//! the lobe's directional albedo leaves; a share `transmission` of the dielectric is glass
//! instead, with the exact Fresnel term. Light that GGX scatters more than once is given back
//! by scaling (Turquin 2019): a lobe of reflectance F₀ gets 1 + F₀ (1 − E)/E, metal and
//! dielectric each its own, for the factor is not linear in F₀; glass is divided by what it keeps.

mod sample;

use super::albedo::{AlbedoRow, STRETCHED_RETURN, albedo, mirror_albedo, stretched_albedo};
use super::coat::{Coat, CoatHit};
use super::diffuse::{Eon, EonColor};
use super::film::Film;
use super::fresnel::{schlick, unit_interval};
use super::glass::{Glass, Shares, clamped_eta, is_matched};
use super::glass_albedo::{glass_gain, make_tables};
use super::microfacet::{Ggx, mirrored_pdf, visibility};
use super::sheen::Sheen;
use super::{Evaluated, Looks, Variation, mean};
use crate::sampling::cosine_hemisphere_density;
use lanecast_model::scene::{Material, Rgb};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{pow, sin_cos_turns};
use lanecast_numerics::math::lanes::{Lanes, max, min};

/// The lobes that hits on a material may have, and their constants.
#[derive(Clone, Copy, Debug)]
pub struct Layered {
    metal: bool,
    /// There is a dielectric that is not glass.
    opaque: bool,
    diffuse: bool,
    diffuse_through: bool,
    gloss: bool,
    glass: bool,
    /// The roughness is 0, so that gloss and glass are delta distributions.
    smooth: bool,
    /// The albedos of the gloss, where the roughness is the same everywhere.
    albedo: Option<AlbedoRow>,
    /// The dielectric's reflectance at normal and at grazing incidence.
    f0: Rgb,
    f90: f32,
    transmission: f32,
    window: Glass,
    diffuse_transmission: f32,
    diffuse_transmission_color: Rgb,
    eon: Option<Eon>,
    film: Option<Film>,
    coat: Option<Coat>,
    sheen: Option<Sheen>,
    stretch: Option<Stretch>,
}

/// An anisotropy: the square of its strength, and the cosine and sine of its turn.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    squared: f32,
    cos: f32,
    sin: f32,
}

/// What [`Layered::eval`] and [`Layered::sample`] share at one hit.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<L> {
    out: Vec3<L>,
    eta: L,
    ggx: Ggx<L>,
    stretch: L,
    /// The gloss has the Fresnel term a + b (1 − v·h)⁵, with all weights.
    a: [L; 3],
    b: [L; 3],
    /// The albedo of what is reflected, and of what is transmitted, diffusely.
    diffuse: [L; 3],
    diffuse_through: [L; 3],
    /// The factors of a rough diffuse base.
    rough: EonColor<L>,
    /// The weights of the film's Fresnel terms over metal and over the dielectric.
    film: [[L; 3]; 2],
    coat: Option<CoatHit<L>>,
    /// Λ of sheen.
    masking: L,
    /// The weight of glass, and its tint.
    glass: L,
    tint: [L; 3],
    chances: Chances<L>,
}

/// The probabilities by which lobes are chosen; of a lobe that the material lacks, 0.
#[derive(Clone, Copy, Debug)]
struct Chances<L> {
    diffuse: L,
    diffuse_through: L,
    gloss: L,
    glass: L,
    coat: L,
    sheen: L,
}

impl Layered {
    /// Finds the lobes of a material.
    pub fn new(material: &Material, looks: &Looks<f32>, variation: Variation) -> Layered {
        let layers = &material.layers;
        let clamped = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let textured = variation == Variation::Textured;
        let transmission = clamped(material.transmission);
        let specular = clamped(layers.specular);
        let ior = clamped_eta(material.ior);
        let root = (ior - 1.0) / (ior + 1.0);
        let tint = layers.specular_color.map(|c| if c > 0.0 { c } else { 0.0 });
        let f0 = tint.map(|c| (root * root * c).min(1.0) * specular);
        let metal = looks.metallic > 0.0;
        let dielectric = looks.metallic < 1.0 || textured;
        let opaque = dielectric && transmission < 1.0;
        let through = clamped(layers.diffuse_transmission);
        let anisotropy = clamped(layers.anisotropy);
        let diffuse_roughness = clamped(layers.diffuse_roughness);
        let coat = clamped(layers.clearcoat);
        let iridescence = clamped(layers.iridescence);
        let sheen = layers.sheen_color.map(clamped);
        let (sin, cos) = sin_cos_turns(layers.anisotropy_rotation / std::f32::consts::TAU);
        let colored = |c: Rgb| c.iter().any(|c| *c > 0.0);
        let glass = dielectric && transmission > 0.0;
        let smooth = looks.roughness == 0.0 && anisotropy == 0.0;
        if glass && !layers.thin_walled && (!smooth || textured) {
            make_tables(anisotropy == 0.0);
        }
        Layered {
            metal,
            opaque,
            diffuse: opaque && through < 1.0 && colored(looks.base_color),
            diffuse_through: opaque && through > 0.0 && colored(layers.diffuse_transmission_color),
            gloss: metal || opaque && specular > 0.0,
            glass,
            albedo: (!textured && anisotropy == 0.0)
                .then(|| AlbedoRow::new(looks.roughness * looks.roughness)),
            smooth,
            f0,
            f90: specular,
            transmission,
            window: Glass::new(layers.thin_walled, ior, tint.map(|c| c.min(1.0) * specular)),
            diffuse_transmission: through,
            diffuse_transmission_color: layers.diffuse_transmission_color.map(clamped),
            eon: (diffuse_roughness > 0.0).then(|| Eon::new(diffuse_roughness)),
            film: (iridescence > 0.0).then(|| {
                Film::new(
                    iridescence,
                    layers.iridescence_ior,
                    layers.iridescence_thickness,
                )
            }),
            coat: (coat > 0.0).then(|| Coat::new(coat, clamped(layers.clearcoat_roughness))),
            sheen: colored(sheen).then(|| Sheen::new(sheen, clamped(layers.sheen_roughness))),
            stretch: (anisotropy > 0.0).then_some(Stretch {
                squared: anisotropy * anisotropy,
                cos,
                sin,
            }),
        }
    }

    pub fn is_black(&self) -> bool {
        !(self.diffuse || self.diffuse_through || self.facets())
            && self.coat.is_none()
            && self.sheen.is_none()
    }

    pub fn only_delta(&self) -> bool {
        !(self.diffuse || self.diffuse_through)
            && (self.smooth || !self.facets())
            && self.coat.is_none_or(|coat| coat.smooth)
            && self.sheen.is_none()
    }

    /// Whether there is gloss or glass.
    fn facets(&self) -> bool {
        self.gloss || self.glass
    }

    pub fn transmits(&self) -> bool {
        self.diffuse_through || self.glass
    }

    /// Computes the weights of all lobes at a hit, as seen from `out`.
    #[inline(always)]
    pub fn prepare<L: Lanes<Scalar = f32>>(
        &self,
        looks: &Looks<L>,
        eta: L,
        out: Vec3<L>,
    ) -> Prepared<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let out = self.turned(out);
        let alpha = looks.roughness * looks.roughness;
        let mut ggx = Ggx::new(alpha);
        if let Some(stretch) = self.stretch {
            // Where the surface is smooth across, f32 needs some width.
            let across = max(alpha, L::splat(1e-4));
            let along = across + (one - across) * L::splat(stretch.squared);
            ggx = Ggx::stretched(along, across);
        }
        // The layers above, and what each leaves to those below it.
        let mut rest = one;
        let mut masking = zero;
        let mut chances = Chances::none();
        if let Some(sheen) = &self.sheen {
            masking = sheen.masking(out.z);
            let albedo = sheen.albedo(out.z);
            let [r, g, b] = sheen.color;
            chances.sheen = albedo * L::splat((r + g + b) / 3.0);
            rest = one - albedo * L::splat(r.max(g).max(b));
        }
        let mut coated = None;
        if let Some(coat) = &self.coat {
            let normal = looks.coat_normal.map(|normal| self.turned(normal));
            let hit = coat.prepare(normal, out, rest);
            chances.coat = hit.albedo;
            rest = max(rest - hit.albedo, zero);
            coated = Some(hit);
        }
        let metallic = looks.metallic * rest;
        let other = (one - looks.metallic) * rest;
        let albedo = if !self.smooth && (self.gloss || self.glass && self.window.thin) {
            match (&self.albedo, self.stretch) {
                (Some(row), _) => row.at(out.z),
                (None, Some(_)) => stretched_albedo(&ggx, out),
                (None, None) => albedo(out.z, alpha),
            }
        } else {
            mirror_albedo(out.z)
        };
        let (e, e5) = (albedo.white, albedo.schlick);
        let inverse = one / e;
        let mut lost = (one - e) * inverse;
        if self.stretch.is_some() {
            lost = lost * L::splat(STRETCHED_RETURN);
        }
        let (mut a, mut b) = ([zero; 3], [zero; 3]);
        let mut film = [[zero; 3]; 2];
        let mut shine = zero;
        if self.metal {
            for k in 0..3 {
                let f0 = looks.base_color[k];
                let weight = metallic * (one + f0 * lost);
                a[k] = weight * f0;
                b[k] = weight * (one - f0);
            }
        }
        let opaque = other * L::splat(1.0 - self.transmission);
        let mut below = opaque;
        if self.opaque && self.gloss {
            let mut covered = zero;
            for k in 0..3 {
                let (f0, rest) = (L::splat(self.f0[k]), L::splat(self.f90 - self.f0[k]));
                let scale = one + f0 * lost;
                covered = max(covered, scale * (f0 * e + rest * e5));
                a[k] = a[k] + opaque * scale * f0;
                b[k] = b[k] + opaque * scale * rest;
            }
            below = opaque * max(one - covered, zero);
        }
        if let Some(layer) = &self.film {
            let share = L::splat(layer.share);
            (a, b) = (a.map(|x| x * (one - share)), b.map(|x| x * (one - share)));
            // The lobe's albedo is taken for the film's term at one cosine to the facets: that
            // at which Schlick's term is the lobe's mean.
            let cos = one - pow(unit_interval(e5 * inverse), L::splat(0.2));
            if self.metal {
                let term = layer.reflectance(cos, looks.base_color);
                film[0] = term.map(|f| share * metallic * (one + f * lost));
                shine = shine + mean([0, 1, 2].map(|k| film[0][k] * term[k])) * e;
            }
            if self.opaque && self.gloss {
                let term = layer.reflectance(cos, self.f0.map(L::splat));
                let specular = L::splat(self.f90);
                film[1] = term.map(|f| specular * share * opaque * (one + f * lost));
                shine = shine + mean([0, 1, 2].map(|k| film[1][k] * term[k])) * e;
                let most = max(max(term[0], term[1]), term[2]);
                let left = one - specular * most * (e + most * (one - e));
                below = below * (one - share) + opaque * share * max(left, zero);
            }
        }
        let reflected = below * L::splat(1.0 - self.diffuse_transmission);
        let transmitted = below * L::splat(self.diffuse_transmission);
        let diffuse = looks.base_color.map(|c| reflected * c);
        let diffuse_through = self
            .diffuse_transmission_color
            .map(|c| transmitted * L::splat(c));
        let rough = match &self.eon {
            Some(eon) if self.diffuse => eon.color(looks.base_color, reflected, out.z),
            _ => EonColor {
                single: [zero; 3],
                multiple: [zero; 3],
            },
        };
        let mut glass = other * L::splat(self.transmission);
        if self.diffuse {
            chances.diffuse = mean(diffuse);
        }
        if self.diffuse_through {
            chances.diffuse_through = mean(diffuse_through);
        }
        if self.gloss {
            chances.gloss = mean([0, 1, 2].map(|k| a[k] * e + b[k] * e5)) + shine;
        }
        if self.glass {
            chances.glass = glass;
        }
        if self.window.thin {
            glass = glass * inverse;
        } else if self.glass && !self.smooth {
            let round_alpha = self.stretch.is_none().then_some(alpha);
            glass = glass * glass_gain(&ggx, out, round_alpha, eta);
        }
        Prepared {
            out,
            eta,
            ggx,
            stretch: ggx.stretch(out),
            a,
            b,
            diffuse,
            diffuse_through,
            rough,
            film,
            coat: coated,
            masking,
            glass,
            tint: looks.base_color,
            chances: chances.normalised(),
        }
    }

    /// Returns what a smooth sheet lets pass straight on, at the cosine to its normal.
    pub fn straight(&self, looks: &Looks<f32>, cos: f32) -> Rgb {
        if !(self.glass && self.window.thin && self.smooth) {
            return [0.0; 3];
        }
        let out = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
        let hit = self.prepare::<f32>(looks, 1.0, out);
        let shares = self.shares(&hit, cos);
        shares.transmitted.map(|share| share * hit.glass)
    }

    /// Turns a direction so that x lies along the stretch.
    #[inline(always)]
    fn turned<L: Lanes<Scalar = f32>>(&self, v: Vec3<L>) -> Vec3<L> {
        match self.stretch {
            None => v,
            Some(Stretch { cos, sin, .. }) => turn(v, cos, sin),
        }
    }

    /// Returns the Fresnel term of the gloss with all weights.
    #[inline(always)]
    fn reflectance<L: Lanes<Scalar = f32>>(&self, hit: &Prepared<L>, cos: L) -> [L; 3] {
        let term = schlick(cos);
        let mut color: [L; 3] = std::array::from_fn(|k| hit.a[k] + hit.b[k] * term);
        if let Some(film) = &self.film {
            if self.metal {
                let term = film.reflectance(cos, hit.tint);
                color = [0, 1, 2].map(|k| color[k] + hit.film[0][k] * term[k]);
            }
            if self.opaque {
                let term = film.reflectance(cos, self.f0.map(L::splat));
                color = [0, 1, 2].map(|k| color[k] + hit.film[1][k] * term[k]);
            }
        }
        color
    }

    /// Returns the shares of glass at the cosine to a facet.
    #[inline(always)]
    fn shares<L: Lanes<Scalar = f32>>(&self, hit: &Prepared<L>, cos: L) -> Shares<L> {
        self.window.shares(cos, hit.eta, hit.tint)
    }

    /// Returns the albedo of the Lambertian lobe.
    #[inline(always)]
    pub fn lambert<L: Lanes<Scalar = f32>>(&self, hit: &Prepared<L>) -> [L; 3] {
        match self.diffuse && self.eon.is_none() {
            true => hit.diffuse,
            false => [L::zero(); 3],
        }
    }

    #[inline(always)]
    pub fn eval<L: Lanes<Scalar = f32>>(&self, hit: &Prepared<L>, into: Vec3<L>) -> Evaluated<L> {
        self.eval_turned(hit, self.turned(into))
    }

    /// Returns what diffuse lobes and sheen make of [`Layered::eval`].
    pub fn diffuse_part<L: Lanes<Scalar = f32>>(&self, hit: &Prepared<L>, into: Vec3<L>) -> [L; 3] {
        let into = self.turned(into);
        let mut all = self.eval_diffuse(hit, into);
        self.add_sheen(hit, into, &mut all);
        all.value
    }

    /// Evaluates a direction of the turned frame, in which `hit.out` lies.
    #[inline(always)]
    fn eval_turned<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        into: Vec3<L>,
    ) -> Evaluated<L> {
        let up = into.z.gt(L::zero());
        let mut all = self.eval_diffuse(hit, into);
        if !self.smooth && self.facets() {
            self.eval_facets(hit, into, up, &mut all);
        }
        if let (Some(coat), Some(coated)) = (&self.coat, &hit.coat)
            && !coat.smooth
        {
            let (value, pdf) = coat.eval(coated, into);
            all.add([L::splat(1.0); 3], value, hit.chances.coat * pdf);
        }
        self.add_sheen(hit, into, &mut all);
        all
    }

    /// Adds the fibres' lobe.
    #[inline(always)]
    fn add_sheen<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        into: Vec3<L>,
        all: &mut Evaluated<L>,
    ) {
        let zero = L::zero();
        if let Some(sheen) = &self.sheen {
            let value = sheen.value(hit.out, hit.masking, into);
            let up = into.z.gt(zero);
            let pdf = L::select(up, L::splat(0.5 * std::f32::consts::FRAC_1_PI), zero);
            all.add(sheen.color.map(L::splat), value, hit.chances.sheen * pdf);
        }
    }

    /// Evaluates the diffuse lobes.
    #[inline(always)]
    fn eval_diffuse<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        into: Vec3<L>,
    ) -> Evaluated<L> {
        let zero = L::zero();
        let mut all = Evaluated::none();
        if self.diffuse {
            let cos = cosine_hemisphere_density(into.z);
            let pdf = hit.chances.diffuse * cos;
            match &self.eon {
                None => all.add(hit.diffuse, cos, pdf),
                Some(eon) => {
                    let [single, multiple] = eon.terms(hit.out, into);
                    all.add(hit.rough.single, cos * single, pdf);
                    all.add(hit.rough.multiple, cos * multiple, zero);
                }
            }
        }
        if self.diffuse_through {
            let cos = cosine_hemisphere_density(-into.z);
            all.add(hit.diffuse_through, cos, hit.chances.diffuse_through * cos);
        }
        all
    }

    /// Adds gloss and glass of rough materials, which share one distribution.
    #[inline(always)]
    fn eval_facets<L: Lanes<Scalar = f32>>(
        &self,
        hit: &Prepared<L>,
        into: Vec3<L>,
        up: L::Mask,
        all: &mut Evaluated<L>,
    ) {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let out = hit.out;
        let cos = into.z.abs();
        let solid = self.glass && !self.window.thin;
        // The half vector of reflection, or of refraction (Walter et al. 2007, section 4.2);
        // a sheet scatters what it transmits as the mirror image of what it reflects.
        let half = if solid {
            out + into * L::select(up, one, hit.eta)
        } else {
            Vec3::new(out.x + into.x, out.y + into.y, out.z + cos)
        };
        let squared = max(half.length_squared(), L::splat(f32::MIN_POSITIVE));
        let inverse = one / squared.sqrt();
        let density = hit.ggx.density(half, squared);
        let side = (out.z, hit.stretch);
        let visible = visibility(side, (cos, hit.ggx.stretch(into)));
        let to_half = out.dot(half).abs() * inverse;
        let value = density * (visible * cos);
        let pdf = density * mirrored_pdf(side);
        if self.gloss {
            let value = L::select(up, value, zero);
            let color = self.reflectance(hit, to_half);
            all.add(color, value, hit.chances.gloss * L::select(up, pdf, zero));
        }
        if !self.glass {
            return;
        }
        let shares = self.shares(hit, to_half);
        let reflected = hit.chances.glass * shares.chance;
        let transmitted = hit.chances.glass * (one - shares.chance);
        let toward = into.z.lt(zero);
        let (through_value, through_pdf) = if self.window.thin {
            (value, L::select(toward, pdf, zero))
        } else {
            // Walter et al. 2007, equations 17 and 21, with the visible normals' density. The
            // half vector has the length |o·h + eta i·h|.
            let ahead = L::select(half.z.lt(zero), -inverse, inverse);
            let (near, far) = (out.dot(half) * ahead, into.dot(half) * ahead);
            let crosses = toward & near.gt(zero) & far.lt(zero) & !is_matched(hit.eta);
            let jacobian = L::splat(4.0) * to_half * far.abs() / squared;
            let jacobian = L::select(crosses, jacobian, zero);
            (value * jacobian, pdf * jacobian * hit.eta * hit.eta)
        };
        let color = [0, 1, 2]
            .map(|k| L::select(up, shares.reflected[k], shares.transmitted[k]) * hit.glass);
        let pdf = L::select(up, reflected * pdf, transmitted * through_pdf);
        all.add(color, L::select(up, value, through_value), pdf);
    }
}

/// Turns a vector about z.
#[inline(always)]
fn turn<L: Lanes<Scalar = f32>>(v: Vec3<L>, cos: f32, sin: f32) -> Vec3<L> {
    let (cos, sin) = (L::splat(cos), L::splat(sin));
    Vec3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z)
}

impl<L: Lanes<Scalar = f32>> Chances<L> {
    /// Scales the chances to the sum 1; all are 0 where there is nothing to choose.
    #[inline(always)]
    fn normalised(self) -> Chances<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let sum = (self.diffuse + self.diffuse_through)
            + (self.gloss + self.glass)
            + (self.coat + self.sheen);
        let scale = L::select(sum.gt(zero), one / max(sum, L::splat(1e-30)), zero);
        let of = |x: L| min(x * scale, one);
        Chances {
            diffuse: of(self.diffuse),
            diffuse_through: of(self.diffuse_through),
            gloss: of(self.gloss),
            glass: of(self.glass),
            coat: of(self.coat),
            sheen: of(self.sheen),
        }
    }

    #[inline(always)]
    fn none() -> Chances<L> {
        let zero = L::zero();
        Chances {
            diffuse: zero,
            diffuse_through: zero,
            gloss: zero,
            glass: zero,
            coat: zero,
            sheen: zero,
        }
    }
}

impl<L: Lanes<Scalar = f32>> Evaluated<L> {
    /// Adds `color` · `value`, of density `pdf`.
    #[inline(always)]
    fn add(&mut self, color: [L; 3], value: L, pdf: L) {
        for k in 0..3 {
            self.value[k] = self.value[k] + color[k] * value;
        }
        self.pdf = self.pdf + pdf;
    }
}
