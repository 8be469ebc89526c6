//! Where on a track a camera is, and whether it can see any of the track.

use crate::track::{Track, TrackPoint};
use crate::twin::render::constants::SIGHT_M;
use nalgebra::Point3;

/// Between places of a track that are tried.
const STEP_M: f64 = 20.0;
/// Farther from the line than this the chainage found is not believed.
const NEAR_LINE_M: f64 = 30.0;

/// The search for cameras along one track.
pub struct TrackSearch {
    /// Chainages a step apart, and where they are.
    tried: Vec<(f64, Point3<f64>)>,
    /// The least and the greatest coordinates of these places.
    bounds: [Point3<f64>; 2],
    /// Where a camera was last.
    last_s_m: f64,
}

impl TrackSearch {
    /// For a track.
    pub fn new(track: &Track) -> Self {
        let from_m = track.sections.first().map_or(0.0, |r| r.from_m);
        let to_m = track.sections.last().map_or(0.0, |r| r.to_m);
        let steps = ((to_m - from_m) / STEP_M).ceil().clamp(1.0, 1e5) as u32;
        let tried: Vec<_> = (0..=steps)
            .map(|k| from_m + (to_m - from_m) * f64::from(k) / f64::from(steps))
            .map(|s_m| (s_m, track.alignment.at(s_m).origin))
            .collect();
        let places = || tried.iter().map(|(_, place)| *place);
        let start = tried[0].1;
        Self {
            bounds: [
                places().fold(start, |a, b| a.inf(&b)),
                places().fold(start, |a, b| a.sup(&b)),
            ],
            tried,
            last_s_m: 0.0,
        }
    }

    /// Whether the eye is so far that no part of the track can be in sight; the cost does not grow with its length.
    fn is_far_from(&self, eye: &Point3<f64>) -> bool {
        let [least, greatest] = &self.bounds;
        let nearest = eye.sup(least).inf(greatest);
        (nearest - eye).norm() > SIGHT_M + STEP_M
    }

    /// A camera as the track has it: by Newton's method from where the last one was, else from the nearest of the
    /// places tried; one of these itself for a camera far from the line. None where no part of the track is in sight.
    pub fn place(&mut self, track: &Track, eye: &Point3<f64>) -> Option<TrackPoint> {
        if self.is_far_from(eye) {
            return None;
        }
        let on_line = |s_m: f64| {
            let t = track.alignment.track_from_world(eye, s_m);
            let found = t.l_m.abs() < NEAR_LINE_M && (t.s_m - s_m).abs() < 4.0 * STEP_M;
            found.then_some(t)
        };
        let place = on_line(self.last_s_m).or_else(|| {
            let (near_m, away_m) = self.nearest_tried(eye);
            let in_sight = away_m < SIGHT_M + STEP_M;
            in_sight.then(|| {
                on_line(near_m).unwrap_or_else(|| TrackPoint {
                    s_m: near_m,
                    ..track.alignment.track_from_world(eye, near_m)
                })
            })
        })?;
        self.last_s_m = place.s_m;
        Some(place)
    }

    /// Its chainage, and how far it is from the eye.
    fn nearest_tried(&self, eye: &Point3<f64>) -> (f64, f64) {
        let all = self.tried.iter().map(|(s_m, p)| (*s_m, (p - eye).norm()));
        all.min_by(|a, b| f64::total_cmp(&a.1, &b.1))
            .unwrap_or((0.0, f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::render::sample;

    #[test]
    fn a_camera_is_found_wherever_the_last_one_was() {
        let track = sample::track();
        let mut search = TrackSearch::new(&track);
        let length_m = track.alignment.length_m();
        for s_m in [1.0, length_m - 1.0, 0.4 * length_m, 2.0] {
            let at = TrackPoint {
                s_m,
                l_m: 1.5,
                h_m: 2.0,
            };
            let eye = track.alignment.world_from_track(at);
            let found = search.place(&track, &eye);
            let off_m = found.map_or(f64::INFINITY, |f| (f.s_m - s_m).hypot(f.l_m - 1.5));
            assert!(off_m < 1e-6, "{s_m}: {found:?}");
        }
    }

    #[test]
    fn a_track_is_out_of_sight_from_afar_only() {
        let track = sample::track();
        let mut search = TrackSearch::new(&track);
        for place in search.tried.clone() {
            for away_m in [0.0, SIGHT_M - 1.0, SIGHT_M + STEP_M + 1.0, 2.0 * SIGHT_M] {
                let eye = place.1 + nalgebra::Vector3::z() * away_m;
                let nearest_m = search.nearest_tried(&eye).1;
                let seen = search.place(&track, &eye).is_some();
                assert!(seen || nearest_m > SIGHT_M, "{nearest_m}");
                assert!(!seen || nearest_m < SIGHT_M + 100.0, "{nearest_m}");
            }
        }
        let far = Point3::new(0.0, 0.0, 1e4);
        assert_eq!(search.place(&track, &far), None);
    }
}
