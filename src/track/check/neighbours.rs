//! Tracks beside each other: trains must pass, and no wall may stand where they run.

use super::findings::{Findings, Room, Wrong};
use crate::settings::Checker;
use crate::track::network::{Network, SwitchLeg, TrackEnd};
use crate::track::section::{CrossSection, OutlinePoint};
use crate::track::{Direction, Gauge, Place, Side, Stretch, TrackFrame, TrackId, TrackPoint};
use nalgebra::Point3;
use std::collections::BTreeMap;

/// Tracks are looked at so often: less than the gauge of a track that crosses square is wide, twice 1.6 m. Borders of
/// cross-sections, which are round numbers in most files, are missed.
const STEP_M: f64 = 3.0;
const FIRST_M: f64 = 1.37;
/// Nothing on another track that is farther away is in the way; as wide as a cross-section may be.
const NEAR_M: f64 = 60.0;
/// Nor what is so much higher or lower.
const LEVEL_M: f64 = 10.0;
/// Legs of a switch part within this distance of its toe.
const PARTING_M: f64 = 150.0;
/// So much may the ways from the toe differ of places that are beside each other.
const ABREAST_M: f64 = 5.0;
/// Gauges overlap no farther than this beyond the zone of a crossing: its corners are those of its widest gauges.
const BESIDE_ZONE_M: f64 = 0.1;
/// Walls may reach into each other by so much: chords of arcs, rounding.
const OVERLAP_M: f64 = 0.02;

/// Problems of tracks beside each other, nearer than they should be by more than `slack_m`. `key` is that of a track in
/// the file.
pub(super) fn check_neighbours(
    network: &Network,
    slack_m: f64,
    key: impl Fn(TrackId) -> String,
    check: &mut Checker<'_>,
) {
    findings(network, slack_m).tell(network, key, check);
}

/// Places of tracks where trains would touch those on another track, or where walls of one are in the way of the
/// other: the first of each two tracks.
pub(in crate::track) fn in_the_way(network: &Network, slack_m: f64) -> Vec<(Place, TrackId)> {
    findings(network, slack_m).places().collect()
}

fn findings(network: &Network, slack_m: f64) -> Findings {
    let mut findings = Findings::default();
    if network.tracks.len() < 2 {
        return findings;
    }
    let grid = Grid::of(network);
    let partings = Partings::of(network);
    for checked in &grid.places {
        let mut lies_in_another = false;
        let mut nearest_room: Option<Room> = None;
        for (other, point) in grid.beside(network, checked.place.track, &checked.frame.origin) {
            let s_m = point.s_m;
            let place = Place { track: other, s_m };
            let Some(pair) = Pair::of(network, slack_m, checked, place, point) else {
                continue;
            };
            lies_in_another |= pair.holds();
            let room = pair.room(other, point.l_m);
            nearest_room = nearest_room.into_iter().chain(room).min_by(Room::by_lack);
            let may_touch =
                partings.part(checked.place, place) || cross(network, checked.place, place);
            if let Some(wrong) = pair.wrong(may_touch) {
                findings.note(wrong.at(checked.place, other, point.l_m).with(room));
            }
        }
        let is_shared = section(network, checked.place).is_some_and(CrossSection::is_shared);
        if is_shared && !lies_in_another {
            let nowhere = Wrong::Nowhere.at(checked.place, checked.place.track, 0.0);
            findings.note(nowhere.with(nearest_room));
        }
    }
    for (place, world) in standing(network) {
        for (other, point) in grid.beside(network, place.track, &world) {
            let frame = network.alignment(other).map(|line| line.at(point.s_m));
            let gauge = frame.map(|frame| Gauge::b1(frame.curvature_per_m));
            if gauge.is_some_and(|gauge| gauge.contains(point.l_m, point.h_m)) {
                findings.note(Wrong::Furniture.at(place, other, point.l_m));
            }
        }
    }
    findings
}

/// Whether two places that are beside each other lie where their tracks cross.
fn cross(network: &Network, a: Place, b: Place) -> bool {
    let is_in = |place: Place, zone: Stretch| {
        let zone = zone.widened(BESIDE_ZONE_M);
        zone.track == place.track && (zone.from_m..=zone.to_m).contains(&place.s_m)
    };
    network.crossings.iter().any(|crossing| {
        let [first, second] = [0, 1].map(|side| crossing.zone(side));
        (is_in(a, first) && is_in(b, second)) || (is_in(b, first) && is_in(a, second))
    })
}

