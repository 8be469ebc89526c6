//! Photometry: what light lamps and headlights throw on a surface, in double precision.
//!
//! A lamp is a disc whose intensity falls as I = I0 cos(a)^m with the angle a from its normal
//! (the generalised Lambert source of optical wireless: Gfeller and Bapst, Proc. IEEE 67(11), 1979;
//! m = 1 is a Lambert disc). Its flux is the
//! integral over the hemisphere, 2 pi I0 / (m + 1). Its luminance is the intensity over the
//! disc's apparent area, so it falls as cos(a)^(m - 1).
//!
//! A surface far from the disc compared with its radius gets E = I cos(a_in) / d^2. A lamp is off
//! half of the time (Manchester code), far too fast for
//! an eye, so its light in the mean over time is what is stored; what a row's exposure sees of the
//! blinking comes on top ([`LampField::flickering_lx`](super::lamp_field::LampField::flickering_lx)).
//!
//! # Shadows
//!
//! A body between a light and a surface hides part of the light's disc. The surface loses the same
//! share of its illuminance:
//!
//! ```text
//! E = E0 (1 - hidden / 16)
//! ```
//!
//! where E0 is the illuminance without bodies and `hidden` counts those of 16 places on the disc,
//! spread evenly over its area ([`disc_points`](super::disc::disc_points)), to which a straight line from the surface is cut
//! by a body. So an edge throws a penumbra as wide as the disc seen through it, in 16 steps. Lines
//! start [`OFFSET_M`] off the surface. A body carries a headlight ([`Headlight::is_carried_by`]) or
//! hides it. Only bodies hide light, the tunnel and the rails do not.
//!
//! # Air
//!
//! Mist and dust ([`Air`]) take light away over a distance d as e^(-k d), on its way to a surface
//! and from there to the eye, and add what they scatter towards it (Koschmieder, "Theorie der
//! horizontalen Sichtweite", Beitraege zur Physik der freien Atmosphaere 12, 1924):
//!
//! ```text
//! L = L0 e^(-k d) + A (1 - e^(-k d))
//! ```
//!
//! The airlight A is that of air evenly lit by what reaches a point about the camera, scattered
//! alike in all directions: A = w E_s / (4 pi), w the share scattered, E_s the light that passes a
//! point from all sides, see
//! [`LampField::airlight_cd_m2`](super::lamp_field::LampField::airlight_cd_m2). Headlights' own beams in the mist, and
//! the halo of lamps through it, are left out.

use crate::track::waveform::LightCurve;
use crate::twin::air::Air;
use crate::twin::lights::{Headlight, LampLight};
use nalgebra::{Point3, Vector3};
use std::ops::Deref;

/// Lamps farther than this from a surface do not light it.
pub const LAMP_REACH_M: f64 = 30.0;

/// Lines to lights start this far off their surface, along its normal.
pub const OFFSET_M: f64 = 1e-3;

/// A lamp with its light in time worked out once: that takes longer than any use of it.
#[derive(Clone, Debug)]
pub struct BlinkingLamp {
    lamp: LampLight,
    curve: LightCurve,
    duty: f64,
}

impl Deref for BlinkingLamp {
    type Target = LampLight;

    fn deref(&self) -> &LampLight {
        &self.lamp
    }
}

impl BlinkingLamp {
    /// Of a lamp.
    pub fn new(lamp: LampLight) -> Self {
        let curve = lamp.curve();
        Self {
            duty: lamp.level * curve.long_mean(),
            curve,
            lamp,
        }
    }

    /// Its light in the mean over time, as a share of that of a good lamp that stays on.
    pub fn duty(&self) -> f64 {
        self.duty
    }

    /// Its light in the mean from `open_s` to `close_s`, as such a share.
    pub fn share(&self, open_s: f64, close_s: f64) -> f64 {
        self.level * self.curve.mean(open_s, close_s)
    }

    /// Mean illuminance of a surface at `p` with unit normal `n`, lux; 0 out of reach.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        let d = p - self.centre;
        if d.norm_squared() > LAMP_REACH_M * LAMP_REACH_M {
            return 0.0;
        }
        self.duty
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
        let d = p - self.place();
        point_source_lx(self.intensity_cd, self.exponent, &self.axis(), &d, n)
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

/// Illuminance by all headlights of a surface at `p` with unit normal `n` through air, lux.
pub fn headlights_lx(
    headlights: &[Headlight],
    air: &Air,
    p: &Point3<f64>,
    n: &Vector3<f64>,
) -> f64 {
    headlights
        .iter()
        .map(|light| light.irradiance_lx(p, n) * air.transmission((p - light.place()).norm()))
        .sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::track::LampSite;
    use crate::track::uid::Uid;
    use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};
    use std::f64::consts::{PI, TAU};

    fn lamp(centre: Point3<f64>, facing: Vector3<f64>) -> BlinkingLamp {
        BlinkingLamp::new(light(centre, facing))
    }

    /// A lamp of the usual kind.
    pub(in super::super) fn light(centre: Point3<f64>, facing: Vector3<f64>) -> LampLight {
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
            &Air::default(),
            &Point3::new(1.0, 3.0, 0.0),
            &-Vector3::y(),
        );
        assert!((e - 200.0).abs() < 1e-9);
    }
}
