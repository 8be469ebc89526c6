//! Crossings at one level: where their tracks cross, and whether fixed rails can be laid there.

use crate::settings::{Checker, name_advice};
use crate::track::file::CrossingEntry;
use crate::track::network::{Crossing, Network, SwitchLeg};
use crate::track::{Direction, Stretch, TrackId};

/// Tangent of the least angle. In the obtuse points of a crossing no check rail guides the wheels over a gap that
/// grows as tracks cross more flatly: fixed ones are laid up to 1 in 8 in Britain, 1 in 8.5 in India, and 1 in 9 in
/// Germany. This is 1 in 9 with what lengths are rounded by.
const LEAST_TANGENT: f64 = 0.11;
/// Heads of rails that cross differ by so much in height at most: tracks of one plane, surveyed to a millimetre or two.
const MOST_STEP_M: f64 = 3e-3;
/// Crossings of the same tracks that are closer are one.
const SAME_M: f64 = 0.1;

/// The crossings of a file that are right.
pub(super) fn crossings(
    entries: &[CrossingEntry],
    network: &Network,
    slack_m: f64,
    check: &mut Checker<'_>,
) -> Vec<Crossing> {
    let mut all: Vec<Crossing> = Vec::new();
    for (k, entry) in entries.iter().enumerate() {
        let check = &mut check.below(&format!("crossings[{k}]"));
        let Some(crossing) = crossing(entry, network, check) else {
            continue;
        };
        if let Some(first) = all.iter().find(|other| is_same(other, &crossing)) {
            let what = format!("`{}` is where `{}` is already", entry.name, first.name);
            let remedy = "leave it out, or say by `near_m` where it is on the first track";
            check.problem("tracks", what, remedy);
        }
        check_level(&crossing, check);
        check_angle(&crossing, slack_m, check);
        check_room(&crossing, network, check);
        check_blades(&crossing, network, check);
        all.push(crossing);
    }
    all
}

/// Where the tracks of an entry cross; a problem where they do not, or where it does not say which place it is.
fn crossing(entry: &CrossingEntry, network: &Network, check: &mut Checker<'_>) -> Option<Crossing> {
    // Another count of names has its problem already.
    let [first, second] = &entry.tracks[..] else {
        return None;
    };
    let tracks = tracks([first, second], network, check)?;
    let found = network.crossed_at_m(tracks);
    let at_m = match (&found[..], entry.near_m) {
        ([], _) => {
            let what = format!("tracks `{first}` and `{second}` do not cross each other in plan");
            let remedy = "name two that do, between their ends, or leave the crossing out";
            check.problem("tracks", what, remedy);
            return None;
        }
        ([only], None) => *only,
        (several, Some(near_m)) => {
            let away_m = |at_m: &&[f64; 2]| (at_m[0] - near_m).abs();
            let nearest = several
                .iter()
                .min_by(|a, b| away_m(a).total_cmp(&away_m(b)));
            *nearest?
        }
        (several, None) => {
            let places = several.iter().map(|at_m| format!("{:.1} m", at_m[0]));
            let places = places.collect::<Vec<_>>().join(", ");
            let what = format!("tracks `{first}` and `{second}` cross at {places} of `{first}`");
            check.problem("tracks", what, "say which place it is by `near_m`");
            return None;
        }
    };
    let crossing = network.crossing(&entry.name, tracks, at_m);
    if crossing.is_none() {
        let what = format!(
            "tracks `{first}` and `{second}` do not part to both sides of where they cross"
        );
        check.problem("tracks", what, "let them cross at a greater angle");
    }
    crossing
}

/// The two tracks that an entry names.
fn tracks(names: [&String; 2], network: &Network, check: &mut Checker<'_>) -> Option<[TrackId; 2]> {
    let found = names.map(|name| network.named(name));
    let unknown = names.iter().zip(found).enumerate();
    for (k, (name, _)) in unknown.filter(|(_, (_, track))| track.is_none()) {
        let known = network.tracks.iter().map(|track| track.name.clone());
        let known: Vec<String> = known.collect();
        let remedy = name_advice(name, &known, "the tracks are", "name a track");
        let what = format!("there is no track `{name}`");
        check.problem(&format!("tracks[{k}]"), what, remedy);
    }
    let [Some(first), Some(second)] = found else {
        return None;
    };
    if first == second {
        let what = format!("both are `{}`, and no track crosses itself", names[0]);
        check.problem("tracks", what, "name two tracks");
        return None;
    }
    Some([first, second])
}