/// Lamps and wayside devices, by the place on their track and in the world.
fn standing(network: &Network) -> impl Iterator<Item = (Place, Point3<f64>)> + '_ {
    let tracks = network.tracks.iter().enumerate();
    tracks.flat_map(|(k, track)| {
        let place = move |s_m| Place {
            track: TrackId(k as u16),
            s_m,
        };
        let lamps = (track.lamps.iter()).map(move |lamp| (place(lamp.chainage_m), lamp.centre));
        let devices = track.wayside.iter().map(move |site| {
            let point = TrackPoint {
                s_m: site.chainage_m,
                l_m: site.lateral_m,
                h_m: site.height_m,
            };
            (
                place(site.chainage_m),
                track.alignment.world_from_track(point),
            )
        });
        lamps.chain(devices)
    })
}

/// A place of a track that is looked at.
struct CheckedPlace {
    place: Place,
    frame: TrackFrame,
}

/// The checked places of all tracks by where they are in the world.
struct Grid {
    places: Vec<CheckedPlace>,
    cells: BTreeMap<(i64, i64), Vec<usize>>,
}

fn cell_of(p: &Point3<f64>) -> (i64, i64) {
    ((p.x / NEAR_M).floor() as i64, (p.y / NEAR_M).floor() as i64)
}

impl Grid {
    fn of(network: &Network) -> Self {
        let mut places = Vec::new();
        let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (k, track) in network.tracks.iter().enumerate() {
            let length_m = track.alignment.length_m();
            let count = ((length_m - FIRST_M) / STEP_M).max(0.0).ceil() as usize;
            for j in 0..count {
                let s_m = FIRST_M + j as f64 * STEP_M;
                let frame = track.alignment.at(s_m);
                cells
                    .entry(cell_of(&frame.origin))
                    .or_default()
                    .push(places.len());
                let place = Place {
                    track: TrackId(k as u16),
                    s_m,
                };
                places.push(CheckedPlace { place, frame });
            }
        }
        Self { places, cells }
    }

    /// The other tracks beside a position, each with the point as that track has it.
    fn beside(
        &self,
        network: &Network,
        own: TrackId,
        at: &Point3<f64>,
    ) -> Vec<(TrackId, TrackPoint)> {
        let (i, j) = cell_of(at);
        let cells = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| (i, j)));
        let near = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        let mut nearest: BTreeMap<TrackId, (f64, f64)> = BTreeMap::new();
        for other in near.map(|k| &self.places[*k]) {
            let away = other.frame.origin - at;
            let away_m = away.xy().norm();
            let Place { track, s_m } = other.place;
            if track == own || away_m > NEAR_M || away.z.abs() > LEVEL_M {
                continue;
            }
            let best = nearest.entry(track).or_insert((away_m, s_m));
            if away_m < best.0 {
                *best = (away_m, s_m);
            }
        }
        let points = nearest.into_iter().filter_map(|(track, (_, near_s_m))| {
            let line = network.alignment(track)?;
            let point = line.track_from_world(at, near_s_m);
            let inside = (0.01..=line.length_m() - 0.01).contains(&point.s_m);
            inside.then_some((track, point))
        });
        points.collect()
    }
}

/// Which places part at a switch: how far behind the toe of each switch a track is, on which leg.
struct Partings(BTreeMap<TrackId, Vec<Parting>>);

struct Parting {
    switch: usize,
    leg: SwitchLeg,
    /// Way from the toe to where the track is entered, and which end that is.
    begin_m: f64,
    entered: TrackEnd,
    length_m: f64,
}

impl Parting {
    fn behind_m(&self, s_m: f64) -> f64 {
        self.begin_m
            + match self.entered.way {
                Direction::Down => s_m,
                Direction::Up => self.length_m - s_m,
            }
    }
}

impl Partings {
    fn of(network: &Network) -> Self {
        let mut all = Self(BTreeMap::new());
        for (number, switch) in network.switches.iter().enumerate() {
            for leg in [SwitchLeg::Through, SwitchLeg::Diverging] {
                let mut open = vec![(switch.leg(leg), 0.0)];
                while let Some((entered, begin_m)) = open.pop() {
                    let Some(line) = network.alignment(entered.track) else {
                        continue;
                    };
                    let length_m = line.length_m();
                    let parting = Parting {
                        switch: number,
                        leg,
                        begin_m,
                        entered,
                        length_m,
                    };
                    all.0.entry(entered.track).or_default().push(parting);
                    let end_m = begin_m + length_m;
                    if end_m < PARTING_M {
                        let next = network.next(entered.opposite());
                        open.extend(next.map(|next| (next, end_m)));
                    }
                }
            }
        }
        all
    }

