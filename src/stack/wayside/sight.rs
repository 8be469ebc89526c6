//! Where a pixel's line of sight goes: through which stretch of the structure gauge, and where
//! it meets the track bed.
//!
//! Planes of constant chainage are vertical, so a ray meets the plane of a station at
//! t = n.(o - c) / n.d in closed form. Marching over stations half a metre apart, with straight
//! lines between them, is off by less than 0.2 mm in a curve of 150 m radius.

use super::WaysideSettings;
use crate::bus::{PixelBox, WaysideCalibration};
use crate::numerics::bisected;
use crate::track::{CrossSection, Edge, Track, TrackPoint};
use nalgebra::{Point2, Point3, Vector3};
use std::sync::Arc;

/// A train's headlights are within this of the middle between the rails, across and in height.
const LAMPS_WITHIN_M: f64 = 1.8;
/// Boxes in the picture end here, on the right and below.
const FARTHEST_PX: f64 = 65_535.0;

/// Distance between stations.
const STATION_M: f64 = 0.5;
/// Height of the bed over top of rail where the map has no cross-section: a slab track's.
const DEFAULT_BED_M: f64 = -0.2;
/// A place on the floor is seen where its line of sight meets the floor within so many metres of it along
/// the line.
const FOOT_ERROR_M: f64 = 1.0;
/// Resolution across the track of the tabulated cross-section.
const PROFILE_STEP_M: f64 = 0.02;

/// Lowest and highest points of an outline over l.
#[derive(Clone, Debug, Default)]
struct SectionProfile {
    first_l_m: f64,
    /// Floor and ceiling at each step.
    heights_m: Vec<(f64, f64)>,
}

impl SectionProfile {
    fn new(section: &CrossSection) -> Self {
        let across = section.points.iter().map(|p| p.l_m);
        let (low, high) = ends(across);
        let steps = ((high - low) / PROFILE_STEP_M).floor().clamp(0.0, 5000.0) as usize;
        let middle = |k: usize| low + (k as f64 + 0.5) * PROFILE_STEP_M;
        Self {
            first_l_m: low,
            heights_m: (0..steps)
                .map(|k| Self::extent(section, middle(k)))
                .collect(),
        }
    }

    /// Lowest and highest crossing of the outline with the vertical at `l`.
    fn extent(section: &CrossSection, l: f64) -> (f64, f64) {
        let crossing = |Edge { a, b, .. }: Edge| {
            let h = a.h_m + (b.h_m - a.h_m) * (l - a.l_m) / (b.l_m - a.l_m);
            ((a.l_m <= l) != (b.l_m <= l)).then_some(h)
        };
        let (floor, ceiling) = ends(section.edges().filter_map(crossing));
        (
            floor,
            if section.closed {
                ceiling
            } else {
                f64::INFINITY
            },
        )
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

    /// Whether a point is in the tunnel.
    fn contains(&self, p: TrackPoint) -> bool {
        let room = self.at(p.l_m);
        room.is_some_and(|(floor, ceiling)| p.h_m > floor && p.h_m < ceiling)
    }
}

/// The least and the greatest of some numbers.
pub(super) fn ends(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    })
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
    map: Arc<Track>,
    /// In order of chainage; the device's own station is `here`.
    stations: Vec<Station>,
    here: usize,
    profiles: Vec<SectionProfile>,
    half_width_m: f64,
    top_m: f64,
}

