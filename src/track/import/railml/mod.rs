//! Maps in railML: tracks and switches of 2.x, topology and functional infrastructure of 3.x.
//!
//! ```
//! use metrotwin::track::import::railml::{RailMlOptions, read_railml};
//!
//! let map = read_railml(
//!     r#"<railml version="2.2" xmlns="http://www.railml.org/schemas/2013"><infrastructure><tracks>
//!         <track id="stem"><trackTopology>
//!             <trackBegin pos="0"><openEnd id="west"/></trackBegin>
//!             <trackEnd pos="900"><bufferStop id="east"/></trackEnd>
//!             <connections><switch id="w1" pos="300">
//!                 <connection id="a" ref="b" orientation="outgoing" course="left" maxSpeed="40"/>
//!             </switch></connections>
//!         </trackTopology></track>
//!         <track id="leg"><trackTopology>
//!             <trackBegin pos="0"><connection id="b" ref="a"/></trackBegin>
//!             <trackEnd pos="500"><openEnd id="north"/></trackEnd>
//!         </trackTopology></track>
//!     </tracks></infrastructure></railml>"#,
//!     &RailMlOptions::default(),
//! )?;
//! assert_eq!(map.network.elements.len(), 3);
//! assert_eq!(map.switches[0].diverging_kmh, Some(40.0));
//! // There are no coordinates, so where these tracks lie was made up.
//! assert!(map.plan_is_laid_out && map.network.datum.is_none());
//! # Ok::<(), metrotwin::track::import::railml::RailMlError>(())
//! ```
//!
//! **Elements.** A track of 2.x is cut at its switches and crossings into elements of the network; they have the
//! track's id, with a dot and a count from the second on. Of 3.x, the net elements that are no collection of others
//! are the elements (the micro level); collections (meso, macro) and relations between them are checked and left out.
//!
//! **Switches.** 2.x: the leg that leaves the track diverges, unless its `course` is `straight`. 3.x: the leg on the
//! side of `branchCourse` diverges. Slips and crossings are joints of the network.
//!
//! **Plan.** Where the file has coordinates, a track is drawn through those of its begin, end, switches, detectors,
//! balises and changes, and of tracks that are joined to it there. Between them it has the curvature that the file
//! states: a stated curve is a curve, not its chord (see `through.rs`). Coordinates that disagree with lengths along the
//! track are left out and told (see `chain.rs`). Those of signals, which stand beside the track, are held against the
//! plan ([`PlanCheck`](super::PlanCheck)). Without stated curvature a track is straight from place to place.
//!
//! Measured on a real file of 2.x (14 tracks, 25 km, radii without transitions): the 26 signals stand 2.3 m to 4.0 m
//! beside their tracks and within 0.35 m of their `pos`. With every second of the detectors, which lie on the track,
//! held out, half of the 33 are within 2 mm of the plan and 28 within 0.2 m; in a curve of 700 m radius in which
//! nothing is known over 1160 m, the plan is 6 m off. A detector that has the coordinates of another track is noticed
//! where known places are near, and bends the track where they are not.
//!
//! Where the file has no coordinates, the plan is laid out (see `layout.rs`), and
//! [`plan_is_laid_out`](super::ImportedMap::plan_is_laid_out) says so.
//!
//! **Radii.** railML 3 counts curves to the right positive. railML 2 does not say; there, coordinates decide, and
//! without them radii are left out.
//!
//! **Speeds.** Of 2.x, the least of a change's own and of those that it refers to. Of 3.x, those of the basic profile;
//! what is permitted beyond the end of a section is not stated, and here it goes on.
//!
//! **Refused**, with line, element, id, and what would be right: other XML and other versions, ids that are not unique,
//! connections and relations that name nothing or not each other, switches with one leg or of which nothing tells which
//! leg diverges, places outside their track, numbers that no railway has, collections that contain themselves,
//! coordinates without a system, in one that is not read, or the wrong way round (see `swapped.rs`), and tracks that are
//! stated to be of another length than their coordinates are apart.
//!
//! Source: railML 2.2 to 2.5 and 3.1 to 3.3, as documented at wiki2.railml.org and wiki3.railml.org. Of 3.x all versions
//! are read alike. Versions 1.x are refused.
//!
//! Not here: rolling stock, timetable, interlocking; heights (gradients are read); transitions of railML 2, which
//! states radii in steps; cant of railML 3; electrification, platforms, train detection; speeds of single trains.

