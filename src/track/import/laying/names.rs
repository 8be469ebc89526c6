//! Names of tracks and switches in the file: those of the map where they are there once, else with the id.

use super::joining::Joined;
use crate::track::import::ImportedMap;
use std::collections::BTreeSet;

/// Names by number.
pub(super) struct Names {
    tracks: Vec<String>,
    switches: Vec<String>,
}

impl Names {
    pub fn of(map: &ImportedMap, joined: &Joined) -> Self {
        let mut taken: BTreeSet<String> = ["open", "buffer"].map(str::to_owned).into();
        let mut unique = |wanted: &str, id: &str| {
            let wanted = plain(wanted);
            let with_id = format!("{wanted} {}", plain(id));
            let numbered = (2..).map(|k: u32| format!("{wanted} {} {k}", plain(id)));
            let mut names = [wanted.clone(), with_id].into_iter().chain(numbered);
            let name = names.find(|name| !name.is_empty() && taken.insert(name.clone()));
            name.unwrap_or(wanted)
        };
        let switches = map.switches.iter().enumerate();
        let switches = switches
            .map(|(k, s)| unique(&s.name, &format!("W{}", k + 1)))
            .collect();
        let tracks = joined.tracks.iter().map(|track| {
            let pieces = || track.pieces.iter().map(|(element, _)| *element);
            let id = pieces()
                .next()
                .map_or("", |element| &map.network.elements[element].id);
            let name = pieces().find_map(|element| map.along[element].name.as_deref());
            unique(name.unwrap_or(id), id)
        });
        Self {
            tracks: tracks.collect(),
            switches,
        }
    }

    pub fn track(&self, k: usize) -> &str {
        self.tracks.get(k).map_or("", |name| name)
    }

    pub fn switch(&self, k: usize) -> &str {
        self.switches.get(k).map_or("", |name| name)
    }
}

/// Without dots, by which parts of a name are told from it, and without what a line of text does not show.
fn plain(name: &str) -> String {
    let kept = name.trim().chars().filter(|c| !c.is_control());
    kept.map(|c| if c == '.' { '-' } else { c })
        .take(60)
        .collect()
}
