//! Which kind of file a text is, by its keys.

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
    /// Of a text.
    pub(super) fn of(text: &str) -> Self {
        let table = text.parse::<toml::Table>().unwrap_or_default();
        let has_any = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        // A scenario names its tunnel, whatever else is wrong with it.
        let is_scenario = has_any(&["tunnel"]);
        if !is_scenario && has_any(&TUNNEL_KEYS) {
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
