//! Elements of an XML file with their lines, and numbers that are numbers.

use super::RailMlError;
use crate::track::import::lines::LineEnds;
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::BTreeMap;

/// A larger file is refused: 20 times the largest that was seen.
const MOST_NODES: u32 = 4_000_000;
/// No number in a map of tracks is larger.
const LARGEST: f64 = 1e9;
/// Faster is no railway.
const MOST_SPEED_KMH: f64 = 1000.0;
/// Longer texts are cut in messages.
const MOST_CHARS: usize = 80;

/// A file's text without what stands before its first element and is no XML: a byte order mark, blank lines.
pub(super) struct Text<'a> {
    xml: &'a str,
    line_ends: LineEnds,
    /// Lines before the text.
    skipped: usize,
}

/// An element, with the file that it stands in.
#[derive(Clone, Copy)]
pub(super) struct Item<'a> {
    node: Node<'a, 'a>,
    text: &'a Text<'a>,
}

impl<'a> Text<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let xml = text.trim_start_matches(|c: char| c == '\u{feff}' || c.is_whitespace());
        let before = text.get(..text.len() - xml.len()).unwrap_or_default();
        let count = |text: &str| text.bytes().filter(|byte| *byte == b'\n').count();
        Self {
            xml,
            line_ends: LineEnds::of(xml),
            skipped: count(before),
        }
    }

    /// Declarations of document types are refused, so no entity is ever expanded.
    pub(super) fn parse(&self) -> Result<Document<'_>, RailMlError> {
        let options = ParsingOptions {
            nodes_limit: MOST_NODES,
            ..ParsingOptions::default()
        };
        Document::parse_with_options(self.xml, options).map_err(|e| {
            let at = e.pos();
            RailMlError::NotXml {
                line: at.row as usize + self.skipped,
                column: at.col as usize,
                what: short(&e.to_string()),
            }
        })
    }

    pub(super) fn root(&'a self, document: &'a Document<'a>) -> Item<'a> {
        Item {
            node: document.root_element(),
            text: self,
        }
    }

    fn line(&self, at: usize) -> usize {
        self.line_ends.line(at) + self.skipped
    }
}

impl<'a> Item<'a> {
    /// Without its namespace's prefix.
    pub(super) fn name(self) -> &'a str {
        self.node.tag_name().name()
    }

    pub(super) fn namespace(self) -> &'a str {
        self.node.tag_name().namespace().unwrap_or_default()
    }

    /// Of the file, from 1.
    pub(super) fn line(self) -> usize {
        self.text.line(self.node.range().start)
    }

    /// Its place among all nodes of the file.
    pub(super) fn number(self) -> usize {
        self.node.id().get_usize()
    }

    pub(super) fn attribute(self, key: &str) -> Option<&'a str> {
        self.node.attribute(key)
    }

    /// Its id, or its name where it has none.
    pub(super) fn id(self) -> Option<&'a str> {
        self.attribute("id").or_else(|| self.attribute("name"))
    }

    /// What a person calls it.
    pub(super) fn label(self) -> String {
        let of_child = self.child("name").and_then(|name| name.attribute("name"));
        let name = self.attribute("name").or(of_child).or_else(|| self.id());
        short(name.unwrap_or("without id"))
    }

    /// Its kind and id, for messages.
    pub(super) fn title(self) -> String {
        short(&format!("{} {}", self.name(), self.id_or_owner()))
    }

    /// Its id; without one, what it belongs to.
    pub(super) fn id_or_owner(self) -> String {
        let parent = self.node.parent_element();
        let text = match (self.id(), parent) {
            (Some(id), _) => id.to_owned(),
            (None, None) => "without id".to_owned(),
            (None, Some(parent)) => {
                let id = parent.attribute("id").or_else(|| parent.attribute("name"));
                format!(
                    "of {} {}",
                    parent.tag_name().name(),
                    id.unwrap_or("without id")
                )
            }
        };
        short(&text)
    }

    pub(super) fn needed(self, key: &str) -> Result<&'a str, RailMlError> {
        self.attribute(key)
            .ok_or_else(|| self.fault(format!("has no `{key}`")))
    }

    pub(super) fn value(self, key: &str) -> Result<Option<f64>, RailMlError> {
        let Some(text) = self.attribute(key) else {
            return Ok(None);
        };
        let value = text.trim().parse::<f64>().ok();
        match value.filter(|value| value.abs() <= LARGEST) {
            Some(value) => Ok(Some(value)),
            None => Err(self.fault(format!(
                "`{key}` is \"{}\": a number of at most {LARGEST:.0} is needed",
                short(text)
            ))),
        }
    }

    /// A speed, km/h.
    pub(super) fn speed_kmh(self, key: &str) -> Result<Option<f64>, RailMlError> {
        let speed_kmh = self.value(key)?;
        match speed_kmh.filter(|kmh| *kmh <= 0.0 || *kmh > MOST_SPEED_KMH) {
            None => Ok(speed_kmh),
            Some(kmh) => Err(self.fault(format!(
                "`{key}` is {kmh}: more than 0 and at most {MOST_SPEED_KMH} km/h are needed"
            ))),
        }
    }

    pub(super) fn needed_value(self, key: &str) -> Result<f64, RailMlError> {
        self.value(key)?
            .ok_or_else(|| self.fault(format!("has no `{key}`: a number is needed")))
    }

    /// Elements right inside it.
    pub(super) fn children(self) -> impl Iterator<Item = Item<'a>> {
        let inside = self.node.children().filter(Node::is_element);
        inside.map(move |node| Item { node, ..self })
    }

    pub(super) fn child(self, name: &str) -> Option<Item<'a>> {
        self.children().find(|item| item.name() == name)
    }

    /// Of this name, right inside it.
    pub(super) fn named(self, name: &str) -> impl Iterator<Item = Item<'a>> {
        self.children().filter(move |item| item.name() == name)
    }

    /// All elements inside it and itself, in the order of the file.
    pub(super) fn all(self) -> impl Iterator<Item = Item<'a>> {
        let inside = self.node.descendants().filter(Node::is_element);
        inside.map(move |node| Item { node, ..self })
    }

    /// Fails where two elements inside it have one id.
    pub(super) fn check_ids(self) -> Result<(), RailMlError> {
        let mut lines: BTreeMap<&str, usize> = BTreeMap::new();
        for item in self.all() {
            let Some(id) = item.attribute("id") else {
                continue;
            };
            if let Some(line) = lines.insert(id, item.line()) {
                return Err(item.fault(format!(
                    "has the id of an element on line {line}: ids must be unique"
                )));
            }
        }
        Ok(())
    }

    pub(super) fn fault(self, what: impl Into<String>) -> RailMlError {
        RailMlError::Element {
            line: self.line(),
            element: self.name().to_owned(),
            id: self.id_or_owner(),
            what: what.into(),
        }
    }
}

/// A text of the file as it may stand in a message: no longer, and without what would move a terminal's cursor.
pub(super) fn short(text: &str) -> String {
    let plain = |c: char| {
        if c.is_control() {
            char::REPLACEMENT_CHARACTER
        } else {
            c
        }
    };
    let mut cut: String = text.chars().take(MOST_CHARS).map(plain).collect();
    if text.chars().nth(MOST_CHARS).is_some() {
        cut.push_str("...");
    }
    cut
}
