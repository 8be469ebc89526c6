//! The recent past of the vehicle frame, for rolling shutters: each image row asks for the pose
//! at its own time.

use crate::bus::SimTime;
use nalgebra::{Isometry3, Translation3, Vector3};
use std::collections::VecDeque;

/// Motion of the vehicle frame at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleMotion {
    /// When.
    pub time: SimTime,
    /// Where it is.
    pub world_from_vehicle: Isometry3<f64>,
    /// Velocity of its origin, world.
    pub velocity_mps: Vector3<f64>,
    /// Turn rate, world.
    pub angular_rad_s: Vector3<f64>,
}

impl VehicleMotion {
    /// Velocity of a point of the vehicle frame, world.
    pub fn velocity_at(&self, in_vehicle_m: &Vector3<f64>) -> Vector3<f64> {
        let arm = self.world_from_vehicle.rotation * in_vehicle_m;
        self.velocity_mps + self.angular_rad_s.cross(&arm)
    }
}

/// A ring of motions at equal steps.
#[derive(Clone, Debug)]
pub(super) struct MotionHistory {
    ring: VecDeque<VehicleMotion>,
    capacity: usize,
}

impl MotionHistory {
    pub(super) fn new(steps: usize) -> Self {
        let capacity = steps.max(2);
        Self {
            ring: VecDeque::with_capacity(capacity),
            capacity,
        }
    }

    pub(super) fn push(&mut self, motion: VehicleMotion) {
        if self.ring.len() == self.capacity {
            self.ring.pop_front();
        }
        self.ring.push_back(motion);
    }

    pub(super) fn latest(&self) -> Option<&VehicleMotion> {
        self.ring.back()
    }

    /// Pose at a time inside the ring: position by the cubic through the positions and velocities
    /// at both ends of its step, attitude by the shortest turn between them.
    pub(super) fn at(&self, time: SimTime) -> Option<Isometry3<f64>> {
        let after = self.ring.partition_point(|m| m.time < time);
        let b = self.ring.get(after)?;
        if b.time == time {
            return Some(b.world_from_vehicle);
        }
        let a = self.ring.get(after.checked_sub(1)?)?;
        let span = b.time.since(a.time);
        let t = time.since(a.time) / span;
        let (pa, pb) = (&a.world_from_vehicle, &b.world_from_vehicle);
        let chord = pb.translation.vector - pa.translation.vector;
        let (va, vb) = (a.velocity_mps * span, b.velocity_mps * span);
        let step = va * (t * (1.0 - t).powi(2))
            + chord * (t * t * (3.0 - 2.0 * t))
            + vb * (t * t * (t - 1.0));
        Some(Isometry3::from_parts(
            Translation3::from(pa.translation.vector + step),
            pa.rotation.slerp(&pb.rotation, t),
        ))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]
    use super::*;
    use nalgebra::UnitQuaternion;

    /// A shake harder than any train's: 5 mm at 8 Hz across, 2 mrad at 6 Hz, at 100 km/h.
    fn shaken(nanos: i64) -> VehicleMotion {
        let time = SimTime::from_nanos(nanos);
        let t = time.secs();
        let (w, u) = (50.0, 38.0);
        VehicleMotion {
            time,
            world_from_vehicle: Isometry3::from_parts(
                Translation3::new(27.8 * t, 0.005 * (w * t).sin(), 0.0),
                UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.002 * (u * t).sin(), 0.0)),
            ),
            velocity_mps: Vector3::new(27.8, 0.005 * w * (w * t).cos(), 0.0),
            angular_rad_s: Vector3::new(0.0, 0.002 * u * (u * t).cos(), 0.0),
        }
    }

    /// A wrong Hermite basis or a slip by one step shows at once: a step is 28 mm.
    #[test]
    fn interpolation_error() {
        let mut history = MotionHistory::new(300);
        for k in 0..500 {
            history.push(shaken(k * 1_000_000));
        }
        let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
        for nanos in (210_000_000..499_000_000).step_by(37_013) {
            let (got, want) = (
                history.at(SimTime::from_nanos(nanos)).unwrap(),
                shaken(nanos),
            );
            let want = want.world_from_vehicle;
            worst_m = worst_m.max((got.translation.vector - want.translation.vector).norm());
            worst_rad = worst_rad.max(got.rotation.angle_to(&want.rotation));
        }
        assert!(worst_m < 1e-9, "{worst_m} m");
        // h^2/8 times the turn acceleration of 2.9 rad/s^2.
        assert!(worst_rad < 0.5e-6, "{worst_rad} rad");
    }

    /// Nothing is said of times outside the ring, and its ends are exact.
    #[test]
    fn ends_of_the_ring() {
        let mut history = MotionHistory::new(10);
        for k in 0..25 {
            history.push(shaken(k * 1_000_000));
        }
        let at = |nanos| history.at(SimTime::from_nanos(nanos));
        assert_eq!(at(15_000_000), Some(shaken(15_000_000).world_from_vehicle));
        assert_eq!(at(24_000_000), Some(shaken(24_000_000).world_from_vehicle));
        assert_eq!(at(14_999_999), None);
        assert_eq!(at(24_000_001), None);
    }
}
