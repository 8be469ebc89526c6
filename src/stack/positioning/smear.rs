//! Motion blur: how far a lamp moves in an eye's image while a row is exposed.

use crate::bus::Intrinsics;
use crate::track::LampSite;
use nalgebra::{Isometry3, Point2, Point3, Vector3};

/// Farther off no lamp is large enough in the image to be found.
const LAMPS_WITHIN_M: f64 = 60.0;

/// How far a lamp moves in an eye's image while a row is exposed.
///
/// The paper has V cos(psi) f t / W for a lamp at lateral distance W: the speed across the axis
/// at depth W. Here the depth is that of the lamp's line along the pixel's own ray, which also
/// holds off the axis, and the way is that of its image before and after.
#[derive(Clone, Copy, Debug)]
pub struct LampSmear<'a> {
    /// The eye's lens.
    pub lens: Intrinsics,
    /// Its mount.
    pub vehicle_from_eye: Isometry3<f64>,
    /// Lamps of the map.
    pub lamps: &'a [LampSite],
    /// Where the train takes its head to be.
    pub head_m: Option<f64>,
    /// What the train runs while a row is exposed.
    pub travel_m: f64,
}

impl LampSmear<'_> {
    /// Of a lamp at a pixel, along the row.
    pub fn along_row_px(&self, p: &Point2<f64>) -> f64 {
        let ray = self.lens.ray(p.x, p.y);
        let turn = self.vehicle_from_eye.rotation;
        let in_vehicle = turn * ray;
        let left_m = self.lateral_m(&in_vehicle) - self.vehicle_from_eye.translation.y;
        let z = left_m / in_vehicle.y;
        if !(0.3..60.0).contains(&z) {
            return 0.0;
        }
        let half_way = turn.inverse() * Vector3::x() * (0.5 * self.travel_m);
        let seen = |lamp: Vector3<f64>| Some(self.lens.project(&Point3::from(lamp))?.x);
        let (before, after) = (seen(ray * z + half_way), seen(ray * z - half_way));
        before
            .zip(after)
            .map_or(0.0, |(before, after)| after - before)
    }

    /// Of the lamp that is expected nearest to a ray from the eye; of the first lamp while
    /// the train does not know where it is. The track is taken as straight over the few metres.
    fn lateral_m(&self, ray: &Vector3<f64>) -> f64 {
        let eye = self.vehicle_from_eye.translation.vector;
        let off = |lamp: &LampSite, head_m: f64| {
            let ahead_m = lamp.chainage_m - head_m;
            ray.angle(&(Vector3::new(ahead_m, lamp.lateral_m, lamp.height_m) - eye))
        };
        let nearest = self.head_m.and_then(|head_m| {
            let near = |lamp: &&LampSite| (lamp.chainage_m - head_m).abs() < LAMPS_WITHIN_M;
            (self.lamps.iter().filter(near))
                .min_by(|a, b| off(a, head_m).total_cmp(&off(b, head_m)))
        });
        nearest.or(self.lamps.first()).map_or(0.0, |l| l.lateral_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::RigCalibration;
    use crate::stack::led::testing::{rig, track, wide_rig};

    /// Lamps on the left wall and on a nearer pillar between them, on the other side of the line
    /// first: each pixel of either eye, straight or wide, takes the lamp that is there, and without
    /// a position the first.
    #[test]
    fn smear_is_of_the_lamp_that_is_looked_at() {
        let mut lamps = track("manchester").lamps;
        (lamps[0].lateral_m, lamps[4].lateral_m) = (-2.0, 1.8);
        let head_m = lamps[4].chainage_m - 2.0;
        let (rig, wide) = (rig(), wide_rig());
        let from_right = |rig: &RigCalibration| rig.vehicle_from_left * rig.left_from_right;
        for (lens, vehicle_from_eye) in [
            (rig.left.intrinsics, rig.vehicle_from_left),
            (rig.right.intrinsics, from_right(&rig)),
            (wide.left.intrinsics, wide.vehicle_from_left),
            (wide.right.intrinsics, from_right(&wide)),
        ] {
            let at_px = |lamp: &LampSite, head_m: f64| {
                let seen = Point3::new(lamp.chainage_m - head_m, lamp.lateral_m, lamp.height_m);
                let pixel = lens.project(&vehicle_from_eye.inverse_transform_point(&seen));
                pixel.unwrap_or_else(Point2::origin)
            };
            let smear = |head_m| LampSmear {
                lens,
                vehicle_from_eye,
                lamps: &lamps,
                head_m,
                travel_m: 5e-4,
            };
            for lamp in &lamps[4..6] {
                let seen = at_px(lamp, head_m);
                let moved = at_px(lamp, head_m + 5e-4).x - seen.x;
                let said = smear(Some(head_m)).along_row_px(&seen);
                assert!((said - moved).abs() < 0.02 * moved.abs(), "{said} {moved}");
            }
            let seen = at_px(&lamps[4], head_m);
            assert!(smear(None).along_row_px(&seen).abs() < 1e-12);
        }
    }
}
