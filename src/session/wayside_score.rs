//! Scores of wayside detection: what is reported held against what is there, in the picture and by place.
//!
//! In the picture, a report is of the thing whose outline has the most in common with its region, over
//! what either covers, if that is half of the smaller one and a tenth of what either covers at least; a
//! report of none is a false alarm. Where the report puts the thing does not matter, so that the error of
//! its place is that of every report. By place, a report is right where its middle is at most [`ALONG_M`]
//! and [`ACROSS_M`] from the thing, and it is longer and wider than the thing by no more than twice that;
//! the picture does not matter. Neither depends on a setting of the detector, and a report of more is not
//! right more easily.

use super::cost_tally::CostTally;
use super::image_box::ImageBox;
use super::presence::Presence;
use super::summary::{ObstacleScore, Wayside};
use crate::bus::{DangerLevel, DetectedObstacle, SimTime, WaysideReport};
use std::collections::BTreeMap;

/// What region and outline have in common is at least so much of the smaller one: a detector may see a
/// part of a thing, or its shadow with it.
const LEAST_COMMON: f64 = 0.5;
/// And so much of what either covers: a region that is much larger than a thing does not say where it is. A
/// rectangle around a thing, a shadow as wide beside it and a reflection as high below it covers four times
/// as much as the thing, and about twice that where the thing is so small that its blurred border counts.
const LEAST_OVER_UNION: f64 = 0.1;

/// A place is right within so much along the line: the train's authority ends 25 m before an obstacle,
/// and a tenth of that does not matter.
const ALONG_M: f64 = 2.5;
/// And across: in the gauge or beside it.
const ACROSS_M: f64 = 0.5;

/// Scores wayside detection.
#[derive(Debug, Default)]
pub struct WaysideScore {
    found: BTreeMap<String, Found>,
    false_alarms: u32,
    misplaced: u32,
    costs: CostTally,
}

#[derive(Clone, Debug)]
struct Found {
    size_m: f64,
    lay_visible: Option<SimTime>,
    /// When each report of it was given, by one device after the other.
    reported: Vec<SimTime>,
    /// When each report of its place was.
    placed: Vec<SimTime>,
    /// Of its place along the line, without sign, by all reports of it at rest.
    error_sum_m: f64,
    errors: u32,
}

impl Found {
    fn of(p: &Presence) -> Self {
        Self {
            size_m: p.size_m,
            lay_visible: None,
            reported: Vec::new(),
            placed: Vec::new(),
            error_sum_m: 0.0,
            errors: 0,
        }
    }

    /// From lying visible to the first of some reports from then on.
    fn latency_s(&self, reports: &[SimTime]) -> Option<f64> {
        let lay = self.lay_visible?;
        let first = reports.iter().filter(|t| **t >= lay).min()?;
        Some(first.since(lay))
    }
}

impl WaysideScore {
    /// One report, given at `given`, and all that there was at the frame's time.
    pub fn report(
        &mut self,
        report: &WaysideReport,
        given: SimTime,
        cost_ms: f64,
        present: &[Presence],
    ) {
        self.costs.add(cost_ms);
        for p in present.iter().filter(|p| p.obstacle) {
            if let Some(since) = p.lies_in_view_since {
                self.found(p).lay_visible.get_or_insert(since);
            }
        }
        // What the device itself calls clear of the gauge is no alarm.
        for seen in (report.obstacles.iter()).filter(|o| o.danger != DangerLevel::None) {
            self.in_picture(seen, given, present);
            self.by_place(seen, given, present);
        }
    }

    fn found(&mut self, p: &Presence) -> &mut Found {
        let found = self.found.entry(p.name.clone());
        found.or_insert_with(|| Found::of(p))
    }

