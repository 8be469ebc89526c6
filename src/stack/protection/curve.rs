//! Braking curves: how far a train runs until the brake has stopped it, and how fast it may be to
//! stop in time.
//!
//! The safe braking model of IEEE 1474.1, phase by phase: reaction (traction still on, the worst
//! case), traction cut (it ramps down), brake build-up (the brake ramps up), then the guaranteed
//! rate. In the last phase, the longest, gradients enter by height: with kinetic energy per mass
//! v^2/2 (1 + rho), rho the rotating mass,
//!
//! v^2 = 2 [a (x_target - x) + g (z_target - z) / (1 + rho)],
//!
//! which is exact on any profile; z is the mean height over the train's length. Before that the
//! steepest descent on the way is taken.

use super::ProtectionSettings;
use crate::numerics::bisected;
use crate::track::Track;

/// Standard gravity.
const G_MPS2: f64 = 9.80665;
/// Steepest gradient considered where a bound over all lines is wanted.
const STEEP: f64 = 0.035;
/// Distance of the tabulated heights: the chord of a vertical curve of 2 km radius is off by
/// 1.6 mm.
const STEP_M: f64 = 5.0;
/// How far the table goes beyond both ends of the line.
const BEYOND_M: f64 = 1000.0;
/// No train is faster.
pub(super) const FASTEST_MPS: f64 = 70.0;

/// Mean height of a train over its length, by the chainage of its head.
#[derive(Clone, Debug)]
pub(super) struct Grades {
    first_m: f64,
    heights_m: Vec<f64>,
    per_slope_mps2: f64,
}

impl Grades {
    /// From the map, with a kilometre beyond both ends.
    pub fn new(map: &Track, settings: &ProtectionSettings) -> Self {
        let steps = (settings.length_m().clamp(STEP_M, 1000.0) / STEP_M).round() as usize;
        let first_m = -BEYOND_M;
        let count = ((map.alignment.length_m() + 2.0 * BEYOND_M) / STEP_M).clamp(2.0, 1e6) as usize;
        let rail: Vec<f64> = (0..count + steps)
            .map(|k| first_m + (k as f64 - steps as f64) * STEP_M)
            .map(|s| map.alignment.at(s).origin.z)
            .collect();
        // Trapezoids from tail (k) to head (k + steps).
        let heights_m = rail
            .windows(steps + 1)
            .map(|w| (w.iter().sum::<f64>() - 0.5 * (w[0] + w[steps])) / steps as f64)
            .collect();
        Self {
            first_m,
            heights_m,
            per_slope_mps2: G_MPS2 / (1.0 + settings.rotating_mass.max(0.0)),
        }
    }

    fn height_m(&self, s_m: f64) -> f64 {
        let last = self.heights_m.len() - 1;
        let x = ((s_m - self.first_m) / STEP_M).clamp(0.0, last as f64);
        let k = (x as usize).min(last.saturating_sub(1));
        let next = self.heights_m[(k + 1).min(last)];
        self.heights_m[k] + (next - self.heights_m[k]) * (x - k as f64)
    }

    /// Acceleration by gravity at a head's chainage, downhill positive.
    pub fn pull_mps2(&self, s_m: f64) -> f64 {
        self.per_slope_mps2 * (self.height_m(s_m - 0.5) - self.height_m(s_m + 0.5))
    }

    /// The most of it over a stretch, at its ends and middle.
    fn strongest_pull_mps2(&self, from_m: f64, to_m: f64) -> f64 {
        let middle = 0.5 * (from_m + to_m);
        self.pull_mps2(from_m)
            .max(self.pull_mps2(middle))
            .max(self.pull_mps2(to_m))
    }
}

/// How a brake answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BrakeModel {
    /// Nothing happens yet; traction on.
    pub reaction_s: f64,
    /// Traction ramps down.
    pub cut_s: f64,
    /// The brake ramps up.
    pub buildup_s: f64,
    /// Traction acceleration meanwhile.
    pub traction_mps2: f64,
    /// Then, on level track.
    pub rate_mps2: f64,
}

/// State at the end of the phases before the full rate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PhaseEnd {
    way_m: f64,
    speed_mps: f64,
}

