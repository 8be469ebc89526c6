//! Slide and slip protection of a train. It knows how fast each axle turns and what effort is demanded: not
//! how fast the train runs, nor the state of the rails. All wheels have the radius that it reckons with.
//!
//! An axle slides or slips where its speed is off the reference speed. While the train brakes that is the
//! speed of the fastest axle, and falls no faster than the effort that is let through can make it; under
//! traction it is that of the slowest, and rises no faster. (EN 15595 says what such systems must do; each
//! maker has its own rules.) When all axles slide slowly together, it follows them and sees nothing.

use super::driver::Effort;

/// An axle slides or slips where its speed is off the reference by more than this share and this speed.
const OFF_SHARE: f64 = 0.1;
const OFF_MPS: f64 = 0.3;
/// It does so too where its speed changes faster than any train's.
const RUNS_AWAY_MPS2: f64 = 4.0;
/// A released axle whose speed changes so much the other way comes back to the train's: more than a slope
/// of 60 permille does to a train that rolls.
const COMES_BACK_MPS2: f64 = 1.0;
/// An axle's acceleration is taken over so long.
const SMOOTHED_S: f64 = 0.05;
/// All effort is taken away in this time.
const LET_GO_S: f64 = 0.1;
/// And given back in this time.
const GIVE_BACK_S: f64 = 1.0;
/// What a slope of 60 permille and resistance add to what brakes and motors do.
const BY_GRADIENT_MPS2: f64 = 0.7;
/// When brakes follow traction, or traction brakes, axles come back from their slide within so long.
const CHANGE_S: f64 = 2.0;

/// What the protection takes for the train's speed, forward or backward.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReferenceSpeed {
    speed_mps: f64,
    /// It is that of the fastest axle, as while the train brakes; otherwise that of the slowest.
    of_fastest: bool,
    /// So long it has not been the one that goes with the effort at work.
    changing_s: f64,
    /// Axles that slide turn too slowly; otherwise they slip, and turn too fast.
    too_slow: bool,
}

impl ReferenceSpeed {
    /// Of a train whose wheels roll at a speed.
    pub fn new(speed_mps: f64) -> Self {
        Self {
            speed_mps: speed_mps.abs(),
            ..Self::default()
        }
    }

    /// A step on, by the axles' speeds, the effort demanded and the mean share of it that is let through.
    pub fn update(
        &mut self,
        axles_mps: impl Iterator<Item = f64>,
        effort: Effort,
        mean_share: f64,
        dt_s: f64,
    ) {
        self.choose(effort, mean_share, dt_s);
        let by_effort_mps2 = mean_share * effort.brake_mps2.max(effort.traction_mps2);
        let change_mps = (by_effort_mps2 + BY_GRADIENT_MPS2) * dt_s;
        let axles_mps = axles_mps.map(f64::abs);
        self.speed_mps = if self.of_fastest {
            axles_mps.fold(self.speed_mps - change_mps, f64::max)
        } else {
            axles_mps.fold(self.speed_mps + change_mps, f64::min)
        };
    }

    /// Of the fastest axle or of the slowest. After brakes an axle may still be too slow, after traction too
    /// fast: the change waits until no effort is held back any more. A train that rolls without effort
    /// changes nothing.
    fn choose(&mut self, effort: Effort, mean_share: f64, dt_s: f64) {
        let (brakes, pulls) = (effort.brake_mps2 > 0.0, effort.traction_mps2 > 0.0);
        self.too_slow = brakes || (self.of_fastest && !pulls);
        if self.too_slow == self.of_fastest {
            self.changing_s = 0.0;
            return;
        }
        self.changing_s += dt_s;
        if mean_share >= 1.0 || self.changing_s > CHANGE_S {
            self.of_fastest = self.too_slow;
        }
    }
}

/// What the protection lets through of brake and traction to one wheelset.
#[derive(Clone, Copy, Debug)]
pub(super) struct EffortShare {
    share: f64,
    /// Speed of the axle, smoothed over [`SMOOTHED_S`].
    smooth_mps: f64,
}

