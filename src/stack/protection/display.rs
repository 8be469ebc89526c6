//! What the driver sees.

use crate::bus::{DangerLevel, DriverDisplay, Indicator, ProtectionReport, Supervision};

/// What the display depends on besides the report of the cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Situation {
    /// The nearest obstacle ahead.
    pub obstacle: Option<Ahead>,
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

pub(super) fn display(report: &ProtectionReport, s: &Situation) -> DriverDisplay {
    let danger = s.obstacle.map_or(DangerLevel::None, |o| o.danger);
    let lamp = if s.brake_failed {
        Indicator::Emergency
    } else if danger == DangerLevel::High || report.supervision != Supervision::Permitted {
        Indicator::BrakeWarningRed
    } else {
        Indicator::NormalGreen
    };
    DriverDisplay {
        power: true,
        lamp,
        position: report.position,
        distance_to_obstacle_m: s.obstacle.map(|o| o.distance_m),
        text: text(report, s),
    }
}

fn text(report: &ProtectionReport, s: &Situation) -> String {
    if s.brake_failed {
        return "Automatic brake failed: brake by hand".into();
    }
    if s.odometer_lost {
        return "Odometer silent: emergency brake".into();
    }
    let action = match report.supervision {
        Supervision::Emergency => ", emergency brake",
        Supervision::Service => ", service brake",
        Supervision::Warning => ", too fast",
        Supervision::Permitted => "",
    };
    let slide = if report.wheels_slide {
        ", wheels slide"
    } else {
        ""
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
            let late = if report.stops_in_time {
                ""
            } else {
                ", MAY NOT STOP BEFORE IT"
            };
            format!(
                "{what} in {:.0} m{action}{late}{slide}{radio}",
                ahead.distance_m
            )
        }
        None if report.position.is_none() => format!("Position unknown{action}{slide}"),
        None => format!(
            "Permitted {:.0} km/h{action}{slide}",
            report.permitted_mps * 3.6
        ),
    }
}
