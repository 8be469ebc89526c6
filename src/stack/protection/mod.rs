//! Onboard warning and control.

mod settings;

pub use settings::ProtectionSettings;

use crate::bus::{Delivery, OdometerSample, PositionFix, ProtectionReport, SimTime, TrainCommand};
use crate::track::Tunnel;
use std::sync::Arc;

/// The protection of one train.
#[derive(Clone, Debug)]
pub struct Protection {
    settings: ProtectionSettings,
    map: Arc<Tunnel>,
}

impl Protection {
    /// Switched on, with the driver's position setting if there is one.
    pub fn new(settings: &ProtectionSettings, map: Arc<Tunnel>) -> Self {
        Self {
            settings: settings.clone(),
            map,
        }
    }

    /// Takes a position from the positioning stack. The caller passes the fixes of one method.
    pub fn on_fix(&mut self, _fix: &PositionFix) {}

    /// Takes a sample of the odometer.
    pub fn on_odometer(&mut self, _sample: &OdometerSample) {}

    /// The antenna on the train head passed over a balise.
    pub fn on_balise(&mut self, _name: &str, _time: SimTime) {}

    /// Takes a message, by balise or by radio.
    pub fn on_delivery(&mut self, _delivery: &Delivery) {}

    /// Decides; called 10 times a second.
    pub fn cycle(&mut self, time: SimTime) -> ProtectionReport {
        let _ = &self.map;
        let permitted_mps = self.settings.line_speed_kmh / 3.6;
        ProtectionReport {
            time,
            permitted_mps,
            command: TrainCommand {
                permitted_speed_mps: permitted_mps,
                ..TrainCommand::default()
            },
            ..ProtectionReport::default()
        }
    }
}
