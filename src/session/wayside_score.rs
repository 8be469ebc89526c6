//! Scores of wayside detection: what is reported held against what is there.

use super::presence::Presence;
use super::summary::{Cost, ObstacleScore, Wayside};
use crate::bus::{DangerLevel, DetectedObstacle, SimTime, WaysideReport};
use crate::track::{BED_M, TrackPoint};
use std::collections::BTreeMap;

/// By how much a line of sight to an obstacle's foot may be off: two rows of the lower edge of its
/// region, of some 1/1000 rad each, and 0.1 deg of calibration.
const FOOT_ERROR_RAD: f64 = 2e-3 + 1.75e-3;

/// A region that ends this near to the last row is cut off there; the noise filter takes the rest.
const CUT_ROWS: u32 = 3;

/// Least height of the eye over a thing's lowest point: of what hangs higher, the camera alone
/// cannot tell the place.
const LEAST_HEIGHT_M: f64 = 0.1;

/// Scores wayside detection.
#[derive(Debug)]
pub struct WaysideScore {
    /// Where the camera really is.
    eye: TrackPoint,
    /// Rows of its pictures.
    rows: u32,
    found: BTreeMap<String, Found>,
    false_alarms: u32,
    costs_ms: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Found {
    size_m: f64,
    lay_visible: Option<SimTime>,
    /// When each report of it was given, by one device after the other.
    reported: Vec<SimTime>,
    error_sum_m: f64,
    errors: u32,
}

impl Found {
    fn of(p: &Presence) -> Self {
        Self {
            size_m: p.size_m,
            lay_visible: None,
            reported: Vec::new(),
            error_sum_m: 0.0,
            errors: 0,
        }
    }

    /// When it was first reported, moving or at rest.
    fn first(&self) -> Option<SimTime> {
        self.reported.iter().min().copied()
    }

    /// From lying visible to the first report from then on.
    fn latency_s(&self) -> Option<f64> {
        let lay = self.lay_visible?;
        let first = self.reported.iter().filter(|t| **t >= lay).min()?;
        Some(first.since(lay))
    }
}

impl WaysideScore {
    /// Of a device whose camera is at `eye` and takes pictures of so many rows.
    pub fn new(eye: TrackPoint, rows: u32) -> Self {
        Self {
            eye,
            rows,
            found: BTreeMap::new(),
            false_alarms: 0,
            costs_ms: Vec::new(),
        }
    }

    /// One report, given at `given`, and all that there was at the frame's time.
    pub fn report(
        &mut self,
        report: &WaysideReport,
        given: SimTime,
        cost_ms: f64,
        present: &[Presence],
    ) {
        self.costs_ms.push(cost_ms);
        for p in present.iter().filter(|p| p.obstacle) {
            if let Some(since) = p.lies_in_view_since {
                let found = self.found.entry(p.name.clone());
                let found = found.or_insert_with(|| Found::of(p));
                found.lay_visible.get_or_insert(since);
            }
        }
        // What the device itself calls clear of the gauge is no alarm.
        for seen in (report.obstacles.iter()).filter(|o| o.danger != DangerLevel::None) {
            self.alarm(seen, given, present);
        }
    }

    fn alarm(&mut self, seen: &DetectedObstacle, given: SimTime, present: &[Presence]) {
        let fitting = || present.iter().filter(|p| self.may_be(seen, p));
        let Some(nearest) = fitting().min_by(|a, b| away_m(seen, a).total_cmp(&away_m(seen, b)))
        else {
            self.false_alarms += 1;
            return;
        };
        // Beside a worker nobody can tell which of the two was seen.
        if fitting().any(|p| !p.obstacle) {
            return;
        }
        let found = self.found.entry(nearest.name.clone());
        let found = found.or_insert_with(|| Found::of(nearest));
        found.reported.push(given);
        if nearest.lies_in_view_since.is_some() {
            found.error_sum_m += middle_m(seen) - nearest.chainage_m;
            found.errors += 1;
        }
    }

