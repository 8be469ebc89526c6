//! Parquet tables whose columns say what they are: the same list makes the file and its
//! description.

use super::stream::{failed, part_name};
use crate::session::ObserverError;
use arrow::array::{
    ArrayRef, BooleanBuilder, Float64Builder, Int64Builder, ListBuilder, RecordBatch, StringBuilder,
};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use serde_json::json;
use std::borrow::Cow;
use std::error::Error;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that are kept in memory before they are written.
const BATCH_ROWS: usize = 16_384;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Kind {
    Int,
    Real,
    Text,
    Flag,
    Reals,
}

impl Kind {
    fn data_type(self) -> DataType {
        match self {
            Self::Int => DataType::Int64,
            Self::Real => DataType::Float64,
            Self::Text => DataType::Utf8,
            Self::Flag => DataType::Boolean,
            Self::Reals => DataType::List(Arc::new(Field::new_list_field(DataType::Float64, true))),
        }
    }

    /// As the description of the data set has it.
    fn name(self) -> &'static str {
        match self {
            Self::Int => "int64",
            Self::Real => "float64",
            Self::Text => "string",
            Self::Flag => "bool",
            Self::Reals => "list<float64>",
        }
    }
}

/// One column.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name.
    pub name: Cow<'static, str>,
    /// What its cells hold.
    pub kind: Kind,
    /// Their unit, 1 of ratios and counts.
    pub unit: Cow<'static, str>,
    /// What they say.
    pub meaning: Cow<'static, str>,
}

/// A column in one line.
pub const fn column(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    meaning: &'static str,
) -> Column {
    Column {
        name: Cow::Borrowed(name),
        kind,
        unit: Cow::Borrowed(unit),
        meaning: Cow::Borrowed(meaning),
    }
}

/// Columns as a table in Markdown.
pub fn describe(columns: &[Column]) -> String {
    let mut text = String::from("| column | type | unit | meaning |\n|---|---|---|---|\n");
    for c in columns {
        let kind = c.kind.name();
        text += &format!("| `{}` | {kind} | {} | {} |\n", c.name, c.unit, c.meaning);
    }
    text
}

/// What stands in one cell.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Value {
    Int(i64),
    Real(f64),
    Text(String),
    Flag(bool),
    Reals(Vec<f64>),
    Null,
}

macro_rules! value_from {
    ($($from:ty => $make:expr),* $(,)?) => {
        $(impl From<$from> for Value {
            fn from(x: $from) -> Self {
                $make(x)
            }
        })*
    };
}

value_from! {
    i64 => Value::Int,
    u32 => |x| Value::Int(i64::from(x)),
    f64 => Value::Real,
    bool => Value::Flag,
    String => Value::Text,
    &str => |x: &str| Value::Text(x.to_owned()),
    Vec<f64> => Value::Reals,
}

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(x: Option<T>) -> Self {
        x.map_or(Self::Null, Into::into)
    }
}

enum Cells {
    Int(Int64Builder),
    Real(Float64Builder),
    Text(StringBuilder),
    Flag(BooleanBuilder),
    Reals(ListBuilder<Float64Builder>),
}

impl Cells {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Int => Self::Int(Int64Builder::new()),
            Kind::Real => Self::Real(Float64Builder::new()),
            Kind::Text => Self::Text(StringBuilder::new()),
            Kind::Flag => Self::Flag(BooleanBuilder::new()),
            Kind::Reals => Self::Reals(ListBuilder::new(Float64Builder::new())),
        }
    }

    /// Whether the value is of the column's kind.
    fn push(&mut self, value: Value) -> bool {
        match (self, value) {
            (Self::Int(cells), Value::Int(x)) => cells.append_value(x),
            (Self::Int(cells), Value::Null) => cells.append_null(),
            (Self::Real(cells), Value::Real(x)) => cells.append_value(x),
            (Self::Real(cells), Value::Null) => cells.append_null(),
            (Self::Text(cells), Value::Text(x)) => cells.append_value(x),
            (Self::Text(cells), Value::Null) => cells.append_null(),
            (Self::Flag(cells), Value::Flag(x)) => cells.append_value(x),
            (Self::Flag(cells), Value::Null) => cells.append_null(),
            (Self::Reals(cells), Value::Reals(list)) => {
                cells.values().append_slice(&list);
                cells.append(true);
            }
            (Self::Reals(cells), Value::Null) => cells.append(false),
            _ => return false,
        }
        true
    }

    fn finish(&mut self) -> ArrayRef {
        match self {
            Self::Int(cells) => Arc::new(cells.finish()),
            Self::Real(cells) => Arc::new(cells.finish()),
            Self::Text(cells) => Arc::new(cells.finish()),
            Self::Flag(cells) => Arc::new(cells.finish()),
            Self::Reals(cells) => Arc::new(cells.finish()),
        }
    }
}

