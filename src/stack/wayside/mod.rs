//! Obstacle detection in a wayside box.

mod settings;

pub use settings::WaysideSettings;

use crate::bus::{
    Frame, LidarScan, ObstacleWarning, TrainReport, WaysideCalibration, WaysideReport,
};
use crate::track::Tunnel;
use std::sync::Arc;

/// One wayside device.
#[derive(Clone, Debug)]
pub struct WaysideDetector {
    settings: WaysideSettings,
    calibration: WaysideCalibration,
    map: Arc<Tunnel>,
}

impl WaysideDetector {
    /// A device as calibrated, on its line.
    pub fn new(
        settings: &WaysideSettings,
        calibration: WaysideCalibration,
        map: Arc<Tunnel>,
    ) -> Self {
        Self {
            settings: settings.clone(),
            calibration,
            map,
        }
    }

    /// Looks at one frame; `train` is the last position report of the train on approach.
    pub fn on_frame(
        &mut self,
        frame: &Frame,
        _scan: Option<&LidarScan>,
        _train: Option<TrainReport>,
    ) -> WaysideReport {
        let _ = (&self.settings, &self.calibration, &self.map);
        WaysideReport {
            time: frame.start,
            number: frame.number,
            learning: true,
            passage_possible: true,
            ..WaysideReport::default()
        }
    }

    /// The message that this report gives rise to, if any.
    pub fn message(&mut self, _report: &WaysideReport) -> Option<ObstacleWarning> {
        None
    }
}
