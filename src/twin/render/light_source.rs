//! Lamps and headlights alike, as shadows are reckoned from them.

use super::photometry::{BlinkingLamp, LAMP_REACH_M};
use crate::twin::geometry::Body;
use crate::twin::lights::{HEADLIGHT_RADIUS_M, Headlight};
use nalgebra::{Point3, Vector3};

/// A lamp or a headlight.
pub struct LightSource<'a> {
    kind: LightKind<'a>,
    /// Centre of its disc.
    pub centre: Point3<f64>,
    /// Where it shines brightest.
    pub axis: Vector3<f64>,
    /// Radius of its disc.
    pub radius_m: f64,
    /// Mean intensity along its axis.
    pub intensity_cd: f64,
    /// Exponent of its pattern.
    pub exponent: f64,
    /// It does not light what is farther.
    pub reach_m: f64,
}

enum LightKind<'a> {
    Lamp(&'a BlinkingLamp),
    Headlight(&'a Headlight),
}

impl<'a> LightSource<'a> {
    /// A lamp.
    pub fn lamp(lamp: &'a BlinkingLamp) -> Self {
        Self {
            kind: LightKind::Lamp(lamp),
            centre: lamp.centre,
            axis: lamp.facing.into_inner(),
            radius_m: lamp.radius_m,
            intensity_cd: lamp.duty() * lamp.axial_intensity_cd(),
            exponent: lamp.exponent,
            reach_m: LAMP_REACH_M,
        }
    }

    /// A headlight, whose reach is longer than any scene.
    pub fn headlight(light: &'a Headlight) -> Self {
        Self {
            kind: LightKind::Headlight(light),
            centre: light.place(),
            axis: light.axis(),
            radius_m: HEADLIGHT_RADIUS_M,
            intensity_cd: light.intensity_cd,
            exponent: light.exponent,
            reach_m: 1e6,
        }
    }

    /// Mean illuminance of a surface at `p` with unit normal `n`, in clear air.
    pub fn irradiance_lx(&self, p: &Point3<f64>, n: &Vector3<f64>) -> f64 {
        match self.kind {
            LightKind::Lamp(lamp) => lamp.irradiance_lx(p, n),
            LightKind::Headlight(light) => light.irradiance_lx(p, n),
        }
    }

    /// Whether it may light anything in a ball, whose surface has a normal or is round.
    pub fn may_light(
        &self,
        centre: &Point3<f64>,
        radius_m: f64,
        normal: Option<&Vector3<f64>>,
    ) -> bool {
        let to = centre - self.centre;
        to.norm_squared() < (self.reach_m + radius_m).powi(2)
            && self.axis.dot(&to) + radius_m > 0.0
            && normal.is_none_or(|n| n.dot(&to) < radius_m)
    }

    /// Whether a body carries it, and so never shades it.
    pub fn is_carried_by(&self, body: &Body) -> bool {
        matches!(self.kind, LightKind::Headlight(light) if light.is_carried_by(body))
    }
}
