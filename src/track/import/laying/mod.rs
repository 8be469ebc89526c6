//! From a map of others to a tunnel file: tracks with plans that a train can run, joined at switches.
//!
//! In this order: elements become tracks (`joining`); along each way straight on over switches a smooth curve gives the
//! pose in which tracks meet (`poses`); each track is fitted between the poses at its ends (`fit`), and written with as
//! few decimals as keep its ends together (`plans`). Each track says itself where it begins, so that rounding adds up
//! nowhere. What stands along the tracks goes into the file (`contents`). At last the file is checked as any file is;
//! what does not pass is taken out and listed (`repair`).
//!
//! Tracks are level unless the map has grades (`heights`). Not here: cant, speeds and signals.

mod contents;
mod heights;
mod joining;
mod laid;
mod names;
mod plans;
mod poses;
mod repair;
#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may panic, and says what it measured"
)]
mod tests;
mod world;

use super::fit::{EndPose, FitTask};
use super::map::{AlongElement, ImportedMap, LeftOut};
use super::plane::length_m;
use crate::track::geodesy::Datum;
use crate::track::network::TrackEnd;
use crate::track::{Direction, TrackId};
use joining::{Joined, Meeting, joined};
pub use laid::{InTunnel, LaidMap, LaidTrack, LayingError, LayingOptions};
use plans::WrittenPlan;
pub(super) use plans::rounded;
use poses::{BentPose, poses};
use repair::{Repair, Unfit};
use std::collections::{BTreeMap, BTreeSet};

/// Shorter tracks are left out.
const LEAST_M: f64 = 0.5;
/// Longer tracks are left out: the map is wrong.
const MOST_M: f64 = 100_000.0;
/// What does not pass is taken out round by round, as one repair may make others needless. At most so many rounds.
const MOST_ROUNDS: usize = 200;

/// What is laid so far.
struct Laying<'a> {
    map: &'a ImportedMap,
    options: &'a LayingOptions,
    datum: Option<Datum>,
    joined: Joined,
    /// By track.
    plans: Vec<FittedPlan>,
    names: names::Names,
    /// Tunnels of the map are left out along these elements.
    in_the_open: &'a BTreeSet<usize>,
    /// Grades of the map are left out.
    is_level: bool,
}

/// A plan, and how near it is.
#[derive(Clone)]
struct FittedPlan {
    written: WrittenPlan,
    length_m: f64,
    most_m: f64,
    rms_m: f64,
}

/// What of the map is not laid.
#[derive(Clone, Debug, Default)]
struct Without {
    elements: BTreeSet<usize>,
    tunnels: BTreeSet<usize>,
    grades: bool,
    told: Vec<LeftOut>,
}

impl ImportedMap {
    /// Its tracks as a tunnel file that passes all checks.
    pub fn lay(&self, options: &LayingOptions) -> Result<LaidMap, LayingError> {
        let count = self.network.elements.len();
        if count >= usize::from(u16::MAX) {
            return Err(LayingError::TooMany(count));
        }
        let mut without = Without::default();
        let mut found = Found::default();
        for _ in 0..MOST_ROUNDS {
            let laying = match Laying::of(self, options, &without, &mut found) {
                Ok(laying) => laying,
                Err(repairs) => {
                    without.add(self, repairs);
                    continue;
                }
            };
            let file = laying.file();
            if file.track.is_empty() {
                let first = without.told.first().map(|left| left.why.clone());
                return Err(LayingError::Nothing {
                    first: first.unwrap_or_else(|| "the map has none".to_owned()),
                });
            }
            let repairs = laying.repairs(&file);
            if repairs.is_empty() {
                let tracks = laying.tracks();
                without.told.extend(laying.joined.left_out);
                without.told.extend(unwritten(self));
                return Ok(LaidMap {
                    tracks,
                    file,
                    left_out: without.told,
                });
            }
            let before = (
                without.elements.len(),
                without.tunnels.len(),
                without.grades,
            );
            let first = repairs.first().map(|repair| repair.why.clone());
            without.add(self, repairs);
            if before
                == (
                    without.elements.len(),
                    without.tunnels.len(),
                    without.grades,
                )
            {
                return Err(LayingError::Unsound(first.unwrap_or_default()));
            }
        }
        Err(LayingError::Unsound(
            "something is wrong after each of many repairs".to_owned(),
        ))
    }
}

