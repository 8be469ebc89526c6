//! A lamp seen in a pair of images: its image in either eye, and where it is in front of the rig.

use super::reckoning::DeadReckoning;
use super::stereo::{Pairing, at_rest, from_size, pinhole, triangulate};
use crate::bus::{Identity, Intrinsics, RigCalibration, SimTime};
use crate::stack::led::{LampImage, LedSettings};
use crate::track::Track;
use crate::track::uid::Uid;
use nalgebra::{Isometry3, Point3, Vector3};

/// Rows of a lamp's two images may miss each other by this, pixels, and by a share of the lamp's
/// height: the two fits of its outline scatter with its size.
const ROW_MISS_PX: f64 = 4.0;
const ROW_MISS_SHARE: f64 = 0.15;

/// The lamps of a pair's images.
#[derive(Debug, Default)]
pub struct PairLamps {
    /// In the left image.
    pub left: Vec<LampImage>,
    /// In the right image.
    pub right: Vec<LampImage>,
}

/// A lamp seen in a pair. Where it is, is given in the left eye's frame, metres.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Index of its image in [`PairLamps::left`].
    pub left: usize,
    /// Index of its image in [`PairLamps::right`].
    pub right: Option<usize>,
    /// Where it is by both images.
    pub stereo: Option<Pairing>,
    /// Where it is by its size in the left image.
    pub mono: Option<Vector3<f64>>,
    /// Mid-exposure of the row of its centre in the left image.
    pub time: SimTime,
    /// Which lamp it is.
    pub named: Option<(Uid, Identity)>,
}

impl Sighting {
    /// Where it is by the better of the two.
    pub fn lamp_in_camera(&self) -> Option<Vector3<f64>> {
        self.stereo.map(|s| s.lamp).or(self.mono)
    }
}

/// What lamps are measured with: the rig, the map, and what is known of the train's motion.
#[derive(Clone, Copy)]
pub struct Measurement<'a> {
    pub settings: &'a LedSettings,
    pub rig: &'a RigCalibration,
    pub map: &'a Track,
    pub reckoning: &'a DeadReckoning,
}

impl Measurement<'_> {
    /// Finds the right eye's image of a lamp and where the lamp is. `starts` are those of the frames,
    /// left and right.
    pub fn sight(&self, starts: [SimTime; 2], lamps: &PairLamps, left: usize) -> Sighting {
        let lamp = &lamps.left[left];
        let height_px = f64::from(lamp.spot.bounds.v1 - lamp.spot.bounds.v0 + 1);
        let row_miss_px = ROW_MISS_PX + ROW_MISS_SHARE * height_px;
        let row_miss = row_miss_px / self.rig.left.intrinsics.fy_px;
        let partner = (lamps.right)
            .iter()
            .enumerate()
            .filter_map(|(r, other)| Some((r, self.pairing(starts, lamp, other)?)))
            .filter(|(_, pairing)| pairing.miss < row_miss)
            .min_by(|a, b| a.1.miss.total_cmp(&b.1.miss));
        let shutter = &self.rig.left.shutter;
        let time = shutter.row_mid(starts[0], lamp.spot.centre.y);
        Sighting {
            left,
            right: partner.map(|p| p.0),
            stereo: partner.map(|p| p.1),
            mono: self.by_size(lamp, time),
            time,
            named: None,
        }
    }

    /// Both eyes' images of a lamp, with what the train runs between their rows. The rows' times
    /// are taken from the images first, then, without their noise, from where the lamp is.
    fn pairing(
        &self,
        starts: [SimTime; 2],
        left: &LampImage,
        right: &LampImage,
    ) -> Option<Pairing> {
        let rig = self.rig;
        let times = |left_row: f64, right_row: f64| {
            let left = rig.left.shutter.row_mid(starts[0], left_row);
            (left, rig.right.shutter.row_mid(starts[1], right_row))
        };
        let (l, r) = (
            line_of_sight(&rig.left.intrinsics, left),
            line_of_sight(&rig.right.intrinsics, right),
        );
        let at_rows = |(now, then)| {
            let left_from_right = self.left_from_right(now, then);
            Some((left_from_right, triangulate(&left_from_right, &l, &r)?))
        };
        let (left_from_right, rough) = at_rows(times(left.spot.centre.y, right.spot.centre.y))?;
        let lamp = Point3::from(rough.lamp);
        let left_row = rig.left.intrinsics.project(&lamp)?.y;
        let seen_right = left_from_right.inverse_transform_point(&lamp);
        let right_row = rig.right.intrinsics.project(&seen_right)?.y;
        Some(at_rows(times(left_row, right_row))?.1)
    }

    /// The right eye at one time in the frame of the left eye at another.
    fn left_from_right(&self, now: SimTime, then: SimTime) -> Isometry3<f64> {
        if now == then {
            return self.rig.left_from_right;
        }
        let mount = self.rig.vehicle_from_left;
        mount.inverse() * self.reckoning.moved(now, then) * mount * self.rig.left_from_right
    }

    /// Where a lamp is by its size in one image.
    fn by_size(&self, lamp: &LampImage, time: SimTime) -> Option<Vector3<f64>> {
        let (camera, outline) = (&self.rig.left, lamp.own_outline?);
        let diameter_m = self.map.lamps.first()?.diameter_m;
        let pinhole = pinhole(&camera.intrinsics);
        let place = |e| from_size(&pinhole, &lamp.centre, e, diameter_m);
        let run = Vector3::x() * self.reckoning.speed_mps(time);
        let velocity = -(self.rig.vehicle_from_left.rotation.inverse() * run);
        place(&at_rest(camera, &outline, &place(&outline)?, &velocity)?)
    }
}

/// Line of sight of a lamp's centre in an eye's frame, at depth 1.
fn line_of_sight(lens: &Intrinsics, lamp: &LampImage) -> Vector3<f64> {
    pinhole(lens).ray(lamp.centre.x, lamp.centre.y)
}
