//! Tunnel files as a user writes them: TOML, every key with its unit and default.

use super::section::Side;
use super::uid::LineCode;
use schemars::{JsonSchema, Schema, schema_for};
use serde::{Deserialize, Serialize};

/// A tunnel file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TunnelFile {
    /// Short name.
    pub name: String,
    /// Line number, the first part of every lamp's UID, 0 to 15. Default 1.
    #[serde(default = "one")]
    pub line_number: u8,
    /// Light that reaches every surface after many reflections, lux. Default 2.
    #[serde(default = "two_lux")]
    pub ambient_lx: f64,
    /// Where the line begins in the world.
    #[serde(default)]
    pub start: StartEntry,
    /// Plan elements in order up the line.
    pub plan: Vec<PlanEntry>,
    /// Grades in order; none means level.
    #[serde(default)]
    pub grades: Vec<GradeEntry>,
    /// Cross-sections in order; none means circular, 3 m, without walkway, all along.
    #[serde(default)]
    pub sections: Vec<SectionEntry>,
    /// A row of lamps at equal distances, and the properties of lamps of this tunnel.
    #[serde(default)]
    pub lamps: Option<LampRow>,
    /// Single lamps.
    #[serde(default)]
    pub lamp: Vec<LampEntry>,
    /// Wayside devices: a camera and a lidar on the tunnel wall.
    #[serde(default)]
    pub wayside: Vec<WaysideEntry>,
    /// Balises between the rails.
    #[serde(default)]
    pub balises: Vec<BaliseEntry>,
    /// Radio base stations.
    #[serde(default)]
    pub base_stations: Vec<BaseStationEntry>,
    /// Places where trains stop.
    #[serde(default)]
    pub stations: Vec<StationEntry>,
}

fn one() -> u8 {
    1
}

fn two_lux() -> f64 {
    2.0
}

/// Where the line begins.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartEntry {
    /// World x of chainage 0, metres. Default 0.
    pub east_m: f64,
    /// World y of chainage 0, metres. Default 0.
    pub north_m: f64,
    /// Height of top of rail at chainage 0, metres. Default 0.
    pub up_m: f64,
    /// Direction up the line, degrees from east towards north. Default 0.
    pub heading_deg: f64,
}

/// Kind of a plan element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlanKind {
    /// No curvature.
    Straight,
    /// Curvature and cant run linearly from those of the element before to those of the next.
    Clothoid,
    /// Constant curvature.
    Arc,
}

/// A plan element.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanEntry {
    /// Its kind.
    pub kind: PlanKind,
    /// Length in plan, metres.
    pub length_m: f64,
    /// Radius of an arc, metres, positive.
    #[serde(default)]
    pub radius_m: Option<f64>,
    /// To which side an arc turns, looking up the line.
    #[serde(default)]
    pub turn: Option<Side>,
    /// Height of an arc's outer rail over the inner one, millimetres, 0 to 120. Default 0.
    #[serde(default)]
    pub cant_mm: Option<f64>,
}

/// A grade.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradeEntry {
    /// Where it begins: where its tangent meets that of the grade before, metres.
    pub from_m: f64,
    /// Rise up the line, permille, -60 to 60.
    pub grade_permille: f64,
    /// Radius of the vertical curve that leads into it, metres (0 for none). Default 3000.
    #[serde(default = "vertical_radius")]
    pub vertical_radius_m: f64,
}

fn vertical_radius() -> f64 {
    3000.0
}

/// Kind of a cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SectionKind {
    /// Shield-driven: `radius_m`, `centre_m`, `walkway`.
    Circular,
    /// Mined: `width_m`, `springing_m`, `ceiling_m`, `walkway`.
    Horseshoe,
    /// Cut and cover, or station: `left_m`, `right_m`, `ceiling_m`, `walkway`, `platform`,
    /// `platform_edge_m`, `platform_height_m`.
    Rectangular,
    /// Without walls: `width_m`.
    Open,
}

/// A cross-section over a range of chainage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionEntry {
    /// Its kind.
    pub kind: SectionKind,
    /// From this chainage, metres.
    pub from_m: f64,
    /// To this chainage, metres. Default: where the next begins, or the end of the line.
    #[serde(default)]
    pub to_m: Option<f64>,
    /// Inner radius of a circular section, metres. Default 3.0.
    #[serde(default)]
    pub radius_m: Option<f64>,
    /// Centre of a circular section over top of rail, metres. Default: 0.74 m of track structure
    /// under top of rail (2.26 for a radius of 3.0).
    #[serde(default)]
    pub centre_m: Option<f64>,
    /// Width of a horseshoe (default 5.2) or of the bed in the open (default 6.0), metres.
    #[serde(default)]
    pub width_m: Option<f64>,
    /// Height over top of rail where a horseshoe's arch springs, metres. Default 2.4.
    #[serde(default)]
    pub springing_m: Option<f64>,
    /// Left wall of a rectangle from the centreline, metres. Default 2.9.
    #[serde(default)]
    pub left_m: Option<f64>,
    /// Right wall of a rectangle from the centreline, metres. Default 2.9.
    #[serde(default)]
    pub right_m: Option<f64>,
    /// Crown of a horseshoe (default 4.8) or ceiling of a rectangle (default 4.6) over top of
    /// rail, metres.
    #[serde(default)]
    pub ceiling_m: Option<f64>,
    /// Side of an evacuation walkway. Default: none.
    #[serde(default)]
    pub walkway: Option<Side>,
    /// Side of a platform. Default: none.
    #[serde(default)]
    pub platform: Option<Side>,
    /// Edge of the platform from the centreline, metres. Default 1.5 (GB 50157, B cars).
    #[serde(default)]
    pub platform_edge_m: Option<f64>,
    /// Platform over top of rail, metres. Default 1.05 (50 mm under the floor of a B car).
    #[serde(default)]
    pub platform_height_m: Option<f64>,
}

