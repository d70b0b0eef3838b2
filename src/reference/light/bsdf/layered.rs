//! glTF's metallic-roughness model (glTF 2.0, appendix B) with transmission, compensated for
//! multiple scattering (Turquin 2019), one direction at a time.

use super::super::maps::cosine_hemisphere;
use super::albedo::{Albedo, RoundGlass, of_glass, of_stretched};
use super::coat::Coat;
use super::diffuse::Eon;
use super::film::Film;
use super::ggx::{Ggx, schlick};
use super::glass::{Window, matched};
use super::sheen::Sheen;
use super::{Color, Sample, Value, mean};
use crate::scene::{Material, Model};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

#[derive(Clone, Debug)]
pub struct Layered {
    base_color: Color,
    metallic: f64,
    ggx: Ggx,
    smooth: bool,
    albedo: Albedo,
    /// Of rough glass that is not stretched.
    round_glass: Option<RoundGlass>,
    transmission: f64,
    window: Window,
    /// Schlick's F₀ and F₉₀ of the dielectric.
    f0: Color,
    f90: f64,
    specular: bool,
    /// The share of the diffuse base that passes, and its colour.
    through: f64,
    through_color: Color,
    coat: Option<Coat>,
    sheen: Option<Sheen>,
    eon: Option<Eon>,
    film: Option<Film>,
    /// α along x and y of the turned frame; they differ under anisotropy.
    alphas: [f64; 2],
    is_stretched: bool,
    /// Cosine and sine of the turn of the frame.
    turn: [f64; 2],
}

/// The weights of all lobes as seen from one direction.
struct Seen {
    /// The gloss has the Fresnel term a + b (1 − o·h)⁵.
    a: Color,
    b: Color,
    diffuse: Color,
    diffuse_through: Color,
    glass: f64,
    /// The weights of the film's Fresnel terms over metal and over the dielectric.
    film: [Color; 2],
    /// What reaches the diffuse base, for rough ones.
    below: f64,
    /// The weight of the coat.
    coat: f64,
    /// The probabilities of diffuse, diffuse through, gloss, glass, coat and sheen.
    chances: [f64; 6],
}

impl Layered {
    pub fn new(material: &Material) -> Layered {
        let layers = &material.layers;
        let (metallic, roughness) = match material.model {
            Model::MetallicRoughness {
                metallic,
                roughness,
            } => (share(metallic), share(roughness)),
            Model::Phong { .. } => (0.0, 0.0),
        };
        let ior = match material.ior > 0.0 {
            true => f64::from(material.ior).clamp(1e-3, 1e3),
            false => 1.0,
        };
        let r0 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let specular = share(layers.specular);
        let tint = layers.specular_color.map(|c| f64::from(c).max(0.0));
        let anisotropy = share(layers.anisotropy);
        let mut alphas = [roughness * roughness; 2];
        if anisotropy > 0.0 {
            // Where the surface is smooth across, f32 needs some width.
            alphas[1] = alphas[1].max(1e-4);
            alphas[0] = alphas[1] + (1.0 - alphas[1]) * anisotropy * anisotropy;
        }
        let (sin, cos) = match anisotropy > 0.0 {
            true => libm::sincos(f64::from(layers.anisotropy_rotation)),
            false => (0.0, 1.0),
        };
        let sheen = layers.sheen_color.map(share);
        let [iridescence, diffuse_roughness] =
            [layers.iridescence, layers.diffuse_roughness].map(share);
        Layered {
            base_color: material.base_color.map(share),
            metallic,
            ggx: Ggx::stretched(alphas[0], alphas[1]),
            smooth: alphas == [0.0; 2],
            albedo: Albedo::new(alphas[1]),
            round_glass: (material.transmission > 0.0
                && !layers.thin_walled
                && anisotropy == 0.0
                && roughness > 0.0)
                .then(|| RoundGlass::new(alphas[0])),
            transmission: share(material.transmission),
            window: Window {
                thin: layers.thin_walled,
                ior,
                tint: tint.map(|c| c.min(1.0) * specular),
                color: material.base_color.map(share),
            },
            f0: tint.map(|c| (r0 * c).min(1.0) * specular),
            f90: specular,
            specular: specular > 0.0,
            through: share(layers.diffuse_transmission),
            through_color: layers.diffuse_transmission_color.map(share),
            coat: (layers.clearcoat > 0.0)
                .then(|| Coat::new(share(layers.clearcoat), share(layers.clearcoat_roughness))),
            sheen: (sheen != [0.0; 3]).then(|| Sheen::new(sheen, share(layers.sheen_roughness))),
            eon: (diffuse_roughness > 0.0).then(|| Eon::new(diffuse_roughness)),
            film: (iridescence > 0.0).then(|| {
                let [ior, thickness] = [layers.iridescence_ior, layers.iridescence_thickness];
                Film::new(iridescence, ior.into(), thickness.into())
            }),
            alphas,
            is_stretched: anisotropy > 0.0,
            turn: [cos, sin],
        }
    }

