//! What a user may not expect of a scenario that is right.

use super::report::train_name;
use crate::bus::TrainId;
use crate::scenario::{OnboardSettings, Scenario, WaysidePost};
use crate::session::FieldOfView;
use crate::track::network::{Itinerary, Network, SwitchLeg};
use crate::track::{BED_M, CrossSection, TrackId, TrackPoint};
use crate::twin::physics::{ObstacleSettings, TrainSettings};

/// Everything that `check` and `run` say of it.
pub(super) fn of(scenario: &Scenario) -> Vec<String> {
    let of_each = scenario.onboard.iter().map(|onboard| {
        [
            without_position(onboard, scenario),
            without_receiver(onboard, scenario),
            without_sky(onboard, scenario),
            told_wrong_position(onboard, scenario),
            without_lamps(onboard, scenario),
        ]
    });
    let devices = Devices::of(scenario);
    let of_obstacles = [
        inside_a_train(scenario),
        devices.out_of_view(),
        devices.in_the_reference(),
    ];
    let notes = of_each.flatten().chain(of_obstacles);
    notes.flatten().chain(switches_against(scenario)).collect()
}

/// Switches that stand against a train at the start, and that nothing sets for it.
fn switches_against(scenario: &Scenario) -> Vec<String> {
    let interlocking = &scenario.physics.interlocking;
    let network = &scenario.tunnel.network;
    let is_moved = |name: &str| interlocking.moves.iter().any(|m| m.switch == name);
    let stands = |name: &str| {
        let mut positions = interlocking.positions.iter();
        let position = positions.find(|position| position.switch == name);
        position.map_or(SwitchLeg::Through, |position| position.leg.into())
    };
    let name_of = |leg: SwitchLeg| match leg {
        SwitchLeg::Through => "through",
        SwitchLeg::Diverging => "diverging",
    };
    let ways = scenario.itineraries.iter().enumerate();
    let ways = ways.filter(|_| !interlocking.automatic);
    ways.flat_map(|(k, way)| {
        let passings = network.passings(&way.route);
        let ahead = passings.into_iter().filter(|p| p.toe_m > way.start_m);
        ahead.filter_map(move |passing| {
            let name = &network.switches[passing.switch].name;
            (stands(name) != passing.leg && !is_moved(name)).then(|| {
                format!(
                    "switch `{name}` leads to its {} leg, and the route of {} runs over the {} leg: \
                     `interlocking.positions` or `moves` would set it",
                    name_of(stands(name)),
                    train_name(scenario, TrainId::from_index(k)),
                    name_of(passing.leg),
                )
            })
        })
    })
    .collect()
}

/// An obstacle that appears where a train stands.
fn inside_a_train(scenario: &Scenario) -> Option<String> {
    let network = &scenario.tunnel.network;
    let holds = |train: &TrainSettings, way: &Itinerary, o: &ObstacleSettings| {
        let stands_until_s = match train.start_speed_kmh > 0.0 {
            true => 0.0,
            false => train.start_s,
        };
        let [width_m, height_m] = train.profile_m();
        let tail_m = way.start_m - train.length_m();
        let track = track_of(network, o);
        let mut stands = way.route.stretches(tail_m, way.start_m);
        o.appears_s <= stands_until_s
            && stands.any(|s| s.track == track && (s.from_m..=s.to_m).contains(&o.chainage_m))
            && o.lateral_m.abs() < 0.5 * width_m
            && o.height_m < height_m
    };
    let mut single = scenario.physics.obstacles.iter().filter(|o| is_single(o));
    single.find_map(|o| {
        let trains = scenario.physics.trains.iter().zip(&scenario.itineraries);
        let (k, (train, _)) = trains.enumerate().find(|(_, (train, way))| holds(train, way, o))?;
        Some(format!(
            "`{}` appears at {} m, in or under {}, which stands there, {:.1} m long: place it clear of the train",
            o.name,
            o.chainage_m,
            train_name(scenario, TrainId::from_index(k)),
            train.length_m()
        ))
    })
}

/// It appears where its entry says; several, and those of a spread, are somewhere about that.
fn is_single(o: &ObstacleSettings) -> bool {
    o.count == 1 && o.spread_m.iter().all(|m| *m <= 0.0)
}

