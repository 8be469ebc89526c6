//! Plan and profile of a tunnel file.

use super::SAME_M;
use crate::settings::Problem;
use crate::track::alignment::{Alignment, Grade, PlanElement};
use crate::track::file::{LONGEST_M, PlanEntry, PlanKind, TunnelFile};
use crate::track::section::Side;
use nalgebra::Point3;

pub(super) fn alignment(file: &TunnelFile, problems: &mut Vec<Problem>) -> Alignment {
    let elements = plan(file, problems);
    let length_m = elements.iter().map(|e| e.length_m).sum();
    let grades = grades(file, length_m, problems);
    let start = &file.start;
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
    let bends: Vec<Option<Bend>> = file
        .plan
        .iter()
        .enumerate()
        .map(|(k, entry)| bend(k, entry, problems))
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

/// Curvature and cant of an element that has its own; none for a clothoid.
fn bend(k: usize, entry: &PlanEntry, problems: &mut Vec<Problem>) -> Option<Bend> {
    match entry.kind {
        PlanKind::Arc => Some(arc(k, entry, problems)),
        PlanKind::Straight => {
            refuse_arc_keys(k, entry, "a straight has no curvature", problems);
            Some((0.0, 0.0))
        }
        PlanKind::Clothoid => {
            let why = "a clothoid runs from the element before to the one after";
            refuse_arc_keys(k, entry, why, problems);
            None
        }
    }
}

fn refuse_arc_keys(k: usize, entry: &PlanEntry, why: &str, problems: &mut Vec<Problem>) {
    let given = [
        ("radius_m", entry.radius_m.is_some()),
        ("turn", entry.turn.is_some()),
        ("cant_mm", entry.cant_mm.is_some()),
    ];
    for (name, _) in given.into_iter().filter(|(_, given)| *given) {
        let key = format!("plan[{k}].{name}");
        problems.push(Problem::new(
            key,
            format!("only arcs have it: {why}"),
            "take it out",
        ));
    }
}

fn arc(k: usize, entry: &PlanEntry, problems: &mut Vec<Problem>) -> Bend {
    let key = |name: &str| format!("plan[{k}].{name}");
    match entry.radius_m {
        None => problems.push(Problem::new(
            key("radius_m"),
            "is missing",
            "give the radius of the arc in metres",
        )),
        Some(r) if !(20.0..=1e6).contains(&r) => problems.push(Problem::new(
            key("radius_m"),
            format!("{r} m is out of range"),
            "give 20 to 1000000 m; `turn` says to which side",
        )),
        Some(_) => {}
    }
    if entry.turn.is_none() {
        let remedy = "give \"left\" or \"right\"";
        problems.push(Problem::new(key("turn"), "is missing", remedy));
    }
    let cant_mm = entry.cant_mm.unwrap_or(0.0);
    let sign = match entry.turn {
        Some(Side::Right) => -1.0,
        _ => 1.0,
    };
    let radius_m = entry.radius_m.unwrap_or(f64::INFINITY);
    (sign / radius_m, sign * cant_mm / 1000.0)
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
        let wrong_start = k == 0 && g.from_m.abs() > SAME_M;
        if wrong_start || !g.from_m.is_finite() {
            problems.push(Problem::new(
                format!("grades[{k}].from_m"),
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
