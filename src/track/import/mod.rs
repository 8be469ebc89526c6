//! Maps of others, as networks in plan.
//!
//! What could not be taken over is counted, and listed with its number in the file.

mod junction;
mod osm;

pub use junction::JunctionKind;
pub use osm::{OsmError, OsmImport};
