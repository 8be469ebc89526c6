//! Cross-sections of a tunnel file.

use super::SAME_M;
use crate::settings::{Checker, Problem};
use crate::track::file::{SectionEntry, SectionKind};
use crate::track::gauge::Gauge;
use crate::track::section::{CrossSection, PlatformShape, SectionRange, Side};
use std::ops::RangeInclusive;

/// Invert of a circular tunnel under top of rail on Chengdu line 1 (Zhang et al. 2023).
const TRACK_STRUCTURE_M: f64 = 0.74;

/// Sections in order, without gaps and overlaps, from 0 to the end of the line.
pub(super) fn sections(
    entries: &[SectionEntry],
    length_m: f64,
    problems: &mut Vec<Problem>,
) -> Vec<SectionRange> {
    if entries.is_empty() {
        return vec![SectionRange {
            from_m: 0.0,
            to_m: length_m,
            section: CrossSection::circular(3.0, 3.0 - TRACK_STRUCTURE_M, None),
        }];
    }
    let mut end_m = 0.0;
    let mut ranges = Vec::with_capacity(entries.len());
    for (k, entry) in entries.iter().enumerate() {
        let next_m = entries.get(k + 1).map_or(length_m, |e| e.from_m);
        let to_m = entry.to_m.unwrap_or(next_m);
        check_range(k, entry.from_m, to_m, end_m, problems);
        end_m = to_m;
        ranges.push(SectionRange {
            from_m: entry.from_m,
            to_m,
            section: section(entry, k, problems),
        });
    }
    if (end_m - length_m).abs() > SAME_M {
        problems.push(Problem::new(
            format!("sections[{}].to_m", entries.len() - 1),
            format!("the sections end at {end_m} m, the line at {length_m} m"),
            "leave `to_m` of the last one out",
        ));
    }
    ranges
}

/// Problems of a range that should begin where the one before ended.
fn check_range(k: usize, from_m: f64, to_m: f64, before_m: f64, problems: &mut Vec<Problem>) {
    let gap_m = from_m - before_m;
    if gap_m.abs() > SAME_M || gap_m.is_nan() {
        problems.push(Problem::new(
            format!("sections[{k}].from_m"),
            if gap_m > 0.0 {
                format!("there is a gap from {before_m} to {from_m} m")
            } else {
                format!("{from_m} to {before_m} m is in the section before too")
            },
            format!("begin it at {before_m} m"),
        ));
    }
    if to_m <= from_m || to_m.is_nan() {
        problems.push(Problem::new(
            format!("sections[{k}].to_m"),
            format!("{to_m} m is not beyond its begin at {from_m} m"),
            "let it end further up the line",
        ));
    }
}

