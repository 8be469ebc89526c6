//! From a region of the image to an obstacle on the line.
//!
//! Camera alone: the middle of the region's lowest edge is taken for its foot, the line of sight
//! through it meets the bed there. An upright plane through the foot, across the line of sight,
//! gives width and height from the outline. How deep the obstacle is the camera cannot see: it
//! is taken to be as deep as wide.
//!
//! With a lidar: echoes on the region's pixels give the range, and the depth where they show more
//! than that; the camera's outline gives width and height at that range.

use super::WaysideSettings;
use super::gauge::{Extent, danger};
use super::sight::Sight;
use crate::bus::{Blob, DetectedObstacle, LidarReturn, LidarScan};
use nalgebra::{Point3, Vector2, Vector3};

/// Most depth that an obstacle of unknown depth is given.
const DEPTH_LIMIT_M: f64 = 2.0;
/// A wider gap than this between the ranges of echoes is the shadow between an obstacle and what
/// is behind it.
const DEPTH_GAP_M: f64 = 1.0;

/// World point of an echo in the lidar's own frame.
///
/// ```
/// use metrotwin::bus::LidarReturn;
/// use metrotwin::stack::wayside::lidar_point;
/// let echo = LidarReturn { range_m: 2.0, azimuth_rad: 0.0, elevation_rad: 0.0 };
/// assert_eq!(lidar_point(&echo).y, 2.0);
/// ```
pub fn lidar_point(echo: &LidarReturn) -> Point3<f64> {
    let (sin_a, cos_a) = echo.azimuth_rad.sin_cos();
    let (sin_w, cos_w) = echo.elevation_rad.sin_cos();
    Point3::new(
        echo.range_m * cos_w * sin_a,
        echo.range_m * cos_w * cos_a,
        echo.range_m * sin_w,
    )
}

/// Places regions; owns the list of echoes on one.
#[derive(Clone, Debug, Default)]
pub(super) struct Placer {
    /// Horizontal ranges from the camera.
    echoes: Vec<f64>,
}

impl Placer {
    /// The obstacle that a region shows; `None` where its foot is not on the floor within reach.
    pub fn place(
        &mut self,
        settings: &WaysideSettings,
        sight: &Sight,
        blob: &Blob,
        binary: &[u8],
        scan: Option<&LidarScan>,
    ) -> Option<DetectedObstacle> {
        let width_px = sight.calibration().camera.intrinsics.width_px as usize;
        let foot_px = foot_column(blob, binary, width_px);
        // Pixel centres are at integers: the lowest edge is half a pixel further down.
        let foot_row = f64::from(blob.bounds.v1) + 0.5;
        let foot = sight.foot(foot_px, foot_row);
        self.collect_echoes(sight, blob, binary, scan);
        let by_camera = foot.map(|p| sight.map().alignment.world_from_track(p));
        let (front, depth) = match self.front_and_depth() {
            Some((range, depth)) => {
                let d = sight.direction(foot_px, foot_row);
                let across = Vector2::new(d.x, d.y).normalize() * range;
                let eye = sight.eye();
                let p = Point3::new(eye.x + across.x, eye.y + across.y, eye.z);
                let on_line = sight.track_from_world(&p);
                let rail = sight.map().alignment.at(on_line.s_m).origin.z;
                let z = rail + sight.floor_m(on_line);
                (Point3::new(p.x, p.y, z), Some(depth))
            }
            None => (by_camera?, None),
        };
        let outline = Outline::at(sight, blob, foot_px, front)?;
        if outline.width_m.max(outline.height_m) < settings.min_size_m {
            return None;
        }
        // Echoes on the top are sparse: the depth that they span is a lower bound.
        let guess = outline.width_m.min(DEPTH_LIMIT_M);
        let depth = depth.map_or(guess, |measured| measured.max(guess));
        Some(outline.obstacle(settings, sight, blob, front, depth))
    }

    /// Ranges of the echoes on the region's own pixels, in order.
    fn collect_echoes(
        &mut self,
        sight: &Sight,
        blob: &Blob,
        binary: &[u8],
        scan: Option<&LidarScan>,
    ) {
        self.echoes.clear();
        let calibration = sight.calibration();
        let (Some(scan), Some(world_from_lidar)) = (scan, calibration.world_from_lidar) else {
            return;
        };
        let intrinsics = &calibration.camera.intrinsics;
        let camera_from_lidar = calibration.world_from_camera.inv_mul(&world_from_lidar);
        let eye = sight.eye();
        for echo in &scan.returns {
            let p = lidar_point(echo);
            let Some(pixel) = intrinsics.project(&(camera_from_lidar * p)) else {
                continue;
            };
            let (u, v) = (pixel.x.round(), pixel.y.round());
            let b = &blob.bounds;
            let inside = u >= f64::from(b.u0)
                && u <= f64::from(b.u1)
                && v >= f64::from(b.v0)
                && v <= f64::from(b.v1);
            let index = v as usize * intrinsics.width_px as usize + u as usize;
            if inside && binary.get(index).is_some_and(|&x| x != 0) {
                let world = world_from_lidar * p;
                self.echoes.push((world.x - eye.x).hypot(world.y - eye.y));
            }
        }
        self.echoes.sort_unstable_by(f64::total_cmp);
    }

