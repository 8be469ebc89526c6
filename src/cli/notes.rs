//! What a user may not expect of a scenario that is right.

use crate::bus::TrainId;
use crate::scenario::{OnboardSettings, Scenario};
use crate::session::FieldOfView;
use crate::track::Direction;
use crate::twin::physics::ObstacleSettings;
use nalgebra::Point3;

/// Everything that `check` and `run` say of it.
pub(super) fn of(scenario: &Scenario) -> Vec<String> {
    let of_each = scenario.onboard.iter().map(|onboard| {
        [
            without_position(onboard, scenario),
            told_wrong_position(onboard, scenario),
            without_lamps(onboard, scenario),
        ]
    });
    let of_obstacles = [
        inside_a_train(scenario),
        out_of_view(scenario),
        in_the_reference(scenario),
    ];
    let notes = of_each.flatten().chain(of_obstacles);
    notes.flatten().collect()
}

/// What is there from the start, at a place where a train stands.
fn inside_a_train(scenario: &Scenario) -> Option<String> {
    let stands_on = |o: &ObstacleSettings| {
        let mut trains = scenario.physics.trains.iter().zip(0..);
        trains.find(|(train, _)| {
            let [from_m, to_m] = train.stands_m();
            (from_m..=to_m).contains(&o.chainage_m) && o.lateral_m.abs() < CAR_HALF_WIDTH_M
        })
    };
    let mut there = scenario.physics.obstacles.iter();
    there.find_map(|o| {
        let (train, k) = stands_on(o).filter(|_| o.appears_s <= 0.0)?;
        let [from_m, to_m] = train.stands_m();
        Some(format!(
            "`{}` lies at {} m from the start, in or under {}, which stands from {from_m:.1} to {to_m:.1} m: \
             place it clear of the train, or let it appear later (appears_s)",
            o.name,
            o.chainage_m,
            TrainId::from_index(k)
        ))
    })
}

/// Half the width of a metro car, metres.
const CAR_HALF_WIDTH_M: f64 = 1.4;

/// An obstacle that no wayside camera has in its picture, neither where it appears nor below that.
fn out_of_view(scenario: &Scenario) -> Option<String> {
    let views: Vec<FieldOfView> = (scenario.wayside.iter())
        .map(|post| FieldOfView::new(scenario, post))
        .collect();
    let line = &scenario.tunnel.alignment;
    let is_unseen = |o: &&ObstacleSettings| {
        let frame = line.at(o.chainage_m).world_from_line();
        let places = [o.height_m, 0.0].map(|up_m| frame * Point3::new(0.0, o.lateral_m, up_m));
        let is_seen = |view: &FieldOfView| places.iter().any(|place| view.has_in_view(place));
        o.spread_m[0] <= 0.0 && !views.iter().any(is_seen)
    };
    let mut obstacles = scenario.physics.obstacles.iter();
    let unseen = obstacles.find(is_unseen).filter(|_| !views.is_empty())?;
    let names: Vec<&str> = (scenario.wayside.iter())
        .map(|post| post.calibration.name.as_str())
        .collect();
    Some(format!(
        "`{}` at {} m is in the picture of no wayside camera ({}), and is not found there",
        unseen.name,
        unseen.chainage_m,
        names.join(", ")
    ))
}

/// A train that is told another position than it has.
fn told_wrong_position(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    let protection = &onboard.protection;
    let told_m = protection
        .initial_chainage_m
        .filter(|_| onboard.protects())?;
    let train = scenario.physics.trains.get(usize::from(onboard.train))?;
    let off_m = told_m - train.start_chainage_m;
    let allowed_m = protection.position_sigmas * protection.initial_sigma_m;
    (off_m.abs() > allowed_m).then(|| {
        format!(
            "the equipment of {} is told (initial_chainage_m) that its head is at {told_m} m; it is at {} m, \
             {:.1} m from there, and the equipment reckons with {allowed_m:.1} m at most",
            onboard.id(),
            train.start_chainage_m,
            off_m.abs()
        )
    })
}

/// What lies before a wayside camera while it learns what the clear track looks like.
fn in_the_reference(scenario: &Scenario) -> Option<String> {
    let detection = &scenario.file.stack.wayside;
    let early = |o: &&ObstacleSettings| {
        let mut devices = scenario.wayside.iter();
        devices.any(|post| {
            let learns_s = f64::from(detection.reference_frames) / post.camera.frames_per_s;
            let away_m = (o.chainage_m - post.calibration.chainage_m).abs();
            o.appears_s < learns_s && o.held_until_s.is_none() && away_m < detection.reach_m
        })
    };
    let first = scenario.physics.obstacles.iter().find(early)?;
    Some(format!(
        "`{}` appears at {} s, while a wayside camera near it learns its reference image from its first {} \
         frames: what lies there then belongs to the track, and is not found; let it appear later (appears_s)",
        first.name, first.appears_s, detection.reference_frames
    ))
}

/// A train that does not know where it is, and by what it may find out.
fn without_position(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    let protection = &onboard.protection;
    if !onboard.protects() || protection.initial_chainage_m.is_some() {
        return None;
    }
    let [from_m, to_m] = way_m(onboard, scenario)?;
    let balises = &scenario.tunnel.balises;
    let meets_balise = (balises.iter()).any(|b| (from_m..=to_m).contains(&b.chainage_m));
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
        onboard.id(),
        protection.restricted_kmh,
        match (meets_balise, onboard.positions()) {
            (false, false) => "all the way: it meets no balise and has no positioning by lamps",
            (true, false) => "until it has read a balise",
            (false, true) => "until it has found itself by lamps",
            (true, true) => "until it has read a balise or found itself by lamps",
        }
    ))
}

/// A rig on a train that has all lamps behind it.
fn without_lamps(onboard: &OnboardSettings, scenario: &Scenario) -> Option<String> {
    onboard.rig.as_ref()?;
    let [from_m, to_m] = way_m(onboard, scenario)?;
    let lamps = &scenario.tunnel.lamps;
    let (first, last) = (lamps.first()?, lamps.last()?);
    let passes = lamps
        .iter()
        .any(|l| (from_m..=to_m).contains(&l.chainage_m));
    (!passes).then(|| {
        format!(
            "no lamp stands on the way of {}, from {from_m:.0} to {to_m:.0} m: those of the line are \
             from {} to {} m",
            onboard.id(),
            first.chainage_m,
            last.chainage_m
        )
    })
}

/// The stretch from where a train starts to the end of the line, or its stop.
fn way_m(onboard: &OnboardSettings, scenario: &Scenario) -> Option<[f64; 2]> {
    let train = scenario.physics.trains.get(usize::from(onboard.train))?;
    let start_m = train.start_chainage_m;
    let stop_m = train.stop_at_m;
    Some(match train.direction {
        Direction::Up => [
            start_m,
            stop_m.unwrap_or(scenario.tunnel.alignment.length_m()),
        ],
        Direction::Down => [stop_m.unwrap_or(0.0), start_m],
    })
}
