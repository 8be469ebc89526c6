//! All that is wrong with the form of a document.
//!
//! serde stops at the first thing it dislikes. Here what it dislikes is taken out of the document,
//! what it misses is put in, and the rest is tried again, so that a user sees all wrong keys at once.

use super::entries::Entries;
use super::problem::{FileError, MOST_PROBLEMS, Problem, is_within, key_below};
use super::wrong::Wrong;
use serde::de::DeserializeOwned;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Error};

/// Every turn reads all of the document. So many bytes together take less than a second.
const MOST_BYTES: usize = 16 << 20;
const MOST_TURNS: usize = 500;

/// What may be put in for a missing key, until one is taken: a number, a text, a list, a table, a flag.
const STAND_INS: [&str; 6] = ["97", "\"stand-in\"", "[]", "{}", "[97, 97, 97]", "true"];

/// A value that stands in for a missing one.
struct StandIn {
    /// In place of the table's span, of which a document has several; no text has it.
    span: Range<usize>,
    table: Range<usize>,
    key: String,
    /// Next of [`STAND_INS`].
    next: usize,
}

/// A document while it is searched.
pub(super) struct Search<'t> {
    document: Spanned<DeTable<'t>>,
    entries: Entries,
    problems: Vec<Problem>,
    stand_in: Option<StandIn>,
    /// Missing keys.
    put_in: BTreeSet<String>,
    /// Keys that are missing only because they were taken out, or are there by a wrong name.
    taken: BTreeSet<String>,
    /// Tables whose kind is not known, and lists with elements taken out: what serde says of them
    /// follows from a problem that is listed already.
    unsure: Vec<String>,
    text_len: usize,
    stand_ins: usize,
}

impl<'t> Search<'t> {
    pub(super) fn of(document: Spanned<DeTable<'t>>, text_len: usize) -> Self {
        Self {
            entries: Entries::of(document.get_ref()),
            document,
            problems: Vec::new(),
            stand_in: None,
            put_in: BTreeSet::new(),
            taken: BTreeSet::new(),
            unsure: Vec::new(),
            text_len,
            stand_ins: 0,
        }
    }

    /// All problems, the first of which serde told, or those found until the search took too long.
    /// `check` finds what is wrong with the values of what could be read.
    pub(super) fn problems<T: DeserializeOwned>(
        mut self,
        first: Error,
        check: impl Fn(&T, &mut Vec<Problem>),
    ) -> FileError {
        let turns = (MOST_BYTES / self.text_len.max(1)).clamp(1, MOST_TURNS);
        let mut error = first;
        for _ in 0..turns {
            if !self.mend::<T>(&error) {
                return FileError::Problems(self.problems);
            }
            match self.read::<T>() {
                Ok(mended) => {
                    let mut more = Vec::new();
                    check(&mended, &mut more);
                    self.add_ranges(more);
                    return FileError::Problems(self.problems);
                }
                Err(next) => error = next,
            }
        }
        FileError::FirstProblems(self.problems)
    }

    /// Adds numbers out of their range, unless they were put in, or taken out and have a default. What
    /// else a mended document is wrong about may follow from its mending.
    fn add_ranges(&mut self, found: Vec<Problem>) {
        for problem in found.into_iter().filter(Problem::is_of_range) {
            if !self.put_in.contains(&problem.key) && !self.taken.contains(&problem.key) {
                self.note(problem);
            }
        }
    }

    fn read<T: DeserializeOwned>(&self) -> Result<T, Error> {
        T::deserialize(toml::Deserializer::from(self.document.clone()))
    }

    /// Notes what is wrong and changes the document so that the next thing is found; false where that
    /// cannot be done.
    fn mend<T: DeserializeOwned>(&mut self, error: &Error) -> bool {
        let wrong = Wrong::read(error.message());
        let span = error.span();
        if self.is_about_stand_in(&wrong, span.as_ref()) {
            return self.try_next_stand_in(&wrong);
        }
        self.stand_in = None;
        match &wrong {
            Wrong::MissingKey { key } => self.put_in(key, &wrong, span.unwrap_or_default()),
            _ => self.take_out::<T>(&wrong, span),
        }
    }