/// What lies along the elements and is not in a tunnel file.
fn unwritten(map: &ImportedMap) -> Option<LeftOut> {
    let count = |of: fn(&AlongElement) -> usize| map.along.iter().map(of).sum::<usize>();
    let counts = [
        (count(|along| along.cants_mm.len()), "cants"),
        (
            count(|along| along.curvatures_per_m.len()),
            "stated curvatures",
        ),
        (count(|along| along.speeds.len()), "speeds"),
        (count(|along| along.signals.len()), "signals"),
    ];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> = counts
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    let why = "tracks are laid by the points of the map alone, without cant; tunnel files have no signals, and no speeds but those of switches";
    (!counts.is_empty()).then(|| LeftOut {
        line: 0,
        what: counts.join(", "),
        why: why.to_owned(),
    })
}

impl Without {
    fn add(&mut self, map: &ImportedMap, repairs: Vec<Repair>) {
        for repair in repairs {
            match repair.what {
                Unfit::Element(element) => self.leave_out(map, element, repair.why),
                Unfit::Grades => {
                    self.grades = true;
                    self.told.push(LeftOut {
                        line: 0,
                        what: "all grades".to_owned(),
                        why: repair.why,
                    });
                }
                Unfit::Tunnels(elements) => {
                    for element in elements {
                        if self.tunnels.insert(element) {
                            let what =
                                format!("tunnel of element {}", map.network.elements[element].id);
                            let line = map.along[element].line;
                            self.told.push(LeftOut {
                                line,
                                what,
                                why: repair.why.clone(),
                            });
                        }
                    }
                }
            }
        }
    }

    fn leave_out(&mut self, map: &ImportedMap, element: usize, why: String) {
        if self.elements.insert(element) {
            let what = format!("element {}", map.network.elements[element].id);
            let line = map.along[element].line;
            self.told.push(LeftOut { line, what, why });
        }
    }
}

/// Elements and the directions in which a track runs over them, and numbers that its plan follows from.
type PlanKey = (Vec<(usize, Direction)>, Vec<u64>);

/// What was found in earlier rounds.
#[derive(Default)]
struct Found {
    plans: BTreeMap<PlanKey, Result<FittedPlan, String>>,
    ways: poses::FoundWays,
}

impl<'a> Laying<'a> {
    /// All tracks laid, or what has no plan.
    fn of(
        map: &'a ImportedMap,
        options: &'a LayingOptions,
        without: &'a Without,
        found: &mut Found,
    ) -> Result<Self, Vec<Repair>> {
        let mut joined = joined(map, options.join, &without.elements);
        let datum = map.network.datum.map(|datum| {
            let centred = world::centred(map, &datum);
            world::move_to(&mut joined, &datum, &centred);
            centred
        });
        let poses = poses(&joined, options.sigma_m, &mut found.ways);
        let mut laying = Self {
            map,
            options,
            datum,
            names: names::Names::of(map, &joined),
            plans: Vec::with_capacity(joined.tracks.len()),
            in_the_open: &without.tunnels,
            is_level: without.grades,
            joined,
        };
        let mut repairs = Vec::new();
        for k in 0..laying.joined.tracks.len() {
            match laying.found_plan(k, &poses, found) {
                Ok(plan) => laying.plans.push(plan),
                Err(why) => {
                    let pieces = laying.joined.tracks[k].pieces.iter();
                    repairs.extend(pieces.map(|(element, _)| Repair {
                        what: Unfit::Element(*element),
                        why: why.clone(),
                    }));
                }
            }
        }
        match repairs.is_empty() {
            true => Ok(laying),
            false => Err(repairs),
        }
    }

