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
use super::gauge::{CrossExtent, danger};
use super::sight::{Sight, ends};
use crate::bus::{Blob, DetectedObstacle, LidarReturn, LidarScan, PixelBox};
use nalgebra::{Point2, Point3, Vector2, Vector3};

/// Most depth that an obstacle of unknown depth is given.
const DEPTH_LIMIT_M: f64 = 2.0;
/// A wider gap than this between the ranges of echoes is the shadow between an obstacle and what
/// is behind it.
const DEPTH_GAP_M: f64 = 1.0;

/// Point of an echo in the lidar's own frame.
pub(super) fn lidar_point(echo: &LidarReturn) -> Point3<f64> {
    let (sin_a, cos_a) = echo.azimuth_rad.sin_cos();
    let (sin_w, cos_w) = echo.elevation_rad.sin_cos();
    Point3::new(
        echo.range_m * cos_w * sin_a,
        echo.range_m * cos_w * cos_a,
        echo.range_m * sin_w,
    )
}

/// Places the regions of one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placer<'a> {
    pub settings: &'a WaysideSettings,
    pub sight: &'a Sight,
    pub binary: &'a [u8],
    pub scan: Option<&'a LidarScan>,
}

impl Placer<'_> {
    /// The obstacle that a region shows; `None` where its foot is not on the floor within reach.
    pub fn place(&self, blob: &Blob) -> Option<DetectedObstacle> {
        let sight = self.sight;
        let foot_px = self.foot_column(&blob.bounds);
        // Pixel centres are at integers: the lowest edge is half a pixel further down.
        let foot_row = f64::from(blob.bounds.v1) + 0.5;
        let (front, depth) = match front_and_depth(&self.echoes(&blob.bounds)) {
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
            None => {
                let foot = sight.foot(foot_px, foot_row)?;
                (sight.map().alignment.world_from_track(foot), None)
            }
        };
        let outline = RegionOutline::at(sight, &blob.bounds, foot_px, front)?;
        if outline.width_m.max(outline.height_m) < self.settings.min_size_m {
            return None;
        }
        // Echoes on the top are sparse: the depth that they span is a lower bound.
        let guess = outline.width_m.min(DEPTH_LIMIT_M);
        let depth = depth.map_or(guess, |measured| measured.max(guess));
        Some(self.obstacle(blob, &outline, front, depth))
    }

    fn is_set(&self, u: u32, v: u32) -> bool {
        let width_px = self.sight.calibration().camera.intrinsics.width_px as usize;
        let pixel = self.binary.get(v as usize * width_px + u as usize);
        pixel.is_some_and(|&x| x != 0)
    }

    /// Mean column of the region's pixels in its lowest tenth.
    fn foot_column(&self, b: &PixelBox) -> f64 {
        let rows = ((b.v1 - b.v0) / 10).max(1);
        let (mut sum, mut n) = (0u64, 0u64);
        for v in b.v1.saturating_sub(rows)..=b.v1 {
            for u in (b.u0..=b.u1).filter(|u| self.is_set(*u, v)) {
                sum += u64::from(u);
                n += 1;
            }
        }
        if n == 0 {
            f64::from(b.u0 + b.u1) / 2.0
        } else {
            sum as f64 / n as f64
        }
    }

    /// Horizontal ranges, from the camera, of the echoes on the region's own pixels, in order.
    fn echoes(&self, bounds: &PixelBox) -> Vec<f64> {
        let calibration = self.sight.calibration();
        let (Some(scan), Some(world_from_lidar)) = (self.scan, calibration.world_from_lidar) else {
            return Vec::new();
        };
        let intrinsics = &calibration.camera.intrinsics;
        let camera_from_lidar = calibration.world_from_camera.inv_mul(&world_from_lidar);
        let eye = self.sight.eye();
        let range = |echo: &LidarReturn| {
            let p = lidar_point(echo);
            let seen = intrinsics.project(&(camera_from_lidar * p))?;
            let pixel = Point2::new(seen.x.round(), seen.y.round());
            let hit = bounds.contains(&pixel) && self.is_set(pixel.x as u32, pixel.y as u32);
            let world = world_from_lidar * p;
            hit.then(|| (world.x - eye.x).hypot(world.y - eye.y))
        };
        let mut ranges: Vec<f64> = scan.returns.iter().filter_map(range).collect();
        ranges.sort_unstable_by(f64::total_cmp);
        ranges
    }

    fn obstacle(
        &self,
        blob: &Blob,
        outline: &RegionOutline,
        foot: Point3<f64>,
        depth_m: f64,
    ) -> DetectedObstacle {
        let sight = self.sight;
        let behind = outline.away * depth_m;
        let (left, right) = (outline.left, outline.right);
        let corners = [left, right, left + behind, right + behind];
        let corners = corners.map(|p| sight.track_from_world(&p));
        let (from_chainage_m, to_chainage_m) = ends(corners.iter().map(|p| p.s_m));
        let (right_m, left_m) = ends(corners.iter().map(|p| p.l_m));
        let place = sight.track_from_world(&foot);
        let extent = CrossExtent {
            right_m,
            left_m,
            foot_m: place.l_m,
            top_m: place.h_m + outline.height_m,
        };
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
            width_m: outline.width_m,
            height_m: outline.height_m,
            danger: danger(self.settings, extent),
        }
    }
}

/// Nearest range and depth of the cluster of echoes around the middle one.
fn front_and_depth(ranges: &[f64]) -> Option<(f64, f64)> {
    let middle = ranges.get(ranges.len() / 2)?;
    let mut clusters = ranges.chunk_by(|a, b| b - a <= DEPTH_GAP_M);
    let cluster = clusters.find(|cluster| cluster.last() >= Some(middle))?;
    let (near, far) = (cluster[0], cluster[cluster.len() - 1]);
    (cluster.len() > 1 && near > 0.0).then_some((near, far - near))
}

/// The outline, on an upright plane through the foot across the line of sight.
struct RegionOutline {
    right: Point3<f64>,
    left: Point3<f64>,
    /// Horizontal unit vector away from the camera.
    away: Vector3<f64>,
    width_m: f64,
    height_m: f64,
}

impl RegionOutline {
    fn at(sight: &Sight, b: &PixelBox, foot_px: f64, foot: Point3<f64>) -> Option<Self> {
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
}

/// Range in plan from the device, and angle to the running direction there, as the paper's plan
/// views have them.
fn polar(sight: &Sight, p: Point3<f64>) -> (f64, f64) {
    let eye = sight.eye();
    let device = sight.map().alignment.at(sight.calibration().chainage_m);
    let (sin, cos) = device.heading_rad.sin_cos();
    let (dx, dy) = (p.x - eye.x, p.y - eye.y);
    let (along, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
    (dx.hypot(dy), left.atan2(along))
}
