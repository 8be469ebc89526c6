//! Coordinates in railML files.

use super::xml::{Item, short};
use super::{Crs, RailMlError, RailMlOptions};
use crate::track::geodesy::{Datum, Geodetic};
use nalgebra::Point2;

/// A place along a track of which coordinates are stated.
#[derive(Clone)]
pub(super) struct KnownPlace<'a> {
    /// Along the track, as stated, metres.
    pub(super) at_m: f64,
    pub(super) place: Geodetic,
    /// With the coordinates the other way round, where that is on earth.
    pub(super) swapped: Option<Geodetic>,
    /// How much it is trusted against others.
    pub(super) weight: u32,
    /// The element of the file with the coordinates.
    pub(super) item: Item<'a>,
    /// What is there.
    pub(super) what: String,
}

impl KnownPlace<'_> {
    /// In the plane of a datum.
    pub(super) fn in_plane(&self, datum: &Datum) -> Point2<f64> {
        datum.world(&self.place).xy()
    }
}

/// Two coordinates as written, and the system that the file names for them.
pub(super) struct Coordinates<'a> {
    pub(super) item: Item<'a>,
    /// In the order of the system: latitude and longitude, easting and northing.
    pub(super) values: [f64; 2],
    pub(super) crs: Option<&'a str>,
}

impl<'a> Coordinates<'a> {
    /// The place along a track of what they belong to.
    pub(super) fn known_at(
        self,
        (of, at_m): (Item<'a>, f64),
        weight: u32,
        options: &RailMlOptions,
    ) -> Result<KnownPlace<'a>, RailMlError> {
        let (place, swapped) = self.resolve(options)?;
        Ok(KnownPlace {
            at_m,
            place,
            swapped,
            weight,
            item: self.item,
            what: of.title(),
        })
    }

    /// On earth, as written and the other way round.
    pub(super) fn resolve(
        &self,
        options: &RailMlOptions,
    ) -> Result<(Geodetic, Option<Geodetic>), RailMlError> {
        let stated = self.crs.map(str::parse::<Crs>).transpose();
        let stated = stated.map_err(|e| self.item.fault(e.to_string()))?;
        let crs = stated.or(options.crs).ok_or_else(|| RailMlError::NoDatum {
            line: self.item.line(),
            element: self.item.name().to_owned(),
            id: self.item.id_or_owner(),
        })?;
        let place = crs.geodetic(self.values);
        let place = place.map_err(|what| self.item.fault(what))?;
        let [first, second] = self.values;
        Ok((place, crs.geodetic([second, first]).ok()))
    }
}

/// The first two of two or three numbers with blanks between them; none where both are 0, as where a height alone is
/// stated.
pub(super) fn two_numbers(item: Item<'_>, key: &str) -> Result<Option<[f64; 2]>, RailMlError> {
    let text = item.needed(key)?;
    let numbers: Vec<Option<f64>> = text
        .split_whitespace()
        .take(4)
        .map(|word| word.parse().ok().filter(|value: &f64| value.abs() <= 1e8))
        .collect();
    match numbers.as_slice() {
        [Some(first), Some(second)] | [Some(first), Some(second), Some(_)] => {
            let is_none = first.abs() + second.abs() == 0.0;
            Ok((!is_none).then_some([*first, *second]))
        }
        _ => Err(item.fault(format!(
            "`{key}` is \"{}\": two or three numbers apart by blanks are needed",
            short(text)
        ))),
    }
}
