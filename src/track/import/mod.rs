//! Maps and tables of others: as networks in plan, and as tunnel files.
//!
//! A reader for each format yields an [`ImportedMap`]: elements in plan with what lies along them, switches, and what was
//! not taken over, with its line in the file. [`ImportedMap::lay`] makes a [`TunnelFile`](crate::track::TunnelFile) of it,
//! whose tracks are curves that a train can run. A table of an office says the curves itself ([`TableImport`]).
//!
//! ```
//! use metrotwin::track::Tunnel;
//! use metrotwin::track::import::{LayingOptions, OsmImport};
//!
//! let map = r#"{ "elements": [
//!     { "type": "node", "id": 1, "lat": 48.2, "lon": 15.600 }, { "type": "node", "id": 2, "lat": 48.2, "lon": 15.604 },
//!     { "type": "way", "id": 10, "nodes": [1, 2], "tags": { "railway": "subway", "name": "U1" } } ] }"#;
//! let map = OsmImport::from_json(map, None).unwrap().map;
//! let options = LayingOptions { name: "town".to_owned(), sigma_m: 0.3, join: true };
//! let laid = map.lay(&options)?;
//! let tunnel = Tunnel::from_toml(&laid.file.to_text(&[]).unwrap()).unwrap();
//! assert_eq!(tunnel.first_track().name, "U1");
//! assert!((tunnel.first_track().alignment.length_m() - 297.3).abs() < 0.1);
//! # Ok::<(), metrotwin::track::import::LayingError>(())
//! ```
//!
//! A tunnel file that is laid has the heights that grades of the map give. Not in it: slips, cant, signals, and speeds
//! but those of switches.

mod crs;
mod fit;
mod junction;
mod laying;
mod lines;
mod map;
mod osm;
mod plane;
pub mod railml;
mod table;

pub use crs::{Crs, UnknownCrs};
pub use junction::JunctionKind;
pub use laying::{InTunnel, LaidMap, LaidTrack, LayingError, LayingOptions};
pub use map::{
    AlongElement, ImportCount, ImportReport, ImportedMap, LeftOut, MapBalise, MapSignal, MapSpeed,
    MapStep, MapSwitch, PlanCheck,
};
pub use osm::{AroundPlace, OsmError, OsmImport};
#[cfg(feature = "cli")]
pub(crate) use table::{Sheet, SheetColumn, SheetRow};
pub use table::{SheetError, TableFault, TableImport, TableOptions};

/// The number in a key of a file such as `switches[3].name`, if it is one of that table.
fn number_in(key: &str, table: &str) -> Option<usize> {
    let rest = key.strip_prefix(table)?.strip_prefix('[')?;
    rest.split(']').next()?.parse().ok()
}