/// A table on its way into a file.
pub struct Table {
    path: PathBuf,
    columns: Vec<Column>,
    schema: Arc<Schema>,
    writer: ArrowWriter<File>,
    cells: Vec<Cells>,
    rows: usize,
}

impl Table {
    /// Begins a file; it gets its name in [`Self::close`].
    pub fn create(path: PathBuf, columns: &[Column]) -> Result<Self, ObserverError> {
        let fields = columns.iter().map(|c| {
            let about = [("unit", &c.unit), ("meaning", &c.meaning)];
            let about = about.map(|(key, text)| (key.to_owned(), text.clone().into_owned()));
            Field::new(c.name.clone(), c.kind.data_type(), true).with_metadata(about.into())
        });
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        let settings = WriterProperties::builder()
            .set_compression(Compression::LZ4_RAW)
            .set_key_value_metadata(Some(vec![about(columns)]))
            .set_created_by(format!("metrotwin {}", env!("CARGO_PKG_VERSION")))
            .build();
        let file = File::create(part_name(&path)).map_err(broken(&path))?;
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(settings));
        Ok(Self {
            writer: writer.map_err(broken(&path))?,
            columns: columns.to_vec(),
            path,
            schema,
            cells: columns.iter().map(|c| Cells::new(c.kind)).collect(),
            rows: 0,
        })
    }

    /// One more row, a value for each column.
    pub fn push(&mut self, row: Vec<Value>) -> Result<(), ObserverError> {
        let path = &self.path;
        if row.len() != self.columns.len() {
            let text = format!("{} values for {} columns", row.len(), self.columns.len());
            return Err(broken(path)(text));
        }
        for ((cells, column), value) in self.cells.iter_mut().zip(&self.columns).zip(row) {
            if !cells.push(value) {
                return Err(broken(path)(format!("a wrong value for `{}`", column.name)));
            }
        }
        self.rows += 1;
        if self.rows >= BATCH_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), ObserverError> {
        self.rows = 0;
        let arrays = self.cells.iter_mut().map(Cells::finish).collect();
        let batch = RecordBatch::try_new(self.schema.clone(), arrays);
        let batch = batch.map_err(broken(&self.path))?;
        self.writer.write(&batch).map_err(broken(&self.path))
    }

    /// Writes the rest and gives the file its name.
    pub fn close(mut self) -> Result<(), ObserverError> {
        self.flush()?;
        self.writer.close().map_err(broken(&self.path))?;
        fs::rename(part_name(&self.path), &self.path).map_err(broken(&self.path))
    }
}

/// Units and meanings once more, for readers that do not see the schema of Arrow: a list in JSON.
fn about(columns: &[Column]) -> KeyValue {
    let column = |c: &Column| json!({"name": c.name, "unit": c.unit, "meaning": c.meaning});
    let list: Vec<_> = columns.iter().map(column).collect();
    KeyValue::new("columns".to_owned(), json!(list).to_string())
}

fn broken<E: Into<Box<dyn Error + Send + Sync>>>(
    path: &Path,
) -> impl FnOnce(E) -> ObserverError + use<E> {
    failed(format!("writing {}", path.display()))
}
