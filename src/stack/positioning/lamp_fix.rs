//! From a lamp of known name in front of the rig to a position of the train, with its sigma.

use super::sighting::{Measurement, PairLamps, Sighting};
use crate::bus::{CameraModel, Method, PositionFix};
use crate::stack::led::LampImage;
use crate::track::TrackId;
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// How well a lamp was measured by the rig.
#[derive(Clone, Copy, Debug)]
struct LampAccuracy {
    /// Standard deviation of its distance, as a share of it.
    distance: f64,
    /// Standard deviation of its image, pixels.
    image_px: f64,
}

/// By one eye's image of a lamp.
fn mono_accuracy(lamp: &LampImage) -> Option<LampAccuracy> {
    Some(LampAccuracy {
        distance: lamp.axis_sigma_px / lamp.own_outline?.semi_major_px,
        image_px: lamp.sigma_px,
    })
}

impl Measurement<'_> {
    /// By both eyes.
    pub fn stereo_fix(&self, sighting: &Sighting, lamps: &PairLamps) -> Option<PositionFix> {
        let accuracy = self.stereo_accuracy(sighting, lamps)?;
        self.fix(Method::Stereo, sighting, sighting.stereo?.lamp, accuracy)
    }

    /// Standard deviation of a lamp's place along the line of sight.
    pub fn place_sigma_m(&self, sighting: &Sighting, lamps: &PairLamps) -> Option<f64> {
        let accuracy = match sighting.stereo {
            Some(_) => self.stereo_accuracy(sighting, lamps),
            None => mono_accuracy(&lamps.left[sighting.left]),
        };
        Some(sighting.lamp_in_camera()?.norm() * accuracy?.distance)
    }

    fn stereo_accuracy(&self, sighting: &Sighting, lamps: &PairLamps) -> Option<LampAccuracy> {
        let stereo = sighting.stereo?;
        let (l, r) = (&lamps.left[sighting.left], &lamps.right[sighting.right?]);
        let baseline_mm = 1e3 * self.rig.baseline_m();
        let focal_px = |eye: &CameraModel| eye.intrinsics.fx_px;
        let sigma = (l.sigma_px / focal_px(&self.rig.left))
            .hypot(r.sigma_px / focal_px(&self.rig.right))
            .hypot(self.vergence_sigma(stereo.right_x));
        Some(LampAccuracy {
            distance: (sigma / stereo.disparity)
                .hypot(self.settings.baseline_sigma_mm / baseline_mm),
            image_px: l.sigma_px,
        })
    }

    /// What the right eye's yaw against the left makes of its x at depth 1: x = tan(angle), so
    /// dx = (1 + tan^2) d(angle).
    fn vergence_sigma(&self, right_x: f64) -> f64 {
        (1.0 + right_x * right_x) * self.settings.vergence_sigma_deg.to_radians()
    }

    /// By the left eye alone.
    pub fn mono_fix(&self, sighting: &Sighting, lamps: &PairLamps) -> Option<PositionFix> {
        let accuracy = mono_accuracy(&lamps.left[sighting.left])?;
        self.fix(Method::Mono, sighting, sighting.mono?, accuracy)
    }

    /// Train = lamp - R (lamp in the vehicle's frame).
    fn fix(
        &self,
        method: Method,
        sighting: &Sighting,
        lamp: Vector3<f64>,
        accuracy: LampAccuracy,
    ) -> Option<PositionFix> {
        let (uid, identity) = sighting.named?;
        let site = self.map.lamp(uid)?;
        let line = &self.map.alignment;
        let vehicle = self.rig.vehicle_from_left * Point3::from(lamp);
        let expected = self.reckoning.chainage_m(sighting.time);
        let mut chainage_m = expected.unwrap_or(site.chainage_m - vehicle.x);
        let mut position = site.centre;
        // The attitude depends on the place, weakly: twice is enough.
        for _ in 0..2 {
            let turn = self.reckoning.attitude(sighting.time, chainage_m);
            position = site.centre - turn * vehicle.coords;
            chainage_m = line.track_from_world(&position, chainage_m).s_m;
        }
        let turn = self.reckoning.attitude(sighting.time, chainage_m);
        let heading = line.at(chainage_m).heading_rad;
        let sigma_m = self.sigma_m(&lamp, &vehicle, &turn, heading, accuracy);
        (sigma_m <= self.settings.max_sigma_m).then_some(PositionFix {
            time: sighting.time,
            method,
            track: TrackId::default(),
            chainage_m,
            sigma_m,
            position,
            uid,
            identity,
            lamp_in_camera: lamp,
        })
    }

    /// One sigma along the track, of
    /// - the distance (`accuracy`: what the images scatter by and, of the rig's calibration, what enters
    ///   the disparity),
    /// - the bearing (`accuracy` too),
    /// - the focal length, which scales depths alone, as x = (u - cx) b / d,
    /// - the attitude of the mount,
    /// - the car's attitude,
    /// - the survey.
    fn sigma_m(
        &self,
        lamp: &Vector3<f64>,
        vehicle: &Point3<f64>,
        turn: &UnitQuaternion<f64>,
        heading_rad: f64,
        accuracy: LampAccuracy,
    ) -> f64 {
        let along = Vector3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        let world_from_camera = turn * self.rig.vehicle_from_left.rotation;
        let in_world = world_from_camera * lamp;
        let depth = world_from_camera * Vector3::new(0.0, 0.0, lamp.z);
        let turned_by = |arm: &Vector3<f64>, deg: f64| along.cross(arm).norm() * deg.to_radians();
        let s = self.settings;
        let terms = [
            along.dot(&in_world) * accuracy.distance,
            accuracy.image_px * lamp.z / self.rig.left.intrinsics.fx_px,
            along.dot(&depth) * s.focal_sigma_share,
            turned_by(&in_world, s.mount_sigma_deg),
            turned_by(&(turn * vehicle.coords), s.attitude_sigma_deg),
            s.survey_sigma_m,
        ];
        terms.iter().map(|t| t * t).sum::<f64>().sqrt()
    }
}
