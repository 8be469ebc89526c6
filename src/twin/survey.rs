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
//! **What it does not do.** Errors of neighbouring lamps are independent: a shift that many lamps
//! share (a control point that has moved) is not modelled, nor are errors of track and balises.

use super::random::Stream;
use crate::settings::settings;
use crate::track::{TrackPoint, Tunnel};

settings! {
    /// How well the map's lamps were surveyed: one sigma of the normal error of each lamp's place.
    #[derive(Copy)]
    pub struct SurveySettings {
        /// Along the track, m. What the stack takes it to be is `stack.led.survey_sigma_m`.
        /// Default 0; 0.01 to 0.02 in a metro surveyed for operation.
        along_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// Across the track, m.
        across_sigma_m: f64 = 0.0, in 0.0..=0.5;
        /// In height, m.
        height_sigma_m: f64 = 0.0, in 0.0..=0.5;
    }
}

impl SurveySettings {
    /// The map of a tunnel as it was surveyed, with the errors of a run's seed.
    pub fn map(&self, tunnel: &Tunnel, seed: u64) -> Tunnel {
        let mut map = tunnel.clone();
        for lamp in &mut map.lamps {
            let stream = Stream::new(seed, 0, &format!("survey/{}", lamp.uid));
            lamp.chainage_m += self.along_sigma_m * stream.normal(0);
            lamp.lateral_m += self.across_sigma_m * stream.normal(1);
            lamp.height_m += self.height_sigma_m * stream.normal(2);
            lamp.centre = tunnel.alignment.world_from_track(TrackPoint {
                s_m: lamp.chainage_m,
                l_m: lamp.lateral_m,
                h_m: lamp.height_m,
            });
        }
        map
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const SETTINGS: SurveySettings = SurveySettings {
        along_sigma_m: 0.015,
        across_sigma_m: 0.010,
        height_sigma_m: 0.005,
    };

    fn line() -> Tunnel {
        Tunnel::from_toml(include_str!("../../tunnels/chengdu_line1.toml")).unwrap()
    }

    /// Fails where an axis is swapped or drawn with another sigma, and where the centre and the
    /// coordinates of a lamp part.
    #[test]
    fn errors_are_as_set() {
        let tunnel = line();
        let map = SETTINGS.map(&tunnel, 1);
        let mut squares = [0.0; 3];
        for (is, said) in tunnel.lamps.iter().zip(&map.lamps) {
            let seen = (tunnel.alignment).track_from_world(&said.centre, is.chainage_m);
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
        let n = tunnel.lamps.len() as f64;
        for (square, sigma) in squares.into_iter().zip([0.015, 0.010, 0.005]) {
            // The rms of n normal errors is good to sigma / sqrt(2 n).
            let off = (square / n).sqrt() / sigma - 1.0;
            assert!(off.abs() < 4.0 / (2.0 * n).sqrt(), "{sigma} m: {off}");
        }
    }

    /// Fails where a lamp's error depends on what other lamps there are, or not on the seed.
    #[test]
    fn a_lamp_has_its_own_error() {
        let mut tunnel = line();
        let whole = SETTINGS.map(&tunnel, 1);
        tunnel.lamps.drain(..100);
        assert_eq!(SETTINGS.map(&tunnel, 1).lamps, whole.lamps[100..]);
        assert_ne!(SETTINGS.map(&tunnel, 2).lamps, whole.lamps[100..]);
        assert_eq!(
            SurveySettings::default().map(&tunnel, 1).lamps,
            tunnel.lamps
        );
    }
}