impl BrakeModel {
    /// The guaranteed emergency brake with everything against it.
    pub fn emergency(s: &ProtectionSettings) -> Self {
        Self {
            reaction_s: s.reaction_s,
            cut_s: s.traction_cut_s,
            buildup_s: s.brake_buildup_s,
            traction_mps2: s.traction_mps2,
            rate_mps2: s.emergency_mps2,
        }
    }

    /// The same after an intervention has already cut traction.
    pub fn traction_is_cut(self) -> Self {
        Self {
            cut_s: 0.0,
            traction_mps2: 0.0,
            ..self
        }
    }

    /// The service brake by which the train approaches an obstacle, at the rate of the poorest rails;
    /// counted from the end of the driver's time.
    pub fn service(s: &ProtectionSettings) -> Self {
        Self {
            traction_mps2: 0.0,
            rate_mps2: s.service_mps2.min(s.low_adhesion_mps2),
            ..Self::emergency(s)
        }
    }

    /// The same brake, demanded `on_s` ago with traction cut.
    pub fn demanded_for(self, on_s: f64) -> Self {
        let building_s = (on_s - self.reaction_s).max(0.0);
        Self {
            reaction_s: (self.reaction_s - on_s).max(0.0),
            buildup_s: (self.buildup_s - building_s).max(0.0),
            ..self.traction_is_cut()
        }
    }

    /// Way and speed through reaction, cut and build-up under a constant pull.
    fn run_up(&self, speed_mps: f64, pull_mps2: f64) -> PhaseEnd {
        let traction = self.traction_mps2;
        let react = phase(
            PhaseEnd {
                way_m: 0.0,
                speed_mps,
            },
            self.reaction_s,
            (pull_mps2 + traction, pull_mps2 + traction),
        );
        let cut = phase(react, self.cut_s, (pull_mps2 + traction, pull_mps2));
        phase(cut, self.buildup_s, (pull_mps2, pull_mps2 - self.rate_mps2))
    }

    /// Whether a train with its head at `at_m` stops with its head before `target_m`.
    pub fn stops(&self, grades: &Grades, at_m: f64, speed_mps: f64, target_m: f64) -> bool {
        let lead_s = self.reaction_s + self.cut_s + self.buildup_s;
        let pull = grades.strongest_pull_mps2(at_m, at_m + speed_mps * lead_s);
        let run = self.run_up(speed_mps, pull);
        let on = at_m + run.way_m;
        let room = target_m - on;
        let climb = grades.height_m(target_m) - grades.height_m(on);
        room >= 0.0
            && run.speed_mps.powi(2)
                <= 2.0 * (self.rate_mps2 * room + grades.per_slope_mps2 * climb)
    }

    /// Greatest speed with which a train at `at_m` stops before `target_m`, when it runs on for
    /// `wait_s` first; 0 where not even a standing train is safe.
    pub fn speed_mps(&self, grades: &Grades, at_m: f64, target_m: f64, wait_s: f64) -> f64 {
        let stops = |speed_mps| self.stops(grades, at_m + speed_mps * wait_s, speed_mps, target_m);
        bisected((0.0, FASTEST_MPS), 36, stops).0
    }

    /// Stopping distance on a constant gradient.
    pub fn distance_m(&self, speed_mps: f64, pull_mps2: f64) -> f64 {
        let run = self.run_up(speed_mps, pull_mps2);
        let rate = (self.rate_mps2 - pull_mps2).max(1e-3);
        run.way_m + run.speed_mps.powi(2) / (2.0 * rate)
    }
}

/// Runs on for `time_s` while the acceleration goes linearly from the first to the second value;
/// ends early at a standstill.
fn phase(from: PhaseEnd, time_s: f64, (a0, a1): (f64, f64)) -> PhaseEnd {
    if time_s <= 0.0 {
        return from;
    }
    let jerk = (a1 - a0) / time_s;
    let speed = |t: f64| from.speed_mps + a0 * t + 0.5 * jerk * t * t;
    let way = |t: f64| from.speed_mps * t + 0.5 * a0 * t * t + jerk * t * t * t / 6.0;
    let end = speed(time_s);
    if end > 0.0 {
        return PhaseEnd {
            way_m: from.way_m + way(time_s),
            speed_mps: end,
        };
    }
    // The speed is a parabola that ends at or under 0: the last root from above.
    let (_, stopped_s) = bisected((0.0, time_s), 40, |t| speed(t) > 0.0);
    PhaseEnd {
        way_m: from.way_m + way(stopped_s).max(0.0),
        speed_mps: 0.0,
    }
}