    fn has_opaque(&self) -> bool {
        self.metallic < 1.0 && self.transmission < 1.0
    }

    fn has_diffuse(&self) -> bool {
        self.has_opaque() && self.through < 1.0 && self.base_color != [0.0; 3]
    }

    fn has_diffuse_through(&self) -> bool {
        self.has_opaque() && self.through > 0.0 && self.through_color != [0.0; 3]
    }

    fn has_gloss(&self) -> bool {
        self.metallic > 0.0 || self.has_opaque() && self.specular
    }

    fn has_glass(&self) -> bool {
        self.metallic < 1.0 && self.transmission > 0.0
    }

    pub fn is_black(&self) -> bool {
        let diffuse = self.has_diffuse() || self.has_diffuse_through();
        !(diffuse || self.has_gloss() || self.has_glass())
            && self.coat.is_none()
            && self.sheen.is_none()
    }

    pub fn only_delta(&self) -> bool {
        let facets = self.has_gloss() || self.has_glass();
        let diffuse = self.has_diffuse() || self.has_diffuse_through();
        !diffuse
            && (self.smooth || !facets)
            && self.coat.as_ref().is_none_or(|coat| coat.smooth)
            && self.sheen.is_none()
    }

    pub fn transmits(&self) -> bool {
        self.has_diffuse_through() || self.has_glass()
    }

