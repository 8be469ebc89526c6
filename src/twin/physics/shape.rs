//! What an obstacle looks like: the shape as a scenario writes it, and as physics and renderers
//! take it.

use crate::settings::{Checker, settings};
use crate::twin::geometry::{Hull, Shape};
use crate::twin::random::Stream;
use nalgebra::{Point3, Vector3};
use std::ops::RangeInclusive;
use std::sync::Arc;

settings! {
    /// Shape of an obstacle with its size.
    #[serde(tag = "shape", rename_all = "snake_case")]
    pub enum ObstacleShape {
        /// A box: length along the line, width across, height, metres.
        Box {
            /// Length, width and height, metres.
            size_m: [f64; 3], in SIZE_M;
        },
        /// A cylinder: upright, or lying with `roll_deg = 90` (its axis across the line, so that it
        /// rolls along) or `pitch_deg = 90` (its axis along the line).
        Cylinder {
            /// Diameter, metres.
            diameter_m: f64, in SIZE_M;
            /// Height, metres.
            height_m: f64, in SIZE_M;
        },
        /// A ball.
        Sphere {
            /// Diameter, metres.
            diameter_m: f64, in SIZE_M;
        },
        /// A rock: a body with some twenty corners and flat faces that no other obstacle of the
        /// scenario shares.
        Rock {
            /// Diameter of the ball about its centre of mass that holds it, metres.
            diameter_m: f64, in SIZE_M;
        },
        /// The convex hull of a mesh from a file.
        Mesh {
            /// Wavefront OBJ file; a relative path counts from the scenario's folder. Its x axis is
            /// the length, y the width to the left, z up.
            file: String;
            /// Metres that a unit of the file stands for.
            #[serde(default = "crate::settings::one::<f64>")]
            scale: f64, in 1e-6..=1e6;
            /// What the file holds, unscaled; whoever reads the scenario puts it here.
            #[serde(skip)]
            hull: Option<Arc<Hull>>;
        },
    }
    also check_mesh
}

/// Smallest and largest extent.
const SIZE_M: RangeInclusive<f64> = 0.01..=10.0;

/// Corners of a rock before the hull is drawn around them.
const ROCK_POINTS: u32 = 22;
/// The nearest of them is this share of the radius from the centre.
const ROCK_INNER: f64 = 0.62;
/// More corners make neither picture nor contact better, but both slower.
const MAX_CORNERS: usize = 256;

impl ObstacleShape {
    /// The body; what is random about it is drawn from `stream`. `None` for a mesh that has not
    /// been read.
    pub fn body(&self, stream: Stream) -> Option<Shape> {
        Some(match self {
            Self::Box { size_m } => Shape::Box(Vector3::from(*size_m) / 2.0),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => Shape::Cylinder(diameter_m / 2.0, height_m / 2.0),
            Self::Sphere { diameter_m } => Shape::Sphere(diameter_m / 2.0),
            Self::Rock { diameter_m } => Shape::Hull(Arc::new(rock(stream)?.scaled(*diameter_m)?)),
            Self::Mesh { scale, hull, .. } => Shape::Hull(Arc::new(hull.as_ref()?.scaled(*scale)?)),
        })
    }

    /// The same shape, larger or smaller.
    pub(super) fn scaled(&self, by: f64) -> Self {
        let mut scaled = self.clone();
        match &mut scaled {
            Self::Box { size_m } => size_m.iter_mut().for_each(|size| *size *= by),
            Self::Cylinder {
                diameter_m,
                height_m,
            } => {
                *diameter_m *= by;
                *height_m *= by;
            }
            Self::Sphere { diameter_m } | Self::Rock { diameter_m } => *diameter_m *= by,
            Self::Mesh { scale, .. } => *scale *= by,
        }
        scaled
    }

    fn check_mesh(&self, check: &mut Checker<'_>) {
        let Self::Mesh { file, scale, hull } = self else {
            return;
        };
        let Some(hull) = hull else {
            check.problem(
                "file",
                format!("the mesh {file} has not been read"),
                "load the scenario from its file, or give the hull",
            );
            return;
        };
        let corners = hull.corners().len();
        if corners > MAX_CORNERS {
            check.problem(
                "file",
                format!("the hull of {file} has {corners} corners, more than {MAX_CORNERS}"),
                "simplify the mesh: neither contacts nor pictures get better with more",
            );
        }
        let sizes_m: [f64; 3] = (hull.half_extents_m() * 2.0 * *scale).into();
        if let Some(size_m) = sizes_m.into_iter().find(|size_m| !SIZE_M.contains(size_m)) {
            let (low, high) = SIZE_M.into_inner();
            check.problem(
                "scale",
                format!("so scaled, {file} is {size_m} m long, wide or high: out of range"),
                format!("scale it to measure {low} to {high} m each way"),
            );
        }
    }
}

/// A rock of diameter 1 about its centre of mass: the hull of points spread evenly over a sphere
/// (a golden spiral), each drawn in towards the centre by an amount of its own.
fn rock(stream: Stream) -> Option<Hull> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let points: Vec<Point3<f64>> = (0..ROCK_POINTS)
        .map(|k| {
            let draw = |n: u64| stream.uniform(u64::from(k) * 3 + n);
            let up = 1.0 - 2.0 * (f64::from(k) + draw(0)) / f64::from(ROCK_POINTS);
            let (sin, cos) = (golden * f64::from(k) + draw(1)).sin_cos();
            let level = (1.0 - up * up).sqrt();
            let radius = ROCK_INNER + (1.0 - ROCK_INNER) * draw(2);
            Point3::new(level * cos, level * sin, up) * radius
        })
        .collect();
    let hull = Hull::around(&points)?;
    let reach = hull.corners().iter().map(|c| c.coords.norm());
    hull.scaled(0.5 / reach.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
    use super::*;

    /// Fails where rocks are all alike, are balls, or are larger than they say.
    #[test]
    fn rocks_are_irregular_and_within_their_diameter() {
        let rocks: Vec<Hull> = (0..20)
            .map(|k| rock(Stream::new(1, 0, &format!("rock {k}"))).unwrap())
            .collect();
        for (k, rock) in rocks.iter().enumerate() {
            let far = rock.corners().iter().map(|c| c.coords.norm());
            assert!((far.fold(0.0, f64::max) - 0.5).abs() < 1e-9);
            // Of the ball's volume, pi / 6.
            let fill = rock.volume_m3() / std::f64::consts::FRAC_PI_6;
            assert!((0.2..0.75).contains(&fill), "rock {k} fills {fill}");
            assert!(rock.faces().len() > 12 && rock.corners().len() > 9);
            assert!(rocks[..k].iter().all(|other| other != rock));
        }
        assert_eq!(rock(Stream::new(1, 0, "rock 3")).unwrap(), rocks[3]);
    }
}
