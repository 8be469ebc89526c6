//! Errors of the tracks in plan.
//!
//! Maps that are made from the air or from old drawings lie some decimetres beside the earth's coordinates. Half of the
//! variance is common to all tracks, that of the map's control points: the map turns and stretches from one to the next.
//! The other half is the joint's where tracks meet, so that each toe of a switch is off by itself, and the track's own
//! away from joints; towards its ends it goes over from the one into the other.
//!
//! Every error is interpolated between independent normal ones, and scaled so that its standard deviation is the same
//! everywhere.

use super::SurveySettings;
use crate::track::plan::PlanNetwork;
use crate::twin::random::Stream;
use nalgebra::{Point2, Vector2};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

/// A plan with the errors of a seed.
pub fn surveyed(plan: &PlanNetwork, settings: &SurveySettings, seed: u64) -> PlanNetwork {
    let (sigma_m, apart_m) = (settings.track_sigma_m, settings.track_points_m);
    if sigma_m == 0.0 {
        return plan.clone();
    }
    let stream = |name: &str| Stream::new(seed, 0, &format!("survey/plan {name}"));
    let axes = ["east", "north"].map(|axis| {
        let tracks = plan.elements.iter();
        AxisErrors {
            apart_m,
            common: stream(&format!("{axis} control")),
            joints: stream(&format!("{axis} joints")),
            tracks: tracks
                .map(|e| stream(&format!("{axis} track {}", e.id)))
                .collect(),
        }
    });
    plan.displaced(|element, along_m, place| {
        let left_m = plan.elements[element].length_m() - along_m;
        // Over the distance of two points the joint's error goes over into the track's own.
        let inward = (along_m.min(left_m) / apart_m).clamp(0.0, 1.0);
        let error = |axis: &AxisErrors| axis.at((element, along_m), place, inward);
        Vector2::new(error(&axes[0]), error(&axes[1])) * (sigma_m * FRAC_1_SQRT_2)
    })
}

/// Of one axis; all of standard deviation 1.
struct AxisErrors {
    /// Distance of the points between which they are interpolated.
    apart_m: f64,
    common: Stream,
    joints: Stream,
    tracks: Vec<Stream>,
}

impl AxisErrors {
    /// Of both halves together, at a place of a track; `inward` is 0 at its ends and 1 where joints count no more.
    fn at(&self, (track, along_m): (usize, f64), place: &Point2<f64>, inward: f64) -> f64 {
        let (of_track, of_joint) = (FRAC_PI_2 * inward).sin_cos();
        self.in_plane(&self.common, place)
            + of_joint * self.in_plane(&self.joints, place)
            + of_track * self.along(&self.tracks[track], along_m)
    }

    /// Between points of a line.
    fn along(&self, stream: &Stream, along_m: f64) -> f64 {
        let (before, share) = self.split(along_m);
        let weights = [1.0 - share, share];
        let values = [0, 1].map(|k| stream.normal((before + k) as u64));
        interpolated(weights.into_iter().zip(values))
    }

    /// Between points of a square grid.
    fn in_plane(&self, stream: &Stream, place: &Point2<f64>) -> f64 {
        let ((east, x), (north, y)) = (self.split(place.x), self.split(place.y));
        let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| {
            let weight = [1.0 - x, x][i] * [1.0 - y, y][j];
            let [column, row] = [east + i as i64, north + j as i64].map(|n| n as u32);
            let value = stream.normal(u64::from(column) << 32 | u64::from(row));
            (weight, value)
        });
        interpolated(corners.into_iter())
    }

    /// The number of the last point before a place, and which share of the way to the next one lies between.
    fn split(&self, m: f64) -> (i64, f64) {
        let x = m / self.apart_m;
        (x.floor() as i64, x - x.floor())
    }
}

