//! The track as wheelsets of one running direction meet it: where it lies, how uneven it is, how it
//! gives, how slippery it is.
//!
//! A train that runs down the line runs up the reversed line: chainages of its run count from the
//! line's end, and left is the line's right. The rails are the same ones.

use super::adhesion::{Adhesion, RailZone};
use super::defect::Defects;
use super::deviation::Deviation;
use super::irregularity::Irregularity;
use super::settings::TrackSettings;
use super::suspension::Axes;
use crate::track::{Alignment, Direction, Track, TrackFrame};
use rapier3d_f64::math::Vector;
use std::sync::Arc;

/// The rails as they are, by the chainage of the line.
struct TrackCondition {
    irregularity: Irregularity,
    defects: Defects,
    adhesion: Adhesion,
    zones: Vec<RailZone>,
}

/// The track in one direction. Chainages are those of the run in it, where nothing else is said.
#[derive(Clone)]
pub(super) struct DirectedTrack {
    pub direction: Direction,
    /// The tunnel as it is met.
    pub tunnel: Arc<Track>,
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    pub support: (f64, f64),
    condition: Arc<TrackCondition>,
}

impl DirectedTrack {
    /// Up the line.
    pub(super) fn new(
        tunnel: Arc<Track>,
        irregularity: Irregularity,
        settings: &TrackSettings,
    ) -> Self {
        Self {
            direction: Direction::Up,
            tunnel,
            support: settings.support(),
            condition: Arc::new(TrackCondition {
                irregularity,
                defects: Defects::new(&settings.defects),
                adhesion: settings.rail.adhesion(),
                zones: settings.rail_zones.clone(),
            }),
        }
    }

    /// The same track in the other direction.
    pub(super) fn reversed(&self) -> Self {
        Self {
            direction: self.direction.reversed(),
            tunnel: Arc::new(self.tunnel.reversed()),
            ..self.clone()
        }
    }

    pub(super) fn alignment(&self) -> &Alignment {
        &self.tunnel.alignment
    }

    /// The chainage of the run at one of the line, and the other way round.
    pub(super) fn turned_m(&self, s_m: f64) -> f64 {
        match self.direction {
            Direction::Up => s_m,
            Direction::Down => self.alignment().length_m() - s_m,
        }
    }

    /// How far the rails lie off their designed place.
    pub(super) fn deviation_at(&self, s_m: f64) -> Deviation {
        let line_m = self.turned_m(s_m);
        let mut deviation = self.condition.irregularity.at(line_m);
        self.condition.defects.add(line_m, &mut deviation);
        match self.direction {
            Direction::Up => deviation,
            Direction::Down => deviation.reversed(),
        }
    }

    /// Of the last zone that covers a chainage, or of the line.
    pub(super) fn adhesion_at(&self, s_m: f64) -> Adhesion {
        let line_m = self.turned_m(s_m);
        let mut zones = self.condition.zones.iter().rev();
        let zone = zones.find(|z| (z.from_m..=z.to_m).contains(&line_m));
        zone.map_or(self.condition.adhesion, |z| z.rail.adhesion())
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
    (frame.origin.into(), axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::PlanElement;
    use crate::twin::physics::testing::line;
    use crate::twin::physics::{
        DefectSettings, DefectShape, IrregularityClass, IrregularitySettings, RailSide, RailState,
    };
    use nalgebra::{Point3, Vector3};

    /// A canted curve on a grade, uneven, with a dip in its left rail and a slippery stretch.
    fn track() -> DirectedTrack {
        let dip = DefectShape::Dip {
            depth_m: 0.004,
            half_length_m: 0.5,
        };
        let settings = TrackSettings {
            irregularity: IrregularitySettings {
                class: IrregularityClass::Fra4,
                ..IrregularitySettings::default()
            },
            defects: vec![DefectSettings {
                shape: dip,
                chainage_m: 100.0,
                side: RailSide::Left,
                every_m: Some(1.7),
                count: 100,
            }],
            rail_zones: vec![RailZone {
                from_m: 50.0,
                to_m: 120.0,
                rail: RailState::Wet,
            }],
            ..TrackSettings::default()
        };
        let tunnel = line(&[PlanElement::arc(400.0, 1.0 / 300.0, 0.1)], 0.02);
        let irregularity = Irregularity::new(&settings.irregularity, 400.0, 1, 0);
        DirectedTrack::new(tunnel, irregularity, &settings)
    }

    /// Middle of a rail's head: 1 for the left one, -1 for the right one.
    fn rail(track: &DirectedTrack, s_m: f64, side: f64) -> Vector {
        let (origin, axes) = rail_axes(&track.alignment().at(s_m));
        let d = track.deviation_at(s_m);
        let across = axes.y * d.roll_rad.cos() + axes.z * d.roll_rad.sin();
        let middle = origin + axes.y * d.left_m + axes.z * d.up_m;
        middle + across * (side * (0.75 + 0.5 * d.gauge_m))
    }

    /// Fails where one who runs down the line does not meet the same rails: a rail elsewhere, its way
    /// not the derivative of its place, or another slipperiness.
    #[test]
    fn both_directions_meet_the_same_rails() {
        let (up, down) = (track(), track().reversed());
        assert_eq!(down.direction, Direction::Down);
        for k in 0..1000 {
            let s_m = 400.0 * (0.618_034 * f64::from(k)).fract();
            let t_m = down.turned_m(s_m);
            for side in [1.0, -1.0] {
                let off = rail(&up, s_m, side) - rail(&down, t_m, -side);
                assert!(off.length() < 1e-9, "{s_m}: {off:?}");
            }
            let h = 1e-6;
            let (a, d, b) = (
                down.deviation_at(t_m - h),
                down.deviation_at(t_m),
                down.deviation_at(t_m + h),
            );
            for (a, b, per_m) in [
                (a.up_m, b.up_m, d.up_per_m),
                (a.left_m, b.left_m, d.left_per_m),
                (a.roll_rad, b.roll_rad, d.roll_rad_per_m),
                (a.gauge_m, b.gauge_m, d.gauge_per_m),
            ] {
                assert!(((b - a) / (2.0 * h) - per_m).abs() < 1e-6, "{s_m}: {per_m}");
            }
            assert_eq!(up.adhesion_at(s_m), down.adhesion_at(t_m));
        }
        assert_ne!(down.adhesion_at(300.0), down.adhesion_at(200.0));
    }

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
        assert_eq!(origin, Vector::from(frame.origin));
        for (axis, along) in [
            (axes.x, Vector3::x()),
            (axes.y, Vector3::y()),
            (axes.z, Vector3::z()),
        ] {
            assert!((axis - Vector::from(want.rotation * along)).length() < 1e-14);
        }
    }
}
