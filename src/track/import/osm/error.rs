//! What is wrong with a map of OpenStreetMap.

use super::TRACKS;

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum OsmError {
    /// Not JSON, or not this kind.
    #[error("line {line}, column {column}: no raw JSON of OpenStreetMap: {what}")]
    NotJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// By the parser.
        what: String,
    },
    /// Not XML.
    #[error("line {line}, column {column}: not XML: {what}")]
    NotXml {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// By the parser.
        what: String,
    },
    /// XML of another kind.
    #[error("its root is `{name}`: XML of OpenStreetMap begins with `<osm>`")]
    OtherXml {
        /// Of its root.
        name: String,
    },
    /// An element without a number that it needs.
    #[error("line {line}: `{key}` of this `{element}` is {given}: a number is needed")]
    Attribute {
        /// From 1.
        line: usize,
        /// Its name.
        element: String,
        /// Of the number.
        key: &'static str,
        /// What is there.
        given: String,
    },
    /// No track in it.
    #[error("no way with `railway` = {} and at least two nodes: {ways} ways are of another kind", TRACKS.join(", "))]
    NoTracks {
        /// How many ways there are.
        ways: usize,
    },
    /// No track near a place.
    #[error(
        "no track within {radius_m} m of latitude {latitude_deg}, longitude {longitude_deg}: the map's tracks are elsewhere, or latitude and longitude are swapped"
    )]
    NoneAround {
        /// As asked for.
        latitude_deg: f64,
        /// As asked for.
        longitude_deg: f64,
        /// As asked for.
        radius_m: f64,
    },
    /// A node that can be nowhere.
    #[error("{}node {id}: latitude {latitude_deg}, longitude {longitude_deg} are not on any railway", at_line(*line))]
    Nowhere {
        /// Of the file, from 1; 0 in JSON.
        line: usize,
        /// Its number.
        id: i64,
        /// As written.
        latitude_deg: f64,
        /// As written.
        longitude_deg: f64,
    },
}

fn at_line(line: usize) -> String {
    match line {
        0 => String::new(),
        line => format!("line {line}: "),
    }
}
