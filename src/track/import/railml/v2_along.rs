//! What railML 2.x states along a track.

use super::draft::DraftTrack;
use super::place::{Coordinates, KnownPlace, two_numbers};
use super::report::Fates;
use super::stated::{LEAST_RADIUS_M, MOST_GRADE_PERMILLE, place_m, switch_m};
use super::xml::Item;
use super::{RailMlError, RailMlOptions};
use crate::track::Direction;
use crate::track::import::{MapBalise, MapSignal, MapSpeed, MapStep};
use std::collections::BTreeMap;

/// More cant is none.
const MOST_CANT_MM: f64 = 400.0;

/// What a file says for all of its tracks.
pub(super) struct FileDefaults<'a> {
    options: RailMlOptions,
    /// The system of coordinates that name none.
    crs: Option<&'a str>,
    /// The least of the speeds that a set of attributes has.
    speeds_kmh: BTreeMap<&'a str, f64>,
}

impl<'a> FileDefaults<'a> {
    pub(super) fn new(
        infrastructure: Item<'a>,
        options: &RailMlOptions,
        fates: &mut Fates,
    ) -> Result<Self, RailMlError> {
        let mut defaults = Self {
            options: *options,
            crs: None,
            speeds_kmh: BTreeMap::new(),
        };
        let groups = infrastructure
            .named("infraAttrGroups")
            .flat_map(|groups| groups.named("infraAttributes"));
        for attributes in groups {
            let epsg = attributes.child("epsgCode");
            defaults.crs = defaults
                .crs
                .or_else(|| epsg.and_then(|code| code.attribute("default")));
            let mut least_kmh: Option<f64> = None;
            for speed in attributes
                .named("speeds")
                .flat_map(|speeds| speeds.named("speed"))
            {
                if let Some(kmh) = kmh(speed)? {
                    least_kmh = Some(least_kmh.map_or(kmh, |least| least.min(kmh)));
                    fates.take(speed);
                }
            }
            if let (Some(id), Some(kmh)) = (attributes.attribute("id"), least_kmh) {
                defaults.speeds_kmh.insert(id, kmh);
                fates.take(attributes);
            }
        }
        Ok(defaults)
    }