impl Sight {
    pub fn new(
        settings: &WaysideSettings,
        calibration: WaysideCalibration,
        map: Arc<Track>,
    ) -> Self {
        let mut profiles: Vec<SectionProfile> = map
            .sections
            .iter()
            .map(|r| SectionProfile::new(&r.section))
            .collect();
        profiles.push(SectionProfile::default());
        let camera = Point3::from(calibration.world_from_camera.translation.vector);
        let own = map
            .alignment
            .track_from_world(&camera, calibration.chainage_m);
        let here = (settings.reach_m / STATION_M).ceil().clamp(1.0, 2000.0) as usize;
        let stations = (0..=2 * here)
            .map(|k| {
                let s_m = own.s_m + (k as f64 - here as f64) * STATION_M;
                let frame = map.alignment.at(s_m);
                let profile = map
                    .sections
                    .iter()
                    .position(|r| r.from_m <= s_m && s_m < r.to_m)
                    .unwrap_or(profiles.len() - 1);
                Station {
                    s_m,
                    origin: frame.origin,
                    along: frame.ahead(),
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

    pub fn map(&self) -> &Track {
        &self.map
    }

    /// The stretch before the camera, from lower to higher chainage, as far as `reach_m`.
    pub fn watched_m(&self) -> (f64, f64) {
        let here_m = self.stations[self.here].s_m;
        let ahead = self.calibration.world_from_camera * Vector3::z();
        if self.sign(&ahead) > 0.0 {
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

    /// Where the headlights of a train whose head is at a chainage are in the picture, and their mirror image
    /// in a wet bed; `None` behind the camera.
    pub fn lamps_box(&self, s_m: f64) -> Option<PixelBox> {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
        let mut boxes = corners.into_iter().map(|(left, up)| {
            let (l_m, h_m) = (left * LAMPS_WITHIN_M, up * LAMPS_WITHIN_M);
            let pixel = self.pixel_of(TrackPoint { s_m, l_m, h_m })?;
            let [u, v] = [pixel.x, pixel.y].map(|x| x.clamp(0.0, FARTHEST_PX) as u32);
            Some(PixelBox::of_row(v, (u, u)))
        });
        let first = boxes.next()??;
        boxes.try_fold(first, |all, corner| Some(all.joined(&corner?)))
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

    /// Where the floor is seen at a place on the line; `None` outside the picture and behind a wall.
    pub fn floor_pixel(&self, s_m: f64, l_m: f64) -> Option<Point2<f64>> {
        let on_rails = TrackPoint { s_m, l_m, h_m: 0.0 };
        let h_m = self.floor_m(on_rails);
        let pixel = self.pixel_of(TrackPoint { h_m, ..on_rails })?;
        let lens = &self.calibration.camera.intrinsics;
        let foot = lens
            .contains(&pixel)
            .then(|| self.foot(pixel.x, pixel.y))??;
        ((foot.s_m - s_m).abs() <= FOOT_ERROR_M).then_some(pixel)
    }

    /// Where a pixel's line of sight meets the floor first; `None` for a wall, the ceiling, or
    /// beyond reach.
    pub fn foot(&self, u: f64, v: f64) -> Option<TrackPoint> {
        let mut last: Option<(TrackPoint, &SectionProfile)> = None;
        for (p, profile) in self.march(self.direction(u, v)) {
            if profile.contains(p) {
                last = Some((p, profile));
            } else if let Some((before, profile_before)) = last {
                return crossing(before, p, profile_before);
            }
        }
        None
    }

    /// Through which stretch of the structure gauge (widened by the margin for low danger) a
    /// pixel looks.
    pub fn gauge_span(&self, u: f64, v: f64) -> Option<GaugeSpan> {
        let mut seen_m: Vec<f64> = Vec::new();
        let (mut was_inside, mut was_in_gauge) = (false, false);
        let mut steps = 0;
        for (p, profile) in self.march(self.direction(u, v)) {
            let inside = profile.contains(p);
            let in_gauge = p.l_m.abs() <= self.half_width_m && p.h_m <= self.top_m;
            let leaves = was_inside && !inside;
            // The gauge reaches to the floor: the last step counts where it began in it.
            if in_gauge && inside || leaves && (in_gauge || was_in_gauge) {
                seen_m.push(p.s_m);
            }
            if leaves {
                break;
            }
            (was_inside, was_in_gauge) = (was_inside || inside, in_gauge);
            steps += 1;
        }
        // Beyond reach the sight goes on.
        if steps > self.here && was_in_gauge && !seen_m.is_empty() {
            seen_m.push(self.sign(&self.direction(u, v)) * f64::INFINITY);
        }
        let (from_m, to_m) = ends(seen_m.into_iter());
        (from_m <= to_m).then_some(GaugeSpan { from_m, to_m })
    }

    /// 1 for a direction up the line, else -1.
    fn sign(&self, direction: &Vector3<f64>) -> f64 {
        let up_the_line = self.stations[self.here].along.dot(direction) >= 0.0;
        if up_the_line { 1.0 } else { -1.0 }
    }

    /// The points of a ray, station by station away from the device, as far as it goes on along the
    /// line.
    fn march(
        &self,
        direction: Vector3<f64>,
    ) -> impl Iterator<Item = (TrackPoint, &SectionProfile)> {
        let eye = self.eye();
        let up_the_line = self.sign(&direction) > 0.0;
        let mut far = 0.0;
        (0..=self.here).map_while(move |k| {
            let at = if up_the_line {
                self.here + k
            } else {
                self.here - k
            };
            let station = &self.stations[at];
            let across = station.along.dot(&direction);
            let t = match k {
                0 => 0.0,
                _ => station.along.dot(&(station.origin - eye)) / across,
            };
            // The ray turned away from the line (a sharp curve): it left the tunnel before.
            if across.abs() < 1e-9 || t < far {
                return None;
            }
            far = t;
            let p = eye + direction * t - station.origin;
            let point = TrackPoint {
                s_m: station.s_m,
                l_m: p.y * station.along.x - p.x * station.along.y,
                h_m: p.z,
            };
            Some((point, &self.profiles[station.profile]))
        })
    }
}

/// Where the straight way from `a` (inside) to `b` (outside) leaves the tunnel, if it does so
/// through the floor.
fn crossing(a: TrackPoint, b: TrackPoint, profile: &SectionProfile) -> Option<TrackPoint> {
    let at = |x: f64| TrackPoint {
        s_m: a.s_m + (b.s_m - a.s_m) * x,
        l_m: a.l_m + (b.l_m - a.l_m) * x,
        h_m: a.h_m + (b.h_m - a.h_m) * x,
    };
    let (inside, _) = bisected((0.0, 1.0), 30, |x| profile.contains(at(x)));
    let p = at(inside);
    let (floor, _) = profile.at(p.l_m)?;
    // A side wall is left at any height over the floor, the floor only at its own.
    (p.h_m - floor < 0.05).then_some(p)
}
