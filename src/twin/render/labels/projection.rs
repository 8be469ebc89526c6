//! The row-time equation: in which row, and so when, a rolling shutter sees a point.
//!
//! Row v sees from where the camera is in the middle of that row's exposure, t(v). A point p is
//! seen in the row that solves
//!
//! ```text
//! project(camera_from_world(t(v)) p(t(v))).v = v
//! ```
//!
//! which is solved by the secant method from two steps of plain iteration. The derivative of the
//! left side is how many rows the point's image moves in the time of a row: 0.2 for a wall that is
//! 2 m beside a camera at 60 km/h, far less than the 1 at which a picture would tear.
//!
//! ```
//! use metrotwin::twin::render::{Job, Scene, labels::Projection};
//!
//! /// In which row the first camera of a job sees each lamp.
//! fn rows(scene: &Scene, job: &Job) -> Vec<Option<f64>> {
//!     let projection = Projection::new(&job.views[0], job.time);
//!     let seen = scene.lamps.iter().map(|lamp| projection.of(&lamp.centre));
//!     seen.map(|seen| Some(seen?.pixel.y)).collect()
//! }
//! ```

use crate::bus::SimTime;
use crate::twin::render::View;
use nalgebra::{Isometry3, Point2, Point3, Vector3};

/// The row is solved to this.
const TOLERANCE_PX: f64 = 1e-7;
/// Steps of the secant method before a point counts as unseen.
const MAX_STEPS: usize = 20;

/// A view with the time from which moving points are reckoned.
pub struct Projection<'a> {
    /// What is looked through.
    pub view: &'a View,
    /// Time of the bodies' poses.
    time: SimTime,
    /// Poses of the rows of the image.
    rows: Vec<Isometry3<f64>>,
}

/// Where a point is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// In the image; it may be outside of its frame.
    pub pixel: Point2<f64>,
    /// Along the optical axis.
    pub depth_m: f64,
}

impl<'a> Projection<'a> {
    /// Of a view of a job at `time`.
    pub fn new(view: &'a View, time: SimTime) -> Self {
        let mut projection = Self {
            view,
            time,
            rows: Vec::new(),
        };
        let rows = 0..view.camera.intrinsics.height_px;
        projection.rows = rows.map(|v| projection.pose(f64::from(v))).collect();
        projection
    }

    /// From the time of the bodies' poses to the middle of the exposure of row `v`.
    pub fn after_s(&self, v: f64) -> f64 {
        self.view.start.since(self.time) + self.mid_s(v)
    }

    /// From the frame's start to the middle of the exposure of row `v`. Not a [`SimTime`]: its whole
    /// nanoseconds are steps of 1e-5 pixels, too coarse to solve an equation with.
    fn mid_s(&self, v: f64) -> f64 {
        let shutter = &self.view.camera.shutter;
        shutter.delay_s(v) + 0.5 * shutter.exposure_s
    }

    /// `world_from_camera` in the middle of the exposure of row `v`. Rows above and below the
    /// image go on as its first and last poses do.
    pub fn pose(&self, v: f64) -> Isometry3<f64> {
        let motion = &self.view.motion;
        let Some(last) = motion.poses.len().checked_sub(2) else {
            return motion.pose_at(self.view.start);
        };
        let x = (self.view.start.since(motion.first) + self.mid_s(v)) / motion.step_s;
        let k = (x.floor().max(0.0) as usize).min(last);
        motion.poses[k].lerp_slerp(&motion.poses[k + 1], x - k as f64)
    }

    /// Where a point that stands still is seen, exactly; `None` where it is behind the camera.
    pub fn of(&self, point: &Point3<f64>) -> Option<Seen> {
        self.of_moving(point, &Vector3::zeros())
    }

    /// The same of a point that is there at the time of the bodies' poses and moves on evenly.
    pub fn of_moving(&self, point: &Point3<f64>, velocity_mps: &Vector3<f64>) -> Option<Seen> {
        self.solve(|v| {
            let at = point + velocity_mps * self.after_s(v);
            self.project(&(self.pose(v).inverse_transform_point(&at)))
        })
    }

    /// The same from poses that are known for whole rows, and interpolated between them: some
    /// thousandths of a pixel off where the camera is shaken, and many times as fast. `None`
    /// also where the point is outside of the image.
    pub fn within_image(&self, point: &Point3<f64>, velocity_mps: &Vector3<f64>) -> Option<Seen> {
        let last = self.rows.len().checked_sub(1)?;
        let in_row = |row: usize| {
            let at = point + velocity_mps * self.after_s(row as f64);
            self.project(&self.rows[row].inverse_transform_point(&at))
        };
        let seen = self.solve(|v| {
            let above = (v.max(0.0) as usize).min(last.saturating_sub(1));
            let (a, b) = (in_row(above)?, in_row((above + 1).min(last))?);
            let share = v - above as f64;
            Some(Seen {
                pixel: a.pixel + (b.pixel - a.pixel) * share,
                depth_m: a.depth_m + (b.depth_m - a.depth_m) * share,
            })
        })?;
        self.contains(&seen.pixel).then_some(seen)
    }

    /// Whether a place is on a pixel of the image.
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        let camera = &self.view.camera.intrinsics;
        let on = |x: f64, size: u32| x >= -0.5 && x < f64::from(size) - 0.5;
        on(pixel.x, camera.width_px) && on(pixel.y, camera.height_px)
    }

    fn project(&self, point: &Point3<f64>) -> Option<Seen> {
        Some(Seen {
            pixel: self.view.camera.intrinsics.project(point)?,
            depth_m: point.z,
        })
    }

    /// The row in which what is seen from row v is seen in row v.
    fn solve(&self, look: impl Fn(f64) -> Option<Seen>) -> Option<Seen> {
        let off = |v: f64| look(v).map(|seen| (seen, seen.pixel.y - v));
        let mut v0 = 0.5 * (f64::from(self.view.camera.intrinsics.height_px) - 1.0);
        let (first, mut off0) = off(v0)?;
        let mut v1 = first.pixel.y;
        for _ in 0..MAX_STEPS {
            let (seen, off1) = off(v1)?;
            if off1.abs() < TOLERANCE_PX {
                return Some(seen);
            }
            let slope = (off1 - off0) / (v1 - v0);
            (v0, off0) = (v1, off1);
            v1 -= if slope.is_finite() && slope < 0.0 {
                off1 / slope
            } else {
                -off1
            };
        }
        None
    }
}
