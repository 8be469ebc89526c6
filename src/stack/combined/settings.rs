//! What combined positioning believes of its sensors.

use super::mode::Source;
use crate::settings::settings;

settings! {
    /// Settings of combined positioning. All are standard deviations unless they say what else they are.
    #[derive(Copy)]
    pub struct CombinedSettings {
        /// By how much the acceleration of a train that has no odometer changes, m/s2 in the root of a second: after ten
        /// seconds its speed is unknown to 3 m/s, what it may have braked or gained.
        acceleration_mps2: f64 = 1.0, in 1e-3..=10.0;
        /// Of the mean speed between two samples of the odometer, m/s: pulses, and creep that comes and goes.
        odometer_mps: f64 = 0.1, in 1e-4..=10.0;
        /// Of the odometer's scale: wheel wear between calibrations, and creep.
        odometer_scale: f64 = 0.01, in 0.0..=0.2;
        /// Time over which the scale's error changes, seconds: creep goes with effort.
        odometer_scale_s: f64 = 100.0, in 1.0..=1e6;
        /// Share of a fix's variance that changes slowly, 0 to 1.
        fix_correlated_share: f64 = 0.8, in 0.0..=1.0;
        /// Time constant of that, seconds.
        fix_correlation_s: f64 = 60.0, in 1.0..=1e6;
        /// Of a surveyed track along itself, against satellites' places, metres.
        map_m: f64 = 0.3, in 1e-3..=100.0;
        /// Of the place that the reads of a tag give, survey included, metres.
        tag_m: f64 = 0.3, in 1e-3..=10.0;
        /// No fix for so long, where there should be some, is a failure of the receiver, seconds.
        fix_silence_s: f64 = 1.6, in 0.1..=60.0;
        /// No report of the tag reader for so long is a failure of it, seconds. It reports whether or not it reads.
        tag_silence_s: f64 = 0.5, in 0.1..=60.0;
        /// No sample of the odometer for so long is a failure of it, seconds.
        odometer_silence_s: f64 = 0.3, in 0.01..=60.0;
        /// So many tags in a row that were passed and not read are a failure of the reader. One in ten is missed at
        /// 120 km/h: four in a row 1e-4.
        missed_tags: u32 = 4, in 1.0..=100.0;
        /// Rate of false alarms of a disagreement, a test.
        false_alarm: f64 = 1e-6, in 1e-15..=0.1;
        /// A source that has failed is back in order after it agreed for so long, seconds.
        recovery_s: f64 = 10.0, in 0.1..=600.0;
        /// Risk that the error is over the protection level, at any time.
        risk: f64 = 1e-5, in 1e-15..=0.1;
        /// Probability at any time that the receiver is wrong unnoticed (reflections, satellites).
        satellites_fault: f64 = 1e-4, in 0.0..=0.5;
        /// Probability at any time that the last tag was a wrong one (exchanged, or of another track).
        tags_fault: f64 = 1e-5, in 0.0..=0.5;
        /// Probability at any time that the odometer is wrong unnoticed (a slow slide, a lost pulse train).
        odometer_fault: f64 = 1e-3, in 0.0..=0.5;
        /// The antenna of the receiver behind the head, metres.
        antenna_behind_head_m: f64 = 10.0, in -10.0..=200.0;
        /// After a change of mode what the position would jump by fades with this time constant, seconds.
        fade_s: f64 = 3.0, in 0.01..=60.0;
    }
}

impl CombinedSettings {
    /// That a source is wrong unnoticed at any time.
    pub fn fault_probability(&self, source: Source) -> f64 {
        match source {
            Source::Satellites => self.satellites_fault,
            Source::Tags => self.tags_fault,
            Source::Odometer => self.odometer_fault,
        }
    }
}
