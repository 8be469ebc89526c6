//! The tunnel file of laid tracks.

use super::heights::{Heights, heights};
use super::joining::Meeting;
use super::plans::rounded;
use super::{Laying, TrackEnd};
use crate::track::Direction;
use crate::track::file::{
    CrossingEntry, DatumEntry, SectionEntry, SectionShape, SwitchEntry, TrackEntry, TunnelFile,
};
use crate::track::furniture::Balise;
use crate::track::import::AlongElement;
use std::collections::{BTreeMap, BTreeSet};

/// Under an overcast sky by day.
const DAYLIGHT_LX: f64 = 10_000.0;
/// Lateral acceleration that passengers are to feel at most on a diverging leg (EN 13803).
const MOST_LATERAL_MPS2: f64 = 0.65;
/// On a leg for which the map permits no speed: a usual one, if its curve allows it.
const USUAL_KMH: f64 = 40.0;
/// Shorter tunnels are left out, and shorter gaps between tunnels are closed.
const LEAST_SECTION_M: f64 = 1.0;

impl Laying<'_> {
    /// The file as it is so far. Tracks that are left out are not in it.
    pub(super) fn file(&self) -> TunnelFile {
        let words = self.words();
        let heights = self.heights();
        let mut tracks: Vec<TrackEntry> = (0..self.plans.len())
            .map(|k| self.track(k, &words, heights.as_ref()))
            .collect();
        name_once(tracks.iter_mut().flat_map(|track| &mut track.balises));
        let switches = self
            .joined
            .meetings
            .iter()
            .filter_map(|meeting| match meeting {
                Meeting::Switch(number, ends) => Some(self.switch(*number, ends)),
                _ => None,
            });
        let crossings = self.joined.crossings.iter().enumerate();
        let crossings = crossings.map(|(k, (tracks, at))| {
            let name = format!("X{}", k + 1);
            let line = self.plans[tracks[0]].written.line();
            let near_m = line.near_m(&nalgebra::Point3::new(at.x, at.y, 0.0));
            let tracks = tracks.map(|k| self.names.track(k).to_owned()).into();
            CrossingEntry {
                name,
                tracks,
                near_m: Some(rounded(near_m, 0)),
            }
        });
        TunnelFile {
            daylight_lx: DAYLIGHT_LX,
            plan_sigma_m: self.options.sigma_m,
            datum: self.datum.map(|datum| DatumEntry {
                latitude_deg: datum.place.latitude_deg,
                longitude_deg: datum.place.longitude_deg,
                height_m: rounded(datum.place.height_m, 3),
                heading_deg: datum.heading_deg,
            }),
            switches: switches.collect(),
            crossings: crossings.collect(),
            track: tracks,
            ..TunnelFile::empty(&self.options.name)
        }
    }

    /// Of the map's grades, if they are taken.
    fn heights(&self) -> Option<Heights> {
        if self.is_level { None } else { heights(self) }
    }

    /// What `from` and `to` say of each end.
    fn words(&self) -> BTreeMap<TrackEnd, String> {
        let mut words = BTreeMap::new();
        for meeting in &self.joined.meetings {
            match meeting {
                Meeting::Switch(number, ends) => {
                    let name = self.names.switch(*number);
                    for (end, part) in
                        self.legs(ends)
                            .into_iter()
                            .zip(["toe", "through", "diverging"])
                    {
                        words.insert(end, format!("{name}.{part}"));
                    }
                }
                Meeting::Joint(a, b) => {
                    words.insert(*a, self.word(*b));
                    words.insert(*b, self.word(*a));
                }
                Meeting::Buffer(end) => {
                    words.insert(*end, "buffer".to_owned());
                }
                Meeting::Open(end) => {
                    words.insert(*end, "open".to_owned());
                }
            }
        }
        words
    }

    fn word(&self, end: TrackEnd) -> String {
        let word = match end.way {
            Direction::Down => "begin",
            Direction::Up => "end",
        };
        format!("{}.{word}", self.names.track(end.track.0.into()))
    }

    /// Toe, through and diverging leg: the one that turns less is the through one.
    pub(super) fn legs(&self, ends: &[TrackEnd; 3]) -> [TrackEnd; 3] {
        let [toe, through, diverging] = *ends;
        match self.bend_per_m(through) > self.bend_per_m(diverging) + 1e-9 {
            true => [toe, diverging, through],
            false => *ends,
        }
    }

    /// How much a track turns at an end.
    pub(super) fn bend_per_m(&self, end: TrackEnd) -> f64 {
        let plan = self.plans.get(usize::from(end.track.0));
        let [begin, last] = plan.map_or([0.0; 2], |plan| plan.written.end_curvatures());
        match end.way {
            Direction::Down => begin.abs(),
            Direction::Up => last.abs(),
        }
    }

    fn switch(&self, number: usize, ends: &[TrackEnd; 3]) -> SwitchEntry {
        let [.., diverging] = self.legs(ends);
        let per_m = self.bend_per_m(diverging);
        let by_curve_kmh = 3.6 * (MOST_LATERAL_MPS2 / per_m.max(1e-9)).sqrt();
        let by_map = self
            .map
            .switches
            .get(number)
            .and_then(|switch| switch.diverging_kmh);
        let kmh = by_map
            .unwrap_or(USUAL_KMH)
            .min(by_curve_kmh)
            .clamp(1.0, 250.0);
        SwitchEntry {
            name: self.names.switch(number).to_owned(),
            diverging_kmh: kmh.floor(),
            throw_s: 4.0,
        }
    }

    fn track(
        &self,
        k: usize,
        words: &BTreeMap<TrackEnd, String>,
        heights: Option<&Heights>,
    ) -> TrackEntry {
        let word = |way| {
            words
                .get(&TrackEnd {
                    track: crate::track::TrackId(k as u16),
                    way,
                })
                .cloned()
        };
        let mut entry = TrackEntry::empty(self.names.track(k));
        entry.from = word(Direction::Down);
        entry.to = word(Direction::Up);
        let plan = &self.plans[k];
        let mut start = plan.written.start.clone();
        if let Some(heights) = heights {
            start.up_m = heights.begin_m[k];
            entry.grades.clone_from(&heights.grades[k]);
        }
        entry.start = Some(start);
        entry.plan = plan.written.plan.clone();
        entry.sections = self.sections(k, plan.length_m);
        entry.balises = self.balises(k, plan.length_m);
        entry
    }

    /// Places along a track from those along its elements.
    fn along<T>(
        &self,
        k: usize,
        length_m: f64,
        of: impl Fn(usize, &AlongElement) -> Vec<(f64, T)>,
    ) -> Vec<(f64, T)> {
        let drawn_m = self.drawn_m(k);
        let mut begin_m = 0.0;
        let mut places = Vec::new();
        for (element, way) in &self.joined.tracks[k].pieces {
            let own_m = self.map.network.elements[*element].length_m();
            for (at_m, what) in of(*element, &self.map.along[*element]) {
                let into_m = if *way == Direction::Up {
                    at_m
                } else {
                    own_m - at_m
                };
                places.push(((begin_m + into_m) * length_m / drawn_m, what));
            }
            begin_m += own_m;
        }
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        places
    }

    /// In the open, but for the tunnels of the map.
    fn sections(&self, k: usize, length_m: f64) -> Vec<SectionEntry> {
        let open = |from_m| SectionEntry {
            from_m,
            to_m: None,
            shape: SectionShape::Open { width_m: None },
        };
        let tunnel = |from_m| SectionEntry {
            from_m,
            to_m: None,
            shape: SectionShape::Circular {
                radius_m: None,
                centre_m: None,
                walkway: None,
            },
        };
        let both = |element: usize, along: &AlongElement| {
            let tunnels_m = along.tunnels_m.iter();
            let ends = tunnels_m
                .filter(|_| !self.in_the_open.contains(&element))
                .flat_map(|[from_m, to_m]| [(*from_m, ()), (*to_m, ())]);
            ends.collect::<Vec<_>>()
        };
        // Ends of tunnels two by two; where one ends and another begins it goes on.
        let mut ends_m: Vec<f64> = self
            .along(k, length_m, both)
            .iter()
            .map(|(m, ())| rounded(*m, 3))
            .collect();
        let mut k = 1;
        while k + 1 < ends_m.len() {
            match ends_m[k + 1] - ends_m[k] < LEAST_SECTION_M {
                true => drop(ends_m.drain(k..k + 2)),
                false => k += 2,
            }
        }
        let mut sections = Vec::new();
        let mut free_m = 0.0;
        for pair in ends_m.chunks_exact(2) {
            let from_m = if pair[0] - free_m < LEAST_SECTION_M {
                free_m
            } else {
                pair[0]
            };
            let to_m = if length_m - pair[1] < LEAST_SECTION_M {
                length_m
            } else {
                pair[1]
            };
            if to_m - from_m < LEAST_SECTION_M {
                continue;
            }
            if from_m > free_m {
                sections.push(open(free_m));
            }
            sections.push(tunnel(from_m));
            free_m = to_m;
        }
        if free_m < length_m {
            sections.push(open(free_m));
        }
        sections
    }

    fn balises(&self, k: usize, length_m: f64) -> Vec<Balise> {
        let of = |_, along: &AlongElement| {
            along
                .balises
                .iter()
                .map(|balise| (balise.along_m, balise.name.clone()))
                .collect()
        };
        let balises = self.along(k, length_m, of).into_iter();
        let balises = balises.map(|(m, name)| Balise {
            name,
            chainage_m: rounded(m.clamp(0.0, (length_m * 1e3).floor() / 1e3), 3),
        });
        balises.collect()
    }
}

/// Gives a number to balises whose name another one has.
fn name_once<'a>(balises: impl Iterator<Item = &'a mut Balise>) {
    let mut taken = BTreeSet::new();
    for balise in balises {
        let first = balise.name.clone();
        let mut count = 1;
        while !taken.insert(balise.name.clone()) {
            count += 1;
            balise.name = format!("{first} {count}");
        }
    }
}
