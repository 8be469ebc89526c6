//! Photometry: what light lamps and headlights throw on a surface, in double precision.
//!
//! A lamp is a disc whose intensity falls as I = I0 cos(a)^m with the angle a from its normal
//! (the generalised Lambert source of IES practice; m = 1 is a Lambert disc). Its flux is the
//! integral over the hemisphere, 2 pi I0 / (m + 1). Its luminance is the intensity over the
//! disc's apparent area, so it falls as cos(a)^(m - 1).
//!
//! A surface far from the disc compared with its radius gets E = I cos(a_in) / d^2. A lamp is off
//! half of the time (Manchester code), far too fast for surfaces to show it; they get the mean.
//! No shadows.

use super::scene::{Headlight, LampLight};
use crate::track::{LampSite, uid::Waveform};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// Lamps farther than this from a surface do not light it.
pub const LAMP_REACH_M: f64 = 30.0;

/// Exponent m for which the intensity has fallen to half at half the full beam angle.
pub fn exponent_of_beam(full_beam_rad: f64) -> f64 {
    0.5f64.ln() / (0.5 * full_beam_rad).cos().ln()
}

impl LampLight {
    /// The lamp of a survey, blinking its name with a period that starts at `phase_s`.
    pub fn from_site(site: &LampSite, phase_s: f64) -> Self {
        let exponent = exponent_of_beam(site.beam_deg.to_radians());
        let flux_lm = site.power_w * site.efficacy_lm_per_w;
        let radius_m = 0.5 * site.diameter_m;
        Self {
            centre: site.centre,
            facing: site.facing,
            radius_m,
            luminance_cd_m2: flux_lm * (exponent + 1.0) / (TAU * PI * radius_m * radius_m),
            exponent,
            waveform: Waveform {
                frame: site.uid.frame(site.code),
                chip_s: site.chip_s,
                phase_s,
            },
        }
    }

    /// Share of the time that it is on.
    pub fn duty(&self) -> f64 {
        let frame = self.waveform.frame;
        f64::from(frame.bits.count_ones()) / f64::from(frame.len.max(1))
    }

    /// Intensity along the normal while on.
    pub fn axial_intensity_cd(&self) -> f64 {
        self.luminance_cd_m2 * PI * self.radius_m * self.radius_m
    }

    /// Mean illuminance of a surface at `p` with unit normal `n`, lux; 0 out of reach.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let d = p - self.centre;
        if d.norm_squared() > LAMP_REACH_M * LAMP_REACH_M {
            return 0.0;
        }
        self.duty()
            * point_source_lx(
                self.axial_intensity_cd(),
                self.exponent,
                &self.facing,
                &d,
                n,
            )
    }
}

impl Headlight {
    /// Illuminance of a surface at `p` with unit normal `n`, lux.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let d = p - Point3::from(self.world_from_light.translation.vector);
        let axis = self.world_from_light.rotation * Vector3::x();
        point_source_lx(self.intensity_cd, self.exponent, &axis, &d, n)
    }
}

/// Illuminance by a point source of intensity `i0` cos^m about `axis`; `d` leads from it to the
/// surface.
fn point_source_lx(
    i0: f64,
    exponent: f64,
    axis: &Vector3<f64>,
    d: &Vector3<f64>,
    n: &Vector3<f64>,
) -> f64 {
    let (out, into) = (axis.dot(d), -n.dot(d));
    if out <= 0.0 || into <= 0.0 {
        return 0.0;
    }
    // A surface never comes nearer than a hand's breadth to a source in a sane scene; the bound
    // only keeps the quotient finite.
    let d2 = d.norm_squared().max(1e-4);
    let distance = d2.sqrt();
    i0 * (out / distance).powf(exponent) * into / (d2 * distance)
}

/// The lamps of a scene, found by place: cells of a plan grid list the lamps that reach them.
#[derive(Clone, Debug)]
pub struct LampField {
    lamps: Vec<LampLight>,
    /// Cell and lamp, sorted, so that the lamps of a cell are one run.
    reach: Vec<((i32, i32), u32)>,
}

const CELL_M: f64 = 10.0;

fn cell(x_m: f64) -> i32 {
    (x_m / CELL_M).floor() as i32
}

impl LampField {
    /// Sorts the lamps into cells.
    pub fn new(lamps: &[LampLight]) -> Self {
        let mut reach = Vec::new();
        for (k, lamp) in lamps.iter().enumerate() {
            let c = lamp.centre;
            for i in cell(c.x - LAMP_REACH_M)..=cell(c.x + LAMP_REACH_M) {
                for j in cell(c.y - LAMP_REACH_M)..=cell(c.y + LAMP_REACH_M) {
                    reach.push(((i, j), k as u32));
                }
            }
        }
        reach.sort_unstable();
        Self {
            lamps: lamps.to_vec(),
            reach,
        }
    }

    /// All lamps, in the order given.
    pub fn lamps(&self) -> &[LampLight] {
        &self.lamps
    }

    /// Those that may reach a place, in the order given.
    pub fn near(&self, p: &Point3<f64>) -> impl Iterator<Item = &LampLight> {
        let at = (cell(p.x), cell(p.y));
        let first = self.reach.partition_point(|(c, _)| *c < at);
        self.reach[first..]
            .iter()
            .take_while(move |(c, _)| *c == at)
            .map(|(_, k)| &self.lamps[*k as usize])
    }

