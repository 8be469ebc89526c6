//! All that is wrong with the form of a document.
//!
//! serde stops at the first thing it dislikes. Here what it dislikes is taken out of the document,
//! what it misses is put in, and the rest is tried again, so that a user sees all wrong keys at once.

use super::edit::{insert, insert_below, remove, replace};
use super::entries::Entries;
use super::message::SerdeMessage;
use crate::settings::problem::{
    FileError, MOST_PROBLEMS, Problem, did_you_mean, is_within, key_below,
};
use serde::de::DeserializeOwned;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

/// Every turn reads all of the document. So many bytes together take less than a second.
const MOST_BYTES: usize = 16 << 20;
const MOST_TURNS: usize = 500;

/// What may be put in for a missing key, until one is taken: a number, a text, a list, a
/// table, a list of three, a flag.
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
pub(super) struct ProblemSearch<'t> {
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

impl<'t> ProblemSearch<'t> {
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

    /// All problems, the first of which serde told, or those found where the search came to no end.
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
                break;
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
        let message = SerdeMessage::read(error.message());
        let span = error.span();
        if self.is_about_stand_in(&message, span.as_ref()) {
            return self.try_next_stand_in(&message);
        }
        self.stand_in = None;
        match &message {
            SerdeMessage::MissingKey { key } => {
                self.put_in(key, &message, span.unwrap_or_default())
            }
            _ => self.take_out::<T>(&message, span),
        }
    }

    fn note(&mut self, problem: Problem) {
        let follows = |table: &String| is_within(&problem.key, table);
        if self.problems.len() < MOST_PROBLEMS && !self.unsure.iter().any(follows) {
            self.problems.push(problem);
        }
    }

    fn put_in(&mut self, key: &str, message: &SerdeMessage, table: Range<usize>) -> bool {
        // The table may be a stand-in itself, of which nothing is said.
        if table.start <= self.text_len {
            let path = self.entries.path(self.entries.table_at(&table));
            let path = key_below(&path, key);
            self.put_in.insert(path.clone());
            if !self.taken.contains(&path) {
                self.note(message.problem(path, Vec::new()));
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
        self.try_next_stand_in(message)
    }

    fn is_about_stand_in(&self, message: &SerdeMessage, span: Option<&Range<usize>>) -> bool {
        let Some(stand_in) = &self.stand_in else {
            return false;
        };
        let of_value =
            span == Some(&stand_in.span) && !matches!(message, SerdeMessage::MissingKey { .. });
        // Where a table is read through a buffer, its span is all that is known.
        let quotes = |what: &str| what.contains("`97`") || what.contains("stand-in");
        let of_table = matches!(message, SerdeMessage::Value { what, .. } if quotes(what));
        of_value || (of_table && span == Some(&stand_in.table))
    }

    /// Puts the next value in; false where none is left.
    fn try_next_stand_in(&mut self, message: &SerdeMessage) -> bool {
        let Some(stand_in) = &mut self.stand_in else {
            return false;
        };
        let value = match message.names().into_iter().next() {
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

    fn take_out<T: DeserializeOwned>(
        &mut self,
        message: &SerdeMessage,
        span: Option<Range<usize>>,
    ) -> bool {
        let span = span.unwrap_or_default();
        let culprit = self.culprit(message, &span);
        let about = culprit.or_else(|| self.entries.around(&span));
        let path = self.entries.path(about);
        let names = match (message.lacks_names(), culprit) {
            (true, Some(culprit)) => self.names_at::<T>(culprit),
            _ => Vec::new(),
        };
        let mut problem = message.problem(path.clone(), names);
        let Some(culprit) = culprit else {
            self.note(problem);
            return false;
        };
        let parent = self.entries.path(self.entries.parent(culprit));
        if let Some(meant) = self.missing_that_is_meant(message, &parent) {
            problem.remedy = format!("did you mean `{meant}`?");
            let missing = key_below(&parent, &meant);
            self.problems.retain(|listed| listed.key != missing);
        }
        self.note(problem);
        if let Some(meant) = message.meant() {
            self.taken.insert(key_below(&parent, meant));
        }
        self.taken.insert(path);
        let entry = self.entries.get(culprit);
        if entry.key.is_none() {
            self.unsure.push(parent);
        }
        remove(self.document.get_mut(), entry.key.as_ref(), &entry.value)
    }

    /// The key that is missing in a table and that stands there by a wrong name, where serde does not list it.
    fn missing_that_is_meant(&self, message: &SerdeMessage, table: &str) -> Option<String> {
        let SerdeMessage::UnknownKey { key, .. } = message else {
            return None;
        };
        if message.meant().is_some() {
            return None;
        }
        let below = |path: &String| match table {
            "" => Some(path.clone()),
            _ => Some(path.strip_prefix(table)?.strip_prefix('.')?.to_owned()),
        };
        let missing: Vec<String> = self.put_in.iter().filter_map(below).collect();
        did_you_mean(key, &missing).map(str::to_owned)
    }

    /// The entry that an error with a span is about.
    ///
    /// Spans are exact, unless an enum was read through a buffer: then they are those of the table
    /// around, and the outermost such key, or the first value that the message quotes, below it is the
    /// one.
    fn culprit(&self, message: &SerdeMessage, span: &Range<usize>) -> Option<usize> {
        let at = self.entries.at(span);
        match message {
            SerdeMessage::MissingKey { .. } => None,
            SerdeMessage::UnknownKey { key, .. } => {
                let named = || self.entries.named_below(at?, key);
                self.entries.key_at(span).or_else(named)
            }
            SerdeMessage::Value { what, .. } => {
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
                SerdeMessage::read(error.message()).names()
            }
            _ => Vec::new(),
        }
    }
}
