//! The track as wheelsets meet it: where it lies, how uneven it is, how it gives, how slippery it
//! is.

use super::adhesion::{Adhesion, RailZone};
use super::convert::point;
use super::irregularity::Irregularity;
use super::settings::TrackSettings;
use super::suspension::Axes;
use crate::track::{Alignment, TrackFrame, Tunnel};
use rapier3d_f64::math::Vector;

/// The track for one step.
pub(super) struct Line<'a> {
    pub alignment: &'a Alignment,
    pub irregularity: &'a Irregularity,
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    pub support: (f64, f64),
    adhesion: Adhesion,
    zones: &'a [RailZone],
}

impl<'a> Line<'a> {
    pub(super) fn new(
        tunnel: &'a Tunnel,
        irregularity: &'a Irregularity,
        settings: &'a TrackSettings,
    ) -> Self {
        Self {
            alignment: &tunnel.alignment,
            irregularity,
            support: settings.support(),
            adhesion: settings.rail.adhesion(),
            zones: &settings.rail_zones,
        }
    }

    /// Of the last zone that covers a chainage, or of the line.
    pub(super) fn adhesion_at(&self, s_m: f64) -> Adhesion {
        let mut zones = self.zones.iter().rev();
        let zone = zones.find(|z| (z.from_m..=z.to_m).contains(&s_m));
        zone.map_or(self.adhesion, |z| z.rail.adhesion())
    }
}

/// Origin and axes of the rail plane, as [`TrackFrame::world_from_rails`]: this is the hot path,
/// and needs no quaternion.
pub(super) fn rail_axes(frame: &TrackFrame) -> (Vector, Axes) {
    let (sin, cos) = frame.heading_rad.sin_cos();
    let level = 1.0 / (1.0 + frame.slope * frame.slope).sqrt();
    let rise = frame.slope * level;
    let left = Vector::new(-sin, cos, 0.0);
    let up = Vector::new(-cos * rise, -sin * rise, level);
    let (lean, upright) = frame.roll_rad.sin_cos();
    let axes = Axes {
        x: Vector::new(cos * level, sin * level, rise),
        y: left * upright + up * lean,
        z: up * upright - left * lean,
    };
    (point(frame.origin), axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::physics::convert::vector;
    use nalgebra::{Point3, Vector3};

    /// Fails where the quick axes are not those of the track's own rotation.
    #[test]
    fn axes_are_those_of_the_track() {
        let frame = TrackFrame {
            s_m: 10.0,
            origin: Point3::new(1.0, 2.0, 3.0),
            heading_rad: 2.1,
            slope: -0.03,
            curvature_per_m: 0.0,
            roll_rad: 0.08,
        };
        let (origin, axes) = rail_axes(&frame);
        let want = frame.world_from_rails();
        assert_eq!(origin, point(frame.origin));
        for (axis, along) in [
            (axes.x, Vector3::x()),
            (axes.y, Vector3::y()),
            (axes.z, Vector3::z()),
        ] {
            assert!((axis - vector(want.rotation * along)).length() < 1e-14);
        }
    }
}
