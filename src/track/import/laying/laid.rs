//! How a map is laid, and what comes of it.

use crate::track::file::TunnelFile;
use crate::track::import::LeftOut;

/// How a map is laid.
#[derive(Clone, Debug)]
pub struct LayingOptions {
    /// Name of the tunnel file.
    pub name: String,
    /// How far points of the map lie beside the track, metres (standard deviation).
    pub sigma_m: f64,
    /// Elements that nothing else meets become one track, as where a map cuts tracks by their properties.
    pub join: bool,
}

/// A map as a tunnel file.
#[derive(Clone, Debug)]
pub struct LaidMap {
    /// The file.
    pub file: TunnelFile,
    /// Its tracks, in the file's order.
    pub tracks: Vec<LaidTrack>,
    /// What of the map is not in the file, and why.
    pub left_out: Vec<LeftOut>,
}

/// How near a track is to the points of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidTrack {
    /// Its name in the file.
    pub name: String,
    /// Ids of the elements that it runs over.
    pub elements: Vec<String>,
    /// Its length, metres.
    pub length_m: f64,
    /// Points of the map.
    pub points: usize,
    /// The farthest of them beside the track, metres.
    pub most_m: f64,
    /// The root of the mean square of their distances, metres.
    pub rms_m: f64,
    /// The tightest radius, metres; none where it is straight.
    pub tightest_m: Option<f64>,
}

/// Why a map cannot be laid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayingError {
    /// Too many tracks for one file.
    #[error("{0} tracks are more than a tunnel file can have, {most}: cut a part out of the map", most = u16::MAX)]
    TooMany(usize),
    /// No track is left.
    #[error("no track could be laid: {first}")]
    Nothing {
        /// Why the first of them could not.
        first: String,
    },
    /// A check is not passed, whatever is left out.
    #[error("the file would not pass its checks: {0}")]
    Unsound(String),
}
