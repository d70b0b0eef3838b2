//! Reflectance of surfaces: evaluates both shading models for a light's direction, and
//! samples the reflected and the refracted ray.
//!
//! Metallic-roughness follows the glTF 2.0 specification, appendix B: Lambert below a
//! GGX lobe (Walter et al. 2007) with Schlick's Fresnel term. Computed in f32, over
//! lights in lanes; powers come from the crate `libm`, so the bits are the same on
//! every machine.

use crate::math::lanes::Lanes;
use crate::math::{Vec3, units};
use crate::scene::{Material, Model, Rgb};
use glam::DVec3;

const PI: f32 = std::f32::consts::PI;

/// Returns the radiance towards `out` due to light from `towards` with irradiance
/// `light`, measured on a surface that faces it. All vectors are unit; `normal` is on
/// `out`'s side.
#[inline(always)]
pub fn reflected<L: Lanes<Scalar = f32>>(
    material: &Material,
    normal: Vec3<L::Double>,
    out: Vec3<L::Double>,
    towards: Vec3<L::Double>,
    light: [L; 3],
) -> [L; 3] {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let cos = normal.dot(towards);
    let n_l = L::narrow(cos);
    let faces = n_l.gt(zero);
    let all: [L; 3] = match material.model {
        Model::Phong {
            diffuse,
            specular,
            exponent,
            ..
        } => {
            let mut lobe = zero;
            if specular.iter().any(|s| *s > 0.0) {
                let two = <L::Double as Lanes>::splat(2.0);
                let mirrored = normal * (two * cos) - towards;
                let mut powers = L::narrow(mirrored.dot(out)).to_array();
                for x in powers.as_mut() {
                    *x = if *x > 0.0 {
                        libm::powf(*x, exponent)
                    } else {
                        0.0
                    };
                }
                lobe = L::load(powers.as_ref());
            }
            std::array::from_fn(|k| {
                let (d, s) = (L::splat(diffuse[k]), L::splat(specular[k]));
                (d * n_l + s * lobe) / L::splat(PI) * light[k]
            })
        }
        Model::MetallicRoughness {
            metallic,
            roughness,
        } => {
            let n_v = L::narrow(normal.dot(out)).max(L::splat(1e-4));
            let half = units(out + towards);
            // sin² from the cross product: 1 − cos² would cancel where smooth lobes
            // peak.
            let sin2 = normal.cross(half).length_squared();
            let sin2 = L::narrow(sin2.min(<L::Double as Lanes>::splat(1.0)));
            let v_h = L::narrow(out.dot(half)).max(zero).min(one);
            let alpha = roughness * roughness;
            let lobe = ggx(alpha, sin2, n_l, n_v);
            let fresnel = schlick(v_h);
            let matte = (1.0 - metallic) * (1.0 - material.transmission);
            let f0 = base_reflectance(material, metallic);
            std::array::from_fn(|k| {
                let f = L::splat(f0[k]) + L::splat(1.0 - f0[k]) * fresnel;
                let below = L::splat(material.base_color[k] * matte / PI) * (one - f);
                (below + f * lobe) * n_l * light[k]
            })
        }
    };
    all.map(|radiance| L::select(faces, radiance, zero))
}

/// GGX distribution times visibility (Smith, height-correlated). Returns 0 for a
/// perfect mirror, which never reflects a light without extent. `sin2` is sin² of the
/// angle between normal and half vector.
#[inline(always)]
fn ggx<L: Lanes<Scalar = f32>>(alpha: f32, sin2: L, n_l: L, n_v: L) -> L {
    let a2 = alpha * alpha;
    if a2 == 0.0 {
        return L::zero();
    }
    let (one, flat, a2) = (L::splat(1.0), L::splat(1.0 - a2), L::splat(a2));
    let spread = sin2 + a2 * (one - sin2);
    let distribution = a2 / (L::splat(PI) * spread * spread);
    let view = n_l * (n_v * n_v * flat + a2).sqrt();
    let light = n_v * (n_l * n_l * flat + a2).sqrt();
    distribution * L::splat(0.5) / (view + light)
}

#[inline(always)]
fn schlick<L: Lanes<Scalar = f32>>(cos: L) -> L {
    let c = L::splat(1.0) - cos;
    let c2 = c * c;
    c2 * c2 * c
}

/// Returns the reflectance at normal incidence, at most 1: above that, Schlick's term would
/// fall towards grazing angles, and below the lobe would be less than nothing.
fn base_reflectance(material: &Material, metallic: f32) -> Rgb {
    let r = (material.ior - 1.0) / (material.ior + 1.0);
    material
        .base_color
        .map(|c| (r * r * (1.0 - metallic) + c * metallic).min(1.0))
}

