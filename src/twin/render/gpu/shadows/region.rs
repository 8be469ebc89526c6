//! A piece of what is lit, as a ball.

use nalgebra::{Point3, Vector3};

/// A ball that holds a piece of a surface, a lamp's disc, or where the eye is.
#[derive(Clone, Copy)]
pub struct Region<'a> {
    pub centre: &'a Point3<f64>,
    pub radius_m: f64,
    /// Of the surface, if it has one.
    pub normal: Option<&'a Vector3<f64>>,
}

impl<'a> Region<'a> {
    /// Of what faces all ways.
    pub fn around(centre: &'a Point3<f64>, radius_m: f64) -> Self {
        Self {
            centre,
            radius_m,
            normal: None,
        }
    }
}
