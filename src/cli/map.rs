//! Maps of others in files: which kind a file is, and what is in it.

use super::check::{read, read_as};
use super::fault::Failure;
use super::file_kind::FileKind;
use crate::settings::ReadLimit;
use crate::track::Tunnel;
use crate::track::geodesy::Datum;
use crate::track::import::railml::{RailMlOptions, read_railml};
use crate::track::import::{AroundPlace, Crs, ImportedMap, OsmImport};
use crate::track::plan::PlanNetwork;
use std::fmt::Display;
use std::path::Path;

/// A format of maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MapFormat {
    /// Raw JSON of OpenStreetMap.
    OsmJson,
    /// XML of OpenStreetMap.
    OsmXml,
    /// railML.
    RailMl,
    /// GeoJSON of track elements and relations.
    GeoJson,
    /// None of these.
    Other,
}

impl MapFormat {
    /// By what the text begins with, whatever the file is called.
    pub fn of(text: &str) -> Self {
        let text = text.trim_start_matches('\u{feff}').trim_start();
        let at = |key: &str| text.find(key).unwrap_or(usize::MAX);
        if text.starts_with('<') {
            let roots = ["<railml", "<railML", "<infrastructure"]
                .into_iter()
                .map(at);
            match (at("<osm"), roots.min().unwrap_or(usize::MAX)) {
                (usize::MAX, usize::MAX) => Self::Other,
                (osm, railml) if osm < railml => Self::OsmXml,
                _ => Self::RailMl,
            }
        } else if text.starts_with('{') {
            match at("\"elements\"") < at("\"features\"") {
                true => Self::OsmJson,
                false => Self::GeoJson,
            }
        } else {
            Self::Other
        }
    }
}

/// The text of a map's file, whose name ends as those of maps do.
pub(super) fn read_map(path: &Path) -> Result<String, Failure> {
    const ENDINGS: [&str; 6] = ["geojson", "json", "osm", "xml", "railml", "railmlx"];
    let own = path
        .extension()
        .map(|ending| ending.to_string_lossy().to_lowercase());
    let ending = ENDINGS
        .into_iter()
        .find(|ending| own.as_deref() == Some(*ending));
    let limit = ReadLimit {
        ending: ending.unwrap_or("geojson"),
        ..ReadLimit::GEOJSON
    };
    read_as(path, limit)
}

/// OpenStreetMap in JSON or XML.
pub(super) fn read_osm(
    path: &Path,
    text: &str,
    around: Option<AroundPlace>,
) -> Result<OsmImport, Failure> {
    let import = match MapFormat::of(text) {
        MapFormat::OsmXml | MapFormat::RailMl | MapFormat::Other => {
            OsmImport::from_xml(text, around)
        }
        MapFormat::OsmJson | MapFormat::GeoJson => OsmImport::from_json(text, around),
    };
    import.map_err(|e| {
        refused(
            path,
            &e,
            "see `metrotwin import osm --help` for how to get such a file",
        )
    })
}

/// railML of any version that is read.
pub(super) fn read_railml_map(
    path: &Path,
    text: &str,
    options: &RailMlOptions,
) -> Result<ImportedMap, Failure> {
    read_railml(text, options).map_err(|e| {
        refused(
            path,
            &e,
            "see `metrotwin import railml --help` for what is read",
        )
    })
}

/// The network of a file of any kind, with where it is on the earth.
pub(super) fn read_network(path: &Path, crs: Option<Crs>) -> Result<(PlanNetwork, Datum), Failure> {
    let is_map = path
        .extension()
        .is_none_or(|ending| !ending.eq_ignore_ascii_case("toml"));
    let network = match is_map {
        true => of_map(path, &read_map(path)?, crs)?,
        false => {
            let text = read(path)?;
            if !matches!(FileKind::of(&text), FileKind::Tunnel) {
                return Err(Failure::input(
                    format!("{} is no tunnel file", path.display()),
                    "give a tunnel file, GeoJSON, OpenStreetMap or railML",
                ));
            }
            let tunnel = Tunnel::from_toml(&text).map_err(|e| Failure::file(path, &text, e))?;
            PlanNetwork::of_network(&tunnel.network, tunnel.datum)
        }
    };
    let datum = network.datum.ok_or_else(|| {
        Failure::input(
            format!("{} does not say where on the earth it is", path.display()),
            "a tunnel file needs a table [datum] with latitude_deg and longitude_deg of the world's origin, railML coordinates",
        )
    })?;
    Ok((network, datum))
}

fn of_map(path: &Path, text: &str, crs: Option<Crs>) -> Result<PlanNetwork, Failure> {
    match MapFormat::of(text) {
        MapFormat::OsmJson | MapFormat::OsmXml => Ok(read_osm(path, text, None)?.map.network),
        MapFormat::RailMl => Ok(read_railml_map(path, text, &RailMlOptions { crs })?.network),
        MapFormat::GeoJson => PlanNetwork::from_geojson(text).map_err(|e| {
            refused(
                path,
                &e,
                "see `metrotwin locate --help` for what a network in JSON holds",
            )
        }),
        MapFormat::Other => Err(refused(
            path,
            &"it is neither GeoJSON nor a map of OpenStreetMap nor railML",
            "see `metrotwin locate --help`",
        )),
    }
}

/// A file that cannot be used.
pub(super) fn refused(path: &Path, error: &dyn Display, remedy: &str) -> Failure {
    Failure::input(
        format!("{} cannot be used: {error}", path.display()),
        remedy,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_known_by_their_text() {
        for (text, format) in [
            ("{ \"elements\": [] }", MapFormat::OsmJson),
            (
                "\u{feff} { \"type\": \"FeatureCollection\", \"features\": [] }",
                MapFormat::GeoJson,
            ),
            (
                "<?xml version='1.0'?>\n<osm version='0.6'>",
                MapFormat::OsmXml,
            ),
            (
                "<?xml version='1.0'?><railML version='3.2'>",
                MapFormat::RailMl,
            ),
            ("<infrastructure version='2.3'>", MapFormat::RailMl),
            (
                "<railml version='2.2'><!-- from <osm> -->",
                MapFormat::RailMl,
            ),
            ("<svg>", MapFormat::Other),
            ("name = 'a'", MapFormat::Other),
        ] {
            assert_eq!(MapFormat::of(text), format, "{text}");
        }
    }
}