fn section(entry: &SectionEntry, k: usize, problems: &mut Vec<Problem>) -> CrossSection {
    let mut read = Reader::new(entry, k, problems);
    let section = match entry.kind {
        SectionKind::Circular => {
            let radius_m = read.length("radius_m", 3.0, 2.2..=20.0);
            let centre_m = read.length("centre_m", radius_m - TRACK_STRUCTURE_M, 0.5..=20.0);
            CrossSection::circular(radius_m, centre_m, read.side("walkway"))
        }
        SectionKind::Horseshoe => {
            let width_m = read.length("width_m", 5.2, 3.4..=20.0);
            let springing_m = read.length("springing_m", 2.4, 0.5..=20.0);
            let crown_m = read.length("ceiling_m", 4.8, 4.0..=30.0);
            let rise_m = crown_m - springing_m;
            if !(0.1..=0.5 * width_m).contains(&rise_m) {
                read.problem(
                    "springing_m",
                    &format!("the arch rises {rise_m} m from there to the ceiling"),
                    &format!("let it rise 0.1 to {} m, half the width", 0.5 * width_m),
                );
            }
            CrossSection::horseshoe(width_m, springing_m, crown_m, read.side("walkway"))
        }
        SectionKind::Rectangular => {
            let left_m = read.length("left_m", 2.9, 1.7..=60.0);
            let right_m = read.length("right_m", 2.9, 1.7..=60.0);
            let ceiling_m = read.length("ceiling_m", 4.6, 4.0..=30.0);
            let walkway = read.side("walkway");
            let platform = read.side("platform").map(|side| PlatformShape {
                side,
                edge_m: read.length("platform_edge_m", 1.5, 1.45..=3.0),
                height_m: read.length("platform_height_m", 1.05, 0.2..=1.2),
            });
            if walkway.is_some() && platform.map(|p| p.side) == walkway {
                read.problem(
                    "walkway",
                    "stands where the platform is",
                    "put it on the other side, or take it out",
                );
            }
            CrossSection::rectangular(left_m, right_m, ceiling_m, platform, walkway)
        }
        SectionKind::Open => CrossSection::open(0.5 * read.length("width_m", 6.0, 3.4..=60.0)),
    };
    read.refuse_the_rest();
    if let Some(corner) = Gauge::b1(0.0)
        .outline()
        .into_iter()
        .find(|c| !section.contains(c.l_m, c.h_m))
    {
        problems.push(Problem::new(
            format!("sections[{k}]"),
            format!(
                "the structure gauge does not fit: its corner at l = {:.2} m, h = {:.2} m is in \
                 the rock",
                corner.l_m, corner.h_m
            ),
            "make the section larger",
        ));
    }
    section
}

/// Hands out the dimensions that a kind of section has, and knows which ones it did not ask for.
struct Reader<'a> {
    k: usize,
    lengths: [(&'static str, Option<f64>); 9],
    sides: [(&'static str, Option<Side>); 2],
    asked: Vec<&'static str>,
    problems: &'a mut Vec<Problem>,
}

impl<'a> Reader<'a> {
    fn new(e: &SectionEntry, k: usize, problems: &'a mut Vec<Problem>) -> Self {
        Self {
            k,
            lengths: [
                ("radius_m", e.radius_m),
                ("centre_m", e.centre_m),
                ("width_m", e.width_m),
                ("springing_m", e.springing_m),
                ("left_m", e.left_m),
                ("right_m", e.right_m),
                ("ceiling_m", e.ceiling_m),
                ("platform_edge_m", e.platform_edge_m),
                ("platform_height_m", e.platform_height_m),
            ],
            sides: [("walkway", e.walkway), ("platform", e.platform)],
            asked: Vec::new(),
            problems,
        }
    }

    fn length(&mut self, name: &'static str, default_m: f64, range: RangeInclusive<f64>) -> f64 {
        self.asked.push(name);
        let given = self.lengths.iter().find(|(n, _)| *n == name);
        let value = given.and_then(|(_, v)| *v).unwrap_or(default_m);
        let at = format!("sections[{}]", self.k);
        Checker::new(&at, self.problems).within(name, value, range);
        value
    }

    fn side(&mut self, name: &'static str) -> Option<Side> {
        self.asked.push(name);
        let given = self.sides.iter().find(|(n, _)| *n == name);
        given.and_then(|(_, side)| *side)
    }

    fn problem(&mut self, name: &str, what: &str, remedy: &str) {
        let key = format!("sections[{}].{name}", self.k);
        self.problems.push(Problem::new(key, what, remedy));
    }

    fn refuse_the_rest(mut self) {
        let lengths = self.lengths.iter().map(|(n, v)| (*n, v.is_some()));
        let sides = self.sides.iter().map(|(n, v)| (*n, v.is_some()));
        let unused: Vec<&str> = lengths
            .chain(sides)
            .filter(|(name, given)| *given && !self.asked.contains(name))
            .map(|(name, _)| name)
            .collect();
        let remedy = format!("its keys are {}", self.asked.join(", "));
        for name in unused {
            self.problem(name, "this kind of section does not have it", &remedy);
        }
    }
}
