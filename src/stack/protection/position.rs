//! Where the train is: the last accepted fix, carried on by the odometer, with a sigma that
//! grows with the distance run.
//!
//! The odometer's error is mostly one of scale (wheel diameter), so it grows in proportion to the
//! distance and not to its root: sigma^2 = sigma_fix^2 + (drift x distance + slide x slid)^2, where
//! slid is the distance that was counted on a sliding wheel. A fix is taken at the time when it was
//! true, by the odometer's reading then, and fused by inverse variance; one too far off is refused.
//! Five refused ones in a row that agree with each other mean that the train is not where it was
//! thought to be: the last of them is taken. They must be of two lamps: of one lamp that is taken for
//! another, all fixes agree. And the name of each lamp must have been read for the fix: one that is
//! predicted from a wrong place agrees with it.

use super::ProtectionSettings;
use super::settings::LEAST_SIGMA_M;
use crate::bus::{PositionFix, PositionSource, SimTime};
use crate::stack::odometry::{DistanceRun, Odometry};
use crate::track::uid::Uid;

/// Refused fixes in a row that overrule the estimate, and of how many lamps after each other.
const OVERRULE: u32 = 5;
const OVERRULE_LAMPS: u32 = 2;

/// Where the train head is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadPosition {
    pub chainage_m: f64,
    /// One sigma of it.
    pub sigma_m: f64,
    /// What was run by then.
    pub run: DistanceRun,
    /// The last source besides the odometer.
    pub source: PositionSource,
}

impl HeadPosition {
    /// Carried on by the odometer.
    fn carried(&self, run: DistanceRun, error: OdometerError) -> Self {
        let run_m = run.distance_m - self.run.distance_m;
        let slid_m = (run.slid_m - self.run.slid_m).abs();
        let error_m = error.drift * run_m.abs() + error.slide * slid_m;
        Self {
            chainage_m: self.chainage_m + run_m,
            sigma_m: self.sigma_m.hypot(error_m),
            run,
            ..*self
        }
    }
}

/// One sigma of the odometer, as shares of what it counted, and of what of it on a sliding wheel.
#[derive(Clone, Copy, Debug)]
struct OdometerError {
    drift: f64,
    slide: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Position {
    error: OdometerError,
    floor_m: f64,
    gate: f64,
    pub odometry: Odometry,
    anchor: Option<HeadPosition>,
    refused: Refused,
}

/// Refused fixes in a row that agree with each other.
#[derive(Clone, Copy, Debug, Default)]
struct Refused {
    fixes: u32,
    lamps: u32,
    last: Option<(HeadPosition, Uid)>,
}

impl Position {
    pub fn new(settings: &ProtectionSettings) -> Self {
        Self {
            error: OdometerError {
                drift: settings.odometer_drift,
                slide: settings.slide_error,
            },
            floor_m: settings.sigma_floor_m.max(LEAST_SIGMA_M),
            gate: settings.gate_sigmas,
            odometry: Odometry::default(),
            anchor: settings.initial_chainage_m.map(|chainage_m| HeadPosition {
                chainage_m,
                sigma_m: settings.initial_sigma_m,
                run: DistanceRun::default(),
                source: PositionSource::Setting,
            }),
            refused: Refused::default(),
        }
    }

    /// A position that may be wrong (from the lamps).
    pub fn on_fix(&mut self, fix: &PositionFix) {
        let (time, chainage_m, sigma_m) = (fix.time, fix.chainage_m, fix.sigma_m);
        let (lamp, is_read) = (fix.uid, fix.identity.is_read());
        if !(chainage_m.is_finite() && sigma_m.is_finite() && sigma_m >= 0.0) {
            return;
        }
        let fix = HeadPosition {
            chainage_m,
            sigma_m: sigma_m.max(self.floor_m),
            run: self.odometry.run(time),
            source: PositionSource::Lamp(fix.method),
        };
        let Some(anchor) = self.anchor else {
            self.anchor = Some(fix);
            return;
        };
        let predicted = anchor.carried(fix.run, self.error);
        let off_m = fix.chainage_m - predicted.chainage_m;
        if off_m.abs() > self.gate * predicted.sigma_m.hypot(fix.sigma_m) {
            if is_read {
                self.refuse(fix, lamp);
            }
            return;
        }
        // Shares of the two in their common sigma: squares of very large ones would be infinite.
        let both_m = predicted.sigma_m.hypot(fix.sigma_m);
        let gain = (predicted.sigma_m / both_m).powi(2);
        let sigma_m = predicted.sigma_m * (fix.sigma_m / both_m);
        self.accept(HeadPosition {
            chainage_m: predicted.chainage_m + gain * off_m,
            sigma_m: sigma_m.max(self.floor_m),
            ..fix
        });
    }

    /// A position that is right within its sigma (from a balise).
    pub fn reset(&mut self, time: SimTime, chainage_m: f64, sigma_m: f64) {
        self.accept(HeadPosition {
            chainage_m,
            sigma_m,
            run: self.odometry.run(time),
            source: PositionSource::Balise,
        });
    }

    fn accept(&mut self, anchor: HeadPosition) {
        self.anchor = Some(anchor);
        self.refused = Refused::default();
    }