fn is_same(a: &Crossing, b: &Crossing) -> bool {
    let near = |track: TrackId| {
        let of = |crossing: &Crossing| {
            let side = crossing.side_of(track)?;
            Some(crossing.places[side].s_m)
        };
        let pair = of(a).zip(of(b));
        pair.is_some_and(|(a_m, b_m)| (a_m - b_m).abs() < SAME_M)
    };
    a.places.iter().all(|place| near(place.track))
}

/// Rails that cross lie at one height.
fn check_level(crossing: &Crossing, check: &mut Checker<'_>) {
    if crossing.rail_step_m > MOST_STEP_M {
        let what = format!(
            "rails of one track are up to {:.1} mm above those of the other where they cross, and {:.0} mm are \
             permitted",
            1e3 * crossing.rail_step_m,
            1e3 * MOST_STEP_M
        );
        let remedy = "let both tracks have one height, grade and cant there, or leave the crossing out where one \
                      passes over the other";
        check.problem("tracks", what, remedy);
    }
}

/// An angle is known as well as places half the crossing apart.
fn check_angle(crossing: &Crossing, slack_m: f64, check: &mut Checker<'_>) {
    let tangent = crossing.angle_rad.tan();
    let Stretch { from_m, to_m, .. } = crossing.zone(0);
    let unknown = slack_m / (0.5 * (to_m - from_m)).max(1.0);
    if tangent < LEAST_TANGENT - unknown {
        let what = format!(
            "the tracks cross at {:.1} deg, 1 in {:.1}: a crossing with fixed rails does not guide wheels over so flat \
             an angle",
            crossing.angle_rad.to_degrees(),
            1.0 / tangent
        );
        check.problem("tracks", what, "let them cross at 1 in 9, 6.3 deg, or more");
    }
}

/// Gauges part on the tracks themselves, so that what is beyond their ends is clear of the crossing.
fn check_room(crossing: &Crossing, network: &Network, check: &mut Checker<'_>) {
    for side in [0, 1] {
        let Stretch {
            track,
            from_m,
            to_m,
        } = crossing.zone(side);
        let track = &network.tracks[usize::from(track.0)];
        let length_m = track.alignment.length_m();
        if from_m < 0.0 || to_m > length_m {
            let name = &track.name;
            let what = format!(
                "trains are in each other's way from {from_m:.1} to {to_m:.1} m of track `{name}`, which goes from 0 \
                 to {length_m:.1} m"
            );
            let remedy = "let both tracks go on until trains on them are clear of each other, or cross at a greater \
                          angle";
            check.problem("tracks", what, remedy);
        }
    }
}

/// No rail crosses blades, which move.
fn check_blades(crossing: &Crossing, network: &Network, check: &mut Checker<'_>) {
    for switch in &network.switches {
        let Some(heel_m) = network.heel_m(switch) else {
            continue;
        };
        for end in [SwitchLeg::Through, SwitchLeg::Diverging].map(|leg| switch.leg(leg)) {
            let Some(rails) = crossing.side_of(end.track).map(|side| crossing.rails(side)) else {
                continue;
            };
            let length_m = network
                .alignment(end.track)
                .map_or(0.0, |line| line.length_m());
            let near_m = match end.way {
                Direction::Down => rails.from_m,
                Direction::Up => length_m - rails.to_m,
            };
            if near_m < heel_m {
                let what = format!(
                    "its rails begin {near_m:.1} m behind the toe of switch `{}`, whose blades reach to {heel_m:.1} m",
                    switch.name
                );
                check.problem(
                    "tracks",
                    what,
                    "let the tracks cross farther from the switch",
                );
            }
        }
    }
}
