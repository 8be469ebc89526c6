//! The file is checked as any file is; what does not pass is named, to be taken out of the map.

use super::joining::Meeting;
use super::{Laying, TrackEnd};
use crate::settings::Problem;
use crate::track::check::{check, in_the_way};
use crate::track::file::TunnelFile;
use crate::track::import::number_in;
use crate::track::network::Network;
use crate::track::{Direction, Place};
use std::collections::BTreeSet;

/// What is to be taken out.
#[derive(Clone, Debug)]
pub(super) enum Unfit {
    Element(usize),
    /// All grades: tracks are level.
    Grades,
    /// The tunnels along elements.
    Tunnels(Vec<usize>),
}

/// What is to be taken out, and why.
#[derive(Clone, Debug)]
pub(super) struct Repair {
    pub what: Unfit,
    pub why: String,
}

impl Laying<'_> {
    /// What does not pass; nothing where the file is right.
    pub(super) fn repairs(&self, file: &TunnelFile) -> Vec<Repair> {
        let mut problems = Vec::new();
        let tunnel = check(file, &mut problems);
        if problems.is_empty() {
            return Vec::new();
        }
        let has_grades = file.track.iter().any(|track| !track.grades.is_empty());
        let of_grades = problems.iter().find(|problem| {
            [".grades", ".from", ".to"]
                .iter()
                .any(|key| problem.key.contains(key))
        });
        if let Some(problem) = of_grades.filter(|_| has_grades) {
            let (what, why) = (Unfit::Grades, said(problem));
            return vec![Repair { what, why }];
        }
        let mut repairs = Vec::new();
        let mut touched = BTreeSet::new();
        for problem in &problems {
            let number = |table: &str| number_in(&problem.key, table);
            let what = if let Some(k) = number("crossings") {
                self.joined
                    .crossings
                    .get(k)
                    .map(|(tracks, at)| self.piece_at(self.shorter(*tracks), at))
            } else if let Some(k) = number("switches") {
                self.diverging(k).map(|leg| self.end_piece(leg))
            } else {
                None
            };
            if let Some(element) = what.filter(|element| touched.insert(*element)) {
                repairs.push(Repair {
                    what: Unfit::Element(element),
                    why: said(problem),
                });
            }
        }
        if repairs.is_empty()
            && let Some(tunnel) = tunnel
        {
            repairs = self.apart(&tunnel.network, file.slack_m(), &problems);
        }
        if repairs.is_empty() {
            repairs.extend(problems.iter().filter_map(|problem| {
                let track = self.joined.tracks.get(number_in(&problem.key, "track")?)?;
                let (element, _) = track.pieces.first()?;
                Some(Repair {
                    what: Unfit::Element(*element),
                    why: said(problem),
                })
            }));
        }
        repairs
    }

    /// Tracks that are in each other's way: first their tunnels are taken out, then one of them.
    fn apart(&self, network: &Network, slack_m: f64, problems: &[Problem]) -> Vec<Repair> {
        let mut touched = BTreeSet::new();
        let mut repairs = Vec::new();
        for (place, other) in in_the_way(network, slack_m) {
            let [own, other] = [place.track, other].map(|track| usize::from(track.0));
            let tunnels: Vec<usize> = [own, other]
                .into_iter()
                .flat_map(|k| self.tunnels_of(k))
                .collect();
            let key = format!("track[{own}]");
            let problem = problems.iter().find(|problem| problem.key == key);
            let why = problem.map_or_else(|| "it is in the way of another track".to_owned(), said);
            if !tunnels.is_empty() {
                repairs.push(Repair {
                    what: Unfit::Tunnels(tunnels),
                    why,
                });
                continue;
            }
            let element = match self.shorter([own, other]) == own {
                true => self.piece_along(place),
                false => {
                    let at = network
                        .alignment(place.track)
                        .map(|line| line.at(place.s_m).origin);
                    at.map_or_else(
                        || self.piece_along(place),
                        |at| self.piece_at(other, &at.xy()),
                    )
                }
            };
            // One of two is enough: what is in the way of what is taken out may stay.
            if !touched.contains(&own) && !touched.contains(&other) {
                touched.extend([own, other]);
                repairs.push(Repair {
                    what: Unfit::Element(element),
                    why,
                });
            }
        }
        repairs
    }

    fn shorter(&self, tracks: [usize; 2]) -> usize {
        let [a, b] = tracks.map(|k| self.plans.get(k).map_or(0.0, |plan| plan.length_m));
        if a <= b { tracks[0] } else { tracks[1] }
    }

    /// The diverging leg of a switch of the file.
    fn diverging(&self, number: usize) -> Option<TrackEnd> {
        let mut switches = self
            .joined
            .meetings
            .iter()
            .filter_map(|meeting| match meeting {
                Meeting::Switch(_, ends) => Some(self.legs(ends)[2]),
                _ => None,
            });
        switches.nth(number)
    }

    fn end_piece(&self, end: TrackEnd) -> usize {
        let pieces = &self.joined.tracks[usize::from(end.track.0)].pieces;
        match end.way {
            Direction::Down => pieces[0].0,
            Direction::Up => pieces[pieces.len() - 1].0,
        }
    }

    /// The element at a place of a track.
    fn piece_along(&self, place: Place) -> usize {
        let k = usize::from(place.track.0);
        let pieces = &self.joined.tracks[k].pieces;
        let mut left_m = place.s_m * self.drawn_m(k) / self.plans[k].length_m.max(1e-9);
        for (element, _) in pieces {
            left_m -= self.map.network.elements[*element].length_m();
            if left_m <= 0.0 {
                return *element;
            }
        }
        pieces[pieces.len() - 1].0
    }

    /// The element of a track that is nearest to a point; at a joint of two the shorter one.
    fn piece_at(&self, k: usize, at: &nalgebra::Point2<f64>) -> usize {
        let line = self.plans[k].written.line();
        let s_m = line.near_m(&nalgebra::Point3::new(at.x, at.y, 0.0));
        let s_m = line
            .track_from_world(&nalgebra::Point3::new(at.x, at.y, 0.0), s_m)
            .s_m;
        let track = crate::track::TrackId(k as u16);
        let [a, b] = [-1.0, 1.0].map(|m| {
            self.piece_along(Place {
                track,
                s_m: s_m + m,
            })
        });
        let length_m = |element: usize| self.map.network.elements[element].length_m();
        if length_m(a) <= length_m(b) { a } else { b }
    }

    fn tunnels_of(&self, k: usize) -> Vec<usize> {
        let pieces = self.joined.tracks[k]
            .pieces
            .iter()
            .map(|(element, _)| *element);
        let with = pieces
            .filter(|e| !self.map.along[*e].tunnels_m.is_empty() && !self.in_the_open.contains(e));
        with.collect()
    }
}

fn said(problem: &Problem) -> String {
    problem.what.clone()
}
