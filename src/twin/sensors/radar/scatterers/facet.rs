//! Cross-section of a flat piece of surface, by the angle at which it is met.
//!
//! A piece of area A is rough on the scale of the wave: its slopes are Gaussian with s (radians, each way) about its normal.
//! By geometric optics (Barrick, "Rough surface scattering based on the specular point theory", IEEE Trans. AP 16(4), 1968)
//! it echoes per area, met at the angle t off its normal, exp(-tan^2 t / 2 s^2) / (2 s^2 cos^3 t): a lobe as wide as
//! the slopes, whose mean over all attitudes is A / 4, the mean shadow of the piece. (Barrick has cos^4: his area is
//! that of the mean plane, ours that of the surface itself.) A share q of the power is
//! scattered evenly by edges and fittings in its place, cos t, which has the same mean. So
//!
//! sigma = R A (q cos t + (1 - q) exp(-tan^2 t / 2 s^2) / (2 s^2 cos^3 t)),
//!
//! R being the reflectivity at normal incidence, and no more than that of an ideal plate, R 4 pi A^2 / lambda^2. The sum
//! over a closed convex body, over all attitudes, is R times its mean shadow, a quarter of its surface: of a metal
//! sphere pi r^2, as is known.

use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

/// Cosines below this are along the surface.
const GRAZING: f64 = 1e-3;

/// How a surface echoes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EchoSurface {
    /// Share of power that it reflects at normal incidence.
    pub reflectivity: f64,
    /// Standard deviation of its slopes each way, radians.
    pub slope_rad: f64,
    /// Share of that which goes evenly everywhere.
    pub diffuse: f64,
}

/// A flat piece of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its middle.
    pub place: Point3<f64>,
    /// Unit normal, outwards.
    pub normal: Vector3<f64>,
    /// Square metres.
    pub area_m2: f64,
    /// It is a piece of something round, with slopes of its own up to this, radians.
    pub round_rad: f64,
}

impl Facet {
    /// Cross-section for a radar in a unit direction from it; zero from behind.
    pub fn section_m2(&self, towards: &Vector3<f64>, surface: &EchoSurface, wave_m: f64) -> f64 {
        let cosine = self.normal.dot(towards);
        if cosine <= GRAZING {
            return 0.0;
        }
        let slope2 = surface.slope_rad.powi(2) + self.round_rad.powi(2);
        let slope2 = slope2.max(1e-6);
        let squared = cosine * cosine;
        let lobe =
            (-(1.0 / squared - 1.0) / (2.0 * slope2)).exp() / (2.0 * slope2 * squared * cosine);
        let diffuse = surface.diffuse.clamp(0.0, 1.0);
        let of_plate = diffuse * cosine + (1.0 - diffuse) * lobe;
        let most = 4.0 * PI * self.area_m2 / (wave_m * wave_m);
        surface.reflectivity * self.area_m2 * of_plate.min(most)
    }
}

/// Reflectivity of a half space of a relative permittivity, at normal incidence (Fresnel).
pub fn reflectivity_of(permittivity: f64) -> f64 {
    let index = permittivity.max(1.0).sqrt();
    ((index - 1.0) / (index + 1.0)).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over all directions of a plate is a quarter of its area, whatever its slopes and its diffuse share
    /// (slopes must be small, so that hardly any leans over to the back).
    #[test]
    fn a_plate_echoes_its_mean_shadow() {
        let facet = Facet {
            place: Point3::origin(),
            normal: Vector3::z(),
            area_m2: 0.5,
            round_rad: 0.0,
        };
        for (slope_rad, diffuse) in [(0.05, 0.0), (0.05, 0.3), (0.1, 0.0), (0.02, 1.0)] {
            let surface = EchoSurface {
                reflectivity: 1.0,
                slope_rad,
                diffuse,
            };
            let n = 200_000;
            // Even over the sphere: the cosine is uniform.
            let mean: f64 = (0..n)
                .map(|k| {
                    let cosine = -1.0 + 2.0 * (f64::from(k) + 0.5) / f64::from(n);
                    let towards = Vector3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                    facet.section_m2(&towards, &surface, 4e-3)
                })
                .sum::<f64>()
                / f64::from(n);
            assert!(
                (mean / 0.125 - 1.0).abs() < 0.01,
                "{slope_rad}, {diffuse}: {mean}"
            );
        }
    }

    /// A small plate cannot echo more than an ideal one of its size.
    #[test]
    fn no_plate_echoes_more_than_an_ideal_one() {
        let facet = Facet {
            place: Point3::origin(),
            normal: Vector3::x(),
            area_m2: 1e-4,
            round_rad: 0.0,
        };
        let surface = EchoSurface {
            reflectivity: 1.0,
            slope_rad: 1e-3,
            diffuse: 0.0,
        };
        let ideal = 4.0 * PI * 1e-8 / (4e-3 * 4e-3);
        let section = facet.section_m2(&Vector3::x(), &surface, 4e-3);
        assert!((section / ideal - 1.0).abs() < 1e-9);
        assert!(facet.section_m2(&-Vector3::x(), &surface, 4e-3) < f64::EPSILON);
    }

    /// Concrete by ITU-R P.2040 (relative permittivity 5.24): 8.1 dB below metal.
    #[test]
    fn val_concrete_reflects_a_seventh() {
        assert!((10.0 * reflectivity_of(5.24).log10() + 8.13).abs() < 0.05);
        assert!(reflectivity_of(1.0) < 1e-12);
    }
}
