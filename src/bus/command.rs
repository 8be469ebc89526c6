//! Commands to the train, and the driver's display.

use super::SimTime;
use crate::track::Place;
use serde::{Deserialize, Serialize};

/// How hard the protection brakes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BrakeDemand {
    /// None.
    #[default]
    None,
    /// Full service brake, traction cut.
    Service,
    /// Emergency brake until standstill.
    Emergency,
}

/// From a piece of equipment to the train, every cycle. The train obeys all that it is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainCommand {
    /// Overrides the driver where it is not `None`.
    pub brake: BrakeDemand,
    /// The speed that the driver may not exceed; the automatic driver keeps under it.
    pub permitted_speed_mps: f64,
}

impl TrainCommand {
    /// No brake, no speed limit.
    pub const UNSUPERVISED: Self = Self {
        brake: BrakeDemand::None,
        permitted_speed_mps: f64::INFINITY,
    };

    /// The harder brake and the lower speed. A speed that is no number permits none.
    #[must_use]
    pub fn stricter(self, other: Self) -> Self {
        let speeds = [self.permitted_speed_mps, other.permitted_speed_mps];
        let speeds = speeds.map(|speed| if speed.is_nan() { 0.0 } else { speed });
        Self {
            brake: self.brake.max(other.brake),
            permitted_speed_mps: speeds[0].min(speeds[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order of commands, and a speed that is no number, must not set a train free.
    #[test]
    fn two_commands_give_the_stricter_of_each_part() {
        let slow = TrainCommand {
            brake: BrakeDemand::None,
            permitted_speed_mps: 5.0,
        };
        let brake = TrainCommand {
            brake: BrakeDemand::Service,
            permitted_speed_mps: 20.0,
        };
        let both = TrainCommand {
            brake: BrakeDemand::Service,
            permitted_speed_mps: 5.0,
        };
        assert_eq!(slow.stricter(brake), both);
        assert_eq!(brake.stricter(slow), both);
        assert_eq!(both.stricter(TrainCommand::UNSUPERVISED), both);
        let wrong = TrainCommand {
            permitted_speed_mps: f64::NAN,
            ..slow
        };
        for both in [
            wrong.stricter(slow),
            TrainCommand::UNSUPERVISED.stricter(wrong),
        ] {
            assert!(both.permitted_speed_mps.abs() < 1e-12);
        }
    }
}

/// One lamp with its buzzer, on the driver's display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Indicator {
    /// Nothing on the way.
    #[default]
    NormalGreen,
    /// A dangerous obstacle ahead, or too fast: brake; red, with buzzer.
    BrakeWarningRed,
    /// The automatic brake failed: brake by hand; emergency lamp and buzzer.
    Emergency,
}

/// The driver's display.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DriverDisplay {
    /// The equipment has power.
    pub power: bool,
    /// Which lamp is lit.
    pub lamp: Indicator,
    /// Where the train takes its head to be.
    pub position: Option<Place>,
    /// Distance to the obstacle ahead.
    pub distance_to_obstacle_m: Option<f64>,
    /// One line of text.
    pub text: String,
}

/// How far the speed supervision has gone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Supervision {
    /// The speed is permitted.
    #[default]
    Permitted,
    /// Over the permitted speed: the driver is warned.
    Warning,
    /// The service brake intervenes, or holds the train before an obstacle.
    Service,
    /// The emergency brake intervenes.
    Emergency,
}

/// One cycle of the protection, for the record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProtectionReport {
    /// When.
    pub time: SimTime,
    /// Estimated place of the train head.
    pub position: Option<Place>,
    /// One sigma of it.
    pub sigma_m: Option<f64>,
    /// Estimated speed.
    pub speed_mps: f64,
    /// Permitted speed here.
    pub permitted_mps: f64,
    /// Speed at which the service brake intervenes.
    pub service_mps: f64,
    /// Speed at which the emergency brake intervenes.
    pub emergency_mps: f64,
    /// How far the supervision has gone.
    pub supervision: Supervision,
    /// Where the movement authority ends, while something limits it.
    pub authority_end: Option<Place>,
    /// Slide and slip protection acts on the wheelset of the odometer.
    pub wheels_slide: bool,
    /// The emergency brake is held to stop the train before the nearest high danger, by the rate that is
    /// guaranteed on rails as the wheels found them; true without one.
    pub stops_in_time: bool,
    /// What goes to the train.
    pub command: TrainCommand,
    /// What the driver sees.
    pub display: DriverDisplay,
}
