//! The track as the wheelsets of a train meet it on its route: where it lies, how uneven it is, how it gives, how
//! slippery it is.
//!
//! Distances are those along the route. A train that runs down a track has its left rail on the track's right. The
//! rails are the same ones for all trains.

use super::adhesion::{Adhesion, RailZone};
use super::defect::Defects;
use super::deviation::Deviation;
use super::irregularity::Irregularity;
use super::settings::TrackSettings;
use super::suspension::Axes;
use crate::track::network::{Beyond, Network, Route, TrackEnd};
use crate::track::{Alignment, Direction, Place, Track, TrackFrame, TrackId};
use crate::twin::random::branch;
use rapier3d_f64::math::Vector;
use std::f64::consts::PI;
use std::sync::Arc;

/// So far from where tracks meet the rails lie as designed: a random course would have a step there.
const FADE_M: f64 = 20.0;

/// The rails of a track as they are, by its chainage.
struct TrackCondition {
    irregularity: Irregularity,
    defects: Defects,
    zones: Vec<RailZone>,
    length_m: f64,
    /// Other tracks meet its lower and its upper end.
    joined: [bool; 2],
}

impl TrackCondition {
    /// Of track `k`.
    fn new(network: &Network, k: usize, settings: &TrackSettings, [seed, index]: [u64; 2]) -> Self {
        let track = &network.tracks[k];
        // The first track has the stream that the only one has.
        let seed = if k == 0 {
            seed
        } else {
            branch(seed, &track.name)
        };
        let length_m = track.alignment.length_m();
        let is_here = |name: &Option<String>| match name {
            Some(name) => *name == track.name,
            None => k == 0,
        };
        let defects = settings.defects.iter().filter(|d| is_here(&d.track));
        let zones = settings
            .rail_zones
            .iter()
            .filter(|zone| is_here(&zone.track));
        let joined = [Direction::Down, Direction::Up].map(|way| {
            let track = TrackId(k as u16);
            let beyond = network.beyond(TrackEnd { track, way });
            !matches!(beyond, Beyond::Buffer | Beyond::Open)
        });
        Self {
            irregularity: Irregularity::new(&settings.irregularity, length_m, seed, index),
            defects: Defects::new(&defects.cloned().collect::<Vec<_>>()),
            zones: zones.cloned().collect(),
            length_m,
            joined,
        }
    }

    /// Share of the irregularity that is there, and how it grows up the track.
    fn share(&self, s_m: f64) -> (f64, f64) {
        let whole = (1.0, 0.0);
        let [below, above] = self.joined;
        let (low, low_per_m) = if below { fade(s_m) } else { whole };
        let (high, high_per_m) = if above {
            fade(self.length_m - s_m)
        } else {
            whole
        };
        (low * high, low_per_m * high - low * high_per_m)
    }

    fn deviation_at(&self, s_m: f64) -> Deviation {
        let (share, share_per_m) = self.share(s_m);
        let mut deviation = self.irregularity.at(s_m);
        if share < 1.0 {
            deviation = deviation.shared(share, share_per_m);
        }
        self.defects.add(s_m, &mut deviation);
        deviation
    }
}

/// From 0 where tracks meet to 1, without a kink at either end; and its growth.
fn fade(away_m: f64) -> (f64, f64) {
    let x = PI * (away_m / FADE_M).clamp(0.0, 1.0);
    (0.5 - 0.5 * x.cos(), 0.5 * PI / FADE_M * x.sin())
}

/// The rails of all tracks.
pub(super) struct Rails {
    conditions: Vec<TrackCondition>,
    adhesion: Adhesion,
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    support: (f64, f64),
}

impl Rails {
    /// Everything random in them depends on seed and run index.
    pub(super) fn new(network: &Network, settings: &TrackSettings, run: [u64; 2]) -> Self {
        let tracks = 0..network.tracks.len();
        Self {
            conditions: tracks
                .map(|k| TrackCondition::new(network, k, settings, run))
                .collect(),
            adhesion: settings.rail.adhesion(),
            support: settings.support(),
        }
    }
}

/// The track along a route.
#[derive(Clone)]
pub(super) struct RouteTrack {
    pub route: Route,
    /// As it is met.
    pub track: Arc<Track>,
    /// Stiffness (N/m) and damping (N s/m) of a rail under a wheel.
    pub support: (f64, f64),
    rails: Arc<Rails>,
}

