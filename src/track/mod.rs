//! The line as surveyed: where the track runs, what the tunnel looks like around it, and where
//! its lamps, devices and balises are. Knows the settings room alone.
//!
//! ```
//! use metrotwin::track::Tunnel;
//!
//! let tunnel = Tunnel::from_toml(
//!     r#"
//!     name = "curve"
//!
//!     [[plan]]
//!     kind = "straight"
//!     length_m = 100.0
//!
//!     [[plan]]
//!     kind = "clothoid"
//!     length_m = 60.0
//!
//!     [[plan]]
//!     kind = "arc"
//!     length_m = 200.0
//!     radius_m = 500.0
//!     turn = "left"
//!     cant_mm = 100.0
//!
//!     [lamps]
//!     from_m = 10.0
//!     spacing_m = 10.0
//!     "#,
//! )?;
//! let track = tunnel.first_track();
//! assert_eq!(track.lamps.len(), 36);
//! assert!((track.alignment.at(200.0).curvature_per_m - 1.0 / 500.0).abs() < 1e-15);
//! # Ok::<(), metrotwin::settings::FileError>(())
//! ```
//!
//! Coordinates on the line are (s, l, h): s is chainage along the centreline in plan, l metres to
//! the left of it, h metres above top of rail. Planes of constant s are vertical, so the
//! conversions are exact both ways. See [`Alignment`]. The world is x east, y north, z up.
//!
//! Theory: plan curvature linear in chainage (straight, clothoid, arc) and parabolic vertical
//! curves, as railways are set out; dimensions, gauge and limits after GB 50157 (code for design
//! of metro) and CJJ 96 (gauges of metros), simplified where their items say so; lamps and rig
//! after Zhang et al., Acta Optica Sinica 2023, doi 10.3788/AOS221912.
//!
//! Tracks are joined to a [`network`] by switches.
//!
//! Not here: rail profiles (rails are boxes), sections that lean with
//! the cant (only the rails' heads follow it), irregularities of the track (they are the world's,
//! not the survey's).

mod alignment;
mod check;
mod file;
mod furniture;
mod gauge;
pub mod geodesy;
pub mod import;
pub mod network;
mod place;
pub mod plan;
mod reversal;
mod section;
mod stated_chainage;
mod tunnel;
pub mod uid;
pub mod waveform;

pub use alignment::{Alignment, CANT_BASE_M, Grade, PlanElement, TrackFrame, TrackPoint};
pub use file::TunnelFile;
pub use furniture::{Balise, BaseStation, LampSite, StoppingPlace, WaysideSite};
pub use gauge::{Gauge, RAIL_OFFSET_M, RAIL_WIDTH_M, rail_outline};
pub use place::{Direction, Place, Stretch, TrackId};
pub use section::{
    BED_M, CHORD_ERROR_M, CrossSection, Edge, Material, OutlinePoint, PlatformShape, SectionRange,
    Side, WALKWAY_EDGE_M, WALKWAY_HEIGHT_M,
};
pub use stated_chainage::{ChainageEquation, ChainageError, StatedChainage};
pub use tunnel::Tunnel;

/// One track: where it runs, what it lies in, and what stands along it.
#[derive(Clone, Debug)]
pub struct Track {
    /// As on the map.
    pub name: String,
    /// Its centreline.
    pub alignment: Alignment,
    /// Chainages as people state them, if they do not count from where it begins. None of a route, which may be of
    /// several tracks.
    pub stated_chainage: Option<StatedChainage>,
    /// What stands around it, in order of chainage, without gaps.
    pub sections: Vec<SectionRange>,
    /// Lamps in order of chainage.
    pub lamps: Vec<LampSite>,
    /// Wayside devices.
    pub wayside: Vec<WaysideSite>,
    /// Balises.
    pub balises: Vec<Balise>,
    /// Radio base stations.
    pub base_stations: Vec<BaseStation>,
    /// Where trains stop.
    pub stations: Vec<StoppingPlace>,
    /// Light that reaches every surface after many reflections, lux. In the open by day `daylight_lx` takes its place.
    pub ambient_lx: f64,
    /// Light of the sky on level ground in the open, lux.
    pub daylight_lx: f64,
}

impl Track {
    /// A track with nothing around it, in the dark.
    pub fn bare(name: &str, alignment: Alignment) -> Self {
        Self {
            name: name.to_owned(),
            alignment,
            stated_chainage: None,
            sections: Vec::new(),
            lamps: Vec::new(),
            wayside: Vec::new(),
            balises: Vec::new(),
            base_stations: Vec::new(),
            stations: Vec::new(),
            ambient_lx: 0.0,
            daylight_lx: 0.0,
        }
    }

    /// The cross-section at a chainage; the first and the last one go on beyond the ends.
    pub fn section_at(&self, s_m: f64) -> Option<&CrossSection> {
        let k = self.sections.partition_point(|r| r.to_m <= s_m);
        self.sections
            .get(k)
            .or(self.sections.last())
            .map(|r| &r.section)
    }

    /// The lamp with a UID.
    pub fn lamp(&self, uid: uid::Uid) -> Option<&LampSite> {
        self.lamps.iter().find(|l| l.uid == uid)
    }

    /// The balise with a name.
    pub fn balise(&self, name: &str) -> Option<&Balise> {
        self.balises.iter().find(|b| b.name == name)
    }

    /// Names of the balises that a train passes whose head runs from one chainage to another, up or
    /// down the line.
    pub fn balises_passed(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = &str> {
        (self.balises.iter())
            .filter(move |b| {
                let up = b.chainage_m > from_m && b.chainage_m <= to_m;
                let down = b.chainage_m < from_m && b.chainage_m >= to_m;
                up || down
            })
            .map(|b| b.name.as_str())
    }
}
