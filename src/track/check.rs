//! From the file as written to a [`Tunnel`]: every number checked, every problem collected.

use super::alignment::{Alignment, Grade, PlanElement};
use super::file::{PlanKind, SectionEntry, SectionKind, TunnelFile};
use super::furniture::{Balise, BaseStation, WaysideSite};
use super::gauge::Gauge;
use super::lamps;
use super::problem::{FileError, Problem};
use super::section::{CrossSection, OutlinePoint, PlatformShape, SectionRange, Side};
use super::{Tunnel, read_toml};
use nalgebra::Point3;
use std::collections::BTreeMap;
use std::path::Path;

/// Chainages closer than this are the same place.
const SAME_M: f64 = 1e-6;
/// No line is longer: chainages stay exact to a nanometre.
const LONGEST_M: f64 = 1e6;
/// Largest cant on metro lines (GB 50157).
const LARGEST_CANT_MM: f64 = 120.0;
/// Steepest grade that is taken for a railway's.
const STEEPEST_PERMILLE: f64 = 60.0;

impl Tunnel {
    /// Reads and checks a tunnel file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|source| FileError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::from_toml(&text)
    }

    /// Reads and checks the text of a tunnel file. [`super::locate`] finds the keys of the
    /// problems in the text again.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        Self::from_file(&read_toml(text)?)
    }

    /// Checks a tunnel as written.
    pub fn from_file(file: &TunnelFile) -> Result<Self, FileError> {
        let mut problems = Vec::new();
        let tunnel = check(file, &mut problems);
        if problems.is_empty() {
            Ok(tunnel)
        } else {
            Err(FileError::Problems(problems))
        }
    }
}

fn check(file: &TunnelFile, problems: &mut Vec<Problem>) -> Tunnel {
    if file.name.trim().is_empty() {
        problems.push(Problem::new("name", "is empty", "give the tunnel a name"));
    }
    Problem::unless_within(
        problems,
        "line_number",
        file.line_number.into(),
        0.0..=15.0,
        "",
    );
    Problem::unless_within(problems, "ambient_lx", file.ambient_lx, 0.0..=1e5, "lx");
    let alignment = alignment(file, problems);
    let length_m = alignment.length_m();
    let sections = sections(&file.sections, length_m, problems);
    let mut tunnel = Tunnel {
        name: file.name.clone(),
        alignment,
        sections,
        lamps: Vec::new(),
        wayside: Vec::new(),
        balises: file
            .balises
            .iter()
            .map(|b| Balise {
                name: b.name.clone(),
                chainage_m: b.chainage_m,
            })
            .collect(),
        base_stations: file
            .base_stations
            .iter()
            .map(|b| BaseStation {
                name: b.name.clone(),
                chainage_m: b.chainage_m,
                reach_m: b.reach_m,
            })
            .collect(),
        line_number: file.line_number,
        stations: file
            .stations
            .iter()
            .map(|s| (s.name.clone(), s.chainage_m))
            .collect(),
        ambient_lx: file.ambient_lx,
    };
    tunnel.lamps = lamps::place(file, &tunnel, problems);
    tunnel.wayside = wayside(file, &tunnel, problems);
    points_on_line(file, length_m, problems);
    tunnel
}

fn alignment(file: &TunnelFile, problems: &mut Vec<Problem>) -> Alignment {
    let elements = plan(file, problems);
    let length_m = elements.iter().map(|e| e.length_m).sum();
    let grades = grades(file, length_m, problems);
    let start = &file.start;
    for (key, value) in [
        ("start.east_m", start.east_m),
        ("start.north_m", start.north_m),
        ("start.up_m", start.up_m),
    ] {
        Problem::unless_within(problems, key, value, -1e7..=1e7, "m");
    }
    Problem::unless_within(
        problems,
        "start.heading_deg",
        start.heading_deg,
        -360.0..=360.0,
        "deg",
    );
    Alignment::new(
        Point3::new(start.east_m, start.north_m, start.up_m),
        start.heading_deg.to_radians(),
        &elements,
        &grades,
    )
}

