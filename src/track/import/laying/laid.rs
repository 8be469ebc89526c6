//! How a map is laid, and what comes of it.

use crate::track::file::{SectionEntry, SectionShape, TunnelFile};
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

/// What of a file lies in tunnels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InTunnel {
    /// Length of tracks, metres.
    pub length_m: f64,
    /// Switches whose toe is there.
    pub switches: usize,
}

impl LaidMap {
    /// What of it lies in tunnels, by the sections of its tracks.
    pub fn in_tunnel(&self) -> InTunnel {
        let tracks = self.file.track.iter().zip(&self.tracks);
        let mut found = InTunnel::default();
        for (entry, laid) in tracks {
            let ends_m = entry.sections.iter().skip(1).map(|next| next.from_m);
            let ends_m = ends_m.chain([laid.length_m]);
            let covered = entry.sections.iter().zip(ends_m);
            let covered = covered.filter(|(section, _)| is_tunnel(section));
            found.length_m += covered.map(|(s, to_m)| to_m - s.from_m).sum::<f64>();
            let ends = [
                (&entry.from, entry.sections.first()),
                (&entry.to, entry.sections.last()),
            ];
            let in_tunnel = ends.into_iter().filter(|(word, section)| {
                let is_toe = word.as_ref().is_some_and(|word| word.ends_with(".toe"));
                is_toe && section.is_some_and(is_tunnel)
            });
            found.switches += in_tunnel.count();
        }
        found
    }
}

/// Maps are laid in the open and in tunnels alone.
fn is_tunnel(section: &SectionEntry) -> bool {
    !matches!(section.shape, SectionShape::Open { .. })
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
