//! Keys of a TOML document with their places in its text.

use crate::settings::problem::{key_below, rest_within};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a dotted key (`lamps.spacing_m`, `obstacles[2].mass_kg`) stands in a text: its value, or
/// the nearest table around it where it is not written. `None` only for text that is not TOML.
pub fn locate(text: &str, dotted_key: &str) -> Option<Range<usize>> {
    let document = DeTable::parse(text).ok()?;
    let found = find_in_table(document.get_ref(), dotted_key);
    Some(found.unwrap_or(document.span()))
}

/// The `name` of the outermost element of a list that a dotted key leads to: for `track[2].plan[0]` that of
/// `track[2]`.
pub fn name_around(text: &str, dotted_key: &str) -> Option<String> {
    let (list, rest) = dotted_key.split_once('[')?;
    let index: usize = rest.split_once(']')?.0.parse().ok()?;
    let document = DeTable::parse(text).ok()?;
    let DeValue::Array(elements) = document.get_ref().get(list)?.get_ref() else {
        return None;
    };
    let DeValue::Table(element) = elements.get(index)?.get_ref() else {
        return None;
    };
    match element.get("name")?.get_ref() {
        DeValue::String(name) => Some(name.to_string()),
        _ => None,
    }
}

fn find_in_table(table: &DeTable<'_>, dotted_key: &str) -> Option<Range<usize>> {
    let leading = table
        .iter()
        .filter_map(|(key, value)| Some((key, value, rest_within(dotted_key, key.get_ref())?)));
    let (key, value, rest) = leading.min_by_key(|(_, _, rest)| rest.len())?;
    // A table's own span is its header only when it has one, its key is always there.
    let shown = match value.get_ref().is_table() {
        true => key.span(),
        false => value.span(),
    };
    Some(find_in_value(value.get_ref(), rest).unwrap_or(shown))
}

fn find_in_value(value: &DeValue<'_>, rest: &str) -> Option<Range<usize>> {
    match value {
        DeValue::Table(table) => find_in_table(table, rest.strip_prefix('.')?),
        DeValue::Array(array) => {
            let (index, rest) = rest.strip_prefix('[')?.split_once(']')?;
            let element = array.get(index.parse::<usize>().ok()?)?;
            Some(find_in_value(element.get_ref(), rest).unwrap_or(element.span()))
        }
        _ => None,
    }
}

/// A key of a document with its value, or an element of a list.
pub(super) struct Entry {
    /// The table or list that holds it; none of the document itself.
    parent: Option<usize>,
    /// The key, or `[2]` of an element.
    name: String,
    /// Where the key is written; an element has none.
    pub(super) key: Option<Range<usize>>,
    pub(super) value: Range<usize>,
    /// The value as messages quote it; a table or list has none.
    text: Option<String>,
    is_table: bool,
    depth: usize,
}

/// All entries of a document, each before those inside it.
///
/// Paths are made when asked for: those of a deep document together may be far longer than its text.
pub(super) struct Entries(Vec<Entry>);

impl Entries {
    pub(super) fn of(document: &DeTable<'_>) -> Self {
        let mut entries = Self(Vec::new());
        entries.add_table(document, None);
        entries
    }

    fn add_table(&mut self, table: &DeTable<'_>, parent: Option<usize>) {
        for (key, value) in table {
            self.add(key.get_ref().to_string(), Some(key.span()), value, parent);
        }
    }

    fn add(
        &mut self,
        name: String,
        key: Option<Range<usize>>,
        value: &Spanned<DeValue<'_>>,
        parent: Option<usize>,
    ) {
        let own = Some(self.0.len());
        self.0.push(Entry {
            parent,
            name,
            key,
            value: value.span(),
            text: quotable(value.get_ref()),
            is_table: value.get_ref().is_table(),
            depth: parent.map_or(0, |parent| self.0[parent].depth + 1),
        });
        match value.get_ref() {
            DeValue::Table(table) => self.add_table(table, own),
            DeValue::Array(array) => {
                for (k, element) in array.iter().enumerate() {
                    self.add(format!("[{k}]"), None, element, own);
                }
            }
            _ => {}
        }
    }

    pub(super) fn get(&self, index: usize) -> &Entry {
        &self.0[index]
    }

    /// Dotted, as `obstacles[2].mass_kg`; empty for the document.
    pub(super) fn path(&self, index: Option<usize>) -> String {
        let mut names = Vec::new();
        let mut next = index;
        while let Some(entry) = next.map(|index| &self.0[index]) {
            names.push((entry.key.is_some(), &entry.name));
            next = entry.parent;
        }
        let names = names.into_iter().rev();
        names.fold(String::new(), |path, (is_key, name)| match is_key {
            true => key_below(&path, name),
            false => path + name,
        })
    }

    /// What holds an entry.
    pub(super) fn parent(&self, index: usize) -> Option<usize> {
        self.0[index].parent
    }

    /// The innermost entry whose value has this span.
    pub(super) fn at(&self, span: &Range<usize>) -> Option<usize> {
        self.innermost(|entry| entry.value == *span)
    }

    /// The innermost table whose value has this span.
    pub(super) fn table_at(&self, span: &Range<usize>) -> Option<usize> {
        self.innermost(|entry| entry.is_table && entry.value == *span)
    }

    /// The innermost entry around a span.
    pub(super) fn around(&self, span: &Range<usize>) -> Option<usize> {
        self.innermost(|entry| entry.value.start <= span.start && span.end <= entry.value.end)
    }

    fn innermost(&self, fits: impl Fn(&Entry) -> bool) -> Option<usize> {
        let fitting = self.0.iter().enumerate().filter(|(_, entry)| fits(entry));
        let innermost = fitting.max_by_key(|(_, entry)| entry.depth);
        innermost.map(|(index, _)| index)
    }

    /// The key that is written at this span.
    pub(super) fn key_at(&self, span: &Range<usize>) -> Option<usize> {
        self.0.iter().position(|e| e.key.as_ref() == Some(span))
    }

    /// Keys below a table, the outermost first.
    fn keys_below(&self, table: usize) -> Vec<usize> {
        let mut below = Vec::new();
        let mut inside = vec![false; self.0.len()];
        inside[table] = true;
        for (index, entry) in self.0.iter().enumerate().skip(table + 1) {
            inside[index] = entry.parent.is_some_and(|parent| inside[parent]);
            if inside[index] && entry.key.is_some() {
                below.push(index);
            }
        }
        below.sort_by_key(|index| self.0[*index].depth);
        below
    }

    /// The outermost key of this name below a table.
    pub(super) fn named_below(&self, table: usize, name: &str) -> Option<usize> {
        let mut keys = self.keys_below(table).into_iter();
        keys.find(|index| self.0[*index].name == name)
    }

    /// The outermost key below a table whose value a message quotes.
    pub(super) fn quoted_below(&self, table: usize, message: &str) -> Option<usize> {
        let is_quoted = |text: &String| {
            message.contains(&format!("`{text}`")) || message.contains(&format!("\"{text}\""))
        };
        let mut keys = self.keys_below(table).into_iter();
        keys.find(|index| self.0[*index].text.as_ref().is_some_and(is_quoted))
    }
}

fn quotable(value: &DeValue<'_>) -> Option<String> {
    Some(match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(value) => value.to_string(),
        _ => return None,
    })
}