    fn in_picture(&mut self, seen: &DetectedObstacle, given: SimTime, present: &[Presence]) {
        let region = ImageBox::from(&seen.blob.bounds);
        let image_boxes = present
            .iter()
            .flat_map(|p| p.image_boxes.iter().map(move |o| (p, o)));
        let fitting = image_boxes.filter(|(_, o)| fits(&region, o));
        let best = fitting.max_by(|(_, a), (_, b)| {
            let [a, b] = [a, b].map(|o| region.over_union(o));
            a.total_cmp(&b)
        });
        match best {
            None => self.false_alarms += 1,
            Some((p, _)) if p.obstacle => {
                let found = self.found(p);
                found.reported.push(given);
                if p.lies_in_view_since.is_some() {
                    found.error_sum_m += (middle_m(seen) - p.chainage_m).abs();
                    found.errors += 1;
                }
            }
            Some(_) => {}
        }
    }

    fn by_place(&mut self, seen: &DetectedObstacle, given: SimTime, present: &[Presence]) {
        let there = present.iter().filter(|p| is_there(seen, p));
        let nearest = there.min_by(|a, b| away_m(seen, a).total_cmp(&away_m(seen, b)));
        match nearest {
            None => self.misplaced += 1,
            Some(p) if p.obstacle => self.found(p).placed.push(given),
            Some(_) => {}
        }
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
            ours.placed.extend(theirs.placed);
            ours.error_sum_m += theirs.error_sum_m;
            ours.errors += theirs.errors;
        }
        self.false_alarms += other.false_alarms;
        self.misplaced += other.misplaced;
        self.costs.add_all(&other.costs);
    }

    /// The figures.
    pub fn finish(self) -> Wayside {
        let score = |(name, f): (String, Found)| ObstacleScore {
            name,
            size_m: f.size_m,
            first_detected_s: f.reported.iter().min().map(|t| t.secs()),
            latency_s: f.latency_s(&f.reported),
            placed_latency_s: f.latency_s(&f.placed),
            distance_error_m: (f.errors > 0).then(|| f.error_sum_m / f64::from(f.errors)),
        };
        Wayside {
            obstacles: self.found.into_iter().map(score).collect(),
            false_alarms: self.false_alarms,
            misplaced_alarms: self.misplaced,
            ms_per_frame: self.costs.cost(),
        }
    }
}

/// Whether a region can be of what has this outline.
fn fits(region: &ImageBox, outline: &ImageBox) -> bool {
    region.over_smaller(outline) >= LEAST_COMMON && region.over_union(outline) >= LEAST_OVER_UNION
}

/// Chainage of the middle of what was reported.
fn middle_m(seen: &DetectedObstacle) -> f64 {
    0.5 * (seen.from_chainage_m + seen.to_chainage_m)
}

/// From what was reported to the centre of what is there.
fn away_m(seen: &DetectedObstacle, p: &Presence) -> f64 {
    (middle_m(seen) - p.chainage_m).hypot(seen.lateral_m - p.lateral_m)
}

