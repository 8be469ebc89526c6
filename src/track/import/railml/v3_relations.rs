//! What railML 3.x says between net elements: collections and their parts, levels, relations.

use super::RailMlError;
use super::draft::CutEnd;
use super::v3_reading::{NetReading, Relation};
use super::xml::{Item, short};
use crate::track::Direction;
use std::collections::{BTreeMap, BTreeSet};

impl<'a> NetReading<'a> {
    /// Parts of collections are elements of the file, and none contains itself.
    pub(super) fn check_collections(&self) -> Result<(), RailMlError> {
        // 1: being looked through, 2: done.
        let mut seen: BTreeMap<&str, u8> = BTreeMap::new();
        for start in self.collections.keys() {
            let mut open = vec![(*start, false)];
            while let Some((id, is_done)) = open.pop() {
                let Some(item) = self.collections.get(id) else {
                    continue;
                };
                if is_done {
                    seen.insert(id, 2);
                    continue;
                }
                if seen.contains_key(id) {
                    continue;
                }
                seen.insert(id, 1);
                open.push((id, true));
                for part in parts(*item) {
                    let to = part.needed("ref")?;
                    if seen.get(to) == Some(&1) {
                        return Err(item.fault(format!("contains \"{}\", which contains it: collections that contain themselves are none", short(to))));
                    }
                    if !self.numbers.contains_key(to) && !self.collections.contains_key(to) {
                        return Err(part.fault(format!(
                            "`ref` is \"{}\", which no netElement has as its `id`",
                            short(to)
                        )));
                    }
                    open.push((to, false));
                }
            }
        }
        Ok(())
    }

    /// Reads all relations.
    pub(super) fn relate(&mut self, topology: Item<'a>) -> Result<(), RailMlError> {
        for item in topology
            .named("netRelations")
            .flat_map(|all| all.named("netRelation"))
        {
            let id = item.needed("id")?;
            let ends = (
                self.end(item, "elementA", "positionOnA")?,
                self.end(item, "elementB", "positionOnB")?,
            );
            let navigability = item.needed("navigability")?;
            let is_run = match navigability.to_ascii_lowercase().as_str() {
                "none" => false,
                // A train may go back the way that it came.
                "both" | "ab" | "ba" => true,
                _ => {
                    return Err(item.fault(format!(
                        "`navigability` is \"{}\": \"Both\", \"AB\", \"BA\" or \"None\" is needed",
                        short(navigability)
                    )));
                }
            };
            let relation = match ends {
                (Some(a), Some(b)) if a == b => {
                    return Err(
                        item.fault("joins an end of an element to itself: two ends are needed")
                    );
                }
                (Some(a), Some(b)) => {
                    self.fates.take(item);
                    Some(Relation {
                        ends: [a, b],
                        is_run,
                    })
                }
                _ => {
                    self.fates.leave(item, "between collections of elements");
                    None
                }
            };
            self.relations.insert(id, relation);
        }
        Ok(())
    }

    /// An end of an element; none of a collection.
    fn end(
        &self,
        item: Item<'a>,
        element: &str,
        position: &str,
    ) -> Result<Option<CutEnd>, RailMlError> {
        let child = item
            .child(element)
            .ok_or_else(|| item.fault(format!("needs an `{element}`")))?;
        let to = child.needed("ref")?;
        let place = item.needed(position)?;
        let way = match place.trim() {
            "0" => Direction::Down,
            "1" => Direction::Up,
            _ => {
                return Err(item.fault(format!(
                    "`{position}` is \"{}\": 0 (begin) or 1 (end) is needed",
                    short(place)
                )));
            }
        };
        let number = self.number_of(item, element, to)?;
        Ok(number.map(|track| CutEnd {
            track,
            piece: 0,
            way,
        }))
    }
}

/// What a collection contains.
pub(super) fn parts<'a>(item: Item<'a>) -> impl Iterator<Item = Item<'a>> {
    let collections = item
        .children()
        .filter(|child| child.name().starts_with("elementCollection"));
    collections.flat_map(|collection| collection.children())
}

/// What the networks of the file have on their micro level; none where they have no such level.
pub(super) fn micro<'a>(topology: Item<'a>) -> Option<BTreeSet<&'a str>> {
    let networks = topology
        .named("networks")
        .flat_map(|all| all.named("network"));
    let levels = networks.flat_map(|network| network.named("level"));
    let mut levels = levels
        .filter(|level| {
            level
                .attribute("descriptionLevel")
                .is_some_and(|name| name.eq_ignore_ascii_case("micro"))
        })
        .peekable();
    levels.peek()?;
    let resources = levels.flat_map(|level| level.named("networkResource"));
    Some(
        resources
            .filter_map(|resource| resource.attribute("ref"))
            .collect(),
    )
}