    /// Reads what lies along a track into it.
    pub(super) fn read_along(
        &self,
        track: &mut DraftTrack<'a>,
        fates: &mut Fates,
    ) -> Result<(), RailMlError> {
        let parts = ["trackTopology", "trackElements", "ocsElements"];
        let own = track.item;
        for part in parts.into_iter().flat_map(|name| own.named(name)) {
            for item in part.children() {
                match item.name() {
                    "trackBegin" => self.add_place(track, item, 0.0, 2)?,
                    "trackEnd" => self.add_place(track, item, track.length_m, 2)?,
                    _ => {
                        for item in item.children() {
                            self.read(track, item, fates)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn read(
        &self,
        track: &mut DraftTrack<'a>,
        item: Item<'a>,
        fates: &mut Fates,
    ) -> Result<(), RailMlError> {
        let at = |track: &DraftTrack<'_>| place_m(item, track.length_m, item.needed_value("pos")?);
        match item.name() {
            "switch" | "crossing" => {
                let at_m = place_m(item, track.length_m, switch_m(item, track.along.stated_m)?)?;
                self.add_place(track, item, at_m, 2)?;
            }
            "gradientChange" => {
                let permille = bounded(item, "slope", MOST_GRADE_PERMILLE)?;
                let from_m = at(track)?;
                track.along.grades_permille.push(MapStep {
                    from_m,
                    value: permille,
                });
                fates.take(item);
                self.add_place(track, item, from_m, 1)?;
            }
            "radiusChange" => {
                let radius_m = item.needed_value("radius")?;
                let per_m = if radius_m.abs() > 0.0 {
                    1.0 / radius_m
                } else {
                    0.0
                };
                if per_m.abs() > 1.0 / LEAST_RADIUS_M {
                    return Err(item.fault(format!("`radius` is {radius_m} m: 0 (straight) or at least {LEAST_RADIUS_M} m is needed")));
                }
                let from_m = at(track)?;
                track.along.curvatures_per_m.push(MapStep {
                    from_m,
                    value: per_m,
                });
                if item.attribute("superelevation").is_some() {
                    let cant_mm = bounded(item, "superelevation", MOST_CANT_MM)?;
                    track.along.cants_mm.push(MapStep {
                        from_m,
                        value: cant_mm,
                    });
                }
                track.curves.push(item);
                fates.take(item);
                self.add_place(track, item, from_m, 1)?;
            }
            "speedChange" => self.read_speed(track, item, at(track)?, fates)?,
            "tunnel" => {
                let length_m = item.needed_value("length")?;
                let from_m = at(track)?;
                let to_m = place_m(item, track.length_m, from_m + length_m)?;
                if length_m < 0.0 {
                    return Err(item.fault(format!("`length` is {length_m}: it is not negative")));
                }
                track.along.tunnels_m.push([from_m, to_m]);
                fates.take(item);
            }
            "balise" => {
                let (name, along_m) = (item.label(), at(track)?);
                track.along.balises.push(MapBalise { name, along_m });
                fates.take(item);
                self.add_place(track, item, along_m, 1)?;
            }
            "signal" => {
                let along_m = at(track)?;
                match way(item) {
                    Some(way) => {
                        track.along.signals.push(MapSignal {
                            name: item.label(),
                            along_m,
                            way,
                        });
                        fates.take(item);
                    }
                    None => fates.leave(
                        item,
                        "`dir` does not say for which trains it is: \"up\" or \"down\" would",
                    ),
                }
                if let Some(known) = self.known(item, along_m, 1)? {
                    track.beside.push(known);
                }
            }
            "trainDetector" | "trackCircuitBorder" | "mileageChange" | "border"
                if item.attribute("pos").is_some() =>
            {
                self.add_place(track, item, at(track)?, 1)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// The lesser of its own speed and that of the attributes that it refers to.
    fn read_speed(
        &self,
        track: &mut DraftTrack<'a>,
        item: Item<'a>,
        from_m: f64,
        fates: &mut Fates,
    ) -> Result<(), RailMlError> {
        let referred = item
            .attribute("profileRef")
            .and_then(|id| self.speeds_kmh.get(id))
            .copied();
        let own = kmh(item)?;
        let least = own.into_iter().chain(referred).reduce(f64::min);
        match least {
            Some(kmh) => {
                track.along.speeds.push(MapSpeed {
                    from_m,
                    kmh,
                    way: way(item),
                });
                fates.take(item);
            }
            None => fates.leave(item, "has neither a `vMax` nor a `profileRef` that has one"),
        }
        self.add_place(track, item, from_m, 1)
    }

    fn add_place(
        &self,
        track: &mut DraftTrack<'a>,
        item: Item<'a>,
        at_m: f64,
        weight: u32,
    ) -> Result<(), RailMlError> {
        let known = self.known(item, at_m, weight)?;
        track.places.extend(known);
        Ok(())
    }

    fn known(
        &self,
        of: Item<'a>,
        at_m: f64,
        weight: u32,
    ) -> Result<Option<KnownPlace<'a>>, RailMlError> {
        let Some(item) = of.child("geoCoord") else {
            return Ok(None);
        };
        let Some(values) = two_numbers(item, "coord")? else {
            return Ok(None);
        };
        let crs = item.attribute("epsgCode").or(self.crs);
        let coordinates = Coordinates { item, values, crs };
        let known = coordinates.known_at((of, at_m), weight, &self.options)?;
        Ok(Some(known))
    }
}

/// A speed, where it is a number: "end" ends one.
fn kmh(item: Item<'_>) -> Result<Option<f64>, RailMlError> {
    match item.attribute("vMax") {
        Some("end") => Ok(None),
        _ => item.speed_kmh("vMax"),
    }
}

fn bounded(item: Item<'_>, key: &str, most: f64) -> Result<f64, RailMlError> {
    let value = item.needed_value(key)?;
    match value.abs() <= most {
        true => Ok(value),
        false => Err(item.fault(format!(
            "`{key}` is {value}: at most {most} is on a railway"
        ))),
    }
}

fn way(item: Item<'_>) -> Option<Direction> {
    match item.attribute("dir") {
        Some("up") => Some(Direction::Up),
        Some("down") => Some(Direction::Down),
        _ => None,
    }
}
