//! Which kind of file a text is, by its keys.

use super::fault::Failure;
use crate::settings::{LONGEST_KEY, shortened};
use std::path::Path;

/// A kind of file of a user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileKind {
    /// A line with its tunnel.
    Tunnel,
    /// A car.
    Vehicle,
    /// A scenario that says what varies from run to run.
    Study,
    /// Any other: a scenario, whose parser tells what is wrong with it.
    Scenario,
}

impl FileKind {
    /// Refuses what is for certain no tunnel: what it is says more than that all its keys are unknown in one.
    pub(super) fn refuse_other_than_tunnel(path: &Path, text: &str) -> Result<(), Failure> {
        let table = text.parse::<toml::Table>().unwrap_or_default();
        let named = table.get("tunnel").and_then(toml::Value::as_str);
        let (what, remedy) = match (Self::of(text), named) {
            (Self::Vehicle, _) => ("vehicle", "give a tunnel file".to_owned()),
            (Self::Study | Self::Scenario, Some(tunnel)) => {
                let tunnel = shortened(tunnel, LONGEST_KEY);
                (
                    "scenario",
                    format!("give the tunnel file that it names: `{tunnel}`"),
                )
            }
            _ => return Ok(()),
        };
        Err(Failure::input(
            format!("{} is a {what}, not a tunnel", path.display()),
            remedy,
        ))
    }

    /// Of a text.
    pub(super) fn of(text: &str) -> Self {
        let table = text.parse::<toml::Table>().unwrap_or_default();
        let has_any = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        // A scenario names its tunnel, whatever else is wrong with it.
        let is_scenario = has_any(&["tunnel"]);
        // A scenario has a table of this name.
        let has_tracks = table.get("track").is_some_and(toml::Value::is_array);
        if !is_scenario && (has_tracks || has_any(&TUNNEL_KEYS)) {
            Self::Tunnel
        } else if !is_scenario && has_any(&VEHICLE_KEYS) {
            Self::Vehicle
        } else if has_any(&["study"]) {
            Self::Study
        } else {
            Self::Scenario
        }
    }
}

/// Keys that only tunnels have.
const TUNNEL_KEYS: [&str; 9] = [
    "plan",
    "datum",
    "grades",
    "sections",
    "lamps",
    "lamp",
    "balises",
    "switches",
    "crossings",
];
/// Keys that only vehicles have.
const VEHICLE_KEYS: [&str; 3] = ["body", "bogie", "wheelset"];