    /// The plan of a track, which may be known from an earlier round.
    fn found_plan(
        &self,
        k: usize,
        poses: &BTreeMap<TrackEnd, BentPose>,
        found: &mut Found,
    ) -> Result<FittedPlan, String> {
        let ends = self.end_poses(k, poses);
        let numbers = ends.iter().flatten().flat_map(|(bent, goes_on)| {
            let BentPose { pose, per_m } = bent;
            let goes_on = f64::from(u8::from(*goes_on));
            [
                pose.place.x,
                pose.place.y,
                pose.heading_rad,
                *per_m,
                goes_on,
            ]
            .map(f64::to_bits)
        });
        let begins = ends.iter().map(|end| u64::from(end.is_some()));
        let key = (
            self.joined.tracks[k].pieces.clone(),
            begins.chain(numbers).collect(),
        );
        let plan = found.plans.entry(key);
        plan.or_insert_with(|| self.plan(k, ends)).clone()
    }

    /// Poses that a track has at its begin and its end, and whether it goes on there as the line does.
    fn end_poses(
        &self,
        k: usize,
        poses: &BTreeMap<TrackEnd, BentPose>,
    ) -> [Option<(BentPose, bool)>; 2] {
        let track = TrackId(k as u16);
        let goes_on = |end: TrackEnd| {
            let mut meetings = self.joined.meetings.iter();
            !meetings.any(|m| matches!(m, Meeting::Switch(_, [.., leg]) if *leg == end))
        };
        [Direction::Down, Direction::Up].map(|way| {
            let end = TrackEnd { track, way };
            poses.get(&end).map(|pose| (*pose, goes_on(end)))
        })
    }

    /// The plan of a track between the poses at its ends.
    fn plan(
        &self,
        k: usize,
        [begin, end]: [Option<(BentPose, bool)>; 2],
    ) -> Result<FittedPlan, String> {
        let mut points = self.joined.tracks[k].points.clone();
        let drawn_m = length_m(&points);
        if drawn_m < LEAST_M {
            return Err(format!(
                "it is {drawn_m:.3} m long, and a track has at least {LEAST_M} m"
            ));
        }
        if drawn_m > MOST_M {
            let km = drawn_m / 1000.0;
            return Err(format!(
                "it is {km:.0} km long without a switch, and at most 100 km are laid"
            ));
        }
        let last = points.len().saturating_sub(1);
        for (given, at) in [(begin, 0), (end, last)] {
            if let (Some((pose, _)), Some(point)) = (given, points.get_mut(at)) {
                *point = pose.pose.place;
            }
        }
        let rules = poses::rules(&points, begin, end);
        let task = FitTask {
            points: &points,
            rules,
            sigma_m: self.options.sigma_m,
        };
        let fit = task.fit().map_err(|error| error.to_string())?;
        let length_m = fit.chain.length_m;
        let end = rules[1].pose.unwrap_or_else(|| fit.chain.end());
        let written = WrittenPlan::of(&fit.chain, end)
            .ok_or("its plan cannot be written with so few decimals that ends still meet")?;
        Ok(FittedPlan {
            written,
            length_m,
            most_m: fit.most_m,
            rms_m: fit.rms_m,
        })
    }

    /// Length of a track's elements on the map.
    fn drawn_m(&self, k: usize) -> f64 {
        let pieces = self.joined.tracks[k].pieces.iter();
        pieces
            .map(|(element, _)| self.map.network.elements[*element].length_m())
            .sum()
    }

    fn tracks(&self) -> Vec<LaidTrack> {
        let laid = self.plans.iter().enumerate().map(|(k, plan)| LaidTrack {
            name: self.names.track(k).to_owned(),
            elements: (self.joined.tracks[k].pieces.iter())
                .map(|(e, _)| self.map.network.elements[*e].id.clone())
                .collect(),
            length_m: plan.length_m,
            points: self.joined.tracks[k].points.len(),
            most_m: plan.most_m,
            rms_m: plan.rms_m,
            tightest_m: plan.written.tightest_m(),
        });
        laid.collect()
    }
}

impl super::fit::ArcChain {
    /// Where it ends.
    fn end(&self) -> EndPose {
        let at = self.places(&[self.length_m]);
        at.last().map_or(
            EndPose {
                place: self.begin,
                heading_rad: self.heading_rad,
            },
            |at| EndPose {
                place: at.place,
                heading_rad: at.heading_rad,
            },
        )
    }
}