impl Default for EffortShare {
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl EffortShare {
    /// All of it, to an axle at a speed.
    pub fn new(axle_mps: f64) -> Self {
        Self {
            share: 1.0,
            smooth_mps: axle_mps.abs(),
        }
    }

    /// A step on, by the axle's speed. An axle that comes back from its slide is waited for: where all have
    /// slid, the reference is off until one of them rolls again.
    pub fn update(&mut self, axle_mps: f64, reference: &ReferenceSpeed, dt_s: f64) -> f64 {
        let axle_mps = axle_mps.abs();
        self.smooth_mps += (axle_mps - self.smooth_mps) * (dt_s / SMOOTHED_S).min(1.0);
        let gains_mps2 = (axle_mps - self.smooth_mps) / SMOOTHED_S;
        let away_mps2 = if reference.too_slow {
            -gains_mps2
        } else {
            gains_mps2
        };
        let off_mps = (axle_mps - reference.speed_mps).abs();
        let is_off = off_mps > OFF_SHARE * reference.speed_mps + OFF_MPS;
        if is_off || away_mps2 > RUNS_AWAY_MPS2 {
            self.share = (self.share - dt_s / LET_GO_S).max(0.0);
        } else if !(self.acts() && away_mps2 < -COMES_BACK_MPS2) {
            self.share = (self.share + dt_s / GIVE_BACK_S).min(1.0);
        }
        self.share
    }

    /// Share of the effort that is let through.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Effort is held back.
    pub fn acts(&self) -> bool {
        self.share < 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRAKE: Effort = Effort {
        traction_mps2: 0.0,
        brake_mps2: 1.3,
    };
    const PULL: Effort = Effort {
        traction_mps2: 1.0,
        brake_mps2: 0.0,
    };
    const ROLL: Effort = Effort {
        traction_mps2: 0.0,
        brake_mps2: 0.0,
    };

    /// While one axle still rolls, the others' slide must show; when all lock at once, the reference must
    /// stay above them; and an axle that rolls again must bring it back at once. Backward as forward.
    #[test]
    fn the_reference_is_the_fastest_axle_while_braking() {
        for sign in [1.0, -1.0] {
            let mut reference = ReferenceSpeed::new(sign * 20.1);
            for (axles_mps, expected_mps) in [
                ([20.0, 20.0, 20.0], 20.0),
                ([12.0, 19.9, 4.0], 19.9),
                ([0.0, 0.0, 0.0], 19.7),
                ([0.0, 0.0, 0.0], 19.5),
                ([0.0, 19.8, 0.0], 19.8),
            ] {
                let axles_mps = axles_mps.map(|v| sign * v);
                reference.update(axles_mps.into_iter(), BRAKE, 1.0, 0.1);
                let speed_mps = reference.speed_mps;
                assert!((speed_mps - expected_mps).abs() < 1e-9, "{speed_mps}");
            }
        }
    }

    /// The same under traction, where slipping axles run too fast.
    #[test]
    fn the_reference_is_the_slowest_axle_under_traction() {
        let mut reference = ReferenceSpeed::new(3.0);
        for (axles_mps, expected_mps) in [([3.0, 3.0], 3.0), ([9.0, 3.1], 3.1), ([9.0, 9.0], 3.27)]
        {
            reference.update(axles_mps.into_iter(), PULL, 1.0, 0.1);
            let speed_mps = reference.speed_mps;
            assert!((speed_mps - expected_mps).abs() < 1e-9, "{speed_mps}");
        }
    }

    /// Four axles under the protection: share of each after some seconds, whose speeds are given over time.
    struct Bogies {
        reference: ReferenceSpeed,
        shares: [EffortShare; 4],
    }

    impl Bogies {
        fn new(speed_mps: f64) -> Self {
            Self {
                reference: ReferenceSpeed::new(speed_mps),
                shares: [EffortShare::new(speed_mps); 4],
            }
        }

        fn run(&mut self, seconds: f64, effort: Effort, speeds: impl Fn(f64) -> [f64; 4]) {
            for k in 0..(seconds * 1000.0) as u32 {
                let axles_mps = speeds(0.001 * f64::from(k));
                let mean_share = self.shares.iter().map(EffortShare::share).sum::<f64>() / 4.0;
                (self.reference).update(axles_mps.into_iter(), effort, mean_share, 0.001);
                for (share, axle_mps) in self.shares.iter_mut().zip(axles_mps) {
                    share.update(axle_mps, &self.reference, 0.001);
                }
            }
        }

        fn acts(&self) -> bool {
            self.shares.iter().any(EffortShare::acts)
        }
    }

    /// A slide that is no faster than the brakes could stop the train is not seen, a faster one is, also of
    /// all axles at once. The same of slip. Fails where the reference changes more slowly than brakes and
    /// motors could make it, or faster.
    #[test]
    fn a_slow_slide_of_all_axles_is_not_seen() {
        for (effort, changes_mps2, seen) in [
            (BRAKE, -1.9, false),
            (BRAKE, -6.0, true),
            (PULL, 1.6, false),
            (PULL, 6.0, true),
        ] {
            let mut bogies = Bogies::new(20.0);
            bogies.run(1.0, effort, |t| [20.0 + changes_mps2 * t; 4]);
            assert_eq!(bogies.acts(), seen, "{changes_mps2} m/s^2");
        }
    }

    /// All axles slide at once, are released and come back: nothing may be given back to them before one of
    /// them rolls. Fails where the reference that has fallen with them is taken for the train's speed.
    #[test]
    fn axles_that_come_back_are_waited_for() {
        let mut bogies = Bogies::new(20.0);
        bogies.run(1.0, BRAKE, |t| [20.0 - 12.0 * t; 4]);
        bogies.run(2.0, BRAKE, |t| [8.0 + 6.0 * t; 4]);
        assert!(bogies.shares.iter().all(|s| s.share() < 0.2));
        bogies.run(1.5, BRAKE, |t| [20.0 - 0.3 * t; 4]);
        assert!(!bogies.acts());
    }

    /// From brakes to traction with an axle that still slides, from traction to brakes with one that still
    /// slips, and with a second without effort in between: some seconds later no axle is held back. So it is
    /// when the train rolls backward. Fails where a reference that goes with the last effort is kept.
    #[test]
    fn a_change_of_effort_leaves_no_wrong_reference() {
        for (before, after, off_mps) in [(BRAKE, PULL, 5.0), (PULL, BRAKE, 20.0)] {
            for (rolls_s, sign) in [(0.0, 1.0), (1.0, 1.0), (0.0, -1.0)] {
                let mut bogies = Bogies::new(sign * 14.0);
                let [rolling, off] = [14.0, off_mps].map(|v| sign * v);
                bogies.run(1.0, before, |_| [rolling, off, rolling, rolling]);
                assert!(bogies.acts());
                let back = |t: f64| off + (rolling - off) * (t / 1.5).min(1.0);
                bogies.run(rolls_s, ROLL, |_| [rolling, off, rolling, rolling]);
                bogies.run(4.0, after, |t| [rolling, back(t), rolling, rolling]);
                assert!(!bogies.acts(), "{off_mps} {rolls_s} {sign}");
            }
        }
    }
}
