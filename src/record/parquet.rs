//! Parquet tables whose columns say what they are: the same list makes the file and its
//! description. Rows are anything that serialises to an object with the columns' names.

use super::observer_error::{Result, broken};
use crate::files::PartFile;
use arrow::datatypes::{DataType, Field, Schema};
use arrow::json::ReaderBuilder;
use arrow::json::reader::Decoder;
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use serde::Serialize;
use serde_json::json;
use std::borrow::Cow;
use std::path::PathBuf;
use std::slice;
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

/// The kind of column that a field of a row makes.
pub(super) trait ColumnType {
    const KIND: Kind;
}

macro_rules! cells {
    ($($type:ty => $kind:ident),* $(,)?) => {
        $(impl ColumnType for $type {
            const KIND: Kind = Kind::$kind;
        })*
    };
}

cells! {
    i64 => Int,
    u64 => Int,
    u32 => Int,
    usize => Int,
    f64 => Real,
    bool => Flag,
    String => Text,
    &str => Text,
    Vec<f64> => Reals,
}

impl<const N: usize> ColumnType for [f64; N] {
    const KIND: Kind = Kind::Reals;
}

impl<T: ColumnType> ColumnType for Option<T> {
    const KIND: Kind = T::KIND;
}

/// Declares the rows of a table. Each field is a column: its type is what the column holds, its
/// documentation what it means, and behind it stands its unit.
macro_rules! table_rows {
    (
        $(#[doc = $about:literal])*
        struct $name:ident {
            $($(#[doc = $meaning:literal])+ $field:ident: $type:ty, $unit:literal;)+
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, serde::Serialize)]
        pub(super) struct $name {
            $($(#[doc = $meaning])+ pub $field: $type,)+
        }

        impl $name {
            pub(super) const COLUMNS: &[$crate::record::parquet::Column] = &[
                $($crate::record::parquet::column(
                    stringify!($field),
                    <$type as $crate::record::parquet::ColumnType>::KIND,
                    $unit,
                    concat!($($meaning),+).trim_ascii(),
                ),)+
            ];
        }
    };
}
pub(super) use table_rows;

/// Columns as a table in Markdown.
pub fn describe(columns: &[Column]) -> String {
    let mut text = String::from("| column | type | unit | meaning |\n|---|---|---|---|\n");
    for c in columns {
        let kind = c.kind.name();
        text += &format!("| `{}` | {kind} | {} | {} |\n", c.name, c.unit, c.meaning);
    }
    text
}

/// A table on its way into a file.
pub struct ParquetTable {
    path: PathBuf,
    rows: Decoder,
    writer: ArrowWriter<PartFile>,
}

impl ParquetTable {
    /// Begins a file; it gets its name in [`Self::close`].
    pub fn create(path: PathBuf, columns: &[Column]) -> Result<Self> {
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
        let rows = ReaderBuilder::new(schema.clone()).with_strict_mode(true);
        let file = PartFile::create(&path).map_err(broken(&path))?;
        let writer = ArrowWriter::try_new(file, schema, Some(settings));
        Ok(Self {
            rows: rows.build_decoder().map_err(broken(&path))?,
            writer: writer.map_err(broken(&path))?,
            path,
        })
    }

    /// One more row: an object with a value for each column; what it lacks is null.
    pub fn push(&mut self, row: &impl Serialize) -> Result {
        let added = self.rows.serialize(slice::from_ref(row));
        added.map_err(broken(&self.path))?;
        if self.rows.len() >= BATCH_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result {
        match self.rows.flush().map_err(broken(&self.path))? {
            Some(batch) => self.writer.write(&batch).map_err(broken(&self.path)),
            None => Ok(()),
        }
    }

    /// Writes the rest and gives the file its name.
    pub fn close(mut self) -> Result {
        self.flush()?;
        let part = self.writer.into_inner().map_err(broken(&self.path))?;
        part.finish().map_err(broken(&self.path))
    }
}

/// Units and meanings once more, for readers that do not see the schema of Arrow: a list in JSON.
fn about(columns: &[Column]) -> KeyValue {
    let column = |c: &Column| json!({"name": c.name, "unit": c.unit, "meaning": c.meaning});
    let list: Vec<_> = columns.iter().map(column).collect();
    KeyValue::new("columns".to_owned(), json!(list).to_string())
}
