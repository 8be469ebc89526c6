//! The survey: where the map that the stack is given has the lamps.
//!
//! The world is right and the map is wrong: each lamp of the map stands off its real place by an
//! error of its own, drawn from the run's seed and the lamp's name. So a lamp has the same error
//! whenever it is passed, and whichever other lamps there are.
//!
//! **How large.** Tunnel furniture is surveyed by total station from control points, or by mobile
//! laser scanning tied to them. Neighbouring control points agree to a few millimetres; finding
//! the middle of a lamp's glass in a point cloud, and reducing it to a chainage, make some 10 to
//! 20 mm of that, the larger figure along the track. The shipped line scenarios take 15 mm along
//! and 10 mm across and up. By default there is no error: a bench measures its one lamp itself.
//!
//! Control points stand every 120 m; where one has moved, everything that was measured from it
//! is off along the track. The error between two control points is linear between theirs. The cant of
//! the map is that of the last track measurement, some millimetres off; balises are placed to
//! some decimetres.
//!
//! Track occupancy is given the tracks in plan, and these are off too (`plan`).
//!
//! **What it does not do.** Plan and profile of the map's track are right for positioning along it: what a survey
//! leaves of them is millimetres over the length of a train.

mod plan;

use super::random::Stream;
use crate::settings::settings;
use crate::track::plan::PlanNetwork;
use crate::track::{Track, TrackPoint, Tunnel};
use std::sync::Arc;

/// Distance of the control points.
const CONTROL_M: f64 = 120.0;

settings! {
    /// How well the map was surveyed: one sigma of normal errors.
    #[derive(Copy)]
    pub struct SurveySettings {
        /// Along the track, m. What the stack takes it to be is `stack.led.survey_sigma_m`.
        /// Default 0; 0.01 to 0.02 in a metro surveyed for operation.
        along_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// Across the track, m.
        across_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// In height, m.
        height_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// Of the control points that lamps are measured from, along the track, m: neighbouring lamps
        /// share it.
        control_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// Of the cant, mm.
        cant_sigma_mm: f64 = 0.0, in 0.0..=20.0;
        /// Of the balises' places along the track, m. What the stack takes it to be is
        /// `balise_sigma_m` of `stack.protection` and of `stack.occupancy`.
        balise_sigma_m: f64 = 0.0, in 0.0..=5.0;
        /// Of the tracks' places in plan, each way, m. What the stack takes it to be is
        /// `stack.occupancy.map_sigma_m`.
        track_sigma_m: f64 = 0.0, in 0.0..=100.0;
        /// Distance of the points that these were measured or drawn by, m: errors of places farther apart are independent.
        /// What the stack takes a third of it to be is `stack.occupancy.map_correlation_m`.
        track_points_m: f64 = 120.0, in 1.0..=1e4;
    }
}

impl SurveySettings {
    /// The map of a tunnel as it was surveyed, with the errors of a run's seed.
    pub fn map(&self, tunnel: &Tunnel, seed: u64) -> Tunnel {
        let mut map = tunnel.clone();
        for track in &mut map.network.tracks {
            *track = Arc::new(self.track(track, seed));
        }
        map
    }

    /// The tracks of a tunnel in plan as they were surveyed.
    pub fn plan(&self, tunnel: &Tunnel, seed: u64) -> PlanNetwork {
        let plan = PlanNetwork::of_network(&tunnel.network, tunnel.datum);
        self.surveyed(&plan, seed)
    }

    /// A plan as it was surveyed.
    pub fn surveyed(&self, plan: &PlanNetwork, seed: u64) -> PlanNetwork {
        plan::surveyed(plan, self, seed)
    }

    fn track(&self, track: &Track, seed: u64) -> Track {
        let mut map = track.clone();
        let controls = Stream::new(seed, 0, "survey/control points");
        let cants = Stream::new(seed, 0, "survey/cant");
        if self.cant_sigma_mm > 0.0 {
            let more_m = |s_m| 1e-3 * self.cant_sigma_mm * between_controls(&cants, s_m);
            map.alignment = track.alignment.canted_more(more_m);
        }
        for balise in &mut map.balises {
            let stream = Stream::new(seed, 0, &format!("survey/{}", balise.name));
            balise.chainage_m += self.balise_sigma_m * stream.normal(0);
        }
        for lamp in &mut map.lamps {
            let stream = Stream::new(seed, 0, &format!("survey/{}", lamp.uid));
            let shared_m = self.control_sigma_m * between_controls(&controls, lamp.chainage_m);
            lamp.chainage_m += shared_m + self.along_sigma_m * stream.normal(0);
            lamp.lateral_m += self.across_sigma_m * stream.normal(1);
            lamp.height_m += self.height_sigma_m * stream.normal(2);
            lamp.centre = map.alignment.world_from_track(TrackPoint {
                s_m: lamp.chainage_m,
                l_m: lamp.lateral_m,
                h_m: lamp.height_m,
            });
        }
        map
    }
}