/// Curvature and cant (of the right rail over the left one) that a straight or an arc has and a
/// clothoid joins.
type Bend = (f64, f64);

fn plan(file: &TunnelFile, problems: &mut Vec<Problem>) -> Vec<PlanElement> {
    if file.plan.is_empty() {
        problems.push(Problem::new(
            "plan",
            "has no elements",
            "add at least one `[[plan]]`",
        ));
    }
    let bends: Vec<Option<Bend>> = (0..file.plan.len())
        .map(|k| bend(file, k, problems))
        .collect();
    let at = |k: Option<usize>| k.and_then(|k| bends.get(k).copied().flatten());
    let elements: Vec<PlanElement> = file
        .plan
        .iter()
        .enumerate()
        .map(|(k, entry)| {
            let own = at(Some(k));
            // A clothoid beside a clothoid or an end of the line meets it without curvature.
            let start = own.or_else(|| at(k.checked_sub(1))).unwrap_or_default();
            let end = own.or_else(|| at(Some(k + 1))).unwrap_or_default();
            PlanElement {
                length_m: entry.length_m,
                start_per_m: start.0,
                end_per_m: end.0,
                start_cant_m: start.1,
                end_cant_m: end.1,
            }
        })
        .collect();
    for (k, pair) in elements.windows(2).enumerate() {
        let step_mm = 1000.0 * (pair[1].start_cant_m - pair[0].end_cant_m).abs();
        if step_mm > 1e-6 {
            problems.push(Problem::new(
                format!("plan[{}].cant_mm", k + 1),
                format!("the cant jumps by {step_mm:.0} mm where this element begins"),
                "put a clothoid between the two, or take the cant away",
            ));
        }
    }
    let length_m: f64 = elements.iter().map(|e| e.length_m).sum();
    if length_m > LONGEST_M {
        problems.push(Problem::new(
            "plan",
            format!("the line is {length_m} m long"),
            format!("at most {LONGEST_M} m"),
        ));
    }
    elements
}

fn bend(file: &TunnelFile, k: usize, problems: &mut Vec<Problem>) -> Option<Bend> {
    let entry = &file.plan[k];
    let key = |name: &str| format!("plan[{k}].{name}");
    Problem::unless_within(
        problems,
        key("length_m"),
        entry.length_m,
        0.001..=LONGEST_M,
        "m",
    );
    if entry.kind != PlanKind::Arc {
        for (name, given) in [
            ("radius_m", entry.radius_m.is_some()),
            ("turn", entry.turn.is_some()),
            ("cant_mm", entry.cant_mm.is_some()),
        ] {
            if given {
                problems.push(Problem::new(
                    key(name),
                    "only arcs have it",
                    "take it out; a clothoid runs from the element before to the one after",
                ));
            }
        }
        return (entry.kind == PlanKind::Straight).then_some((0.0, 0.0));
    }
    let radius_m = entry.radius_m.unwrap_or(f64::INFINITY);
    match entry.radius_m {
        None => problems.push(Problem::new(
            key("radius_m"),
            "is missing",
            "give the arc's radius in metres",
        )),
        Some(r) if !(20.0..=1e6).contains(&r) => problems.push(Problem::new(
            key("radius_m"),
            format!("{r} m is out of range"),
            "give 20 to 1000000 m; the side is said by `turn`",
        )),
        Some(_) => {}
    }
    if entry.turn.is_none() {
        problems.push(Problem::new(
            key("turn"),
            "is missing",
            "give \"left\" or \"right\"",
        ));
    }
    let cant_mm = entry.cant_mm.unwrap_or(0.0);
    Problem::unless_within(
        problems,
        key("cant_mm"),
        cant_mm,
        0.0..=LARGEST_CANT_MM,
        "mm",
    );
    let sign = match entry.turn {
        Some(Side::Right) => -1.0,
        _ => 1.0,
    };
    Some((sign / radius_m, sign * cant_mm / 1000.0))
}

