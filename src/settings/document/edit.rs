//! Changes to a TOML document that keep the places of all else in its text.

use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

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

/// A key and its value, until they are put in.
pub(super) type NewEntry<'t> = Option<(Spanned<Cow<'t, str>>, Spanned<DeValue<'t>>)>;

pub(super) fn insert<'t>(table: &mut DeTable<'t>, entry: &mut NewEntry<'t>) {
    if let Some((key, value)) = entry.take() {
        table.insert(key, value);
    }
}

/// Puts an entry into the innermost table with a span.
pub(super) fn insert_below<'t>(
    table: &mut DeTable<'t>,
    at: &Range<usize>,
    entry: &mut NewEntry<'t>,
) {
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
pub(super) fn replace<'t>(
    table: &mut DeTable<'t>,
    key: &Range<usize>,
    value: &mut Option<DeValue<'t>>,
) {
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
pub(super) fn remove(
    table: &mut DeTable<'_>,
    key: Option<&Range<usize>>,
    value: &Range<usize>,
) -> bool {
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
