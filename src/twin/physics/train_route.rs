//! The way of a train over the network, as its settings have it.

use super::settings::TrainSettings;
use super::train::RUN_IN_S;
use crate::track::network::{Itinerary, Network, Waypoint};
use crate::track::{Place, TrackId};

/// Track behind the tail at the start, over which the train rolls in.
const ROOM_M: f64 = 20.0;

/// Why a train has no way.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRoute {
    /// A key names a track that is not there.
    #[error("there is no track `{name}`")]
    NoTrack {
        /// The key.
        key: &'static str,
        /// What it says.
        name: String,
    },
    /// The tracks do not lead from one to the other that way.
    #[error("no way leads there {direction} the line over the tracks that it is to run over")]
    NoWay {
        /// Which way it starts.
        direction: crate::track::Direction,
    },
}

impl TrainSettings {
    /// Where its head starts.
    pub fn start(&self, network: &Network) -> Result<Place, NoRoute> {
        Ok(Place {
            track: named(network, "start_track", self.start_track.as_ref())?.unwrap_or_default(),
            s_m: self.start_chainage_m,
        })
    }

    /// Its way, from behind its tail to beyond its stop.
    pub fn itinerary(&self, network: &Network) -> Result<Itinerary, NoRoute> {
        let start = self.start(network)?;
        let via = self.via.iter().map(|name| waypoint(network, name));
        let via: Vec<Waypoint> = via.collect::<Result<_, _>>()?;
        let stop_track = named(network, "stop_track", self.stop_track.as_ref())?;
        let last = via.last().map_or(start.track, |waypoint| match waypoint {
            Waypoint::Track(track) => *track,
            Waypoint::Place(place) => place.track,
        });
        let stop = self.stop_at_m.map(|s_m| Place {
            track: stop_track.unwrap_or(last),
            s_m,
        });
        let run_in_m = self.start_speed_kmh / 3.6 * RUN_IN_S;
        let behind_m = self.length_m() + run_in_m + ROOM_M;
        let direction = self.direction;
        if network.tracks.len() == 1 && via.is_empty() {
            // A train on a line of one track may stand or stop beyond its ends.
            return alone(network, self).ok_or(NoRoute::NoWay { direction });
        }
        let way = network.itinerary((start, direction), &via, stop, behind_m);
        way.ok_or(NoRoute::NoWay { direction })
    }
}

fn named(
    network: &Network,
    key: &'static str,
    name: Option<&String>,
) -> Result<Option<TrackId>, NoRoute> {
    let Some(name) = name else {
        return Ok(None);
    };
    match network.named(name) {
        Some(track) => Ok(Some(track)),
        None => Err(NoRoute::NoTrack {
            key,
            name: name.clone(),
        }),
    }
}

/// The track or the station of a name.
fn waypoint(network: &Network, name: &str) -> Result<Waypoint, NoRoute> {
    if let Some(track) = network.named(name) {
        return Ok(Waypoint::Track(track));
    }
    let stations = (0u16..).zip(&network.tracks).flat_map(|(k, track)| {
        let stations = track.stations.iter();
        stations.map(move |station| (TrackId(k), station))
    });
    let mut of_name = stations.filter(|(_, station)| station.name == name);
    let (track, station) = of_name.next().ok_or_else(|| NoRoute::NoTrack {
        key: "via",
        name: name.to_owned(),
    })?;
    Ok(Waypoint::Place(Place {
        track,
        s_m: station.chainage_m,
    }))
}

/// Over the only track.
fn alone(network: &Network, train: &TrainSettings) -> Option<Itinerary> {
    let route = network.only_track(train.direction)?;
    let run_m = |s_m| route.runs_m(Place::on_first_track(s_m)).next();
    Some(Itinerary {
        start_m: run_m(train.start_chainage_m)?,
        places_m: Vec::new(),
        stop_m: train.stop_at_m.and_then(run_m),
        route,
    })
}