    /// Whether what was reported overlaps what is there, in the plane of the track, but for the
    /// error that is expected of a camera `height` over the thing's lowest point at that distance:
    /// e `range` across the line of sight, and e `range`^2 / `height` along it, with e of
    /// [`FOOT_ERROR_RAD`].
    ///
    /// It may be nearer to the device than the report says, on the same line of sight in plan: the
    /// ray over the lowest point of a thing in the air meets the bed behind it, at
    /// `range` * (`height` + its foot) / `height`, and of what the picture's lower border cuts, the
    /// foot may be anywhere before.
    fn may_be(&self, seen: &DetectedObstacle, p: &Presence) -> bool {
        // From the device to the nearest part of it: a train is long.
        let nearest_m = (self.eye.s_m).clamp(
            p.chainage_m - p.half_length_m,
            p.chainage_m + p.half_length_m,
        );
        let (ahead_m, left_m) = (nearest_m - self.eye.s_m, p.lateral_m - self.eye.l_m);
        let range_m = ahead_m.hypot(left_m).max(1.0);
        let eye_m = (self.eye.h_m - BED_M).max(1.0);
        let height_m = (eye_m - p.foot_m.max(0.0)).max(LEAST_HEIGHT_M);
        let across_m = FOOT_ERROR_RAD * range_m;
        let along_m = across_m * range_m / height_m.max(1.0);
        let (cos, sin) = (ahead_m.abs() / range_m, left_m.abs() / range_m);
        let half_m = 0.5 * (seen.to_chainage_m - seen.from_chainage_m);
        // Where on the line of sight it comes nearest to what is there, as a share of the way to
        // what was reported (0/0 where both are beside the device: no nearer).
        let cut = seen.blob.bounds.v1 + CUT_ROWS >= self.rows;
        let least = if cut { 0.0 } else { height_m / eye_m };
        let seen_ahead_m = middle_m(seen) - self.eye.s_m;
        let share = (ahead_m / seen_ahead_m).min(1.0).max(least);
        let middle_m = self.eye.s_m + share * seen_ahead_m;
        let lateral_m = self.eye.l_m + share * (seen.lateral_m - self.eye.l_m);
        let gap_s_m = (middle_m - p.chainage_m).abs() - half_m - p.half_length_m;
        let gap_l_m = (lateral_m - p.lateral_m).abs() - 0.5 * seen.width_m - p.half_width_m;
        gap_s_m <= along_m * cos + across_m * sin && gap_l_m <= along_m * sin + across_m * cos
    }

    /// Takes in the scores of another device.
    pub fn add(&mut self, other: Self) {
        for (name, theirs) in other.found {
            let Some(ours) = self.found.get_mut(&name) else {
                self.found.insert(name, theirs);
                continue;
            };
            let lay = [ours.lay_visible, theirs.lay_visible];
            ours.lay_visible = lay.into_iter().flatten().min();
            ours.reported.extend(theirs.reported);
            ours.error_sum_m += theirs.error_sum_m;
            ours.errors += theirs.errors;
        }
        self.false_alarms += other.false_alarms;
        self.costs_ms.extend(other.costs_ms);
    }

