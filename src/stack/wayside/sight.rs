//! Where a pixel's line of sight goes: through which stretch of the structure gauge, and where
//! it meets the track bed.
//!
//! Planes of constant chainage are vertical, so a ray meets the plane of a station at
//! t = n.(o - c) / n.d in closed form. Marching over stations half a metre apart, with straight
//! lines between them, is off by less than 0.2 mm in a curve of 150 m radius.

use super::WaysideSettings;
use crate::bus::WaysideCalibration;
use crate::track::{CrossSection, TrackPoint, Tunnel};
use nalgebra::{Point2, Point3, Vector3};
use std::sync::Arc;

/// Distance between stations.
const STATION_M: f64 = 0.5;
/// Height of the bed over top of rail where the map has no cross-section: a slab track's.
const DEFAULT_BED_M: f64 = -0.2;
/// Resolution across the track of the tabulated cross-section.
const PROFILE_STEP_M: f64 = 0.02;

/// Lowest and highest points of an outline over l.
#[derive(Clone, Debug)]
struct Profile {
    first_l_m: f64,
    /// Floor and ceiling at each step.
    heights_m: Vec<(f64, f64)>,
}

impl Profile {
    fn new(section: &CrossSection) -> Self {
        let points = &section.points;
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| {
                (a.min(p.l_m), b.max(p.l_m))
            });
        let steps = if high > low {
            ((high - low) / PROFILE_STEP_M).floor().min(5000.0) as usize
        } else {
            0
        };
        let heights_m = (0..steps)
            .map(|k| Self::extent(section, low + (k as f64 + 0.5) * PROFILE_STEP_M))
            .collect();
        Self {
            first_l_m: low,
            heights_m,
        }
    }

    /// Lowest and highest crossing of the outline with the vertical at `l`.
    fn extent(section: &CrossSection, l: f64) -> (f64, f64) {
        let points = &section.points;
        let edges = points.len().saturating_sub(usize::from(!section.closed));
        let mut extent = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..edges {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            if (a.l_m <= l) != (b.l_m <= l) {
                let h = a.h_m + (b.h_m - a.h_m) * (l - a.l_m) / (b.l_m - a.l_m);
                extent = (extent.0.min(h), extent.1.max(h));
            }
        }
        if !section.closed {
            extent.1 = f64::INFINITY;
        }
        extent
    }

    /// Floor and ceiling at `l`; `None` beside the tunnel.
    fn at(&self, l: f64) -> Option<(f64, f64)> {
        if self.heights_m.is_empty() {
            return Some((DEFAULT_BED_M, f64::INFINITY));
        }
        let k = ((l - self.first_l_m) / PROFILE_STEP_M).floor();
        if k < 0.0 {
            return None;
        }
        self.heights_m.get(k as usize).copied()
    }
}

/// The plane of one chainage.
#[derive(Clone, Copy, Debug)]
struct Station {
    s_m: f64,
    origin: Point3<f64>,
    /// Unit vector up the line, in plan.
    along: Vector3<f64>,
    profile: usize,
}

/// Chainages of a line of sight inside the (widened) structure gauge; an end is infinite where
/// the sight goes on beyond the device's reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GaugeSpan {
    pub from_m: f64,
    pub to_m: f64,
}

/// The geometry of one device, ready for ray casts.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    calibration: WaysideCalibration,
    map: Arc<Tunnel>,
    /// In order of chainage; the device's own station is `here`.
    stations: Vec<Station>,
    here: usize,
    profiles: Vec<Profile>,
    half_width_m: f64,
    top_m: f64,
}

