//! Tunnel files as a user writes them: TOML, every key with its unit and default.
//!
//! A file has one track, whose keys stand at its top, or several under `[[track]]`, joined at their ends and by
//! `[[switches]]`, and crossing each other at `[[crossings]]`.

mod chainage;
mod lamps;
mod line;
mod sections;
mod text;

pub use chainage::{ChainageEquationEntry, Increment, StatedChainageEntry};
pub use lamps::{LAST_LAMP, LampEntry, LampRowEntry};
pub use line::{GradeEntry, PlanEntry, PlanShape, StartEntry};
pub use sections::{SectionEntry, SectionShape};

use super::furniture::{Balise, BaseStation, StoppingPlace, WaysideSite};
use super::geodesy::{Datum, Geodetic};
use crate::settings::{Checker, settings};

/// Declares a table that has, besides keys of its own, those of a track.
macro_rules! with_track {
    ($(#[$meta:meta])* pub struct $name:ident { $($own:tt)* } also $also:ident) => {
        settings! {
            $(#[$meta])*
            pub struct $name {
                $($own)*
                /// Where chainage 0 is in the world. Default: where `from` says, or the world's origin.
                start: Option<StartEntry>, nested;
                /// Chainages as plans and people state them. Default: none but the length from where the track begins.
                stated_chainage: Option<StatedChainageEntry>, nested;
                /// Plan elements in order up the line.
                #[serde(default)]
                plan: Vec<PlanEntry>, nested;
                /// Grades in order; none means level, or on as what is joined to it.
                #[serde(default)]
                grades: Vec<GradeEntry>, nested;
                /// Cross-sections in order; none means circular, 3 m, without walkway, all along.
                #[serde(default)]
                sections: Vec<SectionEntry>, nested;
                /// A row of lamps at equal distances, and the properties of lamps of this track.
                lamps: Option<LampRowEntry>, nested;
                /// More rows of lamps.
                #[serde(default)]
                lamp_rows: Vec<LampRowEntry>, nested;
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
            also $also
        }
    };
}

with_track! {
    /// A tunnel file.
    pub struct TunnelFile {
        /// Short name.
        name: String;
        /// Line number, the first part of every lamp's UID.
        #[serde(default = "crate::settings::one::<u8>")]
        line_number: u8, in 0.0..=15.0;
        /// Light that reaches every surface after many reflections, lux. In the open by day `daylight_lx` takes its
        /// place.
        #[serde(default = "two_lux")]
        ambient_lx: f64, in 0.0..=1e5;
        /// Light of the sky on level ground where tracks lie in the open, lux: 0 at night, 5,000 to 20,000 under
        /// clouds.
        #[serde(default)]
        daylight_lx: f64, in 0.0..=1.5e5;
        /// Accuracy of the plan where it comes from a map and not from a survey: standard deviation of the place of a
        /// track, metres. What two tracks lack of their distance or angle by less than twice that of both is let
        /// through.
        #[serde(default)]
        plan_sigma_m: f64, in 0.0..=5.0;
        /// Where the world's origin is on the earth. Default: nowhere, and the line is on no map.
        datum: Option<DatumEntry>, nested;
        /// The tracks, if there are several; then all keys of a track stand in them.
        #[serde(default)]
        track: Vec<TrackEntry>, nested;
        /// Switches between them.
        #[serde(default)]
        switches: Vec<SwitchEntry>, nested;
        /// Places where tracks cross each other at one level.
        #[serde(default)]
        crossings: Vec<CrossingEntry>, nested;
    }
    also check_keys
}

with_track! {
    /// One of several tracks.
    #[derive(Default)]
    pub struct TrackEntry {
        /// Its name. Its ends are `name.begin` and `name.end`.
        name: String;
        /// Light that reaches every surface after many reflections, lux. Default: that of the file.
        ambient_lx: Option<f64>, in 0.0..=1e5;
        /// What is before its begin: an end of another track (`up.end`), a part of a switch (`W1.toe`,
        /// `W1.through`, `W1.diverging`), a `buffer`, or an `open` end. Default: what names this begin, or open.
        from: Option<String>;
        /// What is beyond its end, in the same words.
        to: Option<String>;
    }
    also check_names
}

settings! {
    /// A switch. Three ends of tracks meet at its toe: the track before it, and its two legs.
    pub struct SwitchEntry {
        /// Its name. Its parts are `name.toe`, `name.through` and `name.diverging`.
        name: String;
        /// Permitted speed on the diverging leg, km/h.
        #[serde(default = "thirty_kmh")]
        diverging_kmh: f64, in 1.0..=250.0;
        /// Time that the blades take from one end position to the other, s.
        #[serde(default = "four_s")]
        throw_s: f64, in 0.1..=60.0;
    }
    also check_names
}

settings! {
    /// A place where two tracks cross each other at one level, with fixed points. No train changes from one to the
    /// other there. The place follows from where the tracks lie.
    pub struct CrossingEntry {
        /// Its name.
        name: String;
        /// Names of the two tracks.
        #[schemars(length(equal = 2))]
        tracks: Vec<String>;
        /// Chainage of the first of them near which they cross, metres. To be given where they cross more than once.
        near_m: Option<f64>, in 0.0..=1e6;
    }
    also check_names
}

impl CrossingEntry {
    fn check_names(&self, check: &mut Checker<'_>) {
        check_name(&self.name, check);
        if self.tracks.len() != 2 {
            let what = format!("names {} tracks, and two cross", self.tracks.len());
            check.problem("tracks", what, "name the two tracks");
        }
    }
}

impl SwitchEntry {
    fn check_names(&self, check: &mut Checker<'_>) {
        check_name(&self.name, check);
    }
}

/// On a turn-out of 1 in 9 with a radius of 200 m, as most on metros are.
fn thirty_kmh() -> f64 {
    30.0
}

/// An electric point machine of the common kind takes 3 to 6 s.
fn four_s() -> f64 {
    4.0
}

fn two_lux() -> f64 {
    2.0
}

impl TunnelFile {
    /// One without tracks.
    pub(super) fn empty(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            line_number: 1,
            ambient_lx: two_lux(),
            daylight_lx: 0.0,
            plan_sigma_m: 0.0,
            datum: None,
            track: Vec::new(),
            switches: Vec::new(),
            crossings: Vec::new(),
            start: None,
            stated_chainage: None,
            plan: Vec::new(),
            grades: Vec::new(),
            sections: Vec::new(),
            lamps: None,
            lamp_rows: Vec::new(),
            lamp: Vec::new(),
            wayside: Vec::new(),
            balises: Vec::new(),
            base_stations: Vec::new(),
            stations: Vec::new(),
        }
    }

    /// By how much tracks may be nearer to each other than they should be.
    pub(super) fn slack_m(&self) -> f64 {
        2.0 * std::f64::consts::SQRT_2 * self.plan_sigma_m
    }

    fn check_keys(&self, check: &mut Checker<'_>) {
        if self.name.trim().is_empty() {
            check.problem("name", "is empty", "give the tunnel a name");
        }
        if self.track.is_empty() {
            return;
        }
        let track_keys = [
            ("start", self.start.is_some()),
            ("stated_chainage", self.stated_chainage.is_some()),
            ("plan", !self.plan.is_empty()),
            ("grades", !self.grades.is_empty()),
            ("sections", !self.sections.is_empty()),
            ("lamps", self.lamps.is_some()),
            ("lamp_rows", !self.lamp_rows.is_empty()),
            ("lamp", !self.lamp.is_empty()),
            ("wayside", !self.wayside.is_empty()),
            ("balises", !self.balises.is_empty()),
            ("base_stations", !self.base_stations.is_empty()),
            ("stations", !self.stations.is_empty()),
        ];
        for (key, _) in track_keys.into_iter().filter(|(_, given)| *given) {
            let what = "stands beside `[[track]]`, and belongs to a track";
            check.problem(key, what, "put it into one of the tracks");
        }
    }

    /// The tracks: those under `[[track]]`, or the one of the file's own keys.
    pub(super) fn tracks(&self) -> Vec<TrackEntry> {
        if !self.track.is_empty() {
            return self.track.clone();
        }
        vec![TrackEntry {
            name: self.name.clone(),
            ambient_lx: None,
            from: None,
            to: None,
            start: self.start.clone(),
            stated_chainage: self.stated_chainage.clone(),
            plan: self.plan.clone(),
            grades: self.grades.clone(),
            sections: self.sections.clone(),
            lamps: self.lamps.clone(),
            lamp_rows: self.lamp_rows.clone(),
            lamp: self.lamp.clone(),
            wayside: self.wayside.clone(),
            balises: self.balises.clone(),
            base_stations: self.base_stations.clone(),
            stations: self.stations.clone(),
        }]
    }
}

impl TrackEntry {
    /// One with a name and nothing else.
    pub(super) fn empty(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..Self::default()
        }
    }

    fn check_names(&self, check: &mut Checker<'_>) {
        check_name(&self.name, check);
    }
}

/// A name that ends can be named by.
fn check_name(name: &str, check: &mut Checker<'_>) {
    if name.trim().is_empty() || name.contains('.') {
        let what = format!("\"{name}\" is no name: it is empty, or has a dot in it");
        check.problem("name", what, "give it a name without dots");
    }
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
        assert!(keys > 80, "{keys}");
    }
}
