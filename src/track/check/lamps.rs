//! Lamps of a tunnel file: from a row and single entries to surveyed sites.

use super::{free_standing, on_line};
use crate::settings::Problem;
use crate::track::file::{LAST_LAMP, LampEntry, LampRow, TunnelFile};
use crate::track::furniture::LampSite;
use crate::track::section::OutlinePoint;
use crate::track::uid::Uid;
use crate::track::{TrackPoint, Tunnel};
use nalgebra::{Unit, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A lamp and its place among the file's `[[lamp]]` entries; none for a lamp of the row.
type Placed = (Option<usize>, LampSite);

/// Places every lamp of the file, in order of chainage.
pub(super) fn place(
    file: &TunnelFile,
    tunnel: &Tunnel,
    problems: &mut Vec<Problem>,
) -> Vec<LampSite> {
    let common = file.lamps.clone().unwrap_or_default();
    let row = match &file.lamps {
        Some(row) => row_entries(row, tunnel, problems),
        None => Vec::new(),
    };
    let row = row.iter().map(|entry| (None, site(&common, entry, tunnel)));
    let mut placed: Vec<Placed> = row.collect();
    for (k, entry) in file.lamp.iter().enumerate() {
        if on_line(
            format!("lamp[{k}].chainage_m"),
            entry.chainage_m,
            tunnel,
            problems,
        ) {
            placed.push((Some(k), site(&common, entry, tunnel)));
        }
    }
    check_uids(&placed, problems);
    check_places(&placed, tunnel, problems);
    let mut sites: Vec<LampSite> = placed.into_iter().map(|(_, site)| site).collect();
    sites.sort_by(|a, b| a.chainage_m.total_cmp(&b.chainage_m));
    sites
}

/// The row as single lamps; none where its numbers make no sense.
fn row_entries(row: &LampRow, tunnel: &Tunnel, problems: &mut Vec<Problem>) -> Vec<LampEntry> {
    let to_m = row.to_m.unwrap_or(tunnel.alignment.length_m());
    on_line("lamps.from_m", row.from_m, tunnel, problems);
    on_line("lamps.to_m", to_m, tunnel, problems);
    if to_m < row.from_m {
        problems.push(Problem::new(
            "lamps.to_m",
            format!("{to_m} m is before the row's begin at {} m", row.from_m),
            "let the row end further up the line",
        ));
    }
    let wrong = ["lamps.spacing_m", "lamps.from_m", "lamps.to_m"];
    if problems.iter().any(|p| wrong.contains(&p.key.as_str())) {
        return Vec::new();
    }
    // The last lamp may stand at the end in spite of rounding.
    let count = ((to_m - row.from_m) / row.spacing_m + 1e-9).floor() + 1.0;
    if f64::from(row.first_number) + count > f64::from(LAST_LAMP) + 1.0 {
        problems.push(Problem::new(
            "lamps.spacing_m",
            format!(
                "{count} lamps from number {} need numbers over {LAST_LAMP}",
                row.first_number,
            ),
            "number them from lower on, space them wider, or shorten the row",
        ));
        return Vec::new();
    }
    let count = count as u16;
    (0..count)
        .map(|k| LampEntry {
            number: row.first_number + k,
            chainage_m: row.from_m + f64::from(k) * row.spacing_m,
            lateral_m: None,
            height_m: None,
            aim_yaw_deg: None,
            aim_pitch_deg: None,
            power_w: None,
        })
        .collect()
}

fn site(common: &LampRow, entry: &LampEntry, tunnel: &Tunnel) -> LampSite {
    let lateral_m = entry.lateral_m.unwrap_or(common.lateral_m);
    let height_m = entry.height_m.unwrap_or(common.height_m);
    let yaw = entry.aim_yaw_deg.unwrap_or(common.aim_yaw_deg).to_radians();
    let pitch = entry
        .aim_pitch_deg
        .unwrap_or(common.aim_pitch_deg)
        .to_radians();
    let heading = tunnel.alignment.at(entry.chainage_m).heading_rad;
    let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
    let across = Vector3::new(heading.sin(), -heading.cos(), 0.0) * lateral_m.signum();
    let facing =
        (across * yaw.cos() - ahead * yaw.sin()) * pitch.cos() + Vector3::z() * pitch.sin();
    LampSite {
        uid: Uid {
            line: tunnel.line_number,
            lamp: entry.number,
        },
        chainage_m: entry.chainage_m,
        lateral_m,
        height_m,
        centre: tunnel.alignment.world_from_track(TrackPoint {
            s_m: entry.chainage_m,
            l_m: lateral_m,
            h_m: height_m,
        }),
        facing: Unit::new_normalize(facing),
        diameter_m: common.diameter_m,
        power_w: entry.power_w.unwrap_or(common.power_w),
        efficacy_lm_per_w: common.efficacy_lm_per_w,
        beam_deg: common.beam_deg,
        chip_s: common.chip_us / 1e6,
        code: common.code,
    }
}

/// UIDs that are there twice. Numbers of the row count up, so only entries can repeat one.
fn check_uids(placed: &[Placed], problems: &mut Vec<Problem>) {
    let mut seen: BTreeMap<Uid, Option<usize>> = BTreeMap::new();
    for (entry, lamp) in placed {
        if let (Some(first), Some(k)) = (seen.insert(lamp.uid, *entry), entry) {
            let first = first.map_or("a lamp of the row".to_owned(), |f| format!("lamp[{f}]"));
            problems.push(Problem::new(
                format!("lamp[{k}].number"),
                format!("UID {} is that of {first} too", lamp.uid),
                "give each lamp a number of its own",
            ));
        }
    }
}

/// Discs in the rock or in the train's way. A row repeats the same fault at many lamps, so only
/// its first is told.
fn check_places(placed: &[Placed], tunnel: &Tunnel, problems: &mut Vec<Problem>) {
    let mut row_told = false;
    for (entry, lamp) in placed {
        if entry.is_none() && row_told {
            continue;
        }
        let before = problems.len();
        let key = entry.map_or("lamps".to_owned(), |k| format!("lamp[{k}]"));
        free_standing(&key, tunnel, lamp.chainage_m, &rim(lamp, tunnel), problems);
        row_told |= entry.is_none() && problems.len() > before;
    }
}

/// The disc's centre and rim in the cross-section.
fn rim(lamp: &LampSite, tunnel: &Tunnel) -> Vec<OutlinePoint> {
    let heading = tunnel.alignment.at(lamp.chainage_m).heading_rad;
    let left = Vector3::new(-heading.sin(), heading.cos(), 0.0);
    let radius_m = 0.5 * lamp.diameter_m;
    // Two radii of the disc; where it faces up or down any horizontal one will do.
    let level = Vector3::z().cross(&lamp.facing);
    let u = level.try_normalize(1e-9).unwrap_or(left);
    let v = lamp.facing.cross(&u);
    let mut points = vec![OutlinePoint::new(lamp.lateral_m, lamp.height_m)];
    points.extend((0..16).map(|k| {
        let (sin, cos) = (f64::from(k) * TAU / 16.0).sin_cos();
        let d = (u * cos + v * sin) * radius_m;
        OutlinePoint::new(lamp.lateral_m + d.dot(&left), lamp.height_m + d.z)
    }));
    points
}