/// Wayside cameras, and what they have in their pictures.
struct Devices<'a> {
    scenario: &'a Scenario,
    views: Vec<(&'a WaysidePost, FieldOfView)>,
}

impl<'a> Devices<'a> {
    /// Without views where the scenario has no obstacles.
    fn of(scenario: &'a Scenario) -> Self {
        let views = match scenario.physics.obstacles.is_empty() {
            true => Vec::new(),
            false => FieldOfView::of_all(scenario),
        };
        Self {
            scenario,
            views: scenario.wayside.iter().zip(views).collect(),
        }
    }

    /// An obstacle whose middle is in no picture, neither where it appears nor on the bed below. What moves at
    /// the start may get into one.
    fn out_of_view(&self) -> Option<String> {
        if self.views.is_empty() {
            return None;
        }
        let network = &self.scenario.tunnel.network;
        let is_unseen = |o: &&ObstacleSettings| {
            let mut moves = o.velocity_mps.iter().chain(&o.spin_rad_s);
            let stays = moves.all(|v| v.abs() <= 0.0);
            let mut views = self.views.iter();
            is_single(o) && stays && !views.any(|(_, view)| shows(view, o, network))
        };
        let unseen = self.scenario.physics.obstacles.iter().find(is_unseen)?;
        let views = self.views.iter();
        let names: Vec<&str> = views.map(|(p, _)| &*p.calibration.name).collect();
        Some(format!(
            "no wayside camera ({}) has the middle of `{}` at {} m in its picture: it may not be found there",
            names.join(", "),
            unseen.name,
            unseen.chainage_m
        ))
    }

    /// What lies before a wayside camera while it learns what the clear track looks like.
    fn in_the_reference(&self) -> Option<String> {
        let detection = &self.scenario.file.stack.wayside;
        let network = &self.scenario.tunnel.network;
        let early = |o: &&ObstacleSettings| {
            self.views.iter().any(|(post, view)| {
                let learns_s = f64::from(detection.reference_frames) / post.camera.frames_per_s;
                let away_m = (o.chainage_m - post.calibration.chainage_m).abs();
                o.appears_s < learns_s
                    && o.held_until_s.is_none()
                    && away_m < detection.reach_m
                    && shows(view, o, network)
            })
        };
        let first = self.scenario.physics.obstacles.iter().find(early)?;
        Some(format!(
            "`{}` appears at {} s, while a wayside camera learns its reference image from its first {} frames: \
             what lies there then belongs to the track, and is not found; let it appear later (appears_s)",
            first.name, first.appears_s, detection.reference_frames
        ))
    }
}

/// The track that an obstacle is on.
fn track_of(network: &Network, o: &ObstacleSettings) -> TrackId {
    let named = o.track.as_ref().and_then(|name| network.named(name));
    named.unwrap_or_default()
}

/// Whether the middle of an obstacle is in a picture, where it appears or on the bed below that.
fn shows(view: &FieldOfView, o: &ObstacleSettings, network: &Network) -> bool {
    let line = &network.tracks[usize::from(track_of(network, o).0)].alignment;
    let over_lowest_m = o.middle_m().unwrap_or(o.height_m) - o.height_m;
    [o.height_m, BED_M].iter().any(|lowest_m| {
        view.has_in_view(&line.world_from_track(TrackPoint {
            s_m: o.chainage_m,
            l_m: o.lateral_m,
            h_m: lowest_m + over_lowest_m,
        }))
    })
}

/// A train whose equipment is told another position than it has.
fn told_wrong_position(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    let protection = &onboard.protection;
    let told_m = protection
        .initial_chainage_m
        .filter(|_| onboard.protects())?;
    let train = scenario.physics.trains.get(onboard.id().index())?;
    let start_m = train.start_chainage_m;
    let off_m = (told_m - start_m).abs();
    let margin_m = protection.position_sigmas * protection.initial_sigma_m;
    (off_m > margin_m).then(|| {
        format!(
            "initial_chainage_m of {} is {told_m} m, and its head starts at {start_m} m: {off_m:.2} m off, \
             where the margin of its equipment is {margin_m:.2} m (position_sigmas times initial_sigma_m)",
            train_name(scenario, onboard.id())
        )
    })
}