/// Union of what a scene's materials do; a false flag lets the integrator skip that
/// pass.
#[derive(Clone, Copy, Debug)]
pub struct MaterialFlags {
    pub emits: bool,
    pub spawns_rays: bool,
}

impl MaterialFlags {
    pub fn new(materials: &[Material]) -> MaterialFlags {
        MaterialFlags {
            emits: materials.iter().any(|row| row.emission != [0.0; 3]),
            spawns_rays: materials.iter().any(spawns_rays),
        }
    }
}

/// The specular rays that leave a hit, with their directions and weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct BsdfSample {
    pub mirror: Option<(DVec3, Rgb)>,
    pub refract: Option<(DVec3, Rgb)>,
}

/// Returns whether hits on the material spawn reflected or refracted rays.
pub fn spawns_rays(material: &Material) -> bool {
    let specular = match material.model {
        Model::Phong { mirror, .. } => mirror.iter().any(|m| *m > 0.0),
        Model::MetallicRoughness { roughness, .. } => roughness == 0.0,
    };
    specular || material.transmission > 0.0
}

/// Samples the reflected and refracted rays of a hit, with their weights. `incoming` is
/// unit and points towards the surface; `front` is true if the ray comes from outside.
pub fn sample_bsdf(material: &Material, normal: DVec3, incoming: DVec3, front: bool) -> BsdfSample {
    if !spawns_rays(material) {
        return BsdfSample::default();
    }
    let cos = (-incoming.dot(normal)).clamp(0.0, 1.0);
    let mirrored = incoming + normal * (2.0 * cos);
    let bent = refracted(material, normal, incoming, cos, front);
    let through = material.transmission;
    let some = |dir: DVec3, weight: Rgb| weight.iter().any(|w| *w > 0.0).then_some((dir, weight));
    match material.model {
        Model::Phong { mirror, .. } => match bent {
            _ if through == 0.0 => BsdfSample {
                mirror: some(mirrored, mirror),
                refract: None,
            },
            Some((dir, _)) => BsdfSample {
                mirror: some(mirrored, mirror),
                refract: some(dir, [through; 3]),
            },
            // Under total internal reflection the mirror also carries the transmitted
            // share.
            None => BsdfSample {
                mirror: some(mirrored, mirror.map(|m| (m + through).min(1.0))),
                refract: None,
            },
        },
        Model::MetallicRoughness {
            metallic,
            roughness,
        } => {
            let f0 = base_reflectance(material, metallic);
            let clear = through * (1.0 - metallic);
            if roughness > 0.0 && clear == 0.0 {
                return BsdfSample::default();
            }
            match bent {
                Some((dir, fresnel)) if clear > 0.0 => BsdfSample {
                    mirror: some(mirrored, [fresnel; 3]),
                    refract: some(
                        dir,
                        material
                            .base_color
                            .map(|c| c.min(1.0) * clear * (1.0 - fresnel)),
                    ),
                },
                None if clear > 0.0 => BsdfSample {
                    mirror: some(mirrored, [1.0; 3]),
                    refract: None,
                },
                _ => {
                    let fresnel = schlick(cos as f32);
                    BsdfSample {
                        mirror: some(mirrored, f0.map(|f| f + (1.0 - f) * fresnel)),
                        refract: None,
                    }
                }
            }
        }
    }
}

