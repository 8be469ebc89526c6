//! A piece of what is lit, as a ball.

use crate::twin::render::light_source::LightSource;
use nalgebra::{Point3, Vector3};

/// A ball that holds a piece of a surface or of a body, a lamp's disc, or where the eye is.
#[derive(Clone, Copy)]
pub struct Region {
    pub centre: Point3<f64>,
    pub radius_m: f64,
    /// Of the surface, if it has one.
    pub normal: Option<Vector3<f64>>,
}

impl Region {
    /// Of what faces all ways.
    pub fn around(centre: Point3<f64>, radius_m: f64) -> Self {
        Self {
            centre,
            radius_m,
            normal: None,
        }
    }

    /// Whether a light may light anything in it.
    pub fn may_be_lit(&self, light: &LightSource<'_>) -> bool {
        light.may_light(&self.centre, self.radius_m, self.normal.as_ref())
    }
}
