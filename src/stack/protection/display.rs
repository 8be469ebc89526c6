//! What the driver sees.

use crate::bus::{DangerLevel, DriverDisplay, Indicator, Supervision};

/// All that the display depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Situation {
    pub position_m: Option<f64>,
    /// The nearest obstacle ahead.
    pub obstacle: Option<Ahead>,
    pub supervision: Supervision,
    pub permitted_mps: f64,
    pub brake_failed: bool,
    pub odometer_lost: bool,
    pub radio_timeout_s: f64,
}

/// What a device has warned of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    pub distance_m: f64,
    pub danger: DangerLevel,
    /// Time since the device was heard.
    pub silent_s: f64,
    /// It has found nothing, but cannot see.
    pub blind: bool,
}

pub(super) fn display(s: &Situation) -> DriverDisplay {
    let danger = s.obstacle.map_or(DangerLevel::None, |o| o.danger);
    let lamp = if s.brake_failed {
        Indicator::Emergency
    } else if danger == DangerLevel::High || s.supervision != Supervision::Permitted {
        Indicator::BrakeWarningRed
    } else {
        Indicator::NormalGreen
    };
    DriverDisplay {
        power: true,
        lamp,
        position_m: s.position_m,
        distance_to_obstacle_m: s.obstacle.map(|o| o.distance_m),
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
        Some(ahead) => {
            let what = match (ahead.blind, ahead.danger) {
                (true, _) => "Track not watched",
                (false, DangerLevel::High) => "Obstacle on the track",
                (false, _) => "Object beside the track",
            };
            let radio = if ahead.silent_s > s.radio_timeout_s {
                format!(", not heard of for {:.0} s", ahead.silent_s)
            } else {
                String::new()
            };
            format!("{what} in {:.0} m{action}{radio}", ahead.distance_m)
        }
        None if s.position_m.is_none() => format!("Position unknown{action}"),
        None => format!("Permitted {:.0} km/h{action}", s.permitted_mps * 3.6),
    }
}
