//! Nodes and ways of OpenStreetMap, from raw JSON as the Overpass API gives it (`out body` with the nodes), or from XML
//! as the map's editors and its own interface have it.

use super::OsmError;
use crate::track::import::lines::LineEnds;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A point.
#[derive(Clone, Debug, Default)]
pub(super) struct OsmNode {
    pub latitude_deg: f64,
    pub longitude_deg: f64,
    pub tags: BTreeMap<String, String>,
    /// Line of the file, from 1; 0 in JSON.
    pub line: usize,
}

/// A line through nodes.
#[derive(Clone, Debug)]
pub(super) struct OsmWay {
    pub id: i64,
    pub nodes: Vec<i64>,
    pub tags: BTreeMap<String, String>,
    /// Line of the file, from 1; 0 in JSON.
    pub line: usize,
}

/// All of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct OsmData {
    pub nodes: BTreeMap<i64, OsmNode>,
    pub ways: Vec<OsmWay>,
}

#[derive(Deserialize)]
struct File {
    elements: Vec<Element>,
}

#[derive(Deserialize)]
struct Element {
    #[serde(rename = "type")]
    kind: String,
    id: i64,
    lat: Option<f64>,
    lon: Option<f64>,
    #[serde(default)]
    nodes: Vec<i64>,
    #[serde(default)]
    tags: BTreeMap<String, String>,
}

impl OsmData {
    pub fn from_json(text: &str) -> Result<Self, OsmError> {
        let file: File = serde_json::from_str(text).map_err(|e| OsmError::NotJson {
            line: e.line(),
            column: e.column(),
            what: e.to_string(),
        })?;
        let mut data = Self::default();
        for element in file.elements {
            match &*element.kind {
                "node" => {
                    let node = OsmNode {
                        latitude_deg: element.lat.unwrap_or(f64::NAN),
                        longitude_deg: element.lon.unwrap_or(f64::NAN),
                        tags: element.tags,
                        line: 0,
                    };
                    data.nodes.insert(element.id, node);
                }
                "way" => data.ways.push(OsmWay {
                    id: element.id,
                    nodes: element.nodes,
                    tags: element.tags,
                    line: 0,
                }),
                _ => {}
            }
        }
        Ok(data)
    }

    pub fn from_xml(text: &str) -> Result<Self, OsmError> {
        let document = roxmltree::Document::parse(text).map_err(|e| OsmError::NotXml {
            line: e.pos().row as usize,
            column: e.pos().col as usize,
            what: e.to_string(),
        })?;
        let root = document.root_element();
        if root.tag_name().name() != "osm" {
            let name = root.tag_name().name().to_owned();
            return Err(OsmError::OtherXml { name });
        }
        let lines = LineEnds::of(text);
        let mut data = Self::default();
        // What an editor has deleted is still in its file.
        let is_there = |e: &roxmltree::Node<'_, '_>| {
            e.is_element()
                && e.attribute("action") != Some("delete")
                && e.attribute("visible") != Some("false")
        };
        for element in root.children().filter(is_there) {
            let reader = Reader {
                element,
                line: lines.line(element.range().start),
            };
            match element.tag_name().name() {
                "node" => {
                    let node = OsmNode {
                        latitude_deg: reader.number("lat")?,
                        longitude_deg: reader.number("lon")?,
                        tags: reader.tags(),
                        line: reader.line,
                    };
                    data.nodes.insert(reader.number("id")?, node);
                }
                "way" => data.ways.push(OsmWay {
                    id: reader.number("id")?,
                    nodes: reader.nodes(&lines)?,
                    tags: reader.tags(),
                    line: reader.line,
                }),
                _ => {}
            }
        }
        Ok(data)
    }
}

/// An element, and its line.
struct Reader<'a, 'i> {
    element: roxmltree::Node<'a, 'i>,
    line: usize,
}

impl Reader<'_, '_> {
    fn number<N: std::str::FromStr>(&self, key: &'static str) -> Result<N, OsmError> {
        let given = self.element.attribute(key);
        let number = given.and_then(|text| text.trim().parse().ok());
        number.ok_or_else(|| OsmError::Attribute {
            line: self.line,
            element: self.element.tag_name().name().to_owned(),
            key,
            given: given.map_or("missing".to_owned(), |text| {
                let start: String = text.chars().take(40).collect();
                format!("\"{start}\"")
            }),
        })
    }

    fn nodes(&self, lines: &LineEnds) -> Result<Vec<i64>, OsmError> {
        let children = self.element.children().filter(|e| e.has_tag_name("nd"));
        let nodes = children.map(|element| {
            let line = lines.line(element.range().start);
            Reader { element, line }.number("ref")
        });
        nodes.collect()
    }

    fn tags(&self) -> BTreeMap<String, String> {
        let children = self.element.children().filter(|e| e.has_tag_name("tag"));
        let tags = children.filter_map(|tag| {
            Some((
                tag.attribute("k")?.to_owned(),
                tag.attribute("v")?.to_owned(),
            ))
        });
        tags.collect()
    }
}
