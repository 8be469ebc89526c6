//! What all tracks of a network say together: names, and whether trains come to each of them.

use crate::settings::Checker;
use crate::track::TrackId;
use crate::track::network::{Beyond, Network};
use std::collections::BTreeMap;

/// Names of lamps, devices, balises and so on that another track has too.
pub(super) fn check_names(network: &Network, check: &mut Checker<'_>) {
    let mut seen: BTreeMap<(&str, String), (usize, String)> = BTreeMap::new();
    for (k, track) in network.tracks.iter().enumerate() {
        let named = |table: &'static str, names: Vec<String>| {
            let keys = names.into_iter().enumerate();
            keys.map(move |(j, name)| (table, name, format!("track[{k}].{table}[{j}].name")))
        };
        let names = named(
            "wayside",
            track.wayside.iter().map(|w| w.name.clone()).collect(),
        )
        .chain(named(
            "balises",
            track.balises.iter().map(|b| b.name.clone()).collect(),
        ))
        .chain(named(
            "base_stations",
            track.base_stations.iter().map(|b| b.name.clone()).collect(),
        ))
        .chain(named(
            "stations",
            track.stations.iter().map(|s| s.name.clone()).collect(),
        ));
        let lamps = (track.lamps.iter()).map(|lamp| {
            (
                "lamps",
                lamp.uid.to_string(),
                format!("track[{k}].lamps.first_number"),
            )
        });
        for (table, name, key) in names.chain(lamps) {
            let first = seen
                .entry((table, name.clone()))
                .or_insert((k, key.clone()));
            if first.0 != k && check.is_right(&key) {
                let what = format!(
                    "{name} is there on track `{}` too",
                    network.tracks[first.0].name
                );
                check.problem(
                    &key,
                    what,
                    "give each a name or number of its own, on whichever track",
                );
            }
        }
    }
}

/// Tracks to which no train comes: between buffers, and joined to none with an open end.
pub(super) fn check_reach(network: &Network, check: &mut Checker<'_>) {
    let mut reached = vec![false; network.tracks.len()];
    let mut open: Vec<TrackId> = network
        .ends()
        .filter(|end| network.beyond(*end) == Beyond::Open)
        .map(|end| end.track)
        .collect();
    // On a ring trains are there from the beginning.
    if open.is_empty() {
        open.push(TrackId::default());
    }
    while let Some(track) = open.pop() {
        if std::mem::replace(&mut reached[usize::from(track.0)], true) {
            continue;
        }
        let ends = network.ends().filter(|end| end.track == track);
        open.extend(ends.flat_map(|end| network.next(end)).map(|end| end.track));
    }
    for (k, _) in reached.iter().enumerate().filter(|(_, is)| !**is) {
        check.problem(
            &format!("track[{k}].name"),
            "no train can get there: all ends that are joined to it are buffers",
            "join it to a track with an open end, or leave one of its ends open",
        );
    }
}
