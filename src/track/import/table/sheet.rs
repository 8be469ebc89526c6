//! A table as offices write it: comma, semicolon or tab between columns; decimal point or comma; headers in any case and
//! order.

use std::borrow::Cow;

/// A column that is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SheetColumn {
    pub name: &'static str,
    /// Other headers that mean the same.
    pub others: &'static [&'static str],
    pub is_needed: bool,
}

impl SheetColumn {
    pub const fn needed(name: &'static str, others: &'static [&'static str]) -> Self {
        Self {
            name,
            others,
            is_needed: true,
        }
    }

    pub const fn optional(name: &'static str, others: &'static [&'static str]) -> Self {
        Self {
            is_needed: false,
            ..Self::needed(name, others)
        }
    }
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

/// A table whose headers are read.
pub(crate) struct Sheet<'t> {
    text: &'t str,
    separator: u8,
    columns: Vec<(&'static str, usize)>,
    headers: usize,
    /// Headers that mean nothing here.
    pub unknown: Vec<String>,
}

impl<'t> Sheet<'t> {
    pub fn read(text: &'t str, wanted: &[SheetColumn]) -> Result<Self, SheetError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut first = text.lines().filter(|line| !line.trim().is_empty());
        let first = first.next().unwrap_or_default();
        let count = |separator: &u8| first.bytes().filter(|byte| byte == separator).count();
        let separators = [b';', b'\t', b','].into_iter();
        let separator = separators.max_by_key(|s| (count(s), *s != b','));
        let separator = separator.unwrap_or(b',');
        let Some((_, headers)) = SheetRecords::new(text, separator).next().transpose()? else {
            let what = "the file is empty".to_owned();
            return Err(SheetError::NotATable { line: 1, what });
        };
        let SheetHead { columns, unknown } = head(&headers, wanted)?;
        Ok(Self {
            text,
            separator,
            columns,
            headers: headers.len(),
            unknown,
        })
    }

    /// Row by row, without those that a spreadsheet leaves empty.
    pub fn rows(&self) -> impl Iterator<Item = Result<SheetRow<'_>, SheetError>> {
        SheetRecords::new(self.text, self.separator)
            .skip(1)
            .map(|record| {
                let (line, record) = record?;
                let row = SheetRow {
                    sheet: self,
                    line,
                    record,
                };
                row.refuse_more_cells_than_headers()?;
                Ok(row)
            })
    }

    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|(name, _)| *name == column)
    }

    /// Numbers may have a decimal comma: it does not stand between columns.
    fn takes_decimal_commas(&self) -> bool {
        self.separator != b','
    }
}

/// Records that are not empty, each with its line as an editor counts it.
struct SheetRecords<'t> {
    text: &'t [u8],
    records: csv::StringRecordsIntoIter<&'t [u8]>,
    /// A place in the text, and its line.
    reached: (usize, usize),
}

impl<'t> SheetRecords<'t> {
    fn new(text: &'t str, separator: u8) -> Self {
        let text = text.as_bytes();
        let mut reader = csv::ReaderBuilder::new();
        let reader = reader
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All);
        Self {
            text,
            records: reader.from_reader(text).into_records(),
            reached: (0, 1),
        }
    }

    /// The parser takes a record to begin where the one before has ended: at the rest of its line break, or at empty
    /// lines.
    fn line_of(&mut self, position: Option<&csv::Position>) -> usize {
        let (from, line) = self.reached;
        let rest = self.text.get(from..).unwrap_or_default();
        let skipped = position.map_or(0, |at| (at.byte() as usize).saturating_sub(from));
        let is_break = |byte: &u8| matches!(byte, b'\r' | b'\n');
        let breaks = rest.get(skipped..).unwrap_or_default();
        let skipped = skipped + breaks.iter().take_while(|byte| is_break(byte)).count();
        let passed = rest.get(..skipped).unwrap_or_default();
        let lines = passed.iter().filter(|byte| **byte == b'\n').count();
        self.reached = (from + skipped, line + lines);
        line + lines
    }
}

impl Iterator for SheetRecords<'_> {
    type Item = Result<(usize, csv::StringRecord), SheetError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let record = self.records.next()?;
            let record = match record {
                Ok(record) => record,
                Err(error) => {
                    return Some(Err(SheetError::NotATable {
                        line: self.line_of(error.position()),
                        what: error.to_string(),
                    }));
                }
            };
            let line = self.line_of(record.position());
            if record.iter().any(|cell| !cell.is_empty()) {
                return Some(Ok((line, record)));
            }
        }
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
#[derive(Clone)]
pub(crate) struct SheetRow<'a> {
    sheet: &'a Sheet<'a>,
    /// As an editor counts it: that of the headers is 1.
    pub line: usize,
    record: csv::StringRecord,
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
        let number: Option<f64> = self.with_point(text).parse().ok();
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
        number.ok_or_else(|| {
            let what = "is empty or endless".to_owned();
            self.wrong(column, what, "give a number, or take the row out")
        })
    }

    /// Whether a cell has a decimal comma.
    #[cfg(feature = "cli")]
    pub fn has_decimal_comma(&self, column: &str) -> bool {
        let text = self.text(column).unwrap_or_default();
        self.sheet.takes_decimal_commas() && text.contains(',')
    }

    /// With a decimal point, where numbers may have a decimal comma.
    pub fn with_point<'c>(&self, text: &'c str) -> Cow<'c, str> {
        match self.sheet.takes_decimal_commas() && text.contains(',') {
            true => text.replace(',', ".").into(),
            false => text.into(),
        }
    }

    /// As where a decimal comma stands in a table with commas between its columns.
    fn refuse_more_cells_than_headers(&self) -> Result<(), SheetError> {
        let headers = self.sheet.headers;
        let more = self.record.iter().skip(headers);
        if !more.into_iter().any(|cell| !cell.is_empty()) {
            return Ok(());
        }
        let what = format!(
            "the row has {} cells, and there are {headers} headers",
            self.record.len()
        );
        Err(self.row_wrong(what, match self.sheet.separator {
            b',' => "write numbers with a decimal point where `,` is between columns, or put `;` between them",
            _ => "let it have as many as there are headers",
        }))
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
mod tests;
