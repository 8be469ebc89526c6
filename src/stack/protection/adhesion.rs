//! Slippery rails, known by wheels that slid, and the brake rates that are then assumed.
//!
//! Slide and slip protection acts where it sees that a wheel no longer turns as the train runs. From then
//! on the rails count as slippery until the train has run [`SLIPPERY_FOR_M`] without it: the emergency
//! brake is held to reach `low_adhesion_mps2` only, and while it acts the true speed may be above what the
//! wheel says by k times `slide_error`. A slide that it does not see is not reckoned with.
//!
//! A wheel that stands while its protection acts is locked, and the train may run. That is believed
//! for as long as the fastest train takes to stop on the poorest rails, not for ever.

use super::ProtectionSettings;
use super::curve::FASTEST_MPS;
use crate::bus::SimTime;
use crate::stack::odometry::Odometry;

/// Leaf film lies in stretches of some hundred metres, with gaps.
const SLIPPERY_FOR_M: f64 = 500.0;

/// A wheel slower than this stands.
pub(super) const STANDING_MPS: f64 = 0.1;

/// What may be expected of brake and odometer on the rails as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grip {
    /// Slide and slip protection acts on the wheelset of the odometer now.
    pub slides: bool,
    /// Rate of the full service brake on level track.
    pub service_mps2: f64,
    /// Guaranteed rate of the emergency brake on level track.
    pub emergency_mps2: f64,
    /// What the slide adds to the odometer's speed error.
    pub slide_error_mps: f64,
}

/// Remembers where wheels slid.
#[derive(Clone, Debug, Default)]
pub(super) struct Adhesion {
    /// Distance run when a wheel slid last.
    slid_at_m: Option<f64>,
    /// Since when the wheel is locked.
    locked_since: Option<SimTime>,
}

impl Adhesion {
    /// What holds now. Called every cycle.
    pub fn update(&mut self, time: SimTime, odometry: &Odometry, s: &ProtectionSettings) -> Grip {
        let run_m = odometry.distance_m(time);
        let speed_mps = odometry.mean_speed_mps().unwrap_or(0.0);
        let locked = odometry.slides() && speed_mps <= STANDING_MPS;
        self.locked_since = locked.then(|| self.locked_since.unwrap_or(time));
        let longest_s = FASTEST_MPS / s.low_adhesion_mps2;
        let stands = (self.locked_since).is_some_and(|since| time.since(since) > longest_s);
        let slides = odometry.slides() && !stands;
        if slides {
            self.slid_at_m = Some(run_m);
        }
        let slippery = (self.slid_at_m).is_some_and(|at_m| (run_m - at_m).abs() < SLIPPERY_FOR_M);
        let mut grip = Grip {
            slides,
            service_mps2: s.service_mps2,
            emergency_mps2: s.emergency_mps2,
            slide_error_mps: 0.0,
        };
        if slippery {
            grip.service_mps2 = s.service_mps2.min(s.low_adhesion_mps2);
            grip.emergency_mps2 = s.emergency_mps2.min(s.low_adhesion_mps2);
        }
        if slides {
            grip.slide_error_mps = s.position_sigmas * s.slide_error * speed_mps;
        }
        grip
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::{OdometerSample, SimTime};

    /// A slide must lower the guaranteed rate for the next 500 m, not only while it lasts, and widen the
    /// speed only while it lasts; on rails that bear the brake nothing changes.
    #[test]
    fn rails_are_slippery_for_a_while_after_a_slide() {
        let settings = ProtectionSettings::default();
        let mut odometry = Odometry::default();
        let mut adhesion = Adhesion::default();
        let mut at = |k: u32, slides: bool| {
            let sample = OdometerSample {
                time: SimTime::from_secs(0.1 * f64::from(k)),
                distance_m: f64::from(k),
                speed_mps: 10.0,
                slides,
            };
            odometry.on_sample(&sample);
            let grip = adhesion.update(sample.time, &odometry, &settings);
            (grip.emergency_mps2, grip.slide_error_mps)
        };
        let dry = settings.emergency_mps2;
        assert_eq!(at(0, false), (dry, 0.0));
        let (rate, wider_mps) = at(10, true);
        assert!((rate - settings.low_adhesion_mps2).abs() < 1e-12);
        assert!((wider_mps - 3.0).abs() < 1e-9, "{wider_mps}");
        assert_eq!(at(500, false), (settings.low_adhesion_mps2, 0.0));
        assert_eq!(at(511, false), (dry, 0.0));
    }
}
