//! The elements, grades and lamps of a line, row by row.

use super::TableFault;
use super::sheet::{Sheet, SheetError, SheetRow};
use crate::settings::Problem;
use crate::track::file::{GradeEntry, LampEntry, PlanEntry, PlanShape};
use crate::track::import::laying::rounded;
use crate::track::import::number_in;
use crate::track::section::Side;

/// A length and the distance of chainages may differ by so much.
pub(super) const SAME_M: f64 = 0.005;
/// Columns of the cant, and millimetres in the unit of each.
const CANT_MM: [(&str, f64); 2] = [("cant_mm", 1.0), ("cant_m", 1000.0)];
/// Columns of the grade, and permille in the unit of each.
const GRADE_PERMILLE: [(&str, f64); 3] = [
    ("grade_permille", 1.0),
    ("grade_percent", 10.0),
    ("grade_ratio", 1000.0),
];
/// Rows that a table may have.
const MOST_ROWS: usize = 20_000;

/// A line with the row of the table from which each part is.
pub(super) struct TableLine {
    pub begin_m: f64,
    pub length_m: f64,
    pub plan: Vec<(usize, PlanEntry)>,
    pub grades: Vec<(usize, GradeEntry)>,
}

impl TableLine {
    pub fn of(sheet: &Sheet<'_>) -> Result<Self, SheetError> {
        let rows: Vec<SheetRow<'_>> = sheet.rows().collect::<Result<_, _>>()?;
        let Some((first, last)) = rows.first().zip(rows.last()) else {
            let what = "there is no row under the headers".to_owned();
            return Err(SheetError::NotATable { line: 1, what });
        };
        if rows.len() > MOST_ROWS {
            return Err(first.row_wrong(
                format!("the table has {} rows", rows.len()),
                "at most 20,000 are read",
            ));
        }
        let begin_m = first.needed("chainage_m")?;
        let mut line = Self {
            begin_m,
            length_m: 0.0,
            plan: Vec::new(),
            grades: Vec::new(),
        };
        for (k, row) in rows.iter().enumerate() {
            let at_m = row.needed("chainage_m")?;
            if let Some(grade) = grade(row, rounded(at_m - begin_m, 6))? {
                line.add_grade(row.line, grade);
            }
            let Some(length_m) = element_length_m(row, at_m, rows.get(k + 1))? else {
                continue;
            };
            line.length_m += length_m;
            let entry = PlanEntry {
                length_m,
                closes: false,
                shape: shape(row, sheet)?,
            };
            line.plan.push((row.line, entry));
        }
        match line.plan.is_empty() {
            true => Err(last.row_wrong(
                "the line has no length".to_owned(),
                "give at least one element and the chainage of the end",
            )),
            false => Ok(line),
        }
    }

    /// Grades that only repeat the one before are none.
    fn add_grade(&mut self, line: usize, grade: GradeEntry) {
        let same = |last: &(usize, GradeEntry)| {
            (last.1.grade_permille - grade.grade_permille).abs() < 1e-9
        };
        if !self.grades.last().is_some_and(same) {
            self.grades.push((line, grade));
        }
    }

    pub fn lamps(
        &self,
        sheet: &Sheet<'_>,
        line_number: u8,
    ) -> Result<Vec<(usize, LampEntry)>, SheetError> {
        let lamps = sheet.rows().map(|row| {
            let row = row?;
            let stated_m = row.needed("chainage_m")?;
            let chainage_m = rounded(stated_m - self.begin_m, 6);
            if !(0.0..=self.length_m).contains(&chainage_m) {
                let what = format!("{stated_m} m is not on the line");
                let end_m = self.begin_m + self.length_m;
                return Err(row.wrong(
                    "chainage_m",
                    what,
                    &format!("give {} to {end_m} m", self.begin_m),
                ));
            }
            let lamp = LampEntry {
                number: lamp_number(&row, line_number)?,
                chainage_m,
                lateral_m: row.number("lateral_m")?,
                height_m: row.number("height_m")?,
                aim_yaw_deg: row.number("aim_yaw_deg")?,
                aim_pitch_deg: None,
                power_w: row.number("power_w")?,
            };
            Ok((row.line, lamp))
        });
        lamps.collect()
    }