fn grades(file: &TunnelFile, length_m: f64, problems: &mut Vec<Problem>) -> Vec<Grade> {
    let grades: Vec<Grade> = file
        .grades
        .iter()
        .map(|g| Grade {
            from_m: g.from_m,
            slope: g.grade_permille / 1000.0,
            radius_m: g.vertical_radius_m,
        })
        .collect();
    for (k, g) in file.grades.iter().enumerate() {
        let key = |name: &str| format!("grades[{k}].{name}");
        Problem::unless_within(
            problems,
            key("grade_permille"),
            g.grade_permille,
            -STEEPEST_PERMILLE..=STEEPEST_PERMILLE,
            "permille",
        );
        Problem::unless_within(
            problems,
            key("vertical_radius_m"),
            g.vertical_radius_m,
            0.0..=1e6,
            "m",
        );
        let wrong_start = k == 0 && g.from_m.abs() > SAME_M;
        if wrong_start || !g.from_m.is_finite() {
            problems.push(Problem::new(
                key("from_m"),
                format!("the first grade begins at {} m", g.from_m),
                "begin it at 0 m",
            ));
        }
    }
    let mut free_from_m = 0.0;
    for (k, pair) in grades.windows(2).enumerate() {
        let half_m = 0.5 * pair[1].radius_m * (pair[1].slope - pair[0].slope).abs();
        let (from_m, to_m) = (pair[1].from_m - half_m, pair[1].from_m + half_m);
        if from_m < free_from_m || to_m > length_m || pair[1].from_m <= pair[0].from_m {
            problems.push(Problem::new(
                format!("grades[{}].from_m", k + 1),
                format!(
                    "its vertical curve from {from_m:.1} to {to_m:.1} m does not fit between \
                     {free_from_m:.1} and {length_m:.1} m"
                ),
                "move it, or give it a smaller `vertical_radius_m`",
            ));
        }
        free_from_m = to_m;
    }
    grades
}