impl Sight {
    pub fn new(
        settings: &WaysideSettings,
        calibration: WaysideCalibration,
        map: Arc<Tunnel>,
    ) -> Self {
        let mut profiles: Vec<Profile> = map
            .sections
            .iter()
            .map(|r| Profile::new(&r.section))
            .collect();
        profiles.push(Profile {
            first_l_m: 0.0,
            heights_m: Vec::new(),
        });
        let camera = Point3::from(calibration.world_from_camera.translation.vector);
        let own = map
            .alignment
            .track_from_world(&camera, calibration.chainage_m);
        let here = (settings.reach_m / STATION_M).ceil().clamp(1.0, 2000.0) as usize;
        let stations = (0..=2 * here)
            .map(|k| {
                let s_m = own.s_m + (k as f64 - here as f64) * STATION_M;
                let frame = map.alignment.at(s_m);
                let (sin, cos) = frame.heading_rad.sin_cos();
                let profile = map
                    .sections
                    .iter()
                    .position(|r| r.from_m <= s_m && s_m < r.to_m)
                    .unwrap_or(profiles.len() - 1);
                Station {
                    s_m,
                    origin: frame.origin,
                    along: Vector3::new(cos, sin, 0.0),
                    profile,
                }
            })
            .collect();
        Self {
            calibration,
            map,
            stations,
            here,
            profiles,
            half_width_m: settings.gauge_half_width_m + settings.near_gauge_m,
            top_m: settings.gauge_height_m + settings.near_gauge_m,
        }
    }

    pub fn calibration(&self) -> &WaysideCalibration {
        &self.calibration
    }

    pub fn map(&self) -> &Tunnel {
        &self.map
    }

    /// The stretch before the camera, from lower to higher chainage, as far as `reach_m`.
    pub fn watched_m(&self) -> (f64, f64) {
        let here_m = self.stations[self.here].s_m;
        let ahead = self.calibration.world_from_camera * Vector3::z();
        if self.stations[self.here].along.dot(&ahead) >= 0.0 {
            (here_m, self.stations[2 * self.here].s_m)
        } else {
            (self.stations[0].s_m, here_m)
        }
    }

    /// The camera's centre, world.
    pub fn eye(&self) -> Point3<f64> {
        Point3::from(self.calibration.world_from_camera.translation.vector)
    }

    /// Direction of a pixel, world.
    pub fn direction(&self, u: f64, v: f64) -> Vector3<f64> {
        self.calibration.world_from_camera * self.calibration.camera.intrinsics.ray(u, v)
    }

    /// Where a place on the line is seen; none behind the camera.
    pub fn pixel_of(&self, place: TrackPoint) -> Option<Point2<f64>> {
        let calibration = self.calibration();
        let world = self.map.alignment.world_from_track(place);
        let seen = (calibration.world_from_camera).inverse_transform_point(&world);
        (seen.z > 0.1).then(|| calibration.camera.intrinsics.project(&seen))?
    }

    /// A world point on the line, where it is within the device's surroundings.
    pub fn track_from_world(&self, p: &Point3<f64>) -> TrackPoint {
        self.map
            .alignment
            .track_from_world(p, self.calibration.chainage_m)
    }

    /// Height of the floor (bed, walkway, ...) over top of rail.
    pub fn floor_m(&self, at: TrackPoint) -> f64 {
        let first = self.stations[0].s_m;
        let k = ((at.s_m - first) / STATION_M).round().max(0.0) as usize;
        let station = &self.stations[k.min(self.stations.len() - 1)];
        let floor = self.profiles[station.profile].at(at.l_m);
        floor.map_or(DEFAULT_BED_M, |f| f.0)
    }

    /// Where a pixel's line of sight meets the floor first; `None` for a wall, the ceiling, or
    /// beyond reach.
    pub fn foot(&self, u: f64, v: f64) -> Option<TrackPoint> {
        let mut last: Option<(TrackPoint, &Profile)> = None;
        let mut foot = None;
        self.march(self.direction(u, v), |p, profile| {
            let inside = profile
                .at(p.l_m)
                .is_some_and(|(floor, ceiling)| p.h_m > floor && p.h_m < ceiling);
            if let Some((before, profile_before)) = last
                && !inside
            {
                foot = crossing(before, p, profile_before);
                return false;
            }
            if inside {
                last = Some((p, profile));
            }
            true
        });
        foot
    }