    /// The figures.
    pub fn finish(mut self) -> Wayside {
        let score = |(name, f): (String, Found)| ObstacleScore {
            name,
            size_m: f.size_m,
            first_detected_s: f.first().map(SimTime::secs),
            latency_s: f.latency_s(),
            distance_error_m: (f.errors > 0).then(|| f.error_sum_m / f64::from(f.errors)),
        };
        Wayside {
            obstacles: self.found.into_iter().map(score).collect(),
            false_alarms: self.false_alarms,
            ms_per_frame: Cost::of(&mut self.costs_ms),
        }
    }
}

/// Chainage of the middle of what was reported.
fn middle_m(seen: &DetectedObstacle) -> f64 {
    0.5 * (seen.from_chainage_m + seen.to_chainage_m)
}

/// From what was reported to the centre of what is there.
fn away_m(seen: &DetectedObstacle, p: &Presence) -> f64 {
    (middle_m(seen) - p.chainage_m).hypot(seen.lateral_m - p.lateral_m)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::{Blob, PixelBox};
    use nalgebra::Point3;

    /// A camera on the right wall, 2.7 m over the bed, 25 m ahead of the things below.
    fn score() -> WaysideScore {
        let eye = TrackPoint {
            s_m: 125.0,
            l_m: -2.0,
            h_m: 2.7 + BED_M,
        };
        WaysideScore::new(eye, 1080)
    }

    fn lying(name: &str, chainage_m: f64, lateral_m: f64) -> Presence {
        Presence {
            name: name.into(),
            size_m: 0.5,
            chainage_m,
            lateral_m,
            half_length_m: 0.25,
            half_width_m: 0.15,
            foot_m: 0.0,
            lies_in_view_since: Some(SimTime::from_secs(3.0)),
            obstacle: true,
        }
    }

    fn alarm(chainage_m: f64, lateral_m: f64) -> WaysideReport {
        let bounds = PixelBox {
            u0: 0,
            v0: 0,
            u1: 9,
            v1: 9,
        };
        WaysideReport {
            time: SimTime::from_secs(4.0),
            obstacles: vec![DetectedObstacle {
                blob: Blob {
                    bounds,
                    area_px: 100,
                },
                position: Point3::origin(),
                near_range_m: 0.0,
                near_angle_rad: 0.0,
                far_range_m: 0.0,
                far_angle_rad: 0.0,
                from_chainage_m: chainage_m - 0.2,
                to_chainage_m: chainage_m + 0.2,
                lateral_m,
                width_m: 0.4,
                height_m: 0.25,
                danger: DangerLevel::High,
            }],
            ..WaysideReport::default()
        }
    }

    /// Fails where an alarm at the right chainage but beside the thing counts as finding it, or
    /// one within the expected error does not.
    #[test]
    fn alarms_are_matched_in_the_plane_of_the_track() {
        // Expected at 25 m: 0.09 m across, 0.87 m along, beyond the two half sizes.
        for (chainage_m, lateral_m, found) in [
            (100.0, 0.0, true),
            (101.2, 0.0, true),
            (101.6, 0.0, false),
            (100.0, 0.4, true),
            (100.0, 1.0, false),
        ] {
            let mut score = score();
            let given = SimTime::from_secs(4.1);
            score.report(
                &alarm(chainage_m, lateral_m),
                given,
                1.0,
                &[lying("box", 100.0, 0.0)],
            );
            let wayside = score.finish();
            let latency_s = wayside.obstacles[0].latency_s;
            assert_eq!(wayside.false_alarms, u32::from(!found));
            assert_eq!(latency_s.is_some(), found, "{chainage_m} {lateral_m}");
            // From lying visible at 3 s to the report, not to the frame.
            assert!(latency_s.is_none_or(|s| (s - 1.1).abs() < 1e-9));
        }
    }

    /// Fails where a man under the camera, whose feet are not in the picture, is a false alarm, or
    /// one behind what was reported is none.
    #[test]
    fn what_the_border_cuts_is_nearer() {
        // Half way from the report to the eye he is half way to its wall.
        for (chainage_m, lateral_m, v1, false_alarms) in [
            (122.0, -1.0, 1078, 0),
            (122.0, 0.5, 1078, 1),
            (122.0, -1.0, 900, 1),
            (110.0, 0.0, 1078, 1),
        ] {
            let worker = Presence {
                obstacle: false,
                lies_in_view_since: None,
                ..lying("worker", chainage_m, lateral_m)
            };
            let mut score = score();
            let mut report = alarm(119.0, 0.0);
            report.obstacles[0].blob.bounds.v1 = v1;
            score.report(&report, SimTime::from_secs(4.1), 1.0, &[worker]);
            assert_eq!(
                score.finish().false_alarms,
                false_alarms,
                "{chainage_m} {v1}"
            );
        }
    }

    /// Fails where a thing in the air, whose foot is projected behind it, is a false alarm, or where
    /// one on the bed may be as far off.
    #[test]
    fn what_is_in_the_air_is_matched_along_its_line_of_sight() {
        // 1.2 m over the bed, seen from 2.7 m: 25 m * 2.7 / 1.5 = 45 m away, and 0 goes to +1.6 m.
        for (foot_m, chainage_m, lateral_m, false_alarms) in [
            (1.2, 80.0, 1.6, 0),
            // A lidar puts it where it is.
            (1.2, 100.0, 0.0, 0),
            (1.2, 80.0, 0.0, 1),
            (1.2, 72.0, 2.24, 1),
            (1.2, 104.0, -0.32, 1),
            (0.0, 80.0, 1.6, 1),
            // As high as the camera, and above it: the line of sight does not come down.
            (2.7, 50.0, 4.0, 0),
            (3.5, 50.0, 4.0, 0),
            (3.5, 50.0, 0.0, 1),
        ] {
            let falling = Presence {
                foot_m,
                lies_in_view_since: None,
                ..lying("box", 100.0, 0.0)
            };
            let mut score = score();
            let given = SimTime::from_secs(4.1);
            score.report(&alarm(chainage_m, lateral_m), given, 1.0, &[falling]);
            let wayside = score.finish();
            assert_eq!(wayside.false_alarms, false_alarms, "{foot_m} {chainage_m}");
            assert_eq!(wayside.obstacles.len(), 1 - false_alarms as usize);
            if let Some(found) = wayside.obstacles.first() {
                assert_eq!(found.first_detected_s, Some(given.secs()));
                assert_eq!(found.latency_s, None, "it never lay");
                assert_eq!(found.distance_error_m, None);
            }
        }
    }

    /// Fails where the first report of a falling thing is lost, where it counts as latency, where a
    /// report is lost that was given before it was known to be at rest, and where two devices do
    /// not come to the same as one.
    #[test]
    fn latency_runs_from_lying_to_the_next_report() {
        let box_in_the_air = Presence {
            foot_m: 1.2,
            lies_in_view_since: None,
            ..lying("box", 100.0, 0.0)
        };
        let just_down = Presence {
            lies_in_view_since: None,
            ..lying("box", 100.0, 0.0)
        };
        let frames = [
            (2.6, alarm(80.0, 1.6), box_in_the_air),
            (3.2, alarm(100.0, 0.0), just_down),
            (3.5, alarm(100.0, 0.0), lying("box", 100.0, 0.0)),
        ];
        let together = |split: usize| {
            let mut scores = [score(), score()];
            for (k, (given_s, report, box_there)) in frames.iter().enumerate() {
                let given = SimTime::from_secs(*given_s);
                let present = std::slice::from_ref(box_there);
                scores[usize::from(k >= split)].report(report, given, 1.0, present);
            }
            let [mut one, other] = scores;
            one.add(other);
            one.finish()
        };
        for split in 0..=3 {
            let wayside = together(split);
            let found = &wayside.obstacles[0];
            assert_eq!(wayside.false_alarms, 0);
            let first_s = found.first_detected_s.unwrap();
            assert!((first_s - 2.6).abs() < 1e-9, "{split}: {first_s}");
            assert!((found.latency_s.unwrap() - 0.2).abs() < 1e-9, "{split}");
            assert!(found.distance_error_m.unwrap().abs() < 1e-9, "{split}");
        }
    }

    /// Fails where a thing that the device cannot see is held against it, and where one beside a
    /// worker counts as found.
    #[test]
    fn only_what_is_in_view_and_alone_counts() {
        let hidden = Presence {
            lies_in_view_since: None,
            ..lying("hidden", 60.0, 0.0)
        };
        let worker = Presence {
            obstacle: false,
            lies_in_view_since: None,
            ..lying("worker", 100.3, 0.2)
        };
        let mut score = score();
        let given = SimTime::from_secs(4.1);
        let present = [lying("box", 100.0, 0.0), hidden, worker];
        score.report(&alarm(100.0, 0.0), given, 1.0, &present);
        let wayside = score.finish();
        assert_eq!(wayside.obstacles.len(), 1);
        assert_eq!(wayside.obstacles[0].first_detected_s, None);
        assert_eq!(wayside.false_alarms, 0);
    }
}