    fn note(&mut self, problem: Problem) {
        let follows = |table: &String| is_within(&problem.key, table);
        if self.problems.len() < MOST_PROBLEMS && !self.unsure.iter().any(follows) {
            self.problems.push(problem);
        }
    }

    fn put_in(&mut self, key: &str, wrong: &Wrong, table: Range<usize>) -> bool {
        // The table may be a stand-in itself, of which nothing is said.
        if table.start <= self.text_len {
            let path = self.entries.path(self.entries.table_at(&table));
            let path = key_below(&path, key);
            self.put_in.insert(path.clone());
            if !self.taken.contains(&path) {
                self.note(wrong.problem(path, Vec::new()));
            }
        }
        self.stand_ins += 1;
        let start = self.text_len + 2 * self.stand_ins;
        self.stand_in = Some(StandIn {
            span: start..start + 1,
            table,
            key: key.to_owned(),
            next: 0,
        });
        self.try_next_stand_in(wrong)
    }

    fn is_about_stand_in(&self, wrong: &Wrong, span: Option<&Range<usize>>) -> bool {
        let Some(stand_in) = &self.stand_in else {
            return false;
        };
        let of_value = span == Some(&stand_in.span) && !matches!(wrong, Wrong::MissingKey { .. });
        // Where a table is read through a buffer, its span is all that is known.
        let quotes = |what: &str| what.contains("`97`") || what.contains("stand-in");
        let of_table = matches!(wrong, Wrong::Value { what, .. } if quotes(what));
        of_value || (of_table && span == Some(&stand_in.table))
    }

    /// Puts the next value in; false where none is left.
    fn try_next_stand_in(&mut self, wrong: &Wrong) -> bool {
        let Some(stand_in) = &mut self.stand_in else {
            return false;
        };
        let value = match wrong.names().into_iter().next() {
            Some(name) => {
                // Which keys belong to a choice is not known where it was made for the user.
                let table = self.entries.table_at(&stand_in.table);
                if table.is_some() {
                    self.unsure.push(self.entries.path(table));
                }
                DeValue::String(Cow::Owned(name))
            }
            None => {
                let text = STAND_INS.get(stand_in.next);
                stand_in.next += 1;
                match text.and_then(|text| DeValue::parse(text).ok()) {
                    Some(value) => value.into_inner(),
                    None => return false,
                }
            }
        };
        let span = stand_in.span.clone();
        let key = Spanned::new(span.clone(), Cow::Owned(stand_in.key.clone()));
        let mut entry = Some((key, Spanned::new(span, value)));
        let table = stand_in.table.clone();
        let own = self.document.span();
        insert_below(self.document.get_mut(), &table, &mut entry);
        if entry.is_some() && (own == table || table.is_empty()) {
            insert(self.document.get_mut(), &mut entry);
        }
        entry.is_none()
    }

    fn take_out<T: DeserializeOwned>(&mut self, wrong: &Wrong, span: Option<Range<usize>>) -> bool {
        let span = span.unwrap_or_default();
        let culprit = self.culprit(wrong, &span);
        let about = culprit.or_else(|| self.entries.around(&span));
        let path = self.entries.path(about);
        let names = match (wrong.lacks_names(), culprit) {
            (true, Some(culprit)) => self.names_at::<T>(culprit),
            _ => Vec::new(),
        };
        self.note(wrong.problem(path.clone(), names));
        let Some(culprit) = culprit else {
            return false;
        };
        let parent = self.entries.path(self.entries.parent(culprit));
        if let Some(meant) = wrong.meant() {
            self.taken.insert(key_below(&parent, meant));
        }
        self.taken.insert(path);
        let entry = self.entries.get(culprit);
        if entry.key.is_none() {
            self.unsure.push(parent);
        }
        remove(self.document.get_mut(), entry.key.as_ref(), &entry.value)
    }

