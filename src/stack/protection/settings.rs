//! What a scenario may say about the protection.

use crate::track::{Checker, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the train protection. Defaults: a metro train of class B, and the typical ranges
/// of IEEE 1474.1 for the delays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ProtectionSettings {
    /// Speed limit of the line, km/h.
    pub line_speed_kmh: f64,
    /// Speed limit while the position is unknown, km/h (restricted manual driving).
    pub restricted_kmh: f64,
    /// Position that the driver set before departure, m of chainage of the train head; without
    /// it the first fix or balise tells.
    pub initial_chainage_m: Option<f64>,
    /// One sigma of that position, m.
    pub initial_sigma_m: f64,
    /// The movement authority ends this far before an obstacle, m: room to clear it. The service
    /// brake stops the train there.
    pub safety_distance_m: f64,
    /// The emergency brake, in the worst case, stops the train this far before an obstacle, m:
    /// how well its place is known (10 m, as IEEE 1474.1 wants of a train's).
    pub danger_distance_m: f64,
    /// How many sigma of its position the train is taken to be ahead of its estimate.
    pub position_sigmas: f64,
    /// Odometer error, share of the distance run (wheel wear, slip).
    pub odometer_drift: f64,
    /// Odometer speed error, km/h.
    pub speed_error_kmh: f64,
    /// No fix makes the position better than this, m, one sigma (survey and mounting errors do
    /// not average out).
    pub sigma_floor_m: f64,
    /// One sigma of the position given by a balise, m.
    pub balise_sigma_m: f64,
    /// A fix further off than this many sigma is refused.
    pub gate_sigmas: f64,
    /// Time of the onboard equipment to react, s, with traction still on.
    pub reaction_s: f64,
    /// From there until traction is off, s.
    pub traction_cut_s: f64,
    /// Greatest acceleration by traction on level track, m/s^2.
    pub traction_mps2: f64,
    /// Brake build-up, from nothing to the full rate along a ramp, s.
    pub brake_buildup_s: f64,
    /// Guaranteed rate of the emergency brake on level track, m/s^2.
    pub emergency_mps2: f64,
    /// Rate of the full service brake on level track, m/s^2.
    pub service_mps2: f64,
    /// Rotating mass as a share of the train's mass.
    pub rotating_mass: f64,
    /// Train length, m.
    pub train_length_m: f64,
    /// Time that the driver has from the permitted speed, where he is warned, to the
    /// intervention, s.
    pub driver_time_s: f64,
    /// Over the line speed by this: service brake, km/h.
    pub service_margin_kmh: f64,
    /// Over the line speed by this: emergency brake, km/h.
    pub emergency_margin_kmh: f64,
    /// Without odometer samples for this long, the emergency brake is applied, s.
    pub odometer_timeout_s: f64,
    /// A device whose warning was not refreshed for this long is shown as silent, s (its warning
    /// stays in force).
    pub radio_timeout_s: f64,
}

impl Default for ProtectionSettings {
    fn default() -> Self {
        Self {
            line_speed_kmh: 80.0,
            restricted_kmh: 25.0,
            initial_chainage_m: None,
            initial_sigma_m: 5.0,
            safety_distance_m: 25.0,
            danger_distance_m: 10.0,
            position_sigmas: 3.0,
            odometer_drift: 0.02,
            speed_error_kmh: 3.0,
            sigma_floor_m: 0.3,
            balise_sigma_m: 0.5,
            gate_sigmas: 5.0,
            reaction_s: 0.5,
            traction_cut_s: 0.5,
            traction_mps2: 1.0,
            brake_buildup_s: 1.5,
            emergency_mps2: 1.0,
            service_mps2: 0.8,
            rotating_mass: 0.08,
            train_length_m: 118.0,
            driver_time_s: 4.0,
            service_margin_kmh: 5.5,
            emergency_margin_kmh: 7.5,
            odometer_timeout_s: 1.0,
            radio_timeout_s: 5.0,
        }
    }
}

impl ProtectionSettings {
    /// Appends what is wrong, with keys under `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        let mut check = Checker::new(at, problems);
        check.within("line_speed_kmh", self.line_speed_kmh, 5.0..=200.0, "km/h");
        if let Some(chainage) = self.initial_chainage_m {
            check.within("initial_chainage_m", chainage, -1e5..=1e6, "m");
        }
        check.within("initial_sigma_m", self.initial_sigma_m, 0.01..=1e3, "m");
        check.within(
            "safety_distance_m",
            self.safety_distance_m,
            self.danger_distance_m.max(0.0)..=500.0,
            "m",
        );
        check.within(
            "danger_distance_m",
            self.danger_distance_m,
            0.0..=500.0,
            "m",
        );
        check.within("restricted_kmh", self.restricted_kmh, 1.0..=50.0, "km/h");
        check.within("position_sigmas", self.position_sigmas, 0.0..=10.0, "");
        check.within("odometer_drift", self.odometer_drift, 0.0..=0.5, "");
        check.within("speed_error_kmh", self.speed_error_kmh, 0.0..=20.0, "km/h");
        check.within("sigma_floor_m", self.sigma_floor_m, 0.0..=50.0, "m");
        check.within("balise_sigma_m", self.balise_sigma_m, 0.01..=50.0, "m");
        check.within("gate_sigmas", self.gate_sigmas, 1.0..=100.0, "");
        check.within("reaction_s", self.reaction_s, 0.0..=5.0, "s");
        check.within("traction_cut_s", self.traction_cut_s, 0.0..=5.0, "s");
        check.within("traction_mps2", self.traction_mps2, 0.0..=3.0, "m/s^2");
        check.within("brake_buildup_s", self.brake_buildup_s, 0.0..=10.0, "s");
        check.within("emergency_mps2", self.emergency_mps2, 0.4..=3.0, "m/s^2");
        check.within(
            "service_mps2",
            self.service_mps2,
            0.4..=self.emergency_mps2.max(0.4),
            "m/s^2",
        );
        check.within("rotating_mass", self.rotating_mass, 0.0..=0.5, "");
        check.within("train_length_m", self.train_length_m, 5.0..=500.0, "m");
        check.within("driver_time_s", self.driver_time_s, 0.0..=20.0, "s");
        check.within(
            "service_margin_kmh",
            self.service_margin_kmh,
            0.5..=self.emergency_margin_kmh.max(0.5),
            "km/h",
        );
        check.within(
            "emergency_margin_kmh",
            self.emergency_margin_kmh,
            0.5..=30.0,
            "km/h",
        );
        check.within(
            "odometer_timeout_s",
            self.odometer_timeout_s,
            0.1..=30.0,
            "s",
        );
        check.within("radio_timeout_s", self.radio_timeout_s, 0.1..=600.0, "s");
    }
}
