//! What has become of every element of a file.

use super::xml::{Item, short};
use crate::track::import::{ImportReport, LeftOut};
use std::collections::BTreeMap;

/// More of one name are told as a number.
const MOST_OF_A_NAME: usize = 20;
/// More names than any version of the format has are told as one.
const MOST_NAMES: usize = 400;

/// Which elements were taken over, and why others were not.
#[derive(Default)]
pub(super) struct Fates {
    /// By number of the element; none: taken over.
    fates: BTreeMap<usize, Option<String>>,
}

impl Fates {
    /// What the element says is in the map.
    pub(super) fn take(&mut self, item: Item<'_>) {
        self.fates.insert(item.number(), None);
    }

    /// It is not, for this reason.
    pub(super) fn leave(&mut self, item: Item<'_>, why: impl Into<String>) {
        self.fates.insert(item.number(), Some(why.into()));
    }

    /// Counts what is inside an element and has an id or a place, and what was looked at besides; `usual` tells why
    /// elements of a name are not taken over, or none for what is a part of another element.
    pub(super) fn report(
        &self,
        root: Item<'_>,
        usual: impl Fn(&str) -> Option<&'static str>,
    ) -> ImportReport {
        let mut report = ImportReport::default();
        let mut listed: BTreeMap<&str, usize> = BTreeMap::new();
        let mut more: BTreeMap<&str, (usize, String)> = BTreeMap::new();
        for item in root.all().skip(1) {
            let fate = self.fates.get(&item.number());
            let is_thing = item.attribute("id").is_some() || item.attribute("pos").is_some();
            let why = match (fate, usual(item.name())) {
                (Some(fate), _) => fate.as_deref(),
                (None, Some(why)) if is_thing => Some(why),
                _ => continue,
            };
            let known = listed.len() < MOST_NAMES || listed.contains_key(item.name());
            let name = if known { item.name() } else { "of more names" };
            let told = listed.entry(name).or_default();
            let count = report.counts.entry(short(name)).or_default();
            count.in_file += 1;
            let Some(why) = why else {
                count.taken += 1;
                continue;
            };
            *told += 1;
            if *told <= MOST_OF_A_NAME {
                report.left_out.push(LeftOut {
                    line: item.line(),
                    what: item.title(),
                    why: why.to_owned(),
                });
            } else {
                more.entry(name).or_insert((0, why.to_owned())).0 += 1;
            }
        }
        let more = more.into_iter().map(|(name, (count, why))| LeftOut {
            line: 0,
            what: short(&format!("{count} more of {name}")),
            why,
        });
        report.left_out.extend(more);
        report
    }
}