    /// Whether two places that are beside each other lie on different legs of a switch, near enough to its toe.
    fn part(&self, a: Place, b: Place) -> bool {
        let (Some(of_a), Some(of_b)) = (self.0.get(&a.track), self.0.get(&b.track)) else {
            return false;
        };
        of_a.iter().any(|x| {
            of_b.iter().any(|y| {
                let [m, n] = [x.behind_m(a.s_m), y.behind_m(b.s_m)];
                x.switch == y.switch
                    && x.leg != y.leg
                    && m.max(n) < PARTING_M
                    && (m - n).abs() < ABREAST_M
            })
        })
    }
}

/// A place of a track, and the other track beside it.
struct Pair<'a> {
    own: Option<&'a CrossSection>,
    others: Option<&'a CrossSection>,
    /// Corners of the place's gauge and section as the other track has them.
    gauge: Vec<OutlinePoint>,
    outline: Vec<OutlinePoint>,
    /// Gauges that touch.
    touch: bool,
}

fn section(network: &Network, place: Place) -> Option<&CrossSection> {
    network.track(place.track)?.section_at(place.s_m)
}

impl<'a> Pair<'a> {
    fn of(
        network: &'a Network,
        slack_m: f64,
        checked: &CheckedPlace,
        other: Place,
        point: TrackPoint,
    ) -> Option<Self> {
        let frame = network.alignment(other.track)?.at(other.s_m);
        // Square to its own track is at an angle to square to the other one.
        let across = checked.frame.left().dot(&frame.left());
        let as_other =
            |p: &OutlinePoint| OutlinePoint::new(point.l_m + across * p.l_m, point.h_m + p.h_m);
        let gauges = [&checked.frame, &frame].map(|f| Gauge::b1(f.curvature_per_m));
        let apart_m = across.abs() * gauges[0].widest_m() + gauges[1].widest_m() - slack_m;
        let own = section(network, checked.place);
        Some(Self {
            own,
            others: section(network, other),
            gauge: gauges[0].outline().iter().map(as_other).collect(),
            outline: own.map_or(Vec::new(), |own| own.points.iter().map(as_other).collect()),
            touch: point.l_m.abs() < apart_m && point.h_m.abs() < gauges[0].top_m(),
        })
    }

    /// The other's section has room for this place's gauge.
    fn holds(&self) -> bool {
        let inside =
            |section: &CrossSection| self.gauge.iter().all(|p| section.covers(p.l_m, p.h_m));
        self.others
            .is_some_and(|section| !section.is_shared() && inside(section))
    }

    /// Room in the other's section, to this side of the other track, where it is not wide enough for this place's
    /// gauge.
    fn room(&self, of: TrackId, l_m: f64) -> Option<Room> {
        let section = self.others.filter(|section| !section.is_shared())?;
        let side = if l_m < 0.0 { Side::Right } else { Side::Left };
        let reach_m = section.lateral_m().map(|m| side.sign() * m);
        let needed_m = self.gauge.iter().map(|p| side.sign() * p.l_m);
        let room = Room {
            of,
            side,
            has_m: reach_m.into_iter().fold(0.0, f64::max),
            needs_m: needed_m.fold(0.0, f64::max),
        };
        (room.needs_m > room.has_m).then_some(room)
    }

    /// What is wrong, where the tracks may touch: near a switch, on a crossing.
    fn wrong(&self, may_touch: bool) -> Option<Wrong> {
        if self.touch && !may_touch {
            return Some(Wrong::Gauges);
        }
        let others = self.others.filter(|section| section.closed)?;
        let inside = self
            .gauge
            .iter()
            .filter(|p| others.contains(p.l_m, p.h_m))
            .count();
        let has_walls = self.own.is_some_and(|own| own.closed);
        if inside == self.gauge.len() {
            return has_walls.then_some(Wrong::Walls);
        }
        if inside > 0 {
            return Some(Wrong::Wall);
        }
        let reaches_in = |p: &OutlinePoint| {
            others.contains(p.l_m, p.h_m) && others.distance_m(p.l_m, p.h_m) > OVERLAP_M
        };
        (has_walls && self.outline.iter().any(reaches_in)).then_some(Wrong::Rock)
    }
}
