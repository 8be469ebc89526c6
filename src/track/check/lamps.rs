//! Lamps of a tunnel file: from a row and single entries to surveyed sites.

use super::{free_standing, on_line};
use crate::settings::Checker;
use crate::track::file::{LAST_LAMP, LampEntry, LampRowEntry, TrackEntry};
use crate::track::furniture::LampSite;
use crate::track::section::OutlinePoint;
use crate::track::uid::Uid;
use crate::track::{Track, TrackPoint};
use nalgebra::{Unit, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A lamp and the key that it comes from: that of its row for one of a row.
type Placed = (String, LampSite);

/// Places every lamp of the file, in order of chainage.
pub(super) fn place(
    entry: &TrackEntry,
    line_number: u8,
    track: &Track,
    check: &mut Checker<'_>,
) -> Vec<LampSite> {
    let common = entry.lamps.clone().unwrap_or_default();
    let first = entry.lamps.iter().map(|row| ("lamps".to_owned(), row));
    let more = entry.lamp_rows.iter().enumerate();
    let more = more.map(|(k, row)| (format!("lamp_rows[{k}]"), row));
    let mut placed: Vec<Placed> = Vec::new();
    for (key, row) in first.chain(more) {
        let entries = row_entries(row, track, &mut check.below(&key));
        let sites = entries
            .iter()
            .map(|lamp| site(line_number, row, lamp, track));
        placed.extend(sites.map(|site| (key.clone(), site)));
    }
    for (k, entry) in entry.lamp.iter().enumerate() {
        let key = format!("lamp[{k}]");
        if on_line(&format!("{key}.chainage_m"), entry.chainage_m, track, check) {
            placed.push((key, site(line_number, &common, entry, track)));
        }
    }
    check_uids(&placed, check);
    for (key, lamp) in &placed {
        free_standing(key, track, lamp.chainage_m, &rim(lamp, track), check);
    }
    let mut sites: Vec<LampSite> = placed.into_iter().map(|(_, site)| site).collect();
    sites.sort_by(|a, b| a.chainage_m.total_cmp(&b.chainage_m));
    sites
}

/// The row as single lamps; none where its numbers make no sense.
fn row_entries(row: &LampRowEntry, track: &Track, check: &mut Checker<'_>) -> Vec<LampEntry> {
    let to_m = row.to_m.unwrap_or(track.alignment.length_m());
    if to_m < row.from_m {
        check.problem(
            "to_m",
            format!("{to_m} m is before the row's begin at {} m", row.from_m),
            "let the row end further up the line",
        );
        return Vec::new();
    }
    let begins = on_line("from_m", row.from_m, track, check);
    let ends = on_line("to_m", to_m, track, check);
    if !(begins && ends) {
        return Vec::new();
    }
    // The last lamp may stand at the end in spite of rounding.
    let count = ((to_m - row.from_m) / row.spacing_m + 1e-9).floor() + 1.0;
    let numbers_left = f64::from(LAST_LAMP) + 1.0 - f64::from(row.first_number);
    if !(0.0..=numbers_left).contains(&count) {
        check.problem(
            "spacing_m",
            format!(
                "{count} lamps from number {} need numbers over {LAST_LAMP}",
                row.first_number,
            ),
            "number them from lower on, space them wider, or shorten the row",
        );
        return Vec::new();
    }
    let entry = |k: u16| LampEntry {
        number: row.first_number + k,
        chainage_m: row.from_m + f64::from(k) * row.spacing_m,
        ..LampEntry::default()
    };
    (0..count as u16).map(entry).collect()
}

fn site(line_number: u8, common: &LampRowEntry, entry: &LampEntry, track: &Track) -> LampSite {
    let lateral_m = entry.lateral_m.unwrap_or(common.lateral_m);
    let height_m = entry.height_m.unwrap_or(common.height_m);
    let yaw_deg = entry.aim_yaw_deg.unwrap_or(common.aim_yaw_deg);
    let pitch_deg = entry.aim_pitch_deg.unwrap_or(common.aim_pitch_deg);
    let (yaw, pitch) = (yaw_deg.to_radians(), pitch_deg.to_radians());
    let frame = track.alignment.at(entry.chainage_m);
    let across = -frame.left() * lateral_m.signum();
    let facing =
        (across * yaw.cos() - frame.ahead() * yaw.sin()) * pitch.cos() + Vector3::z() * pitch.sin();
    LampSite {
        uid: Uid {
            line: line_number,
            lamp: entry.number,
        },
        chainage_m: entry.chainage_m,
        lateral_m,
        height_m,
        centre: track.alignment.world_from_track(TrackPoint {
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

/// UIDs that are there twice; of a row once.
fn check_uids(placed: &[Placed], check: &mut Checker<'_>) {
    let mut seen: BTreeMap<Uid, &str> = BTreeMap::new();
    let mut said: Option<&str> = None;
    for (key, lamp) in placed {
        if let Some(first) = seen.insert(lamp.uid, key)
            && said != Some(key)
        {
            let number = match key.starts_with("lamp[") {
                true => "number",
                false => "first_number",
            };
            check.problem(
                &format!("{key}.{number}"),
                format!("`{first}` gives UID {} too", lamp.uid),
                "give each lamp a number of its own",
            );
            said = Some(key);
        }
    }
}

/// The disc's centre and rim in the cross-section.
fn rim(lamp: &LampSite, track: &Track) -> Vec<OutlinePoint> {
    let left = track.alignment.at(lamp.chainage_m).left();
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