fn sections(
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
        let gap_m = entry.from_m - end_m;
        if gap_m.abs() > SAME_M || gap_m.is_nan() {
            problems.push(Problem::new(
                format!("sections[{k}].from_m"),
                if gap_m > 0.0 {
                    format!("nothing is said of {end_m} to {} m", entry.from_m)
                } else {
                    format!("{} to {end_m} m is said twice", entry.from_m)
                },
                format!("begin it at {end_m} m"),
            ));
        }
        if to_m <= entry.from_m || to_m.is_nan() {
            problems.push(Problem::new(
                format!("sections[{k}].to_m"),
                format!("{to_m} m is not beyond its begin at {} m", entry.from_m),
                "let it end further up the line",
            ));
        }
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

/// Invert of a circular tunnel under top of rail on Chengdu line 1 (Zhang et al. 2023).
const TRACK_STRUCTURE_M: f64 = 0.74;

fn section(entry: &SectionEntry, k: usize, problems: &mut Vec<Problem>) -> CrossSection {
    let radius_m = entry.radius_m.unwrap_or(3.0);
    let dimensions = [
        ("radius_m", entry.radius_m, radius_m, 2.2, 20.0),
        (
            "centre_m",
            entry.centre_m,
            radius_m - TRACK_STRUCTURE_M,
            0.5,
            20.0,
        ),
        (
            "width_m",
            entry.width_m,
            if entry.kind == SectionKind::Open {
                6.0
            } else {
                5.2
            },
            3.4,
            60.0,
        ),
        ("springing_m", entry.springing_m, 2.4, 0.5, 20.0),
        ("left_m", entry.left_m, 2.9, 1.7, 60.0),
        ("right_m", entry.right_m, 2.9, 1.7, 60.0),
        (
            "ceiling_m",
            entry.ceiling_m,
            if entry.kind == SectionKind::Horseshoe {
                4.8
            } else {
                4.6
            },
            4.0,
            30.0,
        ),
        ("platform_edge_m", entry.platform_edge_m, 1.5, 1.45, 3.0),
        ("platform_height_m", entry.platform_height_m, 1.05, 0.2, 1.2),
    ];
    let used: &[&str] = match entry.kind {
        SectionKind::Circular => &["radius_m", "centre_m", "walkway"],
        SectionKind::Horseshoe => &["width_m", "springing_m", "ceiling_m", "walkway"],
        SectionKind::Rectangular if entry.platform.is_none() => {
            &["left_m", "right_m", "ceiling_m", "walkway", "platform"]
        }
        SectionKind::Rectangular => &[
            "left_m",
            "right_m",
            "ceiling_m",
            "walkway",
            "platform",
            "platform_edge_m",
            "platform_height_m",
        ],
        SectionKind::Open => &["width_m"],
    };
    let unused = dimensions
        .iter()
        .map(|d| (d.0, d.1.is_some()))
        .chain([
            ("walkway", entry.walkway.is_some()),
            ("platform", entry.platform.is_some()),
        ])
        .filter(|(name, given)| *given && !used.contains(name));
    for (name, _) in unused {
        problems.push(Problem::new(
            format!("sections[{k}].{name}"),
            "this kind of section does not have it",
            format!("it has {}", used.join(", ")),
        ));
    }
    let mut d = [0.0; 9];
    for (value, (name, given, default, low, high)) in d.iter_mut().zip(dimensions) {
        *value = given.unwrap_or(default);
        if used.contains(&name) {
            let key = format!("sections[{k}].{name}");
            Problem::unless_within(problems, key, *value, low..=high, "m");
        }
    }
    let [
        radius_m,
        centre_m,
        width_m,
        springing_m,
        left_m,
        right_m,
        ceiling_m,
        edge_m,
        platform_m,
    ] = d;
    let platform = entry.platform.map(|side| PlatformShape {
        side,
        edge_m,
        height_m: platform_m,
    });
    if platform.is_some() && entry.platform == entry.walkway {
        problems.push(Problem::new(
            format!("sections[{k}].walkway"),
            "stands where the platform is",
            "put it on the other side, or take it out",
        ));
    }
    let section = match entry.kind {
        SectionKind::Circular => CrossSection::circular(radius_m, centre_m, entry.walkway),
        SectionKind::Horseshoe => {
            CrossSection::horseshoe(width_m, springing_m, ceiling_m, entry.walkway)
        }
        SectionKind::Rectangular => {
            CrossSection::rectangular(left_m, right_m, ceiling_m, platform, entry.walkway)
        }
        SectionKind::Open => CrossSection::open(0.5 * width_m),
    };
    if let Some(corner) = Gauge::b1(0.0)
        .outline()
        .into_iter()
        .find(|c| !section.contains(c.l_m, c.h_m))
    {
        problems.push(Problem::new(
            format!("sections[{k}]"),
            format!(
                "the structure gauge does not fit: its corner at l = {:.2} m, h = {:.2} m is in the rock",
                corner.l_m, corner.h_m
            ),
            "make the section larger",
        ));
    }
    section
}

fn wayside(file: &TunnelFile, tunnel: &Tunnel, problems: &mut Vec<Problem>) -> Vec<WaysideSite> {
    let place = |(k, w): (usize, &super::file::WaysideEntry)| {
        let key = |name: &str| format!("wayside[{k}].{name}");
        Problem::unless_within(problems, key("yaw_deg"), w.yaw_deg, -360.0..=360.0, "deg");
        Problem::unless_within(problems, key("pitch_deg"), w.pitch_deg, -90.0..=90.0, "deg");
        let point = OutlinePoint::new(w.lateral_m, w.height_m);
        if on_line(
            &key("chainage_m"),
            w.chainage_m,
            tunnel.alignment.length_m(),
            problems,
        ) {
            free_standing(
                &format!("wayside[{k}]"),
                tunnel,
                w.chainage_m,
                &[point],
                problems,
            );
        }
        match tunnel.balises.iter().find(|b| b.name == w.balise) {
            None => {
                let names: Vec<String> = tunnel.balises.iter().map(|b| b.name.clone()).collect();
                problems.push(Problem::new(
                    key("balise"),
                    format!("there is no balise \"{}\"", w.balise),
                    match super::document::did_you_mean(&w.balise, &names) {
                        Some(name) => format!("did you mean \"{name}\"?"),
                        None => "name one of `[[balises]]`".to_owned(),
                    },
                ));
            }
            Some(b) if b.chainage_m >= w.chainage_m => problems.push(Problem::new(
                key("balise"),
                format!(
                    "balise \"{}\" at {} m is not before the device at {} m",
                    b.name, b.chainage_m, w.chainage_m
                ),
                "name a balise that trains pass before they come to the device",
            )),
            Some(_) => {}
        }
        WaysideSite {
            name: w.name.clone(),
            chainage_m: w.chainage_m,
            lateral_m: w.lateral_m,
            height_m: w.height_m,
            yaw_rad: w.yaw_deg.to_radians(),
            pitch_rad: w.pitch_deg.to_radians(),
            balise: w.balise.clone(),
        }
    };
    file.wayside.iter().enumerate().map(place).collect()
}

/// Chainages and names of everything that has them.
fn points_on_line(file: &TunnelFile, length_m: f64, problems: &mut Vec<Problem>) {
    let named: [(&str, Vec<(&str, f64)>); 4] = [
        (
            "balises",
            file.balises
                .iter()
                .map(|b| (b.name.as_str(), b.chainage_m))
                .collect(),
        ),
        (
            "base_stations",
            file.base_stations
                .iter()
                .map(|b| (b.name.as_str(), b.chainage_m))
                .collect(),
        ),
        (
            "stations",
            file.stations
                .iter()
                .map(|s| (s.name.as_str(), s.chainage_m))
                .collect(),
        ),
        (
            "wayside",
            // Their chainages are checked with their places.
            file.wayside
                .iter()
                .map(|w| (w.name.as_str(), 0.0))
                .collect(),
        ),
    ];
    for (table, entries) in named {
        let mut seen = BTreeMap::new();
        for (k, (name, chainage_m)) in entries.into_iter().enumerate() {
            on_line(
                &format!("{table}[{k}].chainage_m"),
                chainage_m,
                length_m,
                problems,
            );
            if let Some(first) = seen.insert(name, k) {
                problems.push(Problem::new(
                    format!("{table}[{k}].name"),
                    format!("\"{name}\" is the name of {table}[{first}] too"),
                    "give each a name of its own",
                ));
            }
        }
    }
    for (k, b) in file.base_stations.iter().enumerate() {
        let key = format!("base_stations[{k}].reach_m");
        Problem::unless_within(problems, key, b.reach_m, 1.0..=LONGEST_M, "m");
    }
}

/// Whether a chainage is on the line; a problem if not.
pub(super) fn on_line(key: &str, s_m: f64, length_m: f64, problems: &mut Vec<Problem>) -> bool {
    let on = (-SAME_M..=length_m + SAME_M).contains(&s_m);
    if !on {
        problems.push(Problem::new(
            key,
            format!("{s_m} m is outside of the line"),
            format!("give 0 to {length_m} m"),
        ));
    }
    on
}

/// Problems where any of some points (l, h) lies in the rock or where the train runs.
pub(super) fn free_standing(
    key: &str,
    tunnel: &Tunnel,
    s_m: f64,
    points: &[OutlinePoint],
    problems: &mut Vec<Problem>,
) {
    let Some(section) = tunnel.section_at(s_m) else {
        return;
    };
    let gauge = Gauge::b1(tunnel.alignment.at(s_m).curvature_per_m);
    if let Some(p) = points.iter().find(|p| !section.contains(p.l_m, p.h_m)) {
        problems.push(Problem::new(
            key,
            format!(
                "at chainage {s_m} m its point l = {:.3} m, h = {:.3} m is inside the rock, {:.3} m \
                 behind the wall",
                p.l_m,
                p.h_m,
                section.distance_m(p.l_m, p.h_m)
            ),
            "move it into the tunnel: smaller `lateral_m`, or another `height_m`",
        ));
    } else if let Some(p) = points.iter().find(|p| gauge.contains(p.l_m, p.h_m)) {
        problems.push(Problem::new(
            key,
            format!(
                "at chainage {s_m} m its point l = {:.3} m, h = {:.3} m is inside the structure gauge",
                p.l_m, p.h_m
            ),
            "move it towards the wall: larger `lateral_m`",
        ));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const CHENGDU: &str = include_str!("../../tunnels/chengdu_line1.toml");
    const BENCH: &str = include_str!("../../tunnels/test_bench.toml");

    fn problems(text: &str) -> Vec<Problem> {
        match Tunnel::from_toml(text) {
            Err(FileError::Problems(problems)) => problems,
            Err(other) => panic!("{other}"),
            Ok(_) => Vec::new(),
        }
    }

    #[test]
    fn shipped_tunnels_are_right() {
        let line = Tunnel::from_toml(CHENGDU).unwrap();
        assert_eq!(line.lamps.len(), 299);
        assert!((line.alignment.length_m() - 3000.0).abs() < 1e-9);
        let bench = Tunnel::from_toml(BENCH).unwrap();
        assert_eq!(bench.lamps.len(), 1);
    }

    /// Provokes: a checker that stops at the first fault, or that passes one of them.
    #[test]
    fn every_fault_is_told_with_its_key() {
        let cases: [(&str, &str, &str); 16] = [
            ("spacing_m = 10.0", "spacing_mm = 10.0", "lamps.spacing_mm"),
            ("radius_m = 500.0", "radius_m = -500.0", "plan[2].radius_m"),
            (
                "from_m = 60.0",
                "from_m = 60.0\nto_m = 200.0",
                "sections[2].from_m",
            ),
            ("lateral_m = 2.70", "lateral_m = 2.95", "lamps"),
            ("lateral_m = 2.70", "lateral_m = 1.20", "lamps"),
            ("spacing_m = 10.0", "spacing_m = 2.0", "lamps.spacing_m"),
            (
                "balise = \"B1110\"",
                "balise = \"B1111\"",
                "wayside[0].balise",
            ),
            (
                "chainage_m = 2000.0",
                "chainage_m = 3200.0",
                "balises[2].chainage_m",
            ),
            (
                "grade_permille = 28.0",
                "grade_permille = 72.0",
                "grades[4].grade_permille",
            ),
            (
                "vertical_radius_m = 3000.0",
                "vertical_radius_m = 90000.0",
                "grades[2].from_m",
            ),
            ("cant_mm = 100.0", "cant_mm = 180.0", "plan[2].cant_mm"),
            ("line_number = 1", "line_number = 16", "line_number"),
            ("name = \"B2600\"", "name = \"B2000\"", "balises[3].name"),
            (
                "first_number = 1",
                "first_number = \"x\"",
                "lamps.first_number",
            ),
            ("turn = \"left\"", "turn = \"lefd\"", "plan[2].turn"),
            (
                "platform = \"right\"",
                "radius_m = 3.0",
                "sections[1].radius_m",
            ),
        ];
        for (right, wrong, key) in cases {
            assert!(CHENGDU.contains(right), "{right}");
            let text = CHENGDU.replacen(right, wrong, 1);
            let found = problems(&text);
            assert!(found.iter().any(|p| p.key == key), "{wrong}: {found:?}");
        }
    }
}
