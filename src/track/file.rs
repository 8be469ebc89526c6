//! Tunnel files as a user writes them: TOML, every key with its unit and default.

use super::section::Side;
use super::uid::LineCode;
use crate::settings::{Checker, settings};
use schemars::{JsonSchema, Schema, schema_for};
use serde::{Deserialize, Serialize};

/// No line is longer: chainages stay exact to a nanometre.
pub(super) const LONGEST_M: f64 = 1e6;
/// The last of the numbers of 10 bits that lamps have.
pub(super) const LAST_LAMP: u16 = 1023;

settings! {
    /// A tunnel file.
    pub struct TunnelFile {
        /// Short name.
        name: String;
        /// Line number, the first part of every lamp's UID.
        #[serde(default = "one")]
        line_number: u8, in 0.0..=15.0;
        /// Light that reaches every surface after many reflections, lux.
        #[serde(default = "two_lux")]
        ambient_lx: f64, in 0.0..=1e5;
        /// Where the line begins in the world.
        #[serde(default)]
        start: StartEntry, nested;
        /// Plan elements in order up the line.
        plan: Vec<PlanEntry>, nested;
        /// Grades in order; none means level.
        #[serde(default)]
        grades: Vec<GradeEntry>, nested;
        /// Cross-sections in order; none means circular, 3 m, without walkway, all along.
        #[serde(default)]
        sections: Vec<SectionEntry>;
        /// A row of lamps at equal distances, and the properties of lamps of this tunnel.
        lamps: Option<LampRow>, nested;
        /// Single lamps.
        #[serde(default)]
        lamp: Vec<LampEntry>, nested;
        /// Wayside devices: a camera and a lidar on the tunnel wall.
        #[serde(default)]
        wayside: Vec<WaysideEntry>, nested;
        /// Balises between the rails.
        #[serde(default)]
        balises: Vec<BaliseEntry>;
        /// Radio base stations.
        #[serde(default)]
        base_stations: Vec<BaseStationEntry>, nested;
        /// Places where trains stop.
        #[serde(default)]
        stations: Vec<StationEntry>;
    }
    also check_name
}

impl TunnelFile {
    fn check_name(&self, check: &mut Checker<'_>) {
        if self.name.trim().is_empty() {
            check.problem("name", "is empty", "give the tunnel a name");
        }
    }
}

fn one() -> u8 {
    1
}

fn two_lux() -> f64 {
    2.0
}