/// A mean of independent numbers, by weights, with the standard deviation of each of them.
fn interpolated(of: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let squares: f64 = of.clone().map(|(weight, _)| weight * weight).sum();
    of.map(|(weight, value)| weight * value).sum::<f64>() / squares.sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::track::plan::{ElementEnd, TrackElement};
    use crate::track::{Direction, Tunnel};

    const SIGMA_M: f64 = 0.5;
    const SETTINGS: SurveySettings = SurveySettings {
        along_sigma_m: 0.0,
        across_sigma_m: 0.0,
        height_sigma_m: 0.0,
        control_sigma_m: 0.0,
        cant_sigma_mm: 0.0,
        balise_sigma_m: 0.0,
        track_sigma_m: SIGMA_M,
        track_points_m: 120.0,
    };
    const SEEDS: u64 = 400;

    fn terminus() -> PlanNetwork {
        let tunnel = Tunnel::from_toml(include_str!("../../../tunnels/terminus.toml")).unwrap();
        PlanNetwork::of_network(&tunnel.network, tunnel.datum)
    }

    /// Root of the mean square of what comes of each seed, on each axis.
    fn rms_m(of: impl Fn(u64) -> Vector2<f64>) -> f64 {
        let squares = (0..SEEDS).map(|seed| of(seed).norm_squared());
        (squares.sum::<f64>() / (2 * SEEDS) as f64).sqrt()
    }

    /// Bounds of the root of the mean square for a standard deviation of 1: of n normal errors it is good to 1 over the
    /// root of 2 n.
    fn is_one(rms: f64) -> bool {
        (rms - 1.0).abs() < 4.0 / f64::sqrt(4.0 * SEEDS as f64)
    }

    /// At joints, near to them and far from them, on control points and between them, errors are as large as set.
    #[test]
    fn tracks_are_off_by_as_much_everywhere() {
        let plan = terminus();
        let length_m = plan.elements[0].length_m();
        for m in [0.0, 20.0, 60.0, 150.0, 180.0, 240.0, length_m] {
            let rms = rms_m(|seed| {
                let map = surveyed(&plan, &SETTINGS, seed);
                map.elements[0].at(m).0 - plan.elements[0].at(m).0
            });
            // The points of the plan are some metres apart: between them errors are interpolated.
            assert!(is_one(rms / SIGMA_M), "{m} m: {rms}");
        }
    }

    /// Tracks that meet still do, and joints that are apart are off by other errors.
    #[test]
    fn tracks_meet_and_toes_are_off_by_themselves() {
        let plan = terminus();
        let map = surveyed(&plan, &SETTINGS, 1);
        let ends = (0..plan.elements.len()).flat_map(|element| {
            [Direction::Down, Direction::Up].map(|way| ElementEnd { element, way })
        });
        let off = |end: ElementEnd| {
            let m = match end.way {
                Direction::Down => 0.0,
                Direction::Up => plan.elements[end.element].length_m(),
            };
            map.elements[end.element].at(m).0 - plan.elements[end.element].at(m).0
        };
        let mut joints = 0;
        for end in ends {
            for next in plan.onward(end) {
                assert!((off(end) - off(next.opposite())).norm() < 1e-9);
                joints += 1;
            }
        }
        assert!(joints > 10);
        let apart = rms_m(|seed| {
            let map = surveyed(&plan, &SETTINGS, seed);
            let off = |m: f64| map.elements[0].at(m).0 - plan.elements[0].at(m).0;
            off(plan.elements[0].length_m()) - off(0.0)
        });
        assert!(is_one(apart / SIGMA_M * FRAC_1_SQRT_2), "{apart}");
    }

    /// Two tracks side by side share half of the variance far from joints, and have headings that differ.
    #[test]
    fn parallel_tracks_share_half_of_the_variance() {
        let track = |id: &str, y: f64| {
            let points = (0..=120).map(|k| Point2::new(5.0 * f64::from(k), y));
            TrackElement::new(id, points.collect()).unwrap()
        };
        let plan = PlanNetwork::new(None, vec![track("one", 0.0), track("other", 4.0)], &[]);
        let between = rms_m(|seed| {
            let map = surveyed(&plan, &SETTINGS, seed);
            let off = |k: usize| map.elements[k].at(240.0).0 - plan.elements[k].at(240.0).0;
            off(1) - off(0)
        });
        assert!((0.9..1.1).contains(&(between / SIGMA_M)), "{between}");
        let turned_rad = rms_m(|seed| {
            let map = surveyed(&plan, &SETTINGS, seed);
            let heading =
                |k: usize| (map.elements[k].at(330.0).0 - map.elements[k].at(270.0).0) / 60.0;
            heading(1) - heading(0)
        });
        assert!((2e-3..2e-2).contains(&turned_rad), "{turned_rad}");
    }
}
