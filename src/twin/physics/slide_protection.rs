//! Slide and slip protection of a train. It knows how fast the axles turn, and nothing else: not how fast
//! the train runs, nor the state of the rails.
//!
//! An axle slides or slips where its speed is off the reference speed. While the train brakes that is the
//! speed of the fastest axle, and falls no faster than the effort that is let through can make it; under
//! traction it is that of the slowest, and rises no faster. (EN 15595 says what such systems must do; each
//! maker has its own rules.) When all axles slide slowly together, it follows them and sees nothing.

/// An axle slides or slips where its speed is off by this share and this speed.
const OFF_SHARE: f64 = 0.1;
const OFF_MPS: f64 = 0.3;
/// The effort is taken and given back in so many seconds.
const LET_GO_S: f64 = 0.1;
const GIVE_BACK_S: f64 = 1.0;
/// So does one whose speed runs away faster than any train's. With these figures a train of two cars stops
/// from 60 km/h on a film of leaves within 361 m (287 m is the least that friction allows); with others near
/// them, 353 to 377 m.
const RUNS_AWAY_MPS2: f64 = 4.0;
/// A released axle whose speed changes so much the other way comes back to the train's.
const COMES_BACK_MPS2: f64 = 0.5;
/// Over so long its acceleration is taken.
const SMOOTHED_S: f64 = 0.05;
/// What gradients and resistance add to what brakes and motors do.
const BY_GRADIENT_MPS2: f64 = 0.5;

/// What the protection takes for the train's speed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReferenceSpeed {
    speed_mps: f64,
    /// The train brakes; otherwise it pulls or coasts.
    brakes: bool,
}

impl ReferenceSpeed {
    /// Of a train whose wheels roll at a speed.
    pub fn new(speed_mps: f64) -> Self {
        Self {
            speed_mps,
            brakes: false,
        }
    }

    /// A step on, by the axles' speeds now. `hardest_mps2` is what the brakes, or the motors, would do to the
    /// train if no wheel slid.
    pub fn update(
        &mut self,
        axles_mps: impl Iterator<Item = f64>,
        brakes: bool,
        hardest_mps2: f64,
        dt_s: f64,
    ) {
        let change_mps = (hardest_mps2 + BY_GRADIENT_MPS2) * dt_s;
        self.brakes = brakes;
        self.speed_mps = if brakes {
            axles_mps.fold(self.speed_mps - change_mps, f64::max)
        } else {
            axles_mps.fold(self.speed_mps + change_mps, f64::min)
        };
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
            smooth_mps: axle_mps,
        }
    }

    /// A step on, by the axle's speed. An axle that comes back from its slide is waited for: where all
    /// have slid, the reference is too low until one of them rolls again.
    pub fn update(&mut self, axle_mps: f64, reference: &ReferenceSpeed, dt_s: f64) -> f64 {
        self.smooth_mps += (axle_mps - self.smooth_mps) * (dt_s / SMOOTHED_S).min(1.0);
        let gains_mps2 = (axle_mps - self.smooth_mps) / SMOOTHED_S;
        let away_mps2 = if reference.brakes {
            -gains_mps2
        } else {
            gains_mps2
        };
        let off_mps = (axle_mps - reference.speed_mps).abs();
        let slides =
            off_mps > OFF_SHARE * reference.speed_mps.abs() + OFF_MPS || away_mps2 > RUNS_AWAY_MPS2;
        let comes_back = away_mps2 < -COMES_BACK_MPS2;
        if slides {
            self.share = (self.share - dt_s / LET_GO_S).max(0.0);
        } else if !(self.acts() && comes_back) {
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

    /// While one axle still rolls, the others' slide must show; when all lock at once, the reference must
    /// stay above them; and an axle that rolls again must bring it back at once.
    #[test]
    fn the_reference_is_the_fastest_axle_while_braking() {
        let mut reference = ReferenceSpeed::new(20.1);
        for (axles_mps, expected_mps) in [
            ([20.0, 20.0, 20.0], 20.0),
            ([12.0, 19.9, 4.0], 19.9),
            ([0.0, 0.0, 0.0], 19.72),
            ([0.0, 0.0, 0.0], 19.54),
            ([0.0, 19.8, 0.0], 19.8),
        ] {
            reference.update(axles_mps.into_iter(), true, 1.3, 0.1);
            let speed_mps = reference.speed_mps;
            assert!((speed_mps - expected_mps).abs() < 1e-9, "{speed_mps}");
        }
    }

    /// The same under traction, where slipping axles run too fast.
    #[test]
    fn the_reference_is_the_slowest_axle_under_traction() {
        let mut reference = ReferenceSpeed::new(3.0);
        for (axles_mps, expected_mps) in [([3.0, 3.0], 3.0), ([9.0, 3.1], 3.1), ([9.0, 9.0], 3.25)]
        {
            reference.update(axles_mps.into_iter(), false, 1.0, 0.1);
            let speed_mps = reference.speed_mps;
            assert!((speed_mps - expected_mps).abs() < 1e-9, "{speed_mps}");
        }
    }

    /// A slide that is no faster than the brakes could stop the train is not seen: the protection has no
    /// other knowledge of the speed. Fails where it is given the true one.
    #[test]
    fn a_slow_slide_of_all_axles_is_not_seen() {
        for (loses_mps2, seen) in [(1.5, false), (6.0, true)] {
            let mut reference = ReferenceSpeed::new(20.0);
            let mut share = EffortShare::new(20.0);
            for k in 0..1000 {
                let axle_mps = 20.0 - 0.001 * loses_mps2 * f64::from(k);
                reference.update([axle_mps; 4].into_iter(), true, 1.3, 0.001);
                share.update(axle_mps, &reference, 0.001);
            }
            assert_eq!(share.acts(), seen, "{loses_mps2} m/s^2");
        }
    }
}
