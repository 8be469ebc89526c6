//! Lamps, as written.

use crate::settings::settings;
use crate::track::uid::LineCode;

/// The last of the numbers of 10 bits that lamps have.
pub const LAST_LAMP: u16 = 1023;

settings! {
    /// A row of lamps.
    pub struct LampRowEntry {
        /// Chainage of the first lamp, metres.
        from_m: f64 = 0.0;
        /// No lamp of the row stands beyond this chainage, metres. Default: the end of the line.
        to_m: Option<f64> = None;
        /// From lamp to lamp, metres.
        spacing_m: f64 = 10.0, in 0.1..=10_000.0;
        /// Left of the centreline, metres (negative: on the right wall).
        lateral_m: f64 = 2.70, in -60.0..=60.0;
        /// Above top of rail, metres.
        height_m: f64 = 3.20, in -1.0..=30.0;
        /// Turn of the disc's axis from the direction across the track towards trains that come up
        /// the line, degrees.
        aim_yaw_deg: f64 = 65.0, in -90.0..=90.0;
        /// Tilt of the disc's axis, up positive, degrees.
        aim_pitch_deg: f64 = -10.0, in -90.0..=90.0;
        /// Diameter of the luminous disc, metres.
        diameter_m: f64 = 0.25, in 0.01..=2.0;
        /// Electrical power, watts.
        power_w: f64 = 21.0, in 0.01..=10_000.0;
        /// Luminous efficacy, lumens a watt.
        efficacy_lm_per_w: f64 = 100.0, in 1.0..=700.0;
        /// Full angle at which the intensity has fallen to half, degrees.
        beam_deg: f64 = 60.0, in 5.0..=170.0;
        /// Duration of a chip of the code, microseconds.
        chip_us: f64 = 45.0, in 1.0..=10_000.0;
        /// How bits become chips.
        code: LineCode = LineCode::Manchester;
        /// Number of the row's first lamp; the others count up.
        first_number: u16 = 1;
    }
}

settings! {
    /// A single lamp. What is not given is as in `[lamps]`.
    #[derive(Default)]
    pub struct LampEntry {
        /// Lamp number.
        number: u16, in 0.0..=f64::from(LAST_LAMP);
        /// Chainage, metres.
        chainage_m: f64;
        /// Left of the centreline, metres.
        lateral_m: Option<f64>;
        /// Above top of rail, metres.
        height_m: Option<f64>;
        /// Turn of the disc's axis from the direction across the track towards trains that come up
        /// the line, degrees.
        aim_yaw_deg: Option<f64>;
        /// Tilt of the disc's axis, up positive, degrees.
        aim_pitch_deg: Option<f64>;
        /// Electrical power, watts.
        power_w: Option<f64>;
    }
}