    /// Through which stretch of the structure gauge (widened by the margin for low danger) a
    /// pixel looks.
    pub fn gauge_span(&self, u: f64, v: f64) -> Option<GaugeSpan> {
        let mut span: Option<GaugeSpan> = None;
        let mut was_inside = false;
        let mut at_end = None;
        let complete = self.march(self.direction(u, v), |p, profile| {
            let inside = profile
                .at(p.l_m)
                .is_some_and(|(floor, ceiling)| p.h_m > floor && p.h_m < ceiling);
            let in_gauge = p.l_m.abs() <= self.half_width_m && p.h_m <= self.top_m;
            if was_inside && !inside {
                // The gauge reaches to the floor: the last step counts where it began in it.
                if at_end.is_some() || in_gauge {
                    widen(&mut span, p.s_m);
                }
                return false;
            }
            was_inside |= inside;
            at_end = in_gauge.then_some(p.s_m);
            if in_gauge && inside {
                widen(&mut span, p.s_m);
            }
            true
        });
        if complete && let (Some(span), Some(end)) = (&mut span, at_end) {
            if end > self.calibration.chainage_m {
                span.to_m = f64::INFINITY;
            } else {
                span.from_m = f64::NEG_INFINITY;
            }
        }
        span
    }

    /// Calls `visit` with the points of a ray, station by station away from the device, until it
    /// returns false; true when the ray reached the last station.
    fn march<'a>(
        &'a self,
        direction: Vector3<f64>,
        mut visit: impl FnMut(TrackPoint, &'a Profile) -> bool,
    ) -> bool {
        let eye = self.eye();
        let up_the_line = self.stations[self.here].along.dot(&direction) >= 0.0;
        let mut far = 0.0;
        for k in 0..=self.here {
            let station = &self.stations[if up_the_line {
                self.here + k
            } else {
                self.here - k
            }];
            let across = station.along.dot(&direction);
            if across.abs() < 1e-9 {
                return false;
            }
            let t = if k == 0 {
                0.0
            } else {
                station.along.dot(&(station.origin - eye)) / across
            };
            if t < far {
                // The ray turned away from the line (a sharp curve): it left the tunnel before.
                return false;
            }
            far = t;
            let p = eye + direction * t - station.origin;
            let point = TrackPoint {
                s_m: station.s_m,
                l_m: p.y * station.along.x - p.x * station.along.y,
                h_m: p.z,
            };
            if !visit(point, &self.profiles[station.profile]) {
                return false;
            }
        }
        true
    }
}

fn widen(span: &mut Option<GaugeSpan>, s_m: f64) {
    let old = span.unwrap_or(GaugeSpan {
        from_m: s_m,
        to_m: s_m,
    });
    *span = Some(GaugeSpan {
        from_m: old.from_m.min(s_m),
        to_m: old.to_m.max(s_m),
    });
}

/// Where the straight way from `a` (inside) to `b` (outside) leaves the tunnel, if it does so
/// through the floor.
fn crossing(a: TrackPoint, b: TrackPoint, profile: &Profile) -> Option<TrackPoint> {
    let at = |x: f64| TrackPoint {
        s_m: a.s_m + (b.s_m - a.s_m) * x,
        l_m: a.l_m + (b.l_m - a.l_m) * x,
        h_m: a.h_m + (b.h_m - a.h_m) * x,
    };
    let inside = |p: TrackPoint| {
        profile
            .at(p.l_m)
            .is_some_and(|(floor, ceiling)| p.h_m > floor && p.h_m < ceiling)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let mid = 0.5 * (low + high);
        if inside(at(mid)) {
            low = mid;
        } else {
            high = mid;
        }
    }
    let p = at(low);
    let (floor, _) = profile.at(p.l_m)?;
    // A side wall is left at any height over the floor, the floor only at its own.
    (p.h_m - floor < 0.05).then_some(p)
}
