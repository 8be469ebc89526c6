//! Track elements and relations from GeoJSON (RFC 7946), as exported from RailTopoModel data: a line string with an
//! `id` for each element; for each relation a feature with `netelementA`, `netelementB`, `positionOnA`, `positionOnB`
//! (0: first point, 1: last point) and `navigability`.

use super::{ElementEnd, PlanNetwork, TrackElement};
use crate::track::Direction;
use crate::track::geodesy::{Datum, Geodetic};
use nalgebra::Point2;
use serde_json::Value;
use std::collections::BTreeMap;

/// Ends that a relation joins may be so far apart.
const MOST_GAP_M: f64 = 2.0;

/// What is wrong with a GeoJSON file of track elements. Features count from 1.
#[derive(Debug, thiserror::Error)]
pub enum GeoJsonError {
    /// Not JSON at all.
    #[error("line {line}, column {column}: not JSON: {what}")]
    NotJson {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// By the parser.
        what: String,
    },
    /// Without elements.
    #[error(
        "no track elements: a FeatureCollection with a LineString and an `id` for each is needed"
    )]
    Empty,
    /// One feature is wrong.
    #[error("feature {number} ({id}): {what}")]
    Feature {
        /// From 1.
        number: usize,
        /// Its `id`, if it has one.
        id: String,
        /// And what would be right.
        what: String,
    },
}

impl PlanNetwork {
    /// Reads a file's text. The datum is the first point of the first element.
    pub fn from_geojson(text: &str) -> Result<Self, GeoJsonError> {
        let value: Value = serde_json::from_str(text).map_err(|e| GeoJsonError::NotJson {
            line: e.line(),
            column: e.column(),
            what: e.to_string(),
        })?;
        let features = value["features"].as_array().ok_or(GeoJsonError::Empty)?;
        let features: Vec<Feature<'_>> = features
            .iter()
            .zip(1..)
            .map(|(value, number)| Feature { value, number })
            .collect();
        let lines = || features.iter().filter(|f| f.shape() == Some("LineString"));
        let first = lines().next().ok_or(GeoJsonError::Empty)?;
        let place = *first
            .coordinates()?
            .first()
            .ok_or_else(|| first.fault("has no points"))?;
        let datum = Datum {
            place,
            heading_deg: 0.0,
        };
        let mut numbers = BTreeMap::new();
        let mut elements = Vec::new();
        for feature in lines() {
            let element = feature.element(&datum)?;
            if numbers.insert(element.id.clone(), elements.len()).is_some() {
                return Err(feature.fault("another element has the same id; ids must be unique"));
            }
            elements.push(element);
        }
        let relations = features.iter().filter(|f| f.is_relation());
        let joints = relations.filter_map(|f| f.joint(&elements, &numbers).transpose());
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        Ok(Self::new(Some(datum), elements, &joints))
    }
}

/// A feature of the file, and its number from 1.
struct Feature<'a> {
    value: &'a Value,
    number: usize,
}

impl<'a> Feature<'a> {
    fn property(&self, key: &str) -> &'a Value {
        &self.value["properties"][key]
    }

    fn id(&self) -> Option<&'a str> {
        self.property("id").as_str()
    }

    fn shape(&self) -> Option<&'a str> {
        self.value["geometry"]["type"].as_str()
    }

    fn is_relation(&self) -> bool {
        self.property("netelementA") != &Value::Null
    }

    fn fault(&self, what: impl Into<String>) -> GeoJsonError {
        GeoJsonError::Feature {
            number: self.number,
            id: self.id().unwrap_or("without id").to_owned(),
            what: what.into(),
        }
    }

    fn coordinates(&self) -> Result<Vec<Geodetic>, GeoJsonError> {
        let points = self.value["geometry"]["coordinates"].as_array();
        let points = points.ok_or_else(|| self.fault("has no coordinates"))?;
        points.iter().map(|point| self.geodetic(point)).collect()
    }

    fn geodetic(&self, point: &Value) -> Result<Geodetic, GeoJsonError> {
        let (Some(longitude_deg), Some(latitude_deg)) = (point[0].as_f64(), point[1].as_f64())
        else {
            return Err(self.fault(format!("{point} is no point: [longitude, latitude] is")));
        };
        // The projection stretches without bound near the poles.
        if latitude_deg.abs() > 85.0 || longitude_deg.abs() > 180.0 {
            return Err(self.fault(format!(
                "[{longitude_deg}, {latitude_deg}] is not on any railway: the order is longitude, latitude, in degrees"
            )));
        }
        Ok(Geodetic {
            latitude_deg,
            longitude_deg,
            height_m: 0.0,
        })
    }

    fn element(&self, datum: &Datum) -> Result<TrackElement, GeoJsonError> {
        let id = self
            .id()
            .ok_or_else(|| self.fault("a track element needs a property `id`"))?;
        let places = self.coordinates()?;
        let points: Vec<Point2<f64>> = places.iter().map(|place| datum.world(place).xy()).collect();
        TrackElement::new(id, points)
            .ok_or_else(|| self.fault("a track element needs two points that differ"))
    }

    /// The ends that it joins; none where trains do not run from one onto the other.
    fn joint(
        &self,
        elements: &[TrackElement],
        numbers: &BTreeMap<String, usize>,
    ) -> Result<Option<(ElementEnd, ElementEnd)>, GeoJsonError> {
        let end = |element: &str, position: &str| {
            let id = self.property(element).as_str().unwrap_or_default();
            let element = *numbers.get(id).ok_or_else(|| {
                self.fault(format!(
                    "`{element}` is \"{id}\", which no track element has as its id"
                ))
            })?;
            let way = match self.property(position).as_f64() {
                Some(0.0) => Direction::Down,
                Some(1.0) => Direction::Up,
                _ => {
                    return Err(self.fault(format!(
                        "`{position}` is {}: 0 (first point) or 1 (last point) is needed",
                        self.property(position)
                    )));
                }
            };
            Ok(ElementEnd { element, way })
        };
        let a = end("netelementA", "positionOnA")?;
        let b = end("netelementB", "positionOnB")?;
        match self.property("navigability").as_str() {
            Some("none") => return Ok(None),
            // A train may go back the way that it came.
            Some("both" | "AB" | "BA") => {}
            _ => {
                return Err(self.fault(format!(
                    "`navigability` is {}: \"both\", \"AB\", \"BA\" or \"none\" is needed",
                    self.property("navigability")
                )));
            }
        }
        let [at_a, at_b] = [a, b].map(|end| elements[end.element].end(end.way));
        let gap_m = (at_a - at_b).norm();
        if gap_m > MOST_GAP_M {
            return Err(self.fault(format!(
                "joins ends that are {gap_m:.1} m apart, at most {MOST_GAP_M} m are allowed: are the positions swapped?"
            )));
        }
        Ok(Some((a, b)))
    }
}

