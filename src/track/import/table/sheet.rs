//! A table as offices write it: comma, semicolon or tab between columns; decimal point or comma; headers in any case and
//! order.

/// A column that is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetColumn {
    pub name: &'static str,
    /// Other headers that mean the same.
    pub others: &'static [&'static str],
    pub is_needed: bool,
}

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SheetError {
    /// Not a table at all.
    #[error(
        "line {line}: {what}; a table has one line of headers and one for each row, with `,`, `;` or tabs between columns"
    )]
    NotATable {
        /// From 1.
        line: usize,
        /// By the parser.
        what: String,
    },
    /// A column is missing.
    #[error("no column `{column}`; the columns are {has}")]
    NoColumn {
        /// Its header.
        column: &'static str,
        /// Headers that are there.
        has: String,
    },
    /// One header stands over two columns.
    #[error("column `{column}` is there twice")]
    Twice {
        /// Its header.
        column: &'static str,
    },
    /// A cell is wrong.
    #[error("line {line}, column `{column}`: {what}; {remedy}")]
    Cell {
        /// From 1.
        line: usize,
        /// Header of its column.
        column: &'static str,
        /// What is wrong.
        what: String,
        /// What would be right.
        remedy: String,
    },
    /// Rows that do not make a line.
    #[error("line {line}: {what}; {remedy}")]
    Row {
        /// From 1.
        line: usize,
        /// What is wrong.
        what: String,
        /// What would be right.
        remedy: String,
    },
}

/// What stands in which column.
#[derive(Default)]
struct SheetHead {
    columns: Vec<(&'static str, usize)>,
    unknown: Vec<String>,
}

/// A table that was read.
pub(super) struct Sheet {
    columns: Vec<(&'static str, usize)>,
    /// Headers that mean nothing here.
    pub unknown: Vec<String>,
    rows: Vec<(usize, csv::StringRecord)>,
    has_decimal_comma: bool,
}

impl Sheet {
    pub fn read(text: &str, wanted: &[SheetColumn]) -> Result<Self, SheetError> {
        let text = text.trim_start_matches('\u{feff}');
        let first = text.lines().next().unwrap_or_default();
        let separators = [b';', b'\t', b','];
        let count = |separator: &u8| first.bytes().filter(|byte| byte == separator).count();
        let separator = separators
            .into_iter()
            .max_by_key(|s| (count(s), *s != b','))
            .unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| SheetError::NotATable {
                line: error.position().map_or(1, |at| at.line() as usize),
                what: error.to_string(),
            })?;
            let line = record.position().map_or(1, |at| at.line() as usize);
            // Rows that a spreadsheet leaves empty.
            if record.iter().any(|cell| !cell.is_empty()) {
                rows.push((line, record));
            }
        }
        if rows.is_empty() {
            let what = "the file is empty".to_owned();
            return Err(SheetError::NotATable { line: 1, what });
        }
        let (_, headers) = rows.remove(0);
        let SheetHead { columns, unknown } = head(&headers, wanted)?;
        Ok(Self {
            columns,
            unknown,
            rows,
            has_decimal_comma: separator != b',',
        })
    }

    pub fn rows(&self) -> impl ExactSizeIterator<Item = SheetRow<'_>> {
        self.rows.iter().map(|(line, record)| SheetRow {
            sheet: self,
            line: *line,
            record,
        })
    }

    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|(name, _)| *name == column)
    }
}

/// Where each column is, and headers that are none of them.
fn head(headers: &csv::StringRecord, wanted: &[SheetColumn]) -> Result<SheetHead, SheetError> {
    let SheetHead {
        mut columns,
        mut unknown,
    } = SheetHead::default();
    for (at, header) in headers.iter().enumerate() {
        let header = header.to_lowercase();
        let found = wanted
            .iter()
            .find(|column| column.name == header || column.others.contains(&&*header));
        match found {
            Some(column) if columns.iter().any(|(name, _)| *name == column.name) => {
                return Err(SheetError::Twice {
                    column: column.name,
                });
            }
            Some(column) => columns.push((column.name, at)),
            None if header.is_empty() => {}
            None => unknown.push(header.chars().take(40).collect()),
        }
    }
    let is_there = |column: &&SheetColumn| columns.iter().any(|(name, _)| *name == column.name);
    match wanted
        .iter()
        .find(|column| column.is_needed && !is_there(column))
    {
        None => Ok(SheetHead { columns, unknown }),
        Some(missing) => {
            let has: Vec<String> = headers
                .iter()
                .take(20)
                .map(|h| format!("`{}`", h.chars().take(40).collect::<String>()))
                .collect();
            Err(SheetError::NoColumn {
                column: missing.name,
                has: has.join(", "),
            })
        }
    }
}