/// Linear between numbers of the control points on either side: normal ones of sigma 1.
fn between_controls(stream: &Stream, s_m: f64) -> f64 {
    let x = (s_m / CONTROL_M).max(0.0);
    let [before, after] = [x.floor(), x.floor() + 1.0].map(|k| stream.normal(k as u64));
    before + (x - x.floor()) * (after - before)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const SETTINGS: SurveySettings = SurveySettings {
        along_sigma_m: 0.015,
        across_sigma_m: 0.010,
        height_sigma_m: 0.005,
        control_sigma_m: 0.0,
        cant_sigma_mm: 0.0,
        balise_sigma_m: 0.0,
        track_sigma_m: 0.0,
        track_points_m: 120.0,
    };

    fn line() -> Track {
        let text = include_str!("../../tunnels/chengdu_line1.toml");
        Track::clone(Tunnel::from_toml(text).unwrap().first_track())
    }

    /// Fails where an axis is swapped or drawn with another sigma, and where the centre and the
    /// coordinates of a lamp part.
    #[test]
    fn errors_are_as_set() {
        let track = line();
        let map = SETTINGS.track(&track, 1);
        let mut squares = [0.0; 3];
        for (is, said) in track.lamps.iter().zip(&map.lamps) {
            let seen = (track.alignment).track_from_world(&said.centre, is.chainage_m);
            assert!((seen.s_m - said.chainage_m).abs() < 1e-6);
            let errors = [
                seen.s_m - is.chainage_m,
                seen.l_m - is.lateral_m,
                seen.h_m - is.height_m,
            ];
            for (sum, error) in squares.iter_mut().zip(errors) {
                *sum += error * error;
            }
        }
        let n = track.lamps.len() as f64;
        for (square, sigma) in squares.into_iter().zip([0.015, 0.010, 0.005]) {
            // The rms of n normal errors is good to sigma / sqrt(2 n).
            let off = (square / n).sqrt() / sigma - 1.0;
            assert!(off.abs() < 4.0 / (2.0 * n).sqrt(), "{sigma} m: {off}");
        }
    }

    /// Lamps that stand together share the error of their control points and others do not, the map's cant
    /// is off by some millimetres, and balises are off.
    #[test]
    fn control_points_cant_and_balises_have_errors() {
        let track = line();
        let settings = SurveySettings {
            control_sigma_m: 0.05,
            cant_sigma_mm: 4.0,
            balise_sigma_m: 0.3,
            ..SurveySettings::default()
        };
        let (mut near, mut all, mut cants, mut balises) = (0.0, 0.0, 0.0, 0.0);
        let seeds = 40u32;
        for seed in 0..u64::from(seeds) {
            let map = settings.track(&track, seed);
            let lamps = track.lamps.iter().zip(&map.lamps);
            let errors: Vec<f64> = lamps
                .map(|(is, said)| said.chainage_m - is.chainage_m)
                .collect();
            let mean_square = |x: f64, n: usize| x * x / n as f64;
            let steps = errors.windows(2);
            near += steps
                .map(|w| mean_square(w[1] - w[0], errors.len() - 1))
                .sum::<f64>();
            all += errors
                .iter()
                .map(|e| mean_square(*e, errors.len()))
                .sum::<f64>();
            let line = (&track.alignment, &map.alignment);
            for k in 0..20u32 {
                let s_m = 600.0 + 50.0 * f64::from(k);
                let turned_rad = line.1.at(s_m).roll_rad - line.0.at(s_m).roll_rad;
                cants += mean_square(1.5 * turned_rad, 20);
            }
            for (is, said) in track.balises.iter().zip(&map.balises) {
                balises += mean_square(said.chainage_m - is.chainage_m, track.balises.len());
            }
            for lamp in &map.lamps {
                let at = map
                    .alignment
                    .track_from_world(&lamp.centre, lamp.chainage_m);
                assert!((at.h_m - lamp.height_m).abs() < 1e-6);
            }
        }
        let rms = |sum: f64| (sum / f64::from(seeds)).sqrt();
        // Between two control points the mean square of what is shared is 2/3 of theirs.
        let shared = rms(all) / 0.05;
        assert!((0.70..0.95).contains(&shared), "{shared}");
        assert!(rms(near) < 0.2 * rms(all), "{} of {}", rms(near), rms(all));
        assert!((2e-3..5e-3).contains(&rms(cants)), "{}", rms(cants));
        assert!((0.2..0.4).contains(&rms(balises)), "{}", rms(balises));
    }

    /// Fails where a lamp's error depends on what other lamps there are, or not on the seed.
    #[test]
    fn a_lamp_has_its_own_error() {
        let mut track = line();
        let whole = SETTINGS.track(&track, 1);
        track.lamps.drain(..100);
        assert_eq!(SETTINGS.track(&track, 1).lamps, whole.lamps[100..]);
        assert_ne!(SETTINGS.track(&track, 2).lamps, whole.lamps[100..]);
        assert_eq!(
            SurveySettings::default().track(&track, 1).lamps,
            track.lamps
        );
    }
}