    /// Nearest range and depth of the cluster of echoes around the middle one.
    fn front_and_depth(&self) -> Option<(f64, f64)> {
        let middle = self.echoes.len() / 2;
        let gap = |k: usize| self.echoes[k + 1] - self.echoes[k];
        let mut first = middle;
        while first > 0 && gap(first - 1) <= DEPTH_GAP_M {
            first -= 1;
        }
        let mut last = middle;
        while last + 1 < self.echoes.len() && gap(last) <= DEPTH_GAP_M {
            last += 1;
        }
        let (near, far) = (*self.echoes.get(first)?, *self.echoes.get(last)?);
        (last > first && near > 0.0).then_some((near, far - near))
    }
}

/// Mean column of the region's pixels in its lowest tenth.
fn foot_column(blob: &Blob, binary: &[u8], width_px: usize) -> f64 {
    let b = &blob.bounds;
    let rows = ((b.v1 - b.v0) / 10).max(1);
    let (mut sum, mut n) = (0u64, 0u64);
    for v in b.v1.saturating_sub(rows)..=b.v1 {
        for u in b.u0..=b.u1 {
            let set = binary
                .get(v as usize * width_px + u as usize)
                .is_some_and(|&x| x != 0);
            if set {
                sum += u64::from(u);
                n += 1;
            }
        }
    }
    if n == 0 {
        f64::from(b.u0 + b.u1) / 2.0
    } else {
        sum as f64 / n as f64
    }
}

/// The outline, on an upright plane through the foot across the line of sight.
struct Outline {
    right: Point3<f64>,
    left: Point3<f64>,
    /// Horizontal unit vector away from the camera.
    away: Vector3<f64>,
    width_m: f64,
    height_m: f64,
}

impl Outline {
    fn at(sight: &Sight, blob: &Blob, foot_px: f64, foot: Point3<f64>) -> Option<Self> {
        let eye = sight.eye();
        let away = Vector3::new(foot.x - eye.x, foot.y - eye.y, 0.0);
        let range = away.norm();
        if range < 1e-3 {
            return None;
        }
        let away = away / range;
        let on_plane = |u: f64, v: f64| {
            let d = sight.direction(u, v);
            let speed = d.dot(&away);
            (speed > 1e-6).then(|| eye + d * (range / speed))
        };
        let b = &blob.bounds;
        let bottom = f64::from(b.v1) + 0.5;
        let left = on_plane(f64::from(b.u0) - 0.5, bottom)?;
        let right = on_plane(f64::from(b.u1) + 0.5, bottom)?;
        let top = on_plane(foot_px, f64::from(b.v0) - 0.5)?;
        Some(Self {
            right,
            left,
            away,
            width_m: (right - left).norm(),
            height_m: (top.z - foot.z).max(0.0),
        })
    }

    fn obstacle(
        &self,
        settings: &WaysideSettings,
        sight: &Sight,
        blob: &Blob,
        foot: Point3<f64>,
        depth_m: f64,
    ) -> DetectedObstacle {
        let behind = self.away * depth_m;
        let corners = [
            self.left,
            self.right,
            self.left + behind,
            self.right + behind,
        ]
        .map(|p| sight.track_from_world(&p));
        let ends = |f: fn(&crate::track::TrackPoint) -> f64| {
            corners
                .iter()
                .map(f)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                    (a.min(x), b.max(x))
                })
        };
        let (from_chainage_m, to_chainage_m) = ends(|p| p.s_m);
        let (right_m, left_m) = ends(|p| p.l_m);
        let place = sight.track_from_world(&foot);
        let top_m = place.h_m + self.height_m;
        let (near_range_m, near_angle_rad) = polar(sight, foot);
        let (far_range_m, far_angle_rad) = polar(sight, foot + behind);
        DetectedObstacle {
            blob: blob.clone(),
            position: foot,
            near_range_m,
            near_angle_rad,
            far_range_m,
            far_angle_rad,
            from_chainage_m,
            to_chainage_m,
            lateral_m: place.l_m,
            width_m: self.width_m,
            height_m: self.height_m,
            danger: danger(
                settings,
                Extent {
                    right_m,
                    left_m,
                    foot_m: place.l_m,
                    top_m,
                },
            ),
        }
    }
}

/// Range in plan from the device, and angle to the running direction there, as the paper's plan
/// views have them.
fn polar(sight: &Sight, p: Point3<f64>) -> (f64, f64) {
    let eye = sight.eye();
    let heading = sight
        .map()
        .alignment
        .at(sight.calibration().chainage_m)
        .heading_rad;
    let (sin, cos) = heading.sin_cos();
    let (dx, dy) = (p.x - eye.x, p.y - eye.y);
    let (along, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
    (dx.hypot(dy), left.atan2(along))
}
