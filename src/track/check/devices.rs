//! Wayside devices of a track file, and whatever else has a name and a place.

use super::{free_standing, on_line};
use crate::settings::{Checker, did_you_mean};
use crate::track::Track;
use crate::track::furniture::WaysideSite;
use crate::track::section::OutlinePoint;
use std::collections::BTreeMap;

/// Checks wayside devices against rock, gauge and balises.
pub(super) fn check_wayside(track: &Track, check: &mut Checker<'_>) {
    for (k, w) in track.wayside.iter().enumerate() {
        let device = format!("wayside[{k}]");
        if on_line(&format!("{device}.chainage_m"), w.chainage_m, track, check) {
            let place = [OutlinePoint::new(w.lateral_m, w.height_m)];
            free_standing(&device, track, w.chainage_m, &place, check);
        }
        check_balise(&format!("{device}.balise"), w, track, check);
    }
}

fn check_balise(key: &str, w: &WaysideSite, track: &Track, check: &mut Checker<'_>) {
    if w.balise.trim().is_empty() {
        let remedy = "name the one of `[[balises]]` that gets its messages";
        check.problem(key, "is empty", remedy);
        return;
    }
    match track.balise(&w.balise) {
        None => {
            let names: Vec<String> = track.balises.iter().map(|b| b.name.clone()).collect();
            let remedy = match did_you_mean(&w.balise, &names) {
                Some(name) => format!("did you mean \"{name}\"?"),
                None => "name one of `[[balises]]`".to_owned(),
            };
            check.problem(key, format!("there is no balise \"{}\"", w.balise), remedy);
        }
        Some(b) if b.chainage_m >= w.chainage_m => check.problem(
            key,
            format!(
                "balise \"{}\" at {} m is not before the device at {} m",
                b.name, b.chainage_m, w.chainage_m
            ),
            "name a balise that trains pass before they come to the device",
        ),
        Some(_) => {}
    }
}

/// Chainages on the line, and names that are there twice.
pub(super) fn check_named(track: &Track, check: &mut Checker<'_>) {
    let wayside = track.wayside.iter().map(|w| (&w.name, w.chainage_m));
    let balises = track.balises.iter().map(|b| (&b.name, b.chainage_m));
    let base_stations = track.base_stations.iter();
    let base_stations = base_stations.map(|b| (&b.name, b.chainage_m));
    let stations = track.stations.iter().map(|s| (&s.name, s.chainage_m));
    for (table, places) in [
        ("wayside", wayside.collect::<Vec<_>>()),
        ("balises", balises.collect()),
        ("base_stations", base_stations.collect()),
        ("stations", stations.collect()),
    ] {
        let mut named: BTreeMap<&str, usize> = BTreeMap::new();
        for (k, (name, chainage_m)) in places.into_iter().enumerate() {
            let place = format!("{table}[{k}]");
            on_line(&format!("{place}.chainage_m"), chainage_m, track, check);
            let first = *named.entry(name).or_insert(k);
            if name.trim().is_empty() {
                let what = "is empty, and messages and figures go by names";
                check.problem(&format!("{place}.name"), what, "give it a name of its own");
            } else if first < k {
                check.problem(
                    &format!("{place}.name"),
                    format!("\"{name}\" is the name of {table}[{first}] too"),
                    "give each a name of its own",
                );
            }
        }
    }
}