/// Room that must lie between the ends of service and emergency braking so that a good service
/// stop never crosses the emergency curve: the most, over all speeds, by which the emergency
/// distance (speed error in, traction cut) exceeds what is left of a service stop.
pub(super) fn overlap_m(settings: &ProtectionSettings, speed_error_mps: f64) -> f64 {
    let emergency = BrakeModel::emergency(settings).traction_is_cut();
    let service = BrakeModel::service(settings);
    let uphill_pull_mps2 = -G_MPS2 * STEEP / (1.0 + settings.rotating_mass.max(0.0));
    (0..=240)
        .map(|k| f64::from(k) * 0.25)
        .flat_map(|v| [0.0, uphill_pull_mps2].map(|pull| (v, pull)))
        .map(|(v, pull)| {
            let left = v * v / (2.0 * (service.rate_mps2 - pull));
            emergency.distance_m(v + speed_error_mps, pull) - left
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::tests::map;
    use super::*;

    const EMERGENCY: BrakeModel = BrakeModel {
        reaction_s: 0.5,
        cut_s: 0.5,
        buildup_s: 1.5,
        traction_mps2: 1.0,
        rate_mps2: 1.0,
    };

    /// Phase sums written out: v1 = v + a t, cut a t / 2 and a t^2 / 3, build-up b t / 2 and
    /// b t^2 / 6, then v^2 / 2 b. A missing or doubled phase shows.
    #[test]
    fn val_level_stopping_distance() {
        for kmh in [20.0, 60.0, 100.0] {
            let v0 = kmh / 3.6;
            let v1 = v0 + 0.5;
            let v2 = v1 + 0.25;
            let v3 = v2 - 0.75;
            let d = v0 * 0.5
                + 0.125
                + (v1 * 0.5 + 0.25 / 3.0)
                + (v2 * 1.5 - 2.25 / 6.0)
                + v3 * v3 / 2.0;
            assert!((EMERGENCY.distance_m(v0, 0.0) - d).abs() < 1e-9);
        }
    }

    /// Curve and distance must be inverse to each other, on level track and on gradients.
    #[test]
    fn curve_inverts_the_distance() {
        let settings = ProtectionSettings::default();
        for permille in [-28.0, 0.0, 28.0] {
            let map = map(permille);
            let grades = Grades::new(&map, &settings);
            let pull = grades.pull_mps2(1500.0);
            assert!((pull + 9.80665 * permille / 1000.0 / 1.08).abs() < 1e-9);
            for v in [2.0, 10.0, 25.0] {
                let d = EMERGENCY.distance_m(v, pull);
                let curve = EMERGENCY.speed_mps(&grades, 1500.0, 1500.0 + d, 0.0);
                assert!(
                    (curve - v).abs() < 1e-3,
                    "{permille} permille, {v} m/s: {curve}"
                );
            }
        }
    }

    /// A brake answers step by step after its demand: it reacts, builds up, and is on.
    #[test]
    fn a_demanded_brake_comes_on() {
        let left_s = |on_s| {
            let brake = EMERGENCY.demanded_for(on_s);
            (brake.reaction_s, brake.buildup_s)
        };
        assert_eq!(left_s(0.25), (0.25, 1.5));
        assert_eq!(left_s(1.0), (0.0, 1.0));
        assert_eq!(left_s(5.0), (0.0, 0.0));
        let on_m = EMERGENCY.demanded_for(5.0).distance_m(20.0, 0.0);
        assert!((on_m - 200.0).abs() < 1e-9);
    }

    /// A train that stops while the brake builds up, or stands, must not get a negative way.
    #[test]
    fn slow_trains_stop_within_the_build_up() {
        let service = BrakeModel {
            traction_mps2: 0.0,
            ..EMERGENCY
        };
        let d = service.distance_m(0.1, 0.0);
        // 1 s at 0.1 m/s, then v = 0.1 - t^2 / 3 until t = 0.5477 s.
        let t = 0.3f64.sqrt();
        assert!((d - (0.1 + 0.1 * t - t.powi(3) / 9.0)).abs() < 1e-6, "{d}");
        assert!(service.distance_m(0.0, 0.0).abs() < 1e-9);
    }
}
