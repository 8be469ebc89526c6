//! All tracks of a tunnel file.

use super::geodesy::Datum;
use super::network::Network;
use super::{LampSite, Track};
use std::sync::Arc;

/// A tunnel, checked and ready to use: tracks, the switches that join them, where they cross, and what stands along
/// them.
#[derive(Clone, Debug)]
pub struct Tunnel {
    /// Short name, as in the file.
    pub name: String,
    /// Where the world is on the earth, if that is known.
    pub datum: Option<Datum>,
    /// Line number, the first part of every lamp's UID.
    pub line_number: u8,
    /// Its tracks, switches and crossings. There is at least one track.
    pub network: Network,
}

impl Tunnel {
    /// Of one track, which is open at both ends.
    pub fn of_one(track: Track) -> Self {
        Self {
            name: track.name.clone(),
            datum: None,
            line_number: 1,
            network: Network::of_one(track),
        }
    }

    /// The lamps of all tracks.
    pub fn lamps(&self) -> impl Iterator<Item = &LampSite> {
        self.network.tracks.iter().flat_map(|track| &track.lamps)
    }

    /// Its first track, which is the only one in many files.
    pub fn first_track(&self) -> &Arc<Track> {
        &self.network.tracks[0]
    }
}