    fn seen(&self, eta: f64, out: DVec3) -> Seen {
        let compensated = self.has_gloss() || self.has_glass() && self.window.thin;
        let [e, b5] = match compensated {
            true => self.albedos(out),
            false => [1.0, schlick(out.z)],
        };
        // What sheen and coat leave to what is below them.
        let [mut rest, mut fibres] = [1.0, 0.0];
        if let Some(sheen) = &self.sheen {
            let albedo = sheen.albedo(out.z);
            fibres = albedo * mean(sheen.color);
            rest = 1.0 - albedo * sheen.color.into_iter().fold(0.0, f64::max);
        }
        let coat = self.coat.as_ref().map_or([0.0; 2], |c| c.seen(out.z));
        let [coat, coated] = coat.map(|x| rest * x);
        rest = (rest - coated).max(0.0);
        // Turquin's factor for a reflectance F₀; stretched lobes are given back a part.
        let lost = match self.is_stretched {
            true => 0.97 * (1.0 - e) / e,
            false => (1.0 - e) / e,
        };
        let gain = |f0: f64| 1.0 + f0 * lost;
        let (metallic, other) = (rest * self.metallic, rest * (1.0 - self.metallic));
        let opaque = other * (1.0 - self.transmission);
        let (mut a, mut b, mut covered) = ([0.0; 3], [0.0; 3], 0.0_f64);
        for k in 0..3 {
            let f = self.base_color[k];
            a[k] += metallic * gain(f) * f;
            b[k] += metallic * gain(f) * (1.0 - f);
            if self.has_opaque() && self.has_gloss() {
                let (f, rest) = (self.f0[k], self.f90 - self.f0[k]);
                a[k] += opaque * gain(f) * f;
                b[k] += opaque * gain(f) * rest;
                covered = covered.max(gain(f) * (f * e + rest * b5));
            }
        }
        let mut below = opaque * (1.0 - covered).max(0.0);
        let mut shine = 0.0;
        let mut film = [[0.0; 3]; 2];
        if let Some(layer) = &self.film {
            (a, b) = [a, b].map(|c| c.map(|x| x * (1.0 - layer.share))).into();
            // Its albedo is taken for the term at the cosine where Schlick's is its mean.
            let cos = 1.0 - (b5 / e).clamp(0.0, 1.0).powf(0.2);
            if self.metallic > 0.0 {
                let term = layer.reflectance(cos, self.base_color);
                film[0] = term.map(|f| layer.share * metallic * (1.0 + f * lost));
                shine += mean([0, 1, 2].map(|k| film[0][k] * term[k])) * e;
            }
            if self.has_opaque() && self.has_gloss() {
                let term = layer.reflectance(cos, self.f0);
                let share = layer.share * opaque;
                film[1] = term.map(|f| self.f90 * share * (1.0 + f * lost));
                shine += mean([0, 1, 2].map(|k| film[1][k] * term[k])) * e;
                let most = term.into_iter().fold(0.0, f64::max);
                let left = 1.0 - self.f90 * most * (e + most * (1.0 - e));
                below = below * (1.0 - layer.share) + share * left.max(0.0);
            }
        }
        let diffuse = self.base_color.map(|c| below * (1.0 - self.through) * c);
        let diffuse_through = self.through_color.map(|c| below * self.through * c);
        let glass = other * self.transmission;
        let gloss = mean([0, 1, 2].map(|k| a[k] * e + b[k] * b5)) + shine;
        let only = |is: bool, x: f64| if is { x } else { 0.0 };
        let chances = [
            only(self.has_diffuse(), mean(diffuse)),
            only(self.has_diffuse_through(), mean(diffuse_through)),
            only(self.has_gloss(), gloss),
            only(self.has_glass(), glass),
            coated,
            fibres,
        ];
        let sum: f64 = chances.iter().sum();
        Seen {
            a,
            b,
            diffuse,
            diffuse_through,
            glass: glass * self.glass_gain(eta, out, e),
            film,
            below: below * (1.0 - self.through),
            coat,
            chances: chances.map(|x| if sum > 0.0 { x / sum } else { 0.0 }),
        }
    }

    /// The factor that gives back what rough glass loses by scattering only once: all of it to a
    /// sheet, whose facets' albedo is `e`, and nearly all of it to a solid.
    fn glass_gain(&self, eta: f64, out: DVec3, e: f64) -> f64 {
        if self.window.thin {
            return 1.0 / e;
        }
        if self.smooth || !self.has_glass() || matched(eta) {
            return 1.0;
        }
        let (kept, share) = match &self.round_glass {
            Some(round) => (round.at(out.z, self.alphas[0], eta), 0.98),
            None => (of_glass(&self.ggx, out, eta, 1.0), 0.97),
        };
        1.0 + share * (1.0 - kept) / kept
    }

    pub fn eval(&self, eta: f64, out: DVec3, into: DVec3) -> Value {
        self.eval_turned(eta, self.turned(out, 1.0), self.turned(into, 1.0))
    }

    pub fn sample(&self, eta: f64, out: DVec3, u: [f64; 2], lobe: f64) -> Option<Sample> {
        let sample = self.sample_turned(eta, self.turned(out, 1.0), u, lobe)?;
        Some(Sample {
            into: self.turned(sample.into, -1.0),
            ..sample
        })
    }