/// A row of a table.
#[derive(Clone, Copy)]
pub(super) struct SheetRow<'a> {
    sheet: &'a Sheet,
    pub line: usize,
    record: &'a csv::StringRecord,
}

impl SheetRow<'_> {
    /// A cell's text; none where it is empty.
    pub fn text(&self, column: &str) -> Option<&str> {
        let (_, at) = self
            .sheet
            .columns
            .iter()
            .find(|(name, _)| *name == column)?;
        self.record.get(*at).filter(|cell| !cell.is_empty())
    }

    pub fn number(&self, column: &'static str) -> Result<Option<f64>, SheetError> {
        let Some(text) = self.text(column) else {
            return Ok(None);
        };
        let with_point = match self.sheet.has_decimal_comma {
            true => text.replace(',', "."),
            false => text.to_owned(),
        };
        let number: Option<f64> = with_point.parse().ok();
        match number.filter(|number| !number.is_nan()) {
            Some(number) => Ok(Some(number)),
            None => Err(self.wrong(
                column,
                format!("{text:?} is no number"),
                "write digits with a decimal point, or with a decimal comma where `;` or tabs are between columns, and nothing between thousands",
            )),
        }
    }

    pub fn needed(&self, column: &'static str) -> Result<f64, SheetError> {
        let number = self.number(column)?.filter(|number| number.is_finite());
        number.ok_or_else(|| self.wrong(column, "is empty or endless".to_owned(), "give a number"))
    }

    pub fn wrong(&self, column: &'static str, what: String, remedy: &str) -> SheetError {
        SheetError::Cell {
            line: self.line,
            column,
            what: what.chars().take(200).collect(),
            remedy: remedy.to_owned(),
        }
    }

    pub fn row_wrong(&self, what: String, remedy: &str) -> SheetError {
        SheetError::Row {
            line: self.line,
            what: what.chars().take(400).collect(),
            remedy: remedy.to_owned(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const COLUMNS: [SheetColumn; 2] = [
        SheetColumn {
            name: "chainage_m",
            others: &["station"],
            is_needed: true,
        },
        SheetColumn {
            name: "radius_m",
            others: &[],
            is_needed: false,
        },
    ];

    #[test]
    fn tables_of_all_offices_are_the_same() {
        for text in [
            "chainage_m,radius_m\n0,300.5\n12.5,\n",
            "\u{feff}Chainage_m;Radius_m;remark\r\n0;300,5;a\r\n;;\r\n12,5;;\r\n",
            "radius_m\tSTATION\n\"300,5\"\t0\n\t12,5\n",
        ] {
            let sheet = Sheet::read(text, &COLUMNS).unwrap();
            let cells: Vec<_> = sheet
                .rows()
                .map(|row| {
                    (
                        row.needed("chainage_m").unwrap(),
                        row.number("radius_m").unwrap(),
                    )
                })
                .collect();
            assert_eq!(cells, [(0.0, Some(300.5)), (12.5, None)], "{text}");
        }
    }

    #[test]
    fn wrong_cells_are_named() {
        let said = |text: &str| match Sheet::read(text, &COLUMNS) {
            Ok(sheet) => sheet
                .rows()
                .map(|row| row.needed("chainage_m"))
                .find_map(Result::err)
                .map(|e| e.to_string()),
            Err(error) => Some(error.to_string()),
        };
        for (text, told) in [
            ("", "empty"),
            (
                "km;radius_m\n1;2\n",
                "no column `chainage_m`; the columns are `km`, `radius_m`",
            ),
            ("chainage_m,station\n1,2\n", "twice"),
            (
                "chainage_m,radius_m\n1,2\nx,3\n",
                "line 3, column `chainage_m`: \"x\" is no number",
            ),
            ("chainage_m;radius_m\n1.000,5;2\n", "line 2"),
            ("chainage_m;radius_m\n;2\n", "is empty"),
        ] {
            let said = said(text).unwrap();
            assert!(said.contains(told), "{told}: {said}");
        }
    }
}