impl TrackElement {
    fn end(&self, way: Direction) -> Point2<f64> {
        match way {
            Direction::Down => self.points[0],
            Direction::Up => self.points[self.points.len() - 1],
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const SWITCH: &str = r#"{ "type": "FeatureCollection", "features": [
        { "type": "Feature", "properties": { "id": "stem" }, "geometry": { "type": "LineString",
            "coordinates": [[4.48, 50.9], [4.481, 50.9]] } },
        { "type": "Feature", "properties": { "id": "leg" }, "geometry": { "type": "LineString",
            "coordinates": [[4.482, 50.9001], [4.481, 50.9]] } },
        { "type": "Feature", "properties": { "id": "r", "netelementA": "stem", "netelementB": "leg",
            "positionOnA": 1, "positionOnB": 1, "navigability": "both" },
            "geometry": { "type": "Point", "coordinates": [4.481, 50.9] } }
    ] }"#;

    #[test]
    fn elements_are_joined_at_their_ends() {
        let network = PlanNetwork::from_geojson(SWITCH).unwrap();
        let end = |element, way| ElementEnd { element, way };
        assert_eq!(
            network.onward(end(0, Direction::Up)),
            [end(1, Direction::Down)]
        );
        assert_eq!(
            network.onward(end(1, Direction::Up)),
            [end(0, Direction::Down)]
        );
        assert!(network.onward(end(1, Direction::Down)).is_empty());
        // A degree of longitude at this latitude, after the ellipsoid's radius of curvature.
        let east_m = 0.001 * 70_321.0;
        assert!((network.elements[0].length_m() - east_m).abs() < 0.1);
    }

    /// Fails where a wrong file passes, or the message does not name the feature.
    #[test]
    fn what_is_wrong_is_named() {
        for (from, to, told) in [
            ("\"id\": \"leg\"", "\"id\": \"stem\"", "feature 2 (stem)"),
            (
                "\"id\": \"leg\"",
                "\"name\": \"leg\"",
                "feature 2 (without id)",
            ),
            (
                "\"netelementB\": \"leg\"",
                "\"netelementB\": \"log\"",
                "feature 3 (r): `netelementB` is \"log\"",
            ),
            ("\"positionOnB\": 1", "\"positionOnB\": 0", "apart"),
            (
                "\"positionOnA\": 1",
                "\"positionOnA\": 0.5",
                "`positionOnA` is 0.5",
            ),
            ("\"both\"", "\"sometimes\"", "`navigability`"),
            ("[4.48, 50.9]", "[4.48, 150.9]", "longitude, latitude"),
            ("[4.48, 50.9], ", "", "two points"),
            ("LineString", "MultiPoint", "feature 3"),
            ("] }", "", "line "),
        ] {
            let text = SWITCH.replacen(from, to, 1);
            let error = PlanNetwork::from_geojson(&text).unwrap_err().to_string();
            assert!(error.contains(told), "{to}: {error}");
        }
        let empty = r#"{ "type": "FeatureCollection", "features": [] }"#;
        assert!(matches!(
            PlanNetwork::from_geojson(empty),
            Err(GeoJsonError::Empty)
        ));
    }
}