    /// Turns a direction into the frame whose x lies along the stretch, or back.
    fn turned(&self, v: DVec3, way: f64) -> DVec3 {
        let [cos, sin] = [self.turn[0], way * self.turn[1]];
        DVec3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z)
    }

    /// Returns E and B of the gloss.
    fn albedos(&self, out: DVec3) -> [f64; 2] {
        match self.is_stretched {
            true => of_stretched(&self.ggx, out),
            false => self.albedo.at(out.z, self.alphas[0]),
        }
    }

    /// Returns the Fresnel term of the gloss with all weights.
    fn reflectance(&self, seen: &Seen, cos: f64) -> Color {
        let term = schlick(cos);
        let mut color = [0, 1, 2].map(|k| seen.a[k] + seen.b[k] * term);
        let bases = [self.base_color, self.f0];
        for (base, weights) in bases.into_iter().zip(seen.film) {
            if let Some(film) = self.film.filter(|_| weights != [0.0; 3]) {
                let term = film.reflectance(cos, base);
                color = [0, 1, 2].map(|k| color[k] + weights[k] * term[k]);
            }
        }
        color
    }

    fn eval_turned(&self, eta: f64, out: DVec3, into: DVec3) -> Value {
        let seen = self.seen(eta, out);
        let mut all = Value::default();
        let mut add = |color: Color, value: f64, pdf: f64| {
            for k in 0..3 {
                all.value[k] += color[k] * value;
            }
            all.pdf += pdf;
        };
        let cos = into.z.abs();
        let [diffuse, diffuse_through, gloss, glass, coat, fibres] = seen.chances;
        if into.z > 0.0 && self.has_diffuse() {
            let color = match &self.eon {
                None => seen.diffuse,
                Some(eon) => self
                    .base_color
                    .map(|c| seen.below * eon.value(c, out, into)),
            };
            add(color, cos / PI, diffuse * cos / PI);
        }
        if into.z <= 0.0 && self.has_diffuse_through() {
            add(seen.diffuse_through, cos / PI, diffuse_through * cos / PI);
        }
        if let Some(layer) = self.coat.as_ref().filter(|layer| !layer.smooth)
            && into.z > 0.0
        {
            let [value, pdf] = layer.eval(out, into);
            add([seen.coat; 3], value, coat * pdf);
        }
        if let Some(sheen) = self.sheen.as_ref().filter(|_| into.z > 0.0) {
            add(sheen.color, sheen.value(out, into), fibres / TAU);
        }
        if self.smooth || into.z == 0.0 {
            return all;
        }
        if into.z > 0.0 && (self.has_gloss() || self.has_glass()) {
            // Walter et al. 2007, equation 20, and the density of visible normals over 4 o·h.
            let h = (out + into).normalize();
            let o_h = out.dot(h);
            let masking = self.ggx.masking_shadowing(out, into);
            let value = masking * self.ggx.density(h) / (4.0 * out.z);
            let pdf = self.ggx.visible(out, h) / (4.0 * o_h);
            if self.has_gloss() {
                add(self.reflectance(&seen, o_h), value, gloss * pdf);
            }
            if self.has_glass() {
                let shares = self.window.shares(o_h, eta);
                let color = shares.reflected.map(|r| r * seen.glass);
                add(color, value, glass * shares.chance * pdf);
            }
        }
        if into.z < 0.0 && self.has_glass() {
            let (h, o_h, value, pdf) = if self.window.thin {
                let mirrored = DVec3::new(into.x, into.y, -into.z);
                let h = (out + mirrored).normalize();
                let o_h = out.dot(h);
                let masking = self.ggx.masking_shadowing(out, mirrored);
                let value = masking * self.ggx.density(h) / (4.0 * out.z);
                (h, o_h, value, self.ggx.visible(out, h) / (4.0 * o_h))
            } else {
                // Walter et al. 2007, equations 16, 17 and 21, the value of radiance.
                if matched(eta) {
                    return all;
                }
                let h = (out + into * eta).normalize();
                let h = if h.z < 0.0 { -h } else { h };
                let (o_h, i_h) = (out.dot(h), into.dot(h));
                if o_h <= 0.0 || i_h >= 0.0 {
                    return all;
                }
                let divisor = (o_h + eta * i_h).powi(2);
                let masking = self.ggx.masking_shadowing(out, into);
                let value = o_h * i_h.abs() * masking * self.ggx.density(h) / (out.z * divisor);
                let jacobian = eta * eta * i_h.abs() / divisor;
                (h, o_h, value, self.ggx.visible(out, h) * jacobian)
            };
            debug_assert!(h.is_finite());
            let shares = self.window.shares(o_h, eta);
            let color = shares.transmitted.map(|t| t * seen.glass);
            add(color, value, glass * (1.0 - shares.chance) * pdf);
        }
        all
    }

    fn sample_turned(&self, eta: f64, out: DVec3, u: [f64; 2], lobe: f64) -> Option<Sample> {
        let seen = self.seen(eta, out);
        let [diffuse, diffuse_through, gloss, glass, coat, _] = seen.chances;
        if lobe < diffuse + diffuse_through {
            let mut into = cosine_hemisphere(u);
            if lobe >= diffuse {
                into.z = -into.z;
            }
            return self.weighed(eta, out, into);
        }
        let first = diffuse + diffuse_through + gloss;
        if self.sheen.is_some() && lobe >= first + glass + coat {
            let z = 1.0 - u[0];
            let r = (1.0 - z * z).max(0.0).sqrt();
            let (s, c) = libm::sincos(TAU * u[1]);
            return self.weighed(eta, out, DVec3::new(r * c, r * s, z));
        }
        if let Some(layer) = &self.coat
            && lobe >= first + glass
        {
            if layer.smooth {
                let into = DVec3::new(-out.x, -out.y, out.z);
                return delta(into, [seen.coat * Coat::fresnel(out.z); 3], coat);
            }
            let h = layer.ggx.sample(out, u);
            let into = h * (2.0 * out.dot(h)) - out;
            return self.weighed(eta, out, into).filter(|_| into.z > 0.0);
        }
        let h = match self.smooth {
            true => DVec3::Z,
            false => self.ggx.sample(out, u),
        };
        let o_h = out.dot(h);
        let mirrored = h * (2.0 * o_h) - out;
        if !self.has_glass() || self.has_gloss() && lobe < first {
            if self.smooth {
                return delta(mirrored, self.reflectance(&seen, out.z), gloss);
            }
            return self
                .weighed(eta, out, mirrored)
                .filter(|_| mirrored.z > 0.0);
        }
        let shares = self.window.shares(o_h, eta);
        let passes = (lobe - first) / glass >= shares.chance;
        if !passes {
            if self.smooth {
                let value = shares.reflected.map(|r| r * seen.glass);
                return delta(mirrored, value, glass * shares.chance);
            }
            return self
                .weighed(eta, out, mirrored)
                .filter(|_| mirrored.z > 0.0);
        }
        let window = !self.window.thin && matched(eta);
        let bent = match (self.window.thin, self.smooth) {
            (true, true) => -out,
            (true, false) => DVec3::new(mirrored.x, mirrored.y, -mirrored.z),
            _ if window => -out,
            _ => h * (o_h / eta - shares.interface.cos) - out / eta,
        };
        if self.smooth || window {
            let scale = if self.window.thin {
                1.0
            } else {
                1.0 / (eta * eta)
            };
            let value = shares.transmitted.map(|t| t * seen.glass * scale);
            return delta(bent, value, glass * (1.0 - shares.chance));
        }
        self.weighed(eta, out, bent).filter(|_| bent.z < 0.0)
    }

    /// Returns what a smooth sheet lets pass straight on, at the cosine to its normal.
    pub fn straight(&self, cos: f64) -> Color {
        if !(self.has_glass() && self.window.thin && self.smooth) {
            return [0.0; 3];
        }
        let seen = self.seen(1.0, DVec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos));
        self.window
            .shares(cos, 1.0)
            .transmitted
            .map(|t| t * seen.glass)
    }

    /// Weighs a direction by what all lobes say of it.
    fn weighed(&self, eta: f64, out: DVec3, into: DVec3) -> Option<Sample> {
        let all = self.eval_turned(eta, out, into);
        (all.pdf > 0.0).then(|| Sample {
            into,
            weight: all.value.map(|x| x / all.pdf),
            pdf: all.pdf,
            delta: false,
        })
    }
}

fn delta(into: DVec3, value: Color, pdf: f64) -> Option<Sample> {
    (pdf > 0.0).then(|| Sample {
        into,
        weight: value.map(|x| x / pdf),
        pdf,
        delta: true,
    })
}

fn share(x: f32) -> f64 {
    if x > 0.0 { f64::from(x.min(1.0)) } else { 0.0 }
}