    fn refuse(&mut self, fix: HeadPosition, lamp: Uid) {
        let agrees = |before: &HeadPosition| {
            let expected = before.carried(fix.run, self.error);
            (expected.chainage_m - fix.chainage_m).abs()
                <= self.gate * expected.sigma_m.hypot(fix.sigma_m)
        };
        let Refused { fixes, lamps, last } = self.refused;
        let (fixes, lamps) = match last.filter(|(before, _)| agrees(before)) {
            Some((_, before)) => (fixes + 1, lamps + u32::from(before != lamp)),
            None => (1, 1),
        };
        self.refused = Refused {
            fixes,
            lamps,
            last: Some((fix, lamp)),
        };
        if fixes >= OVERRULE && lamps >= OVERRULE_LAMPS {
            self.accept(fix);
        }
    }

    pub fn at(&self, time: SimTime) -> Option<HeadPosition> {
        self.anchor
            .map(|a| a.carried(self.odometry.run(time), self.error))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]
    use super::super::tests::fix;
    use super::*;
    use crate::bus::{Identity, OdometerSample};

    fn driven(settings: &ProtectionSettings, seconds: f64, speed_mps: f64) -> Position {
        let mut p = Position::new(settings);
        for k in 0..=(seconds * 20.0).round() as i64 {
            let t = k as f64 * 0.05;
            p.odometry.on_sample(&OdometerSample {
                time: SimTime::from_secs(t),
                distance_m: 1000.0 + speed_mps * t,
                speed_mps,
                slides: false,
            });
        }
        p
    }

    /// Sigma must grow with distance, in proportion: 2 % of 400 m is 8 m, with 5 m at the start
    /// 9.4 m. And the odometer's own count (here from 1000 m) must not matter.
    #[test]
    fn sigma_grows_with_the_way() {
        let settings = ProtectionSettings {
            initial_chainage_m: Some(50.0),
            ..Default::default()
        };
        let p = driven(&settings, 20.0, 20.0);
        let e = p.at(SimTime::from_secs(20.0)).unwrap();
        assert!((e.chainage_m - 450.0).abs() < 1e-9);
        assert!((e.sigma_m - 5f64.hypot(8.0)).abs() < 1e-9);
    }

    /// A fix of a second ago counts where it was true, not where the train is now.
    #[test]
    fn a_late_fix_is_carried() {
        let mut p = driven(&ProtectionSettings::default(), 20.0, 20.0);
        assert_eq!(p.at(SimTime::from_secs(20.0)), None);
        p.on_fix(&fix(SimTime::from_secs(19.01), 700.0, 0.4));
        let e = p.at(SimTime::from_secs(20.0)).unwrap();
        assert!((e.chainage_m - 719.8).abs() < 1e-9);
    }

    /// Fails where a lamp whose name nobody read stands in for the second one.
    #[test]
    fn only_names_that_were_read_overrule() {
        for (identity, overrules) in [
            (Identity::Decoded, true),
            (Identity::Joined, true),
            (Identity::Followed, false),
            (Identity::Predicted, false),
        ] {
            let mut p = driven(&ProtectionSettings::default(), 1.0, 0.0);
            let t = SimTime::from_secs(1.0);
            p.on_fix(&fix(t, 100.0, 1.0));
            for _ in 0..5 {
                p.on_fix(&fix(t, 160.0, 1.0));
            }
            for _ in 0..20 {
                let mut of_next = PositionFix {
                    identity,
                    ..fix(t, 160.0, 1.0)
                };
                of_next.uid.lamp += 1;
                p.on_fix(&of_next);
            }
            let believed_m = p.at(t).unwrap().chainage_m;
            assert_eq!((believed_m - 160.0).abs() < 1e-9, overrules, "{identity}");
        }
    }

    /// Fusion by inverse variance, one outlier refused, any number of one lamp refused, five of two
    /// lamps that agree believed.
    #[test]
    fn fixes_are_gated() {
        let mut p = driven(&ProtectionSettings::default(), 1.0, 0.0);
        let t = SimTime::from_secs(1.0);
        p.on_fix(&fix(t, 100.0, 2.0));
        p.on_fix(&fix(t, 103.0, 1.0));
        let e = p.at(t).unwrap();
        assert!((e.chainage_m - 102.4).abs() < 1e-9);
        assert!((e.sigma_m - 0.8f64.sqrt()).abs() < 1e-9);
        for _ in 0..20 {
            p.on_fix(&fix(t, 160.0, 1.0));
        }
        assert!((p.at(t).unwrap().chainage_m - 102.4).abs() < 1e-9);
        let mut of_next = fix(t, 160.0, 1.0);
        of_next.uid.lamp += 1;
        p.on_fix(&of_next);
        assert!((p.at(t).unwrap().chainage_m - 160.0).abs() < 1e-9);
        // Not a number changes nothing.
        p.on_fix(&fix(t, f64::NAN, 1.0));
        assert!((p.at(t).unwrap().chainage_m - 160.0).abs() < 1e-9);
    }

    /// Two fixes without a sigma must not make the place no number: no obstacle would be ahead of it.
    #[test]
    fn exact_fixes_give_a_place() {
        let settings = ProtectionSettings {
            sigma_floor_m: 0.0,
            ..ProtectionSettings::default()
        };
        let mut p = driven(&settings, 1.0, 0.0);
        let t = SimTime::from_secs(1.0);
        p.on_fix(&fix(t, 100.0, 0.0));
        p.on_fix(&fix(t, 100.0, 0.0));
        let e = p.at(t).unwrap();
        assert!(
            (e.chainage_m - 100.0).abs() < 1e-9 && e.sigma_m > 0.0,
            "{e:?}"
        );
    }
}