/// Returns the refracted direction (Snell) and the unpolarised Fresnel reflectance,
/// `None` under total internal reflection.
fn refracted(
    material: &Material,
    normal: DVec3,
    incoming: DVec3,
    cos: f64,
    front: bool,
) -> Option<(DVec3, f32)> {
    let ior = f64::from(material.ior);
    let eta = if front { 1.0 / ior } else { ior };
    let sin2 = eta * eta * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2).sqrt();
    let dir = incoming * eta + normal * (eta * cos - cos_t);
    let parallel = (cos - eta * cos_t) / (cos + eta * cos_t);
    let across = (eta * cos - cos_t) / (eta * cos + cos_t);
    Some((dir, ((parallel * parallel + across * across) * 0.5) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates one direction of light.
    fn reflected(material: &Material, n: DVec3, out: DVec3, towards: DVec3, light: Rgb) -> Rgb {
        let [n, out, towards] = [n, out, towards].map(|v| Vec3::splat(v.to_array()));
        super::reflected::<f32>(material, n, out, towards, light)
    }

    #[test]
    fn fresnel_at_normal_incidence_is_the_textbook_value() {
        let glass = Material {
            transmission: 1.0,
            ior: 1.5,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        };
        let out = sample_bsdf(&glass, DVec3::Y, -DVec3::Y, true);
        let (dir, weight) = out.mirror.unwrap();
        assert_eq!(dir, DVec3::Y);
        assert!((weight[0] - 0.04).abs() < 1e-6, "{weight:?}");
        let (dir, weight) = out.refract.unwrap();
        assert_eq!(dir, -DVec3::Y);
        assert!((weight[0] - 0.96).abs() < 1e-6);
    }

    #[test]
    fn a_base_colour_above_1_makes_no_light_and_no_darkness() {
        let bright = Material::metallic_roughness([10.0, 1e38, 1.0], 0.5, 0.5);
        for x in [0.0, 0.5, 0.9, 0.999] {
            let towards = DVec3::new(x, (1.0 - x * x).sqrt(), 0.0);
            let out = DVec3::new(-x, (1.0 - x * x).sqrt(), 0.0);
            let all = reflected(&bright, DVec3::Y, out, towards, [1.0; 3]);
            assert!(all.iter().all(|c| *c >= 0.0 && c.is_finite()), "{all:?}");
        }
        let glass = Material {
            transmission: 1.0,
            ..Material::metallic_roughness([1e38; 3], 0.0, 0.0)
        };
        let out = sample_bsdf(&glass, DVec3::Y, -DVec3::Y, true);
        assert!(out.refract.unwrap().1[0] <= 1.0);
    }

    #[test]
    fn snell_holds_and_total_reflection_reflects_everything() {
        let glass = Material {
            transmission: 1.0,
            ior: 1.5,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        };
        let incoming = DVec3::new(0.6, -0.8, 0.0);
        let (dir, _) = sample_bsdf(&glass, DVec3::Y, incoming, true)
            .refract
            .unwrap();
        assert!((dir.length() - 1.0).abs() < 1e-12);
        assert!((dir.x * 1.5 - 0.6).abs() < 1e-12);
        let inside = sample_bsdf(&glass, DVec3::Y, DVec3::new(0.8, -0.6, 0.0), false);
        assert!(inside.refract.is_none());
        assert_eq!(inside.mirror.unwrap().1, [1.0; 3]);
    }

    #[test]
    fn a_white_lambert_surface_reflects_its_irradiance_over_pi() {
        let white = Material {
            model: Model::Phong {
                diffuse: [1.0; 3],
                specular: [0.0; 3],
                exponent: 0.0,
                mirror: [0.0; 3],
            },
            ..Material::default()
        };
        let out = reflected(&white, DVec3::Y, DVec3::Y, DVec3::Y, [PI; 3]);
        assert_eq!(out, [1.0; 3]);
    }

    #[test]
    fn the_smoothest_lobe_is_finite_at_its_peak() {
        for roughness in [1e-4, 1e-3, 0.01, 0.1, 1.0] {
            let metal = Material::metallic_roughness([1.0; 3], 1.0, roughness);
            let peak = reflected(&metal, DVec3::Y, DVec3::Y, DVec3::Y, [1.0; 3])[0];
            // D/4 at normal incidence: 1 / (4 π α²).
            let expected = 1.0 / (4.0 * PI * roughness.powi(4));
            assert!((peak / expected - 1.0).abs() < 1e-5, "{roughness}: {peak}");
        }
    }

    #[test]
    fn the_ggx_lobe_has_the_albedo_of_the_formula() {
        // White furnace seen along the normal, roughness 1: the integral of
        // μ / (1 + μ) over μ in [0, 1].
        let metal = Material::metallic_roughness([1.0; 3], 1.0, 1.0);
        let out = DVec3::Y;
        let mut sum = 0.0;
        let n = 200;
        for i in 0..n {
            for j in 0..n {
                let z = (i as f64 + 0.5) / n as f64;
                let phi = (j as f64 + 0.5) / n as f64 * std::f64::consts::TAU;
                let r = (1.0 - z * z).sqrt();
                let l = DVec3::new(r * phi.cos(), z, r * phi.sin());
                sum += reflected(&metal, DVec3::Y, out, l, [1.0; 3])[0] as f64;
            }
        }
        let albedo = sum / (n * n) as f64 * std::f64::consts::TAU;
        assert!(
            (albedo - (1.0 - std::f64::consts::LN_2)).abs() < 1e-4,
            "{albedo}"
        );
    }
}