    /// Mean illuminance by all lamps of a surface at `p` with unit normal `n`, lux.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        self.near(p).map(|lamp| lamp.irradiance_lx(p, n)).sum()
    }
}

/// Illuminance by all headlights of a surface at `p` with unit normal `n`, lux.
pub fn headlights_lx(headlights: &[Headlight], p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
    headlights.iter().map(|h| h.irradiance_lx(p, n)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::uid::Uid;
    use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};

    fn lamp(centre: Point3<f64>, facing: Vector3<f64>) -> LampLight {
        LampLight::from_site(
            &LampSite {
                uid: Uid { line: 1, lamp: 7 },
                chainage_m: 0.0,
                lateral_m: 2.8,
                height_m: 3.2,
                centre,
                facing: Unit::new_normalize(facing),
                diameter_m: 0.25,
                power_w: 21.0,
                efficacy_lm_per_w: 100.0,
                beam_deg: 60.0,
                chip_s: 66.6e-6,
                code: crate::track::uid::LineCode::Manchester,
            },
            0.0,
        )
    }

    /// Fails where the factor of the flux or the exponent is wrong: light caught by a sphere of
    /// patches around the lamp is its flux.
    #[test]
    fn a_sphere_around_a_lamp_catches_its_mean_flux() {
        let lamp = lamp(Point3::new(4.0, 5.0, 6.0), Vector3::new(0.2, 1.0, -0.4));
        assert!((lamp.exponent - 4.818).abs() < 1e-3);
        let (radius, bands) = (7.0, 400);
        let side = lamp
            .facing
            .cross(&Vector3::z())
            .try_normalize(1e-9)
            .unwrap_or(Vector3::x());
        let other = lamp.facing.cross(&side);
        let mut flux = 0.0;
        for i in 0..bands {
            let cos = -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(bands);
            let sin = (1.0f64 - cos * cos).sqrt();
            for j in 0..16 {
                let (b, a) = (TAU * f64::from(j) / 16.0).sin_cos();
                let out = lamp.facing.into_inner() * cos + (side * a + other * b) * sin;
                let patch = 2.0 * TAU * radius * radius / f64::from(bands * 16);
                flux += lamp.irradiance_lx(&(lamp.centre + out * radius), &-out) * patch;
            }
        }
        assert!((flux / (0.5 * 2100.0) - 1.0).abs() < 1e-4, "{flux}");
    }

    /// Fails where distance or incidence has the wrong power.
    #[test]
    fn light_falls_with_distance_squared_and_incidence() {
        let lamp = lamp(Point3::origin(), Vector3::x());
        let at = |d: f64, n: Vector3<f64>| lamp.irradiance_lx(&Point3::new(d, 0.0, 0.0), &n);
        let axial = 0.5 * lamp.axial_intensity_cd();
        assert!((at(3.0, -Vector3::x()) - axial / 9.0).abs() < 1e-9);
        assert!((at(6.0, -Vector3::x()) * 4.0 - at(3.0, -Vector3::x())).abs() < 1e-9);
        let slanted = Vector3::new(-0.5, 0.75f64.sqrt(), 0.0);
        assert!((at(3.0, slanted) - 0.5 * axial / 9.0).abs() < 1e-9);
        // Turned away, behind the lamp, out of reach: dark.
        assert!(at(3.0, Vector3::x()).abs() < 1e-300);
        assert!(at(-3.0, Vector3::x()).abs() < 1e-300);
        assert!(at(30.01, -Vector3::x()).abs() < 1e-300);
        let half = Point3::new(30f64.to_radians().cos(), 30f64.to_radians().sin(), 0.0);
        let inwards = -half.coords;
        assert!((lamp.irradiance_lx(&half, &inwards) - 0.5 * axial).abs() < 1e-9);
    }

    /// Fails where the grid loses a lamp: the same sum over all lamps.
    #[test]
    fn cells_hold_every_lamp_in_reach() {
        let lamps: Vec<_> = (0..40)
            .map(|k| {
                let s = 10.0 * f64::from(k) - 200.0;
                lamp(
                    Point3::new(s * 0.8, s * 0.6, 3.0),
                    Vector3::new(1.0, -2.0, 0.1),
                )
            })
            .collect();
        let field = LampField::new(&lamps);
        let n = Vector3::new(0.0, 0.6, 0.8);
        for k in 0..500 {
            let s = f64::from(k) - 250.0;
            let p = Point3::new(s * 0.8 + 1.0, s * 0.6 - 2.5, 0.0);
            let all: f64 = lamps.iter().map(|l| l.irradiance_lx(&p, &n)).sum();
            assert!((field.irradiance_lx(&p, &n) - all).abs() < 1e-12);
            assert!(field.near(&p).count() <= 10);
        }
    }

    /// Fails where a headlight shines along another axis than x, or blinks.
    #[test]
    fn a_headlight_shines_along_its_x_axis() {
        let light = Headlight {
            world_from_light: Isometry3::from_parts(
                Translation3::new(1.0, 0.0, 0.0),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * PI),
            ),
            intensity_cd: 900.0,
            exponent: 30.0,
        };
        let e = headlights_lx(
            &[light.clone(), light],
            &Point3::new(1.0, 3.0, 0.0),
            &-Vector3::y(),
        );
        assert!((e - 200.0).abs() < 1e-9);
    }
}
