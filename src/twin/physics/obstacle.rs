//! Things that lie, fall and get hit.

use super::settings::within;
use crate::track::Problem;
use crate::twin::render::Shape;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of an obstacle with its size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum ObstacleShape {
    /// A box: length along the line, width across, height, metres.
    Box {
        /// Length, width and height, metres.
        size_m: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Diameter, metres.
        diameter_m: f64,
        /// Height, metres.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Diameter, metres.
        diameter_m: f64,
    },
}

impl ObstacleShape {
    /// Length, width and height of its bounding box at rest.
    pub fn size_m(&self) -> Vector3<f64> {
        match *self {
            Self::Box { size_m } => size_m.into(),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => Vector3::new(diameter_m, diameter_m, height_m),
            Self::Sphere { diameter_m } => Vector3::repeat(diameter_m),
        }
    }

    /// As the renderer draws it.
    pub fn render_shape(&self) -> Shape {
        match *self {
            Self::Box { .. } => Shape::Box(self.size_m() / 2.0),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => Shape::Cylinder(diameter_m / 2.0, height_m / 2.0),
            Self::Sphere { diameter_m } => Shape::Sphere(diameter_m / 2.0),
        }
    }
}

/// One obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ObstacleSettings {
    /// Name, for the summary.
    pub name: String,
    /// Shape and size: `body = { shape = "box", size_m = [0.4, 0.25, 0.25] }`, or `cylinder` with
    /// `diameter_m` and `height_m`, or `sphere` with `diameter_m`.
    pub body: ObstacleShape,
    /// Mass, kilograms.
    pub mass_kg: f64,
    /// Coulomb friction.
    pub friction: f64,
    /// Restitution, 0 to 1.
    pub restitution: f64,
    /// Share of light reflected, 0 to 1.
    pub albedo: f64,
    /// Chainage of its centre, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    pub lateral_m: f64,
    /// Height of its lowest point above top of rail when it appears, metres.
    pub height_m: f64,
    /// Turned about the vertical, degrees.
    pub yaw_deg: f64,
    /// When it appears, seconds.
    pub appears_s: f64,
    /// Velocity when it appears: up the line, to the left, up, m/s.
    pub velocity_mps: [f64; 3],
}

impl Default for ObstacleSettings {
    fn default() -> Self {
        Self {
            name: "box".to_owned(),
            body: ObstacleShape::Box {
                size_m: [0.3, 0.3, 0.3],
            },
            mass_kg: 10.0,
            friction: 0.6,
            restitution: 0.2,
            albedo: 0.3,
            chainage_m: 0.0,
            lateral_m: 0.0,
            height_m: 0.5,
            yaw_deg: 0.0,
            appears_s: 0.0,
            velocity_mps: [0.0; 3],
        }
    }
}

impl ObstacleSettings {
    /// Appends what is wrong with these settings; `at` is the dotted key that leads here.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = |key: &str, value: f64, low: f64, high: f64, unit: &str| {
            within(problems, at, key, value, low, high, unit);
        };
        for size in self.body.size_m().iter() {
            check("body", *size, 0.01, 10.0, "m");
        }
        check("mass_kg", self.mass_kg, 0.01, 1e5, "kg");
        check("friction", self.friction, 0.0, 2.0, "");
        check("restitution", self.restitution, 0.0, 1.0, "");
        check("albedo", self.albedo, 0.0, 1.0, "");
        check("chainage_m", self.chainage_m, -1e6, 1e6, "m");
        check("lateral_m", self.lateral_m, -10.0, 10.0, "m");
        check("height_m", self.height_m, -1.0, 10.0, "m");
        check("yaw_deg", self.yaw_deg, -360.0, 360.0, "deg");
        check("appears_s", self.appears_s, 0.0, 1e6, "s");
        for v in self.velocity_mps {
            check("velocity_mps", v, -50.0, 50.0, "m/s");
        }
    }
}
