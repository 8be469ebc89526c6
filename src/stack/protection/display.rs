//! What the driver sees.

use crate::bus::{DangerLevel, DriverDisplay, Lamp, Supervision};

/// All that the display depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Situation {
    pub position_m: Option<f64>,
    /// Distance to the nearest obstacle ahead, its danger, and time since its device was heard.
    pub obstacle: Option<(f64, DangerLevel, f64)>,
    pub supervision: Supervision,
    pub permitted_mps: f64,
    pub brake_failed: bool,
    pub odometer_lost: bool,
    pub radio_timeout_s: f64,
}

pub(super) fn display(s: &Situation) -> DriverDisplay {
    let danger = s.obstacle.map_or(DangerLevel::None, |o| o.1);
    let lamp = if s.brake_failed {
        Lamp::Emergency
    } else if danger == DangerLevel::High || s.supervision != Supervision::Permitted {
        Lamp::BrakeWarningRed
    } else {
        Lamp::NormalGreen
    };
    DriverDisplay {
        power: true,
        lamp,
        position_m: s.position_m,
        distance_to_obstacle_m: s.obstacle.map(|o| o.0),
        text: text(s),
    }
}

fn text(s: &Situation) -> String {
    if s.brake_failed {
        return "Automatic brake failed: brake by hand".into();
    }
    if s.odometer_lost {
        return "Odometer silent: emergency brake".into();
    }
    let action = match s.supervision {
        Supervision::Emergency => ", emergency brake",
        Supervision::Service => ", service brake",
        Supervision::Warning => ", too fast",
        Supervision::Permitted => "",
    };
    match s.obstacle {
        Some((distance_m, danger, silent_s)) => {
            let what = if danger == DangerLevel::High {
                "Obstacle on the track"
            } else {
                "Object beside the track"
            };
            let radio = if silent_s > s.radio_timeout_s {
                format!(", not heard of for {silent_s:.0} s")
            } else {
                String::new()
            };
            format!("{what} in {distance_m:.0} m{action}{radio}")
        }
        None if s.position_m.is_none() => format!("Position unknown{action}"),
        None => format!("Permitted {:.0} km/h{action}", s.permitted_mps * 3.6),
    }
}