settings! {
    /// Where the line begins.
    pub struct StartEntry {
        /// World x of chainage 0, metres.
        east_m: f64 = 0.0, in -1e7..=1e7;
        /// World y of chainage 0, metres.
        north_m: f64 = 0.0, in -1e7..=1e7;
        /// Height of top of rail at chainage 0, metres.
        up_m: f64 = 0.0, in -1e7..=1e7;
        /// Direction up the line, degrees from east towards north.
        heading_deg: f64 = 0.0, in -360.0..=360.0;
    }
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

settings! {
    /// A plan element.
    pub struct PlanEntry {
        /// Its kind.
        kind: PlanKind;
        /// Length in plan, metres.
        length_m: f64, in 0.001..=LONGEST_M;
        /// Radius of an arc, metres, positive.
        radius_m: Option<f64>;
        /// To which side an arc turns, looking up the line.
        turn: Option<Side>;
        /// Height of an arc's outer rail over the inner one, millimetres. Default 0.
        // The most on metro lines (GB 50157).
        cant_mm: Option<f64>, in 0.0..=120.0;
    }
}

settings! {
    /// A grade.
    pub struct GradeEntry {
        /// Where it begins: where its tangent meets that of the grade before, metres.
        from_m: f64;
        /// Rise up the line, permille.
        grade_permille: f64, in -60.0..=60.0;
        /// Radius of the vertical curve that leads into it, metres (0 for none).
        #[serde(default = "vertical_radius")]
        vertical_radius_m: f64, in 0.0..=1e6;
    }
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
    pub to_m: Option<f64>,
    /// Inner radius of a circular section, metres. Default 3.0.
    pub radius_m: Option<f64>,
    /// Centre of a circular section over top of rail, metres. Default: 0.74 m of track structure
    /// under top of rail (2.26 for a radius of 3.0).
    pub centre_m: Option<f64>,
    /// Width of a horseshoe (default 5.2) or of the bed in the open (default 6.0), metres.
    pub width_m: Option<f64>,
    /// Height over top of rail where a horseshoe's arch springs, metres. Default 2.4.
    pub springing_m: Option<f64>,
    /// Left wall of a rectangle from the centreline, metres. Default 2.9.
    pub left_m: Option<f64>,
    /// Right wall of a rectangle from the centreline, metres. Default 2.9.
    pub right_m: Option<f64>,
    /// Crown of a horseshoe (default 4.8) or ceiling of a rectangle (default 4.6) over top of
    /// rail, metres.
    pub ceiling_m: Option<f64>,
    /// Side of an evacuation walkway. Default: none.
    pub walkway: Option<Side>,
    /// Side of a platform. Default: none.
    pub platform: Option<Side>,
    /// Edge of the platform from the centreline, metres. Default 1.5 (GB 50157, B cars).
    pub platform_edge_m: Option<f64>,
    /// Platform over top of rail, metres. Default 1.05 (50 mm under the floor of a B car).
    pub platform_height_m: Option<f64>,
}

settings! {
    /// A row of lamps, and the properties of lamps of this tunnel.
    pub struct LampRow {
        /// Chainage of the first lamp, metres.
        from_m: f64 = 0.0;
        /// No lamp of the row stands beyond this chainage, metres. Default: the end of the line.
        to_m: Option<f64> = None;
        /// From lamp to lamp, metres.
        spacing_m: f64 = 10.0, in 0.1..=10_000.0;
        /// Left of the centreline, metres (negative: on the right wall).
        lateral_m: f64 = 2.70, in -60.0..=60.0;
        /// Above top of rail, metres.
        height_m: f64 = 3.20, in -1.0..=30.0;
        /// Turn of the disc's axis from the direction across the track towards trains that come up
        /// the line, degrees.
        aim_yaw_deg: f64 = 65.0, in -90.0..=90.0;
        /// Tilt of the disc's axis, up positive, degrees.
        aim_pitch_deg: f64 = -10.0, in -90.0..=90.0;
        /// Diameter of the luminous disc, metres.
        diameter_m: f64 = 0.25, in 0.01..=2.0;
        /// Electrical power, watts.
        power_w: f64 = 21.0, in 0.01..=10_000.0;
        /// Luminous efficacy, lumens a watt.
        efficacy_lm_per_w: f64 = 100.0, in 1.0..=700.0;
        /// Full angle at which the intensity has fallen to half, degrees.
        beam_deg: f64 = 60.0, in 5.0..=170.0;
        /// Duration of a chip of the code, microseconds.
        chip_us: f64 = 45.0, in 1.0..=10_000.0;
        /// How bits become chips.
        code: LineCode = LineCode::Manchester;
        /// Number of the row's first lamp; the others count up.
        first_number: u16 = 1;
    }
}

settings! {
    /// A single lamp. What is not given is as in `[lamps]`.
    pub struct LampEntry {
        /// Lamp number.
        number: u16, in 0.0..=f64::from(LAST_LAMP);
        /// Chainage, metres.
        chainage_m: f64;
        /// Left of the centreline, metres.
        lateral_m: Option<f64>;
        /// Above top of rail, metres.
        height_m: Option<f64>;
        /// Turn of the disc's axis from the direction across the track towards trains that come up
        /// the line, degrees.
        aim_yaw_deg: Option<f64>;
        /// Tilt of the disc's axis, up positive, degrees.
        aim_pitch_deg: Option<f64>;
        /// Electrical power, watts.
        power_w: Option<f64>;
    }
}

settings! {
    /// A wayside device.
    pub struct WaysideEntry {
        /// Name.
        name: String;
        /// Chainage, metres.
        chainage_m: f64;
        /// Left of the centreline, metres.
        lateral_m: f64;
        /// Above top of rail, metres.
        height_m: f64;
        /// Turn of its axis from up the line, to the left, degrees (180 looks down the line).
        yaw_deg: f64, in -360.0..=360.0;
        /// Tilt of its axis, up positive, degrees.
        pitch_deg: f64, in -90.0..=90.0;
        /// Name of the balise that gets its messages.
        balise: String;
    }
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

settings! {
    /// A radio base station.
    pub struct BaseStationEntry {
        /// Name.
        name: String;
        /// Chainage, metres.
        chainage_m: f64;
        /// Reach up and down the line, metres.
        reach_m: f64, in 1.0..=LONGEST_M;
    }
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
