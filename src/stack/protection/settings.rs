//! What a scenario may say about the protection.

use crate::settings::{Checker, settings};

settings! {
    /// Settings of the train protection. Defaults: a metro train of class B, and the typical ranges
    /// of IEEE 1474.1 for the delays.
    pub struct ProtectionSettings {
        /// Speed limit of the line, km/h.
        line_speed_kmh: f64 = 80.0, in 5.0..=200.0;
        /// Speed limit while the position is unknown, km/h (restricted manual driving).
        restricted_kmh: f64 = 25.0, in 1.0..=50.0;
        /// Position that the driver set before departure, m of chainage of the train head; without
        /// it the first fix or balise tells.
        initial_chainage_m: Option<f64> = None, in -1e5..=1e6;
        /// Name of the track that it is on. Default: that on which the train starts.
        initial_track: Option<String> = None;
        /// One sigma of that position, m.
        initial_sigma_m: f64 = 5.0, in LEAST_SIGMA_M..=1e3;
        /// The movement authority ends this far before an obstacle, m: room to clear it. The
        /// service brake stops the train there.
        safety_distance_m: f64 = 25.0, in 0.0..=500.0;
        /// The emergency brake, in the worst case, stops the train this far before an obstacle, m:
        /// how well its place is known (10 m, as IEEE 1474.1 wants of a train's).
        danger_distance_m: f64 = 10.0, in 0.0..=500.0;
        /// How many sigma of its position the train is taken to be ahead of its estimate.
        position_sigmas: f64 = 3.0, in 0.0..=10.0;
        /// Odometer error, share of the distance run (wheel wear, slip).
        odometer_drift: f64 = 0.02, in 0.0..=0.5;
        /// One sigma of the odometer's distance and speed while slide and slip protection acts on its
        /// wheelset, share of what it says. It acts at some 10 %, and wheels slide deeper until it does.
        slide_error: f64 = 0.1, in 0.0..=1.0;
        /// Odometer speed error, km/h.
        speed_error_kmh: f64 = 3.0, in 0.0..=20.0;
        /// No fix makes the position better than this, m, one sigma (survey and mounting errors do
        /// not average out).
        sigma_floor_m: f64 = 0.3, in LEAST_SIGMA_M..=50.0;
        /// One sigma of the position given by a balise, m.
        balise_sigma_m: f64 = 0.5, in LEAST_SIGMA_M..=50.0;
        /// A fix further off than this many sigma is refused.
        gate_sigmas: f64 = 5.0, in 1.0..=100.0;
        /// Time of the onboard equipment to react, s, with traction still on.
        reaction_s: f64 = 0.5, in 0.0..=5.0;
        /// From there until traction is off, s.
        traction_cut_s: f64 = 0.5, in 0.0..=5.0;
        /// Greatest acceleration by traction on level track, m/s^2.
        traction_mps2: f64 = 1.0, in 0.0..=3.0;
        /// Brake build-up, from nothing to the full rate along a ramp, s.
        brake_buildup_s: f64 = 1.5, in 0.0..=10.0;
        /// Guaranteed rate of the emergency brake on level track, m/s^2.
        emergency_mps2: f64 = 1.0, in 0.4..=3.0;
        /// Rate of the full service brake on level track, m/s^2.
        service_mps2: f64 = 0.8, in 0.4..=3.0;
        /// Rate that the brakes reach on the poorest rails that the operator reckons with, m/s^2: the train
        /// approaches every obstacle by it, since what the rails ahead bear is not known, and the emergency
        /// brake is held to reach no more where wheels have slid. A film of leaves (friction 0.05) leaves
        /// some 0.4.
        low_adhesion_mps2: f64 = 0.4, in 0.1..=3.0;
        /// Rotating mass as a share of the train's mass.
        rotating_mass: f64 = 0.08, in 0.0..=0.5;
        /// Length that the equipment takes its train to have, m. Default: that of the train.
        train_length_m: Option<f64> = None, in 5.0..=500.0;
        /// Time that the driver has from the permitted speed, where he is warned, to the
        /// intervention, s.
        driver_time_s: f64 = 4.0, in 0.0..=20.0;
        /// Over the line speed by this: service brake, km/h.
        service_margin_kmh: f64 = 5.5, in 0.5..=30.0;
        /// Over the line speed by this: emergency brake, km/h.
        emergency_margin_kmh: f64 = 7.5, in 0.5..=30.0;
        /// Without odometer samples for this long, the emergency brake is applied, s.
        odometer_timeout_s: f64 = 1.0, in 0.1..=30.0;
        /// A device that has not been heard by radio for this long is silent, s: a warning of it stays
        /// in force, and all of the stretch that it watches counts as occupied.
        radio_timeout_s: f64 = 5.0, in 0.1..=600.0;
        /// The equipment was at work before the start, and had heard every device of the map by radio
        /// until then. Otherwise it is switched on at the start, and a device is silent until it is
        /// heard. Default: at work where the train starts at speed, else switched on.
        starts_under_way: Option<bool> = None;
        /// How far along the line to either side of it a device of the map watches, m.
        device_reach_m: f64 = 80.0, in 5.0..=500.0;
    }
    also check_order
}

/// No position is known better than this, metres, one sigma.
pub(super) const LEAST_SIGMA_M: f64 = 0.01;

/// Length of six cars of class B (GB 50157), metres.
const SIX_CARS_M: f64 = 118.0;

impl ProtectionSettings {
    /// Length of the train, metres; six cars of class B where nothing is said.
    pub fn length_m(&self) -> f64 {
        self.train_length_m.unwrap_or(SIX_CARS_M)
    }

    fn check_order(&self, check: &mut Checker<'_>) {
        let danger_m = self.danger_distance_m.max(0.0);
        check.within(
            "safety_distance_m",
            self.safety_distance_m,
            danger_m..=500.0,
        );
        let emergency = self.emergency_mps2.max(0.4);
        check.within("service_mps2", self.service_mps2, 0.4..=emergency);
        let emergency = self.emergency_margin_kmh.max(0.5);
        check.within(
            "service_margin_kmh",
            self.service_margin_kmh,
            0.5..=emergency,
        );
    }
}
