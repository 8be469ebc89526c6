//! JSON Schemas of the files, generated from the types. The copies in the repository serve
//! editors (`#:schema scenario.schema.json` as a file's first line); a test keeps them in step.

use super::ScenarioFile;
use crate::track::tunnel_schema;
use crate::twin::physics::VehicleFile;
use schemars::schema_for;

/// The schema of a scenario.
pub fn scenario() -> serde_json::Value {
    schema_for!(ScenarioFile).to_value()
}

/// Where each schema is kept, relative to the repository, and its text.
pub fn all() -> Result<[(&'static str, String); 3], serde_json::Error> {
    let pretty = |schema| serde_json::to_string_pretty(&schema).map(|text| text + "\n");
    Ok([
        (
            "scenarios/scenario.schema.json",
            pretty(schema_for!(ScenarioFile))?,
        ),
        (
            "scenarios/vehicles/vehicle.schema.json",
            pretty(schema_for!(VehicleFile))?,
        ),
        ("tunnels/tunnel.schema.json", pretty(tunnel_schema())?),
    ])
}
