//! The `paper` positioning and its baseline `mono`, from samples to fixes.

use super::LedSettings;
use crate::bus::{ImuSample, LedReport, OdometerSample, RigCalibration, StereoPair};
use crate::track::Tunnel;
use std::sync::Arc;

/// Positions the train from stereo pairs of a lamp, as it would on board: raw images, odometer
/// and inertial samples, the rig's calibration and the surveyed map are all that it gets.
#[derive(Debug)]
pub struct LedPositioner {
    _settings: LedSettings,
    _rig: RigCalibration,
    _map: Arc<Tunnel>,
}

impl LedPositioner {
    /// For one rig on one line.
    pub fn new(settings: &LedSettings, rig: RigCalibration, map: Arc<Tunnel>) -> Self {
        Self {
            _settings: settings.clone(),
            _rig: rig,
            _map: map,
        }
    }

    /// Takes an inertial sample; samples come in order of time.
    pub fn on_imu(&mut self, _sample: &ImuSample) {}

    /// Takes an odometer sample; samples come in order of time.
    pub fn on_odometer(&mut self, _sample: &OdometerSample) {}

    /// Takes a pair of images, after all samples up to the end of its exposure.
    pub fn on_pair(&mut self, pair: &StereoPair) -> LedReport {
        LedReport {
            time: pair.left.start,
            number: pair.left.number,
            left: Vec::new(),
            right: Vec::new(),
            fixes: Vec::new(),
        }
    }
}
