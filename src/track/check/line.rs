//! Plan and profile of a tunnel file.

use super::SAME_M;
use crate::settings::Checker;
use crate::track::alignment::{Alignment, Grade, PlanElement};
use crate::track::file::{PlanShape, TrackEntry};
use crate::track::furniture::LONGEST_M;
use nalgebra::Point3;

/// Where a track runs, but for its place in the world.
#[derive(Clone, Debug)]
pub(super) struct UnplacedLine {
    pub elements: Vec<PlanElement>,
    /// None: on as what it is joined to.
    pub grades: Vec<Grade>,
}

impl UnplacedLine {
    /// Of a track as written, level so far.
    pub(super) fn of(entry: &TrackEntry, check: &mut Checker<'_>) -> Self {
        Self {
            elements: plan(entry, check),
            grades: Vec::new(),
        }
    }

    /// Length in plan.
    pub(super) fn length_m(&self) -> f64 {
        self.elements.iter().map(|e| e.length_m).sum()
    }

    /// The line that begins at a pose.
    pub(super) fn from(&self, origin: Point3<f64>, heading_rad: f64, slope: f64) -> Alignment {
        let on = [Grade {
            from_m: 0.0,
            slope,
            radius_m: 0.0,
        }];
        let grades = match self.grades.is_empty() {
            true => &on[..],
            false => &self.grades,
        };
        Alignment::new(origin, heading_rad, &self.elements, grades)
    }
}

/// Curvature and cant (of the right rail over the left one) that a straight or an arc has and a
/// clothoid joins.
type Bend = (f64, f64);

fn plan(entry: &TrackEntry, check: &mut Checker<'_>) -> Vec<PlanElement> {
    if entry.plan.is_empty() {
        check.problem("plan", "has no elements", "add at least one `[[plan]]`");
    }
    let bends: Vec<Option<Bend>> = entry.plan.iter().map(|e| bend(&e.shape)).collect();
    let at = |k: Option<usize>| k.and_then(|k| bends.get(k).copied().flatten());
    let elements = entry.plan.iter().enumerate().map(|(k, element)| {
        let own = at(Some(k));
        // A clothoid beside a clothoid or an end of the line meets it without curvature.
        let start = own.or_else(|| at(k.checked_sub(1))).unwrap_or_default();
        let end = own.or_else(|| at(Some(k + 1))).unwrap_or_default();
        PlanElement {
            length_m: element.length_m,
            start_per_m: start.0,
            end_per_m: end.0,
            start_cant_m: start.1,
            end_cant_m: end.1,
        }
    });
    let elements: Vec<PlanElement> = elements.collect();
    for (k, pair) in elements.windows(2).enumerate() {
        let step_mm = 1000.0 * (pair[1].start_cant_m - pair[0].end_cant_m).abs();
        if step_mm > 1e-6 {
            check.problem(
                &format!("plan[{}].cant_mm", k + 1),
                format!("the cant jumps by {step_mm:.0} mm where this element begins"),
                "put a clothoid between the two, or take the cant away",
            );
        }
    }
    let length_m: f64 = elements.iter().map(|e| e.length_m).sum();
    if length_m > LONGEST_M {
        check.problem(
            "plan",
            format!("the line is {length_m} m long"),
            format!("at most {LONGEST_M} m"),
        );
    }
    elements
}

/// Curvature and cant of an element that has its own; none for a clothoid.
fn bend(shape: &PlanShape) -> Option<Bend> {
    match *shape {
        PlanShape::Straight {} => Some((0.0, 0.0)),
        PlanShape::Clothoid {} => None,
        PlanShape::Arc {
            radius_m,
            turn,
            cant_mm,
        } => {
            let sign = turn.sign();
            Some((sign / radius_m, sign * cant_mm / 1000.0))
        }
    }
}

/// Grades of a track of a length.
pub(super) fn grades(entry: &TrackEntry, length_m: f64, check: &mut Checker<'_>) -> Vec<Grade> {
    let grades = entry.grades.iter().map(|g| Grade {
        from_m: g.from_m,
        slope: g.grade_permille / 1000.0,
        radius_m: g.vertical_radius_m,
    });
    let grades: Vec<Grade> = grades.collect();
    for (k, g) in grades.iter().enumerate() {
        let wrong_start = k == 0 && g.from_m.abs() > SAME_M;
        if wrong_start || !g.from_m.is_finite() {
            check.problem(
                &format!("grades[{k}].from_m"),
                format!("the first grade begins at {} m", g.from_m),
                "begin it at 0 m",
            );
        }
    }
    let mut free_from_m = 0.0;
    for (k, pair) in grades.windows(2).enumerate() {
        let half_m = 0.5 * pair[1].radius_m * (pair[1].slope - pair[0].slope).abs();
        let (from_m, to_m) = (pair[1].from_m - half_m, pair[1].from_m + half_m);
        if from_m < free_from_m || to_m > length_m || pair[1].from_m <= pair[0].from_m {
            check.problem(
                &format!("grades[{}].from_m", k + 1),
                format!(
                    "its vertical curve from {from_m:.1} to {to_m:.1} m does not fit between \
                     {free_from_m:.1} and {length_m:.1} m"
                ),
                "move it, or give it a smaller `vertical_radius_m`",
            );
        }
        free_from_m = to_m;
    }
    grades
}
