//! The line as surveyed: where the track runs, what the tunnel looks like around it, and where
//! its lamps, devices and balises are. Knows nobody.
//!
//! Coordinates on the line are (s, l, h): s is chainage along the centreline in plan, l metres to
//! the left of it, h metres above top of rail. Planes of constant s are vertical, so the
//! conversions are exact both ways. See [`Alignment`].
//!
//! The world is x east, y north, z up.

mod alignment;
mod file;
mod furniture;
mod mesh;
mod problem;
mod section;
pub mod uid;

pub use alignment::{Alignment, Grade, PlanElement, RAIL_CENTRES_M, TrackFrame, TrackPoint};
pub use furniture::{Balise, BaseStation, LampSite, WaysideSite};
pub use problem::Problem;
pub use section::{CrossSection, Material, OutlinePoint, SectionRange};

/// A tunnel, checked and ready to use.
#[derive(Clone, Debug)]
pub struct Tunnel {
    /// Short name, as in the file.
    pub name: String,
    /// Where the track runs.
    pub alignment: Alignment,
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
    /// Line number, the first part of every lamp's UID.
    pub line_number: u8,
    /// Names and chainages where trains stop.
    pub stations: Vec<(String, f64)>,
    /// Light that reaches every surface after many reflections, lux.
    pub ambient_lx: f64,
}