/// Whether what was reported is where this is: its middle within what this covers and the tolerance, and
/// itself no larger than that. A report that is larger does not say where.
fn is_there(seen: &DetectedObstacle, p: &Presence) -> bool {
    let length_m = seen.to_chainage_m - seen.from_chainage_m;
    let (along_m, across_m) = (p.half_length_m + ALONG_M, p.half_width_m + ACROSS_M);
    (middle_m(seen) - p.chainage_m).abs() <= along_m
        && (seen.lateral_m - p.lateral_m).abs() <= across_m
        && 0.5 * length_m.abs() <= along_m
        && 0.5 * seen.width_m.abs() <= across_m
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::bus::{Blob, PixelBox};
    use nalgebra::Point3;

    /// A thing of half a metre at a chainage, whose outline in the picture begins at a column.
    fn lying(name: &str, chainage_m: f64, left_px: f64) -> Presence {
        Presence {
            name: name.into(),
            size_m: 0.5,
            chainage_m,
            lateral_m: 0.0,
            half_length_m: 0.25,
            half_width_m: 0.15,
            image_boxes: vec![ImageBox {
                sides_px: [left_px, 0.0, left_px + 10.0, 10.0],
            }],
            lies_in_view_since: Some(SimTime::from_secs(3.0)),
            obstacle: true,
        }
    }

    fn worker(chainage_m: f64, sides_px: [f64; 4]) -> Presence {
        Presence {
            obstacle: false,
            lies_in_view_since: None,
            image_boxes: vec![ImageBox { sides_px }],
            ..lying("worker", chainage_m, 0.0)
        }
    }

    /// A report of a region of 10 x 10 pixels.
    fn alarm(chainage_m: f64, lateral_m: f64, u0: u32) -> WaysideReport {
        let bounds = PixelBox {
            u0,
            v0: 0,
            u1: u0 + 9,
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

    fn scored(reports: &[(f64, WaysideReport)], present: &[Presence]) -> Wayside {
        let mut score = WaysideScore::default();
        for (given_s, report) in reports {
            score.report(report, SimTime::from_secs(*given_s), 1.0, present);
        }
        score.finish()
    }

    /// A report of the right pixels counts as seen wherever it puts the thing, with that error; one of the
    /// right place counts as placed whatever its pixels are. One of neither is false twice.
    #[test]
    fn picture_and_place_are_scored_apart() {
        for (chainage_m, lateral_m, u0, seen, placed) in [
            (100.0, 0.0, 200, true, true),
            (109.0, 0.0, 200, true, false),
            (100.0, 1.0, 204, true, false),
            (102.7, 0.0, 206, false, true),
            (102.8, 0.0, 206, false, false),
            (97.3, 0.6, 100, false, true),
            (97.3, 0.7, 100, false, false),
        ] {
            let alarm = alarm(chainage_m, lateral_m, u0);
            let wayside = scored(&[(4.1, alarm)], &[lying("box", 100.0, 200.0)]);
            let found = &wayside.obstacles[0];
            let case = format!("{chainage_m} {lateral_m} {u0}");
            assert_eq!(found.latency_s.is_some(), seen, "{case}");
            assert_eq!(found.placed_latency_s.is_some(), placed, "{case}");
            assert_eq!(wayside.false_alarms, u32::from(!seen), "{case}");
            assert_eq!(wayside.misplaced_alarms, u32::from(!placed), "{case}");
            if let Some(error_m) = found.distance_error_m {
                assert!(
                    (error_m - (chainage_m - 100.0f64).abs()).abs() < 1e-9,
                    "{case}"
                );
            }
            // From lying visible at 3 s to the report, not to the frame.
            assert!(found.latency_s.is_none_or(|s| (s - 1.1).abs() < 1e-9));
        }
    }

    /// A report of the whole picture, of a stretch of kilometres, or of all of the tunnel's width must not
    /// count for what lies somewhere in it: neither in the picture nor by place.
    #[test]
    fn reports_of_everything_are_of_nothing() {
        let toolbox = || lying("box", 100.0, 200.0);
        let mut picture = alarm(100.0, 0.0, 0);
        picture.obstacles[0].blob.bounds = PixelBox {
            u0: 0,
            v0: 0,
            u1: 1919,
            v1: 1079,
        };
        let wayside = scored(&[(4.1, picture)], &[toolbox()]);
        assert_eq!(wayside.false_alarms, 1);
        assert_eq!(wayside.obstacles[0].latency_s, None);
        // Shadow and reflection beside the thing, each as large as it.
        let mut with_shadow = alarm(100.0, 0.0, 190);
        with_shadow.obstacles[0].blob.bounds.u1 = 219;
        let wayside = scored(&[(4.1, with_shadow)], &[toolbox()]);
        assert_eq!(wayside.false_alarms, 0);

        for (from_m, to_m, width_m, misplaced) in [
            (97.5, 102.5, 0.4, 0),
            (97.0, 103.0, 0.4, 1),
            (0.0, 3000.0, 0.4, 1),
            (99.8, 100.2, 1.2, 0),
            (99.8, 100.2, 5.0, 1),
            (99.8, 100.2, f64::NAN, 1),
        ] {
            let mut stretch = alarm(100.0, 0.0, 200);
            let seen = &mut stretch.obstacles[0];
            (seen.from_chainage_m, seen.to_chainage_m, seen.width_m) = (from_m, to_m, width_m);
            let wayside = scored(&[(4.1, stretch)], &[toolbox()]);
            let case = format!("{from_m} to {to_m}, {width_m}");
            assert_eq!(wayside.misplaced_alarms, misplaced, "{case}");
            let placed = wayside.obstacles[0].placed_latency_s.is_some();
            assert_eq!(placed, misplaced == 0, "{case}");
        }
    }

    /// Fails where an error to one side makes up for one to the other.
    #[test]
    fn errors_of_the_distance_have_no_sign() {
        let reports = [98.0, 102.0].map(|m| (4.1, alarm(m, 0.0, 200)));
        let wayside = scored(&reports, &[lying("box", 100.0, 200.0)]);
        let error_m = wayside.obstacles[0].distance_error_m.unwrap();
        assert!((error_m - 2.0).abs() < 1e-9, "{error_m}");
    }

    /// Beside a worker, or before him, a report must count for the one whose outline it fits: it is neither
    /// dropped, nor a hit because he stands there. Far from both of a train's cars in the picture it is
    /// false although the train is at that place.
    #[test]
    fn reports_near_workers_and_trains_count() {
        let toolbox = || lying("box", 100.0, 200.0);
        let man = worker(100.3, [195.0, -90.0, 225.0, 12.0]);
        let of_box = scored(&[(4.1, alarm(100.0, 0.0, 200))], &[toolbox(), man.clone()]);
        assert!(of_box.obstacles[0].latency_s.is_some());
        let mut of_man = alarm(100.0, 0.0, 196);
        of_man.obstacles[0].blob.bounds = PixelBox {
            u0: 196,
            v0: 0,
            u1: 222,
            v1: 11,
        };
        let tall = worker(100.3, [195.0, 0.0, 225.0, 12.0]);
        let of_man = scored(&[(4.1, of_man)], &[toolbox(), tall]);
        assert_eq!(of_man.obstacles[0].latency_s, None);
        assert_eq!(of_man.false_alarms, 0);
        let shadow = scored(&[(4.1, alarm(100.0, 0.0, 300))], &[toolbox(), man]);
        assert_eq!(shadow.false_alarms, 1);

        let train = Presence {
            half_length_m: 59.0,
            ..worker(100.0, [0.0, 0.0, 50.0, 50.0])
        };
        let wayside = scored(&[(4.1, alarm(100.0, 0.0, 300))], &[train]);
        assert_eq!((wayside.false_alarms, wayside.misplaced_alarms), (1, 0));
    }

    /// Fails where the first report of a falling thing is lost, where it counts as latency, where a
    /// report is lost that was given before it was known to be at rest, and where two devices do
    /// not come to the same as one.
    #[test]
    fn latency_runs_from_lying_to_the_next_report() {
        let moving = |left_px| Presence {
            lies_in_view_since: None,
            ..lying("box", 100.0, left_px)
        };
        let frames = [
            (2.6, alarm(80.0, 1.6, 50), moving(50.0)),
            (3.2, alarm(100.0, 0.0, 200), moving(200.0)),
            (3.5, alarm(100.0, 0.0, 200), lying("box", 100.0, 200.0)),
        ];
        let together = |split: usize| {
            let mut scores = [WaysideScore::default(), WaysideScore::default()];
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
            assert_eq!(wayside.misplaced_alarms, 1);
            let first_s = found.first_detected_s.unwrap();
            assert!((first_s - 2.6).abs() < 1e-9, "{split}: {first_s}");
            assert!((found.latency_s.unwrap() - 0.2).abs() < 1e-9, "{split}");
            assert!(found.distance_error_m.unwrap().abs() < 1e-9, "{split}");
        }
    }

    /// Fails where a thing that the device cannot see is held against it.
    #[test]
    fn only_what_is_in_view_counts() {
        let hidden = Presence {
            lies_in_view_since: None,
            image_boxes: Vec::new(),
            ..lying("hidden", 60.0, 0.0)
        };
        let wayside = scored(&[(4.1, WaysideReport::default())], &[hidden]);
        assert!(wayside.obstacles.is_empty());
    }
}
