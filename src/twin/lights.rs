//! The lights as they really are: lamps on the wall that blink their names, and headlights of trains.
//! What they light is worked out in [`photometry`](super::render::photometry).

use super::geometry::Body;
use crate::bus::SimTime;
use crate::track::LampSite;
use crate::track::waveform::{LightCurve, Ripple, Waveform};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::f64::consts::{PI, TAU};

/// Radius of a headlight's luminous disc.
pub const HEADLIGHT_RADIUS_M: f64 = 0.09;
/// What is nearer to a headlight than this carries it.
const MOUNT_M: f64 = 0.3;
/// Rise and fall time of a lamp's light, from 10 to 90 %: that of an LED driver that switches a
/// lamp of some ten watts by a transistor; the phosphor's own is a seventh of it or so.
const EDGE_S: f64 = 1e-6;

/// A lamp: a luminous disc that blinks.
#[derive(Clone, Debug, PartialEq)]
pub struct LampLight {
    /// Centre of the disc, world.
    pub centre: Point3<f64>,
    /// Normal of the disc, on the luminous side.
    pub facing: Unit<Vector3<f64>>,
    /// Radius of the disc.
    pub radius_m: f64,
    /// Luminance along the normal while on, cd/m^2. Seen at angle a from the normal it is this
    /// times cos(a)^(exponent - 1).
    pub luminance_cd_m2: f64,
    /// Exponent m of the intensity pattern I = I0 cos(a)^m.
    pub exponent: f64,
    /// When it is on.
    pub waveform: Waveform,
    /// Its light as a share of that of a good lamp: 1 good, 0 dead, between them dim.
    pub level: f64,
    /// What the mains leave in its light.
    pub ripple: Ripple,
    /// What level and ripple become later, in order of time.
    pub changes: Vec<LampChange>,
}

/// A lamp fails, or recovers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampChange {
    /// When.
    pub at: SimTime,
    /// Its level from then on.
    pub level: f64,
    /// Its ripple from then on.
    pub ripple: Ripple,
}

impl LampLight {
    /// The lamp as it is at a time.
    #[must_use]
    pub fn at(&self, time: SimTime) -> Self {
        let passed = self.changes.iter().take_while(|c| c.at <= time);
        let (level, ripple) = passed
            .last()
            .map_or((self.level, self.ripple), |c| (c.level, c.ripple));
        Self {
            level,
            ripple,
            ..self.clone()
        }
    }
}

/// A lamp on a train that lights what is in front.
#[derive(Clone, Debug, PartialEq)]
pub struct Headlight {
    /// Where it is and where it looks (along its x axis).
    pub world_from_light: Isometry3<f64>,
    /// Intensity along the axis.
    pub intensity_cd: f64,
    /// Exponent of its pattern I = I0 cos(a)^m.
    pub exponent: f64,
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
                rise_s: EDGE_S,
                fall_s: EDGE_S,
                ..Waveform::sharp(site.uid.frame(site.code), site.chip_s, phase_s)
            },
            level: 1.0,
            ripple: Ripple::default(),
            changes: Vec::new(),
        }
    }

    /// Its light in time. Times [`Self::level`] it is the light of a good lamp that stays on.
    pub fn curve(&self) -> LightCurve {
        LightCurve::new(&self.waveform, self.ripple)
    }

    /// Intensity along the normal of a good lamp while on.
    pub fn axial_intensity_cd(&self) -> f64 {
        self.luminance_cd_m2 * PI * self.radius_m * self.radius_m
    }
}

impl Headlight {
    /// Where it is.
    pub fn place(&self) -> Point3<f64> {
        Point3::from(self.world_from_light.translation.vector)
    }

    /// Where it shines brightest, a unit vector.
    pub fn axis(&self) -> Vector3<f64> {
        self.world_from_light.rotation * Vector3::x()
    }

    /// Whether a body, taken as the box around it, has the headlight in it or next to it. It moves
    /// with the light and is behind it, so it never shades it.
    pub fn is_carried_by(&self, body: &Body) -> bool {
        let place = body
            .world_from_body
            .inverse_transform_point(&self.place())
            .coords;
        let outside = (place.abs() - body.shape.half_extents_m()).sup(&Vector3::zeros());
        outside.norm() < MOUNT_M
    }
}

/// Exponent m for which the intensity has fallen to half at half the full beam angle.
pub fn exponent_of_beam(full_beam_rad: f64) -> f64 {
    0.5f64.ln() / (0.5 * full_beam_rad).cos().ln()
}

#[cfg(test)]
mod tests {
    use super::super::geometry::Shape;
    use super::*;

    /// Fails where a train stands in its own light: the headlight is just inside of its front, or
    /// just before it, behind a lens. A board half a metre ahead is not part of the train.
    #[test]
    fn a_train_carries_its_headlights() {
        let light = Headlight {
            world_from_light: Isometry3::translation(100.0, 0.9, 1.0),
            intensity_cd: 900.0,
            exponent: 30.0,
        };
        let carries = |shape: Shape, x: f64, y: f64| {
            light.is_carried_by(&Body {
                shape,
                world_from_body: Isometry3::translation(x, y, 1.5),
                velocity_mps: Vector3::zeros(),
                albedo: 0.5,
                luminance_cd_m2: 0.0,
            })
        };
        let car = || Shape::Box(Vector3::new(10.0, 1.4, 1.4));
        assert!(carries(car(), 90.1, 0.0) && carries(car(), 89.9, 0.0));
        assert!(!carries(car(), 68.0, 0.0) && !carries(car(), 90.1, 2.8));
        assert!(carries(Shape::Sphere(0.3), 100.0, 0.9));
        assert!(!carries(
            Shape::Box(Vector3::new(0.01, 1.0, 1.0)),
            100.5,
            0.9
        ));
    }
}
