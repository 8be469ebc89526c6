//! Cross-sections of a tunnel file.

use super::SAME_M;
use crate::settings::Checker;
use crate::track::file::{SectionEntry, SectionShape};
use crate::track::gauge::Gauge;
use crate::track::section::{CrossSection, PlatformShape, SectionRange};

/// Invert of a circular tunnel under top of rail on Chengdu line 1 (Zhang et al. 2023).
const TRACK_STRUCTURE_M: f64 = 0.74;

/// Sections in order, without gaps and overlaps, from 0 to the end of the line.
pub(super) fn sections(
    entries: &[SectionEntry],
    length_m: f64,
    check: &mut Checker<'_>,
) -> Vec<SectionRange> {
    if entries.is_empty() {
        return vec![SectionRange {
            from_m: 0.0,
            to_m: length_m,
            missing_rail: None,
            section: CrossSection::circular(3.0, 3.0 - TRACK_STRUCTURE_M, None),
        }];
    }
    let mut end_m = 0.0;
    let mut ranges = Vec::with_capacity(entries.len());
    for (k, entry) in entries.iter().enumerate() {
        let key = format!("sections[{k}]");
        let next_m = entries.get(k + 1).map_or(length_m, |e| e.from_m);
        let to_m = entry.to_m.unwrap_or(next_m);
        check_range(entry.from_m, to_m, end_m, &mut check.below(&key));
        end_m = to_m;
        let section = section(&entry.shape, &mut check.below(&key));
        check_room(&section, &key, check);
        ranges.push(SectionRange {
            from_m: entry.from_m,
            to_m,
            missing_rail: None,
            section,
        });
    }
    if (end_m - length_m).abs() > SAME_M {
        check.problem(
            &format!("sections[{}].to_m", entries.len() - 1),
            format!("the sections end at {end_m} m, the line at {length_m} m"),
            "leave `to_m` of the last one out",
        );
    }
    ranges
}

/// Problems of a range that should begin where the one before ended.
fn check_range(from_m: f64, to_m: f64, before_m: f64, check: &mut Checker<'_>) {
    let gap_m = from_m - before_m;
    if gap_m.abs() > SAME_M || gap_m.is_nan() {
        let what = if gap_m > 0.0 {
            format!("there is a gap from {before_m} to {from_m} m")
        } else {
            format!("{from_m} to {before_m} m is in the section before too")
        };
        check.problem("from_m", what, format!("begin it at {before_m} m"));
    }
    if to_m <= from_m || to_m.is_nan() {
        check.problem(
            "to_m",
            format!("{to_m} m is not beyond its begin at {from_m} m"),
            "let it end further up the line",
        );
    }
}

fn section(shape: &SectionShape, check: &mut Checker<'_>) -> CrossSection {
    match *shape {
        SectionShape::Circular {
            radius_m,
            centre_m,
            walkway,
        } => {
            let radius_m = radius_m.unwrap_or(3.0);
            let centre_m = centre_m.unwrap_or(radius_m - TRACK_STRUCTURE_M);
            CrossSection::circular(radius_m, centre_m, walkway)
        }
        SectionShape::Horseshoe {
            width_m,
            springing_m,
            ceiling_m,
            walkway,
        } => {
            let width_m = width_m.unwrap_or(5.2);
            let springing_m = springing_m.unwrap_or(2.4);
            let crown_m = ceiling_m.unwrap_or(4.8);
            let rise_m = crown_m - springing_m;
            if !(0.1..=0.5 * width_m).contains(&rise_m) {
                check.problem(
                    "springing_m",
                    format!("the arch rises {rise_m} m from there to the ceiling"),
                    format!("let it rise 0.1 to {} m, half the width", 0.5 * width_m),
                );
            }
            CrossSection::horseshoe(width_m, springing_m, crown_m, walkway)
        }
        SectionShape::Rectangular {
            left_m,
            right_m,
            ceiling_m,
            walkway,
            platform,
            platform_edge_m,
            platform_height_m,
        } => {
            for (key, given) in [
                ("platform_edge_m", platform_edge_m.is_some()),
                ("platform_height_m", platform_height_m.is_some()),
            ] {
                if given && platform.is_none() {
                    check.problem(key, "there is no platform", "give `platform` its side");
                }
            }
            if walkway.is_some() && walkway == platform {
                check.problem(
                    "walkway",
                    "stands where the platform is",
                    "put it on the other side, or take it out",
                );
            }
            let platform = platform.map(|side| PlatformShape {
                side,
                edge_m: platform_edge_m.unwrap_or(1.5),
                height_m: platform_height_m.unwrap_or(1.05),
            });
            CrossSection::rectangular(
                left_m.unwrap_or(2.9),
                right_m.unwrap_or(2.9),
                ceiling_m.unwrap_or(4.6),
                platform,
                walkway,
            )
        }
        SectionShape::Trough {
            left_m,
            right_m,
            wall_m,
        } => CrossSection::trough(
            left_m.unwrap_or(2.9),
            right_m.unwrap_or(2.9),
            wall_m.unwrap_or(4.0),
        ),
        SectionShape::Shared {} => CrossSection::shared(),
        SectionShape::Open { width_m } => CrossSection::open(0.5 * width_m.unwrap_or(6.0)),
    }
}

/// A problem where the structure gauge does not fit.
fn check_room(section: &CrossSection, key: &str, check: &mut Checker<'_>) {
    let corners = Gauge::b1(0.0).outline();
    if let Some(corner) = corners.iter().find(|c| !section.contains(c.l_m, c.h_m)) {
        check.problem(
            key,
            format!(
                "the structure gauge does not fit: its corner at l = {:.2} m, h = {:.2} m is in \
                 the rock",
                corner.l_m, corner.h_m
            ),
            "make the section larger",
        );
    }
}
