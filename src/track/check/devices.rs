//! Wayside devices, balises, base stations and stations of a tunnel file.

use super::{free_standing, on_line};
use crate::settings::{Problem, did_you_mean};
use crate::track::Tunnel;
use crate::track::file::{TunnelFile, WaysideEntry};
use crate::track::furniture::{Balise, BaseStation, WaysideSite};
use crate::track::section::OutlinePoint;

/// Balises as written.
pub(super) fn balises(file: &TunnelFile) -> Vec<Balise> {
    let balises = file.balises.iter().map(|b| Balise {
        name: b.name.clone(),
        chainage_m: b.chainage_m,
    });
    balises.collect()
}

/// Base stations as written.
pub(super) fn base_stations(file: &TunnelFile) -> Vec<BaseStation> {
    let stations = file.base_stations.iter().map(|b| BaseStation {
        name: b.name.clone(),
        chainage_m: b.chainage_m,
        reach_m: b.reach_m,
    });
    stations.collect()
}

/// Stations as written.
pub(super) fn stations(file: &TunnelFile) -> Vec<(String, f64)> {
    let stations = file.stations.iter();
    stations.map(|s| (s.name.clone(), s.chainage_m)).collect()
}

/// Wayside devices, checked against rock, gauge and balises.
pub(super) fn wayside(
    file: &TunnelFile,
    tunnel: &Tunnel,
    problems: &mut Vec<Problem>,
) -> Vec<WaysideSite> {
    let mut sites = Vec::with_capacity(file.wayside.len());
    for (k, w) in file.wayside.iter().enumerate() {
        let key = |name: &str| format!("wayside[{k}].{name}");
        if on_line(key("chainage_m"), w.chainage_m, tunnel, problems) {
            let place = [OutlinePoint::new(w.lateral_m, w.height_m)];
            free_standing(
                &format!("wayside[{k}]"),
                tunnel,
                w.chainage_m,
                &place,
                problems,
            );
        }
        check_balise(&key("balise"), w, tunnel, problems);
        sites.push(WaysideSite {
            name: w.name.clone(),
            chainage_m: w.chainage_m,
            lateral_m: w.lateral_m,
            height_m: w.height_m,
            yaw_rad: w.yaw_deg.to_radians(),
            pitch_rad: w.pitch_deg.to_radians(),
            balise: w.balise.clone(),
        });
    }
    sites
}

fn check_balise(key: &str, w: &WaysideEntry, tunnel: &Tunnel, problems: &mut Vec<Problem>) {
    match tunnel.balise(&w.balise) {
        None => {
            let names: Vec<String> = tunnel.balises.iter().map(|b| b.name.clone()).collect();
            problems.push(Problem::new(
                key,
                format!("there is no balise \"{}\"", w.balise),
                match did_you_mean(&w.balise, &names) {
                    Some(name) => format!("did you mean \"{name}\"?"),
                    None => "name one of `[[balises]]`".to_owned(),
                },
            ));
        }
        Some(b) if b.chainage_m >= w.chainage_m => problems.push(Problem::new(
            key,
            format!(
                "balise \"{}\" at {} m is not before the device at {} m",
                b.name, b.chainage_m, w.chainage_m
            ),
            "name a balise that trains pass before they come to the device",
        )),
        Some(_) => {}
    }
}

/// Chainages on the line, and names that are there twice.
pub(super) fn check(file: &TunnelFile, tunnel: &Tunnel, problems: &mut Vec<Problem>) {
    for (k, b) in file.balises.iter().enumerate() {
        on_line(
            format!("balises[{k}].chainage_m"),
            b.chainage_m,
            tunnel,
            problems,
        );
    }
    for (k, b) in file.base_stations.iter().enumerate() {
        on_line(
            format!("base_stations[{k}].chainage_m"),
            b.chainage_m,
            tunnel,
            problems,
        );
    }
    for (k, s) in file.stations.iter().enumerate() {
        on_line(
            format!("stations[{k}].chainage_m"),
            s.chainage_m,
            tunnel,
            problems,
        );
    }
    check_names(
        "wayside",
        file.wayside.iter().map(|w| w.name.as_str()),
        problems,
    );
    check_names(
        "balises",
        file.balises.iter().map(|b| b.name.as_str()),
        problems,
    );
    check_names(
        "base_stations",
        file.base_stations.iter().map(|b| b.name.as_str()),
        problems,
    );
    check_names(
        "stations",
        file.stations.iter().map(|s| s.name.as_str()),
        problems,
    );
}

fn check_names<'n>(table: &str, names: impl Iterator<Item = &'n str>, problems: &mut Vec<Problem>) {
    let mut seen: Vec<&str> = Vec::new();
    for (k, name) in names.enumerate() {
        if let Some(first) = seen.iter().position(|n| *n == name) {
            problems.push(Problem::new(
                format!("{table}[{k}].name"),
                format!("\"{name}\" is the name of {table}[{first}] too"),
                "give each a name of its own",
            ));
        }
        seen.push(name);
    }
}