    /// What the checker says, with the row that it is of.
    pub fn fault(&self, problem: &Problem, lamp_lines: &[usize]) -> TableFault {
        let number = |table: &str| number_in(&problem.key, table);
        let of_lamp = number("lamp").and_then(|k| lamp_lines.get(k));
        let of_plan = number("plan")
            .and_then(|k| self.plan.get(k))
            .map(|(line, _)| line);
        let of_grade = number("grades")
            .and_then(|k| self.grades.get(k))
            .map(|(line, _)| line);
        let line = of_lamp.or(of_plan).or(of_grade).copied().unwrap_or(1);
        TableFault {
            is_of_lamps: of_lamp.is_some(),
            error: SheetError::Row {
                line,
                what: problem.said(),
                remedy: problem.remedy.clone(),
            },
        }
    }
}

impl SheetRow<'_> {
    /// What one of several columns says, each with the factor from its unit; none where all are empty.
    fn in_units(&self, columns: &[(&'static str, f64)]) -> Result<Option<f64>, SheetError> {
        let mut found: Option<(&str, f64)> = None;
        for (column, factor) in columns {
            let Some(value) = self.number_or_ratio(column)? else {
                continue;
            };
            if let Some((other, _)) = found {
                let what = format!("`{other}` says it too");
                return Err(self.wrong(column, what, "leave one of the two columns out"));
            }
            found = Some((column, rounded(factor * value, 6)));
        }
        Ok(found.map(|(_, value)| value))
    }

    /// A number, or in a column of ratios one to another, as `1:40`.
    fn number_or_ratio(&self, column: &'static str) -> Result<Option<f64>, SheetError> {
        let text = self.text(column).filter(|_| column.ends_with("_ratio"));
        let Some((one, other)) = text.and_then(|text| text.split_once(':')) else {
            return self.number(column);
        };
        let number = |text: &str| self.with_point(text.trim()).parse::<f64>().ok();
        let ratio = number(one).zip(number(other)).map(|(a, b)| a / b);
        match ratio.filter(|ratio| ratio.is_finite()) {
            Some(ratio) => Ok(Some(ratio)),
            None => Err(self.wrong(
                column,
                format!("{one:?} to {other:?} is no ratio"),
                "write 1:40, -1:40 where the line falls, and 0 where it is level",
            )),
        }
    }
}

/// Length of the element of a row, to the next row or as given; none of a row that only ends the line.
fn element_length_m(
    row: &SheetRow<'_>,
    at_m: f64,
    next: Option<&SheetRow<'_>>,
) -> Result<Option<f64>, SheetError> {
    let given_m = row.number("length_m")?;
    let next_m = next.map(|next| next.needed("chainage_m")).transpose()?;
    let length_m = match (next_m.map(|next_m| next_m - at_m), given_m) {
        (Some(to_next_m), Some(given_m)) if (to_next_m - given_m).abs() > SAME_M => {
            let what = format!("is {given_m} m, and the next row begins {to_next_m:.3} m farther");
            let remedy = "let both agree: jumps of the chainage are not read";
            return Err(row.wrong("length_m", what, remedy));
        }
        (_, Some(given_m)) => given_m,
        (Some(to_next_m), None) => to_next_m,
        (None, None) if is_end(row) => return Ok(None),
        (None, None) => {
            let what = "the last row has no length".to_owned();
            let remedy =
                "give `length_m`, or add a row with nothing but the chainage of the line's end";
            return Err(row.row_wrong(what, remedy));
        }
    };
    if length_m.is_nan() || length_m <= 0.0 {
        let what = format!("the next row begins {length_m:.3} m farther");
        return Err(row.wrong("chainage_m", what, "let chainages grow from row to row"));
    }
    Ok(Some(rounded(length_m, 6)))
}

/// A row with nothing but the chainage of the end.
fn is_end(row: &SheetRow<'_>) -> bool {
    let element = row.text("element").map(str::to_lowercase);
    element.is_none_or(|element| element == "end") && row.text("radius_m").is_none()
}

/// The grade that begins at a row.
fn grade(row: &SheetRow<'_>, from_m: f64) -> Result<Option<GradeEntry>, SheetError> {
    let Some(grade_permille) = row.in_units(&GRADE_PERMILLE)? else {
        return Ok(None);
    };
    let radius_m = row.number("vertical_radius_m")?;
    Ok(Some(GradeEntry {
        from_m,
        grade_permille,
        vertical_radius_m: radius_m.unwrap_or(3000.0),
    }))
}

fn shape(row: &SheetRow<'_>, sheet: &Sheet<'_>) -> Result<PlanShape, SheetError> {
    let radius_m = row.number("radius_m")?.unwrap_or(0.0);
    let is_straight = radius_m.abs() < f64::MIN_POSITIVE || radius_m.is_infinite();
    let word = row.text("element").map(str::to_lowercase);
    match word.as_deref() {
        None if is_straight => return Ok(PlanShape::Straight {}),
        None => {}
        Some("straight" | "tangent" | "line") if is_straight => return Ok(PlanShape::Straight {}),
        Some("straight" | "tangent" | "line") => {
            let what = format!("a straight has the radius {radius_m}");
            return Err(row.wrong(
                "radius_m",
                what,
                "leave it empty, or name the element `arc`",
            ));
        }
        // From the curvature before to that of the next row: its own radius says nothing more.
        Some("clothoid" | "spiral" | "transition") => return Ok(PlanShape::Clothoid {}),
        Some("arc" | "curve" | "circle") if is_straight => {
            return Err(row.wrong(
                "radius_m",
                "an arc has no radius".to_owned(),
                "give it, metres",
            ));
        }
        Some("arc" | "curve" | "circle") => {}
        Some(other) => {
            let what = format!("{other:?} is no element");
            return Err(row.wrong("element", what, "write straight, clothoid or arc"));
        }
    }
    let turn = match row.text("turn").map(str::to_lowercase).as_deref() {
        Some("left" | "l") if radius_m > 0.0 => Side::Left,
        Some("right" | "r") if radius_m > 0.0 => Side::Right,
        Some("left" | "l" | "right" | "r") => {
            let what = format!("the radius is {radius_m}, and `turn` says the side too");
            return Err(row.wrong("radius_m", what, "let it be positive, or take out `turn`"));
        }
        Some(other) => {
            let what = format!("{other:?} is no side");
            return Err(row.wrong("turn", what, "write left or right, looking up the line"));
        }
        None if sheet.has("turn") => {
            return Err(row.wrong(
                "turn",
                "an arc does not say to which side it turns".to_owned(),
                "write left or right",
            ));
        }
        None if radius_m > 0.0 => Side::Left,
        None => Side::Right,
    };
    Ok(PlanShape::Arc {
        radius_m: radius_m.abs(),
        turn,
        cant_mm: row.in_units(&CANT_MM)?.unwrap_or(0.0),
    })
}

/// As `23`, or as `1-023` with the number of the line.
fn lamp_number(row: &SheetRow<'_>, line_number: u8) -> Result<u16, SheetError> {
    let remedy = "give a number from 0 to 1023, or line and number as in 1-023";
    let text = row.text("number").unwrap_or_default();
    let (line, number) = match text.split_once('-') {
        Some((line, number)) => (Some(line), number),
        None => (None, text),
    };
    if let Some(line) = line
        && line.trim().parse() != Ok(line_number)
    {
        let what = format!("{text:?} is not of line {line_number}");
        return Err(row.wrong("number", what, "say the line with --line-number"));
    }
    let number: Option<u16> = number.trim().parse().ok();
    number.ok_or_else(|| row.wrong("number", format!("{text:?} is no lamp number"), remedy))
}