mod agreement;
mod along;
mod course;
mod draft;
mod layout;
mod line;
mod place;
mod plan;
mod report;
mod stated;
mod swapped;
#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic"
)]
mod tests;
mod through;
mod to_map;
mod v2;
mod v2_along;
mod v2_joints;
mod v3;
mod v3_along;
mod v3_reading;
mod v3_relations;
mod v3_switches;
mod xml;

use super::{Crs, ImportedMap};
use xml::{Item, Text, short};

/// What a file may leave to its reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RailMlOptions {
    /// The system of coordinates for which the file names none.
    pub crs: Option<Crs>,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum RailMlError {
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
    /// XML of another kind, or of a version that is not read.
    #[error("line {line}: {what}; railML 2.x and 3.x are read, with an element `railml` outside")]
    NotRailMl {
        /// From 1.
        line: usize,
        /// What it is.
        what: String,
    },
    /// No track in it.
    #[error(
        "no tracks: railML 2.x needs infrastructure/tracks/track, railML 3.x needs infrastructure/topology/netElements/netElement"
    )]
    NoTracks,
    /// Coordinates that may be anywhere.
    #[error(
        "line {line}: {element} ({id}) has coordinates, but no datum: the file does not say in which system they are; say so with --crs, as `--crs EPSG:25832` for UTM zone 32 or `--crs EPSG:4326` for latitude and longitude"
    )]
    NoDatum {
        /// From 1.
        line: usize,
        /// Its name in railML.
        element: String,
        /// Its id.
        id: String,
    },
    /// One element is wrong.
    #[error("line {line}: {element} ({id}): {what}")]
    Element {
        /// From 1.
        line: usize,
        /// Its name in railML.
        element: String,
        /// Its id, or its name where it has none.
        id: String,
        /// What is wrong, and what would be right.
        what: String,
    },
}

/// Reads a file's text. The datum is the first place with coordinates.
pub fn read_railml(text: &str, options: &RailMlOptions) -> Result<ImportedMap, RailMlError> {
    let text = Text::new(text);
    let document = text.parse()?;
    let root = text.root(&document);
    match generation(root)? {
        Generation::Two => v2::read(root, options),
        Generation::Three => v3::read(root, options),
    }
}

/// What tells how a file is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Generation {
    Two,
    Three,
}

/// By its version, or where it has none by its namespace, which has a year until 2.5, and a version from 3.1 on.
fn generation(root: Item<'_>) -> Result<Generation, RailMlError> {
    let other = |what: String| RailMlError::NotRailMl {
        line: root.line(),
        what,
    };
    let name = root.name();
    if !name.eq_ignore_ascii_case("railml") && name != "infrastructure" {
        return Err(other(format!("this is `{}`, not railML", short(name))));
    }
    let schema = root.namespace().split("/schemas/").nth(1);
    let by_schema = schema.map(|schema| match schema.parse::<u32>() {
        Ok(2009..=2025) => "2",
        Ok(_) => "1",
        Err(_) => schema,
    });
    let version = root
        .attribute("version")
        .filter(|_| name != "infrastructure");
    match version
        .or(by_schema)
        .and_then(|version| version.chars().next())
    {
        Some('2') => Ok(Generation::Two),
        Some('3') => Ok(Generation::Three),
        Some(_) => Err(other(format!(
            "this is railML {}, which is not read",
            short(version.or(schema).unwrap_or_default())
        ))),
        None => Err(other(
            "neither `version` nor a namespace says which railML this is".to_owned(),
        )),
    }
}
