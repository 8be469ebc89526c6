//! Tunnel files as a user writes them: TOML, every key with its unit and default.

use super::furniture::{Balise, BaseStation, LONGEST_M, StoppingPlace, WaysideSite};
use super::geodesy::{Datum, Geodetic};
use super::section::Side;
use super::uid::LineCode;
use crate::settings::{Checker, Problem, Settings, put_range, settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The last of the numbers of 10 bits that lamps have.
pub(super) const LAST_LAMP: u16 = 1023;

settings! {
    /// A tunnel file.
    pub struct TunnelFile {
        /// Short name.
        name: String;
        /// Line number, the first part of every lamp's UID.
        #[serde(default = "crate::settings::one::<u8>")]
        line_number: u8, in 0.0..=15.0;
        /// Light that reaches every surface after many reflections, lux.
        #[serde(default = "two_lux")]
        ambient_lx: f64, in 0.0..=1e5;
        /// Where the world's origin is on the earth. Default: nowhere, and the line is on no map.
        datum: Option<DatumEntry>, nested;
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
        sections: Vec<SectionEntry>, nested;
        /// A row of lamps at equal distances, and the properties of lamps of this tunnel.
        lamps: Option<LampRowEntry>, nested;
        /// Single lamps.
        #[serde(default)]
        lamp: Vec<LampEntry>, nested;
        /// Wayside devices: a camera and a lidar on the tunnel wall.
        #[serde(default)]
        wayside: Vec<WaysideSite>, nested;
        /// Balises between the rails.
        #[serde(default)]
        balises: Vec<Balise>;
        /// Radio base stations.
        #[serde(default)]
        base_stations: Vec<BaseStation>, nested;
        /// Places where trains stop.
        #[serde(default)]
        stations: Vec<StoppingPlace>;
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

fn two_lux() -> f64 {
    2.0
}

settings! {
    /// Where the world's origin is on the earth, on WGS 84.
    pub struct DatumEntry {
        /// North of the equator, degrees.
        latitude_deg: f64, in -85.0..=85.0;
        /// East of Greenwich, degrees.
        longitude_deg: f64, in -180.0..=180.0;
        /// Over the ellipsoid, metres.
        #[serde(default)]
        height_m: f64, in -1000.0..=9000.0;
        /// Direction of the world's x axis, degrees from east towards north.
        #[serde(default)]
        heading_deg: f64, in -360.0..=360.0;
    }
}

impl DatumEntry {
    /// As it is reckoned with.
    pub fn datum(&self) -> Datum {
        Datum {
            place: Geodetic {
                latitude_deg: self.latitude_deg,
                longitude_deg: self.longitude_deg,
                height_m: self.height_m,
            },
            heading_deg: self.heading_deg,
        }
    }
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

/// A plan element.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct PlanEntry {
    /// Length in plan, metres.
    #[schemars(transform = put_range(LENGTH_M))]
    pub length_m: f64,
    /// Its kind.
    #[serde(flatten)]
    pub shape: PlanShape,
}

/// Lengths that a plan element may have.
const LENGTH_M: RangeInclusive<f64> = 0.001..=LONGEST_M;

impl Settings for PlanEntry {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        Checker::new(at, problems).within("length_m", self.length_m, LENGTH_M);
        self.shape.check(at, problems);
    }
}

settings! {
    /// Shape of a plan element, by its kind.
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum PlanShape {
        /// No curvature.
        Straight {},
        /// Curvature and cant run linearly from those of the element before to those of the next.
        Clothoid {},
        /// Constant curvature.
        Arc {
            /// Radius, metres, positive.
            radius_m: f64, in 20.0..=1e6;
            /// To which side it turns, looking up the line.
            turn: Side;
            /// Height of the outer rail over the inner one, millimetres. Default 0.
            #[serde(default)]
            // The most on metro lines (GB 50157).
            cant_mm: f64, in 0.0..=120.0;
        },
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

/// A cross-section over a stretch of the line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("unevaluatedProperties" = false))]
pub struct SectionEntry {
    /// From this chainage, metres.
    pub from_m: f64,
    /// To this chainage, metres. Default: where the next begins, or the end of the line.
    pub to_m: Option<f64>,
    /// Its kind and dimensions.
    #[serde(flatten)]
    pub shape: SectionShape,
}

impl Settings for SectionEntry {
    fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        self.shape.check(at, problems);
    }
}

settings! {
    /// Outline of a cross-section, by its kind.
    #[serde(tag = "kind", rename_all = "snake_case")]
    pub enum SectionShape {
        /// Shield-driven.
        Circular {
            /// Inner radius, metres. Default 3.0.
            radius_m: Option<f64>, in 2.2..=20.0;
            /// Its centre over top of rail, metres. Default: 0.74 m of track structure under top of
            /// rail (2.26 for a radius of 3.0).
            centre_m: Option<f64>, in 0.5..=20.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
        },
        /// Mined.
        Horseshoe {
            /// Width, metres. Default 5.2.
            width_m: Option<f64>, in 3.4..=20.0;
            /// Height over top of rail where the arch springs, metres. Default 2.4.
            springing_m: Option<f64>, in 0.5..=20.0;
            /// Crown over top of rail, metres. Default 4.8.
            ceiling_m: Option<f64>, in 4.0..=30.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
        },
        /// Cut and cover, or station.
        Rectangular {
            /// Left wall from the centreline, metres. Default 2.9.
            left_m: Option<f64>, in 1.7..=60.0;
            /// Right wall from the centreline, metres. Default 2.9.
            right_m: Option<f64>, in 1.7..=60.0;
            /// Ceiling over top of rail, metres. Default 4.6.
            ceiling_m: Option<f64>, in 4.0..=30.0;
            /// Side of an evacuation walkway. Default: none.
            walkway: Option<Side>;
            /// Side of a platform. Default: none.
            platform: Option<Side>;
            /// Edge of the platform from the centreline, metres. Default 1.5 (GB 50157, B cars).
            platform_edge_m: Option<f64>, in 1.45..=3.0;
            /// Platform over top of rail, metres. Default 1.05 (50 mm under the floor of a B car).
            platform_height_m: Option<f64>, in 0.2..=1.2;
        },
        /// Track in the open.
        Open {
            /// Width of the bed, metres. Default 6.0.
            width_m: Option<f64>, in 3.4..=60.0;
        },
    }
}

settings! {
    /// A row of lamps, and the properties of lamps of this tunnel.
    pub struct LampRowEntry {
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
    #[derive(Default)]
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Provokes: a key without a description in the schema, or one that may be misspelt because
    /// unknown keys are let through.
    #[test]
    fn every_key_of_the_schema_is_described() {
        let schema = schemars::schema_for!(TunnelFile);
        let root = schema.as_value();
        let definitions = root["$defs"].as_object().unwrap().values();
        let mut keys = 0;
        for table in definitions.chain([root]) {
            let choices = table["oneOf"].as_array().into_iter().flatten();
            let tables = choices.chain([table]);
            let properties = tables.filter_map(|t| t["properties"].as_object()).flatten();
            for (key, property) in properties.filter(|(_, p)| p["const"].is_null()) {
                let more = ["additionalProperties", "unevaluatedProperties"];
                assert!(more.iter().any(|more| table[more] == false), "{key}");
                assert!(property["description"].is_string(), "{key}");
                keys += 1;
            }
        }
        assert!(keys > 60, "{keys}");
    }
}