    /// The entry that an error with a span is about.
    ///
    /// Spans are exact, unless an enum was read through a buffer: then they are those of the table
    /// around, and the outermost such key, or the first value that the message quotes, below it is the
    /// one.
    fn culprit(&self, wrong: &Wrong, span: &Range<usize>) -> Option<usize> {
        let at = self.entries.at(span);
        match wrong {
            Wrong::MissingKey { .. } => None,
            Wrong::UnknownKey { key, .. } => {
                let named = || self.entries.named_below(at?, key);
                self.entries.key_at(span).or_else(named)
            }
            Wrong::Value { what, .. } => {
                let quoted = at.and_then(|at| self.entries.quoted_below(at, what));
                quoted.or(at)
            }
        }
    }

    /// The names that may stand in place of a value: serde tells them of a text only.
    fn names_at<T: DeserializeOwned>(&self, culprit: usize) -> Vec<String> {
        let mut document = self.document.clone();
        let Some(key) = &self.entries.get(culprit).key else {
            return Vec::new();
        };
        let mut text = Some(DeValue::String(Cow::Borrowed("stand-in")));
        replace(document.get_mut(), key, &mut text);
        match T::deserialize(toml::Deserializer::from(document)) {
            Err(error) if error.message().contains("`stand-in`") => {
                Wrong::read(error.message()).names()
            }
            _ => Vec::new(),
        }
    }
}

/// Tables directly inside a value.
fn tables_in<'a, 't>(
    value: &'a mut Spanned<DeValue<'t>>,
) -> Vec<(Range<usize>, &'a mut DeTable<'t>)> {
    let span = value.span();
    match value.get_mut() {
        DeValue::Table(table) => vec![(span, table)],
        DeValue::Array(array) => array.iter_mut().flat_map(tables_in).collect(),
        _ => Vec::new(),
    }
}

type NewEntry<'t> = Option<(Spanned<Cow<'t, str>>, Spanned<DeValue<'t>>)>;

fn insert<'t>(table: &mut DeTable<'t>, entry: &mut NewEntry<'t>) {
    if let Some((key, value)) = entry.take() {
        table.insert(key, value);
    }
}

/// Puts an entry into the innermost table with a span.
fn insert_below<'t>(table: &mut DeTable<'t>, at: &Range<usize>, entry: &mut NewEntry<'t>) {
    for (_, value) in table.iter_mut() {
        for (span, inner) in tables_in(value) {
            insert_below(inner, at, entry);
            if span == *at {
                insert(inner, entry);
            }
        }
    }
}

/// Puts a value in place of that whose key has a span.
fn replace<'t>(table: &mut DeTable<'t>, key: &Range<usize>, value: &mut Option<DeValue<'t>>) {
    for (other, old) in table.iter_mut() {
        if other.span() == *key
            && let Some(value) = value.take()
        {
            *old.get_mut() = value;
        }
        for (_, inner) in tables_in(old) {
            replace(inner, key, value);
        }
    }
}

/// Takes the entry out whose key has a span, or an element of a list by the span of its value.
fn remove(table: &mut DeTable<'_>, key: Option<&Range<usize>>, value: &Range<usize>) -> bool {
    let found = table
        .keys()
        .find(|other| Some(&other.span()) == key)
        .cloned();
    if let Some(found) = found {
        return table.remove(&found).is_some();
    }
    let mut values = table.iter_mut();
    values.any(|(_, inner)| remove_from(inner.get_mut(), key, value))
}

fn remove_from(inner: &mut DeValue<'_>, key: Option<&Range<usize>>, value: &Range<usize>) -> bool {
    match inner {
        DeValue::Table(table) => remove(table, key, value),
        DeValue::Array(array) => {
            let is_it = |element: &Spanned<DeValue<'_>>| key.is_none() && element.span() == *value;
            if array.iter().any(is_it) {
                let all = std::mem::replace(array, DeArray::new());
                *array = all.into_iter().filter(|element| !is_it(element)).collect();
                return true;
            }
            let mut elements = array.iter_mut();
            elements.any(|element| remove_from(element.get_mut(), key, value))
        }
        _ => false,
    }
}