impl RouteTrack {
    pub(super) fn new(network: &Network, route: Route, rails: Arc<Rails>) -> Self {
        Self {
            track: network.along(&route),
            route,
            support: rails.support,
            rails,
        }
    }

    pub(super) fn alignment(&self) -> &Alignment {
        &self.track.alignment
    }

    /// The place at a distance along the route, the way that it is run there, and the rails of its track.
    fn rails_at(&self, run_m: f64) -> (Place, Direction, &TrackCondition) {
        let (place, direction) = self.route.place(run_m);
        let condition = &self.rails.conditions[usize::from(place.track.0)];
        (place, direction, condition)
    }

    /// How far the rails lie off their designed place.
    pub(super) fn deviation_at(&self, run_m: f64) -> Deviation {
        let (place, direction, rails) = self.rails_at(run_m);
        let deviation = rails.deviation_at(place.s_m);
        match direction {
            Direction::Up => deviation,
            Direction::Down => deviation.reversed(),
        }
    }

    /// Of the last zone that covers a place, or of the line.
    pub(super) fn adhesion_at(&self, run_m: f64) -> Adhesion {
        let (place, _, rails) = self.rails_at(run_m);
        let mut zones = rails.zones.iter().rev();
        let zone = zones.find(|z| (z.from_m..=z.to_m).contains(&place.s_m));
        zone.map_or(self.rails.adhesion, |z| z.rail.adhesion())
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
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::{PlanElement, Tunnel};
    use crate::twin::physics::testing::line;
    use crate::twin::physics::{
        DefectSettings, DefectShape, IrregularityClass, IrregularitySettings, RailSide, RailState,
    };
    use nalgebra::{Point3, Vector3};

    /// Up and down a canted curve on a grade, uneven, with a dip in its left rail and a slippery stretch.
    fn tracks() -> [RouteTrack; 2] {
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
                track: None,
                every_m: Some(1.7),
                count: 100,
            }],
            rail_zones: vec![RailZone {
                from_m: 50.0,
                to_m: 120.0,
                rail: RailState::Wet,
                track: None,
            }],
            ..TrackSettings::default()
        };
        let tunnel = line(&[PlanElement::arc(400.0, 1.0 / 300.0, 0.1)], 0.02);
        let network = &tunnel.network;
        let rails = Arc::new(Rails::new(network, &settings, [1, 0]));
        [Direction::Up, Direction::Down].map(|direction| {
            let route = network.only_track(direction).unwrap();
            RouteTrack::new(network, route, rails.clone())
        })
    }

    /// Middle of a rail's head: 1 for the left one, -1 for the right one.
    fn rail(track: &RouteTrack, s_m: f64, side: f64) -> Vector {
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
        let [up, down] = tracks();
        for k in 0..1000 {
            let s_m = 400.0 * (0.618_034 * f64::from(k)).fract();
            let t_m = 400.0 - s_m;
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

    /// Provokes: a step or a kink of the rails where tracks meet, or growth that is not that of the course.
    #[test]
    fn rails_lie_as_designed_where_tracks_meet() {
        let text = include_str!("../../../tunnels/terminus.toml");
        let network = Tunnel::from_toml(text).unwrap().network;
        let settings = TrackSettings {
            irregularity: IrregularitySettings {
                class: IrregularityClass::GermanHigh,
                ..IrregularitySettings::default()
            },
            ..TrackSettings::default()
        };
        let rails = Arc::new(Rails::new(&network, &settings, [1, 0]));
        let place = |name: &str, s_m| Place {
            track: network.named(name).unwrap(),
            s_m,
        };
        let start = (place("depot 3", 100.0), Direction::Down);
        let it = network
            .itinerary(start, &[], Some(place("d1", 50.0)), 100.0)
            .unwrap();
        let track = RouteTrack::new(&network, it.route, rails);
        let (mut before, mut largest_m) = (None::<(f64, f64)>, 0.0_f64);
        let step_m = 0.01;
        for k in 0..(track.alignment().length_m() / step_m) as u32 {
            let d = track.deviation_at(step_m * f64::from(k));
            largest_m = largest_m.max(d.up_m.abs());
            if let Some((up_m, up_per_m)) = before {
                let grown_m: f64 = d.up_m - up_m;
                let expected_m = 0.5 * (d.up_per_m + up_per_m) * step_m;
                assert!(
                    (grown_m - expected_m).abs() < 1e-6,
                    "{k}: {grown_m} {expected_m}"
                );
            }
            before = Some((d.up_m, d.up_per_m));
        }
        assert!(largest_m > 3e-3, "{largest_m}");
    }
}