/// A row of lamps, and the properties of lamps of this tunnel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LampRow {
    /// Chainage of the first lamp, metres. Default 0.
    pub from_m: f64,
    /// No lamp of the row stands beyond this chainage, metres. Default: the end of the line.
    pub to_m: Option<f64>,
    /// From lamp to lamp, metres. Default 10.
    pub spacing_m: f64,
    /// Left of the centreline, metres (negative: on the right wall). Default 2.70.
    pub lateral_m: f64,
    /// Above top of rail, metres. Default 3.20.
    pub height_m: f64,
    /// Turn of the disc's axis from the direction across the track towards trains that come up
    /// the line, degrees. Default 65.
    pub aim_yaw_deg: f64,
    /// Tilt of the disc's axis, up positive, degrees. Default -10.
    pub aim_pitch_deg: f64,
    /// Diameter of the luminous disc, metres. Default 0.25.
    pub diameter_m: f64,
    /// Electrical power, watts. Default 21.
    pub power_w: f64,
    /// Luminous efficacy, lumens a watt. Default 100.
    pub efficacy_lm_per_w: f64,
    /// Full angle at which the intensity has fallen to half, degrees. Default 60.
    pub beam_deg: f64,
    /// Duration of a chip of the code, microseconds. Default 45.
    pub chip_us: f64,
    /// How bits become chips. Default manchester.
    pub code: LineCode,
    /// Number of the row's first lamp; the others count up. Default 1.
    pub first_number: u16,
}

impl Default for LampRow {
    fn default() -> Self {
        Self {
            from_m: 0.0,
            to_m: None,
            spacing_m: 10.0,
            lateral_m: 2.70,
            height_m: 3.20,
            aim_yaw_deg: 65.0,
            aim_pitch_deg: -10.0,
            diameter_m: 0.25,
            power_w: 21.0,
            efficacy_lm_per_w: 100.0,
            beam_deg: 60.0,
            chip_us: 45.0,
            code: LineCode::Manchester,
            first_number: 1,
        }
    }
}

/// A single lamp. What is not given is as in `[lamps]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampEntry {
    /// Lamp number, 0 to 1023.
    pub number: u16,
    /// Chainage, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    #[serde(default)]
    pub lateral_m: Option<f64>,
    /// Above top of rail, metres.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Turn of the disc's axis from the direction across the track towards trains that come up
    /// the line, degrees.
    #[serde(default)]
    pub aim_yaw_deg: Option<f64>,
    /// Tilt of the disc's axis, up positive, degrees.
    #[serde(default)]
    pub aim_pitch_deg: Option<f64>,
    /// Electrical power, watts.
    #[serde(default)]
    pub power_w: Option<f64>,
}

/// A wayside device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaysideEntry {
    /// Name.
    pub name: String,
    /// Chainage, metres.
    pub chainage_m: f64,
    /// Left of the centreline, metres.
    pub lateral_m: f64,
    /// Above top of rail, metres.
    pub height_m: f64,
    /// Turn of its axis from up the line, to the left, degrees (180 looks down the line).
    pub yaw_deg: f64,
    /// Tilt of its axis, up positive, degrees.
    pub pitch_deg: f64,
    /// Name of the balise that gets its messages.
    pub balise: String,
}

/// A balise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BaliseEntry {
    /// Name.
    pub name: String,
    /// Chainage, metres.
    pub chainage_m: f64,
}

/// A radio base station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BaseStationEntry {
    /// Name.
    pub name: String,
    /// Chainage, metres.
    pub chainage_m: f64,
    /// Reach up and down the line, metres.
    pub reach_m: f64,
}

/// A place where trains stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StationEntry {
    /// Name.
    pub name: String,
    /// Where the head of a train stops, metres.
    pub chainage_m: f64,
}

/// JSON Schema of tunnel files, for editors that complete and check TOML.
pub fn tunnel_schema() -> Schema {
    schema_for!(TunnelFile)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Provokes: a key without a description in the schema, or one that may be misspelt because
    /// unknown keys are let through.
    #[test]
    fn every_key_of_the_schema_is_described() {
        let schema = tunnel_schema();
        let root = schema.as_value();
        let definitions = root["$defs"].as_object().unwrap().values();
        let mut keys = 0;
        for table in definitions.chain([root]) {
            let Some(properties) = table["properties"].as_object() else {
                continue;
            };
            assert_eq!(table["additionalProperties"], false);
            for (key, property) in properties {
                assert!(property["description"].is_string(), "{key}");
                keys += 1;
            }
        }
        assert!(keys > 60, "{keys}");
    }
}
