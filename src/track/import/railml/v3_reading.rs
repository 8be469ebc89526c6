//! What is known of a file of railML 3.x while it is read: its elements, and what refers to them.

use super::draft::CutEnd;
use super::place::{Coordinates, KnownPlace};
use super::report::Fates;
use super::xml::{Item, short};
use super::{Crs, RailMlError, RailMlOptions};
use std::collections::BTreeMap;

/// What is known of a file while it is read.
pub(super) struct NetReading<'a> {
    pub(super) options: RailMlOptions,
    /// Definition of each system of coordinates; of screens, none.
    pub(super) systems: BTreeMap<&'a str, Option<&'a str>>,
    /// Elements that are no collection, by number.
    pub(super) numbers: BTreeMap<&'a str, usize>,
    pub(super) collections: BTreeMap<&'a str, Item<'a>>,
    pub(super) relations: BTreeMap<&'a str, Option<Relation>>,
    pub(super) fates: Fates,
}

/// A relation between two elements.
pub(super) struct Relation {
    pub(super) ends: [CutEnd; 2],
    pub(super) is_run: bool,
}

impl<'a> NetReading<'a> {
    /// A place by `x` (longitude, easting) and `y` (latitude, northing).
    pub(super) fn known(
        &self,
        of: Item<'a>,
        item: Item<'a>,
        (at_m, weight): (f64, u32),
    ) -> Result<Option<KnownPlace<'a>>, RailMlError> {
        let (x, y) = (item.needed_value("x")?, item.needed_value("y")?);
        let reference = item.attribute("positioningSystemRef").unwrap_or_default();
        let crs = match self.systems.get(reference) {
            Some(None) => return Ok(None),
            Some(Some(definition)) => Some(*definition).filter(|text| !text.is_empty()),
            None if reference.is_empty() => None,
            None => {
                return Err(item.fault(format!(
                    "`positioningSystemRef` is \"{}\", which no geometricPositioningSystem has as its `id`",
                    short(reference)
                )));
            }
        };
        let system = crs.map_or(Ok(self.options.crs), |text| text.parse().map(Some));
        let values = match system {
            Ok(Some(Crs::Wgs84)) => [y, x],
            _ => [x, y],
        };
        let coordinates = Coordinates { item, values, crs };
        let known = coordinates.known_at((of, at_m), weight, &self.options)?;
        Ok(Some(known))
    }

    /// The element that something lies on; none where it is a collection.
    pub(super) fn number(&self, item: Item<'a>) -> Result<Option<usize>, RailMlError> {
        self.number_of(item, "netElementRef", item.needed("netElementRef")?)
    }

    /// The element with an id, which an item names by a key; none where it is a collection.
    pub(super) fn number_of(
        &self,
        item: Item<'a>,
        key: &str,
        id: &str,
    ) -> Result<Option<usize>, RailMlError> {
        let number = self.numbers.get(id).copied();
        match number.is_some() || self.collections.contains_key(id) {
            true => Ok(number),
            false => Err(item.fault(format!(
                "`{key}` is \"{}\", which no netElement has as its `id`",
                short(id)
            ))),
        }
    }
}