/// A train that does not know where it is, and by what it may find out.
fn without_position(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    let protection = &onboard.protection;
    if !onboard.protects() || protection.initial_chainage_m.is_some() {
        return None;
    }
    let meets_balise = meets_balise(onboard, scenario)?;
    let key = match onboard.train {
        0 => "stack.protection",
        _ => "the protection of its [[onboard]]",
    };
    let train = scenario.physics.trains.get(usize::from(onboard.train))?;
    let too_fast = if train.start_speed_kmh > protection.restricted_kmh {
        ", so that it brakes at once"
    } else {
        ""
    };
    Some(format!(
        "{} starts without a position, and its equipment permits {} km/h {}{too_fast}; \
         initial_chainage_m in {key} gives it one",
        train_name(scenario, onboard.id()),
        protection.restricted_kmh,
        match (meets_balise, onboard.positions()) {
            (false, false) => "all the way: it meets no balise and has no positioning by lamps",
            (true, false) => "until it has read a balise",
            (false, true) => "until it has found itself by lamps",
            (true, true) => "until it has read a balise or found itself by lamps",
        }
    ))
}

/// A train that is to tell its track without a satellite receiver.
fn without_receiver(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    if onboard.gnss.is_some() || !onboard.tells_its_track() {
        return None;
    }
    Some(format!(
        "{} has the equipment \"occupancy\" and no satellite receiver: {}; {} gives it one",
        train_name(scenario, onboard.id()),
        match meets_balise(onboard, scenario)? {
            true => "it knows its track from the first balise on that it runs over",
            false => "it never knows its track, as it meets no balise",
        },
        match onboard.train {
            0 => "[gnss]",
            _ => "gnss = {} in its [[onboard]]",
        }
    ))
}

/// A satellite receiver that is in tunnels all the way.
fn without_sky(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    onboard.gnss.as_ref()?;
    let train = scenario.physics.trains.get(usize::from(onboard.train))?;
    let [from_m, to_m] = way_m(onboard, scenario)?;
    let tail_m = from_m - train.length_m();
    let sections = &scenario.along(onboard.id())?.sections;
    let mut on_way = sections
        .iter()
        .filter(|r| r.from_m < to_m && r.to_m > tail_m);
    // A shared section is that of a neighbour, which may be open.
    let is_closed = |section: &CrossSection| !section.is_open() && !section.is_shared();
    on_way.all(|range| is_closed(&range.section)).then(|| {
        format!(
            "the satellite receiver of {} never sees the sky, for all of its way is in a tunnel: it gives no fix; \
             sections of kind \"open\" in the tunnel file are under the sky",
            train_name(scenario, onboard.id())
        )
    })
}

/// Whether a train runs over a balise on its way.
fn meets_balise(onboard: &OnboardSettings, scenario: &Scenario) -> Option<bool> {
    let [from_m, to_m] = way_m(onboard, scenario)?;
    let track = scenario.along(onboard.id())?;
    let mut balises = track.balises.iter();
    Some(balises.any(|b| (from_m..=to_m).contains(&b.chainage_m)))
}

/// A rig on a train that has all lamps behind it.
fn without_lamps(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    onboard.rig.as_ref()?;
    let [from_m, to_m] = way_m(onboard, scenario)?;
    let lamps = &scenario.along(onboard.id())?.lamps;
    let (first, last) = (lamps.first()?, lamps.last()?);
    let passes = lamps
        .iter()
        .any(|l| (from_m..=to_m).contains(&l.chainage_m));
    (!passes).then(|| {
        format!(
            "no lamp stands on the way of {}, from {from_m:.0} to {to_m:.0} m: those of the line are \
             from {} to {} m",
            train_name(scenario, onboard.id()),
            first.chainage_m,
            last.chainage_m
        )
    })
}

/// The stretch of its route from where a train starts to its stop, or the end of the route.
fn way_m(onboard: &OnboardSettings, scenario: &Scenario) -> Option<[f64; 2]> {
    scenario.physics.trains.get(usize::from(onboard.train))?;
    let way = scenario.itineraries.get(onboard.id().index())?;
    let end_m = way.stop_m.unwrap_or(way.route.length_m());
    Some([way.start_m, end_m])
}
