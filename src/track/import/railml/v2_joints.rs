//! How tracks of railML 2.x are joined, by connections that name each other.

use super::RailMlError;
use super::draft::{CutEnd, Draft, DraftSwitch, DraftTrack};
use super::report::Fates;
use super::stated::SAME_M;
use super::xml::{Item, short};
use crate::track::Direction;
use std::collections::BTreeMap;

/// Where a connection is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum At {
    Begin,
    End,
    Switch { at_m: f64 },
}

/// A connection.
pub(super) struct Connection<'a> {
    pub(super) item: Item<'a>,
    pub(super) to: &'a str,
    pub(super) track: usize,
    pub(super) at: At,
    /// The switch or crossing that it is of.
    pub(super) of: Option<Item<'a>>,
}

/// What has been joined so far.
struct Joining<'d, 'a> {
    draft: &'d mut Draft<'a>,
    /// One of the ends that each end is joined to.
    joined: BTreeMap<CutEnd, CutEnd>,
}

/// A way off a track, at a switch or crossing of it.
#[derive(Clone, Copy)]
struct Branch<'l, 'a> {
    link: &'l Connection<'a>,
    node: Item<'a>,
    leg: CutEnd,
}

/// Joins tracks by their connections.
pub(super) fn join<'a>(
    draft: &mut Draft<'a>,
    links: &[Connection<'a>],
    fates: &mut Fates,
) -> Result<(), RailMlError> {
    let ids = links
        .iter()
        .enumerate()
        .filter_map(|(k, link)| Some((link.item.attribute("id")?, k)));
    let ids: BTreeMap<&str, usize> = ids.collect();
    let mut joining = Joining {
        draft,
        joined: BTreeMap::new(),
    };
    let mut crossings: BTreeMap<usize, Vec<Branch<'_, 'a>>> = BTreeMap::new();
    let mut switches = Vec::new();
    for (number, link) in links.iter().enumerate() {
        let (partner, other) = partner(links, &ids, link)?;
        fates.take(link.item);
        match (link.of, other.of) {
            (Some(_), Some(_)) => {
                return Err(link
                    .item
                    .fault("connects two switches: a track between them is needed"));
            }
            (None, None) if number < partner => {
                let ends = (joining.end(link), joining.end(other));
                joining.join(ends.0, ends.1);
            }
            (Some(node), None) => {
                let leg = joining.end(other);
                let branch = Branch { link, node, leg };
                match node.name() {
                    "crossing" => crossings.entry(node.number()).or_default().push(branch),
                    _ => switches.push(branch),
                }
            }
            _ => {}
        }
    }
    // First the switches inside tracks: those at ends of tracks are joined over them.
    switches.sort_by_cached_key(|branch| !matches!(joining.sides(branch.link), (Some(_), Some(_))));
    for branch in switches {
        let switch = joining.switch(&branch)?;
        joining.join(switch.toe, branch.leg);
        fates.take(branch.node);
        joining.draft.switches.push(switch);
    }
    for branches in crossings.into_values() {
        joining.cross(&branches, fates)?;
    }
    Ok(())
}

/// The connection that a connection names, which must name it too.
fn partner<'l, 'a>(
    links: &'l [Connection<'a>],
    ids: &BTreeMap<&str, usize>,
    link: &Connection<'_>,
) -> Result<(usize, &'l Connection<'a>), RailMlError> {
    let to = short(link.to);
    let found = ids.get(link.to).and_then(|k| Some((*k, links.get(*k)?)));
    let Some((number, other)) = found else {
        return Err(link.item.fault(format!(
            "`ref` is \"{to}\", which no connection has as its `id`"
        )));
    };
    let own = link.item.attribute("id").unwrap_or_default();
    if own == link.to {
        return Err(link
            .item
            .fault("`ref` is its own `id`: the connection of another track is needed"));
    }
    if other.to != own {
        return Err(link.item.fault(format!(
            "`ref` is \"{to}\", but that one (line {}) refers to \"{}\": the two must refer to each other",
            other.item.line(),
            short(other.to)
        )));
    }
    Ok((number, other))
}

impl Joining<'_, '_> {
    fn join(&mut self, a: CutEnd, b: CutEnd) {
        self.draft.joints.push((a, b));
        self.joined.insert(a, b);
        self.joined.insert(b, a);
    }

    /// The end of a track at which a connection is.
    fn end(&self, link: &Connection<'_>) -> CutEnd {
        let pieces = self
            .draft
            .tracks
            .get(link.track)
            .map_or(1, DraftTrack::pieces);
        let (piece, way) = match link.at {
            At::End => (pieces - 1, Direction::Up),
            _ => (0, Direction::Down),
        };
        CutEnd {
            track: link.track,
            piece,
            way,
        }
    }

    /// Ends of pieces before and after the place of a switch; at an end of its track, those that are joined to it.
    fn sides(&self, link: &Connection<'_>) -> (Option<CutEnd>, Option<CutEnd>) {
        let (At::Switch { at_m }, Some(track)) = (link.at, self.draft.tracks.get(link.track))
        else {
            return (None, None);
        };
        let piece = track.cuts.partition_point(|cut| *cut <= at_m + SAME_M);
        let joined = |end: CutEnd| self.joined.get(&end).copied();
        let of = |piece, way| CutEnd {
            track: link.track,
            piece,
            way,
        };
        let last = track.pieces() - 1;
        if at_m < SAME_M {
            (joined(of(0, Direction::Down)), Some(of(0, Direction::Down)))
        } else if at_m > track.length_m - SAME_M {
            (
                Some(of(last, Direction::Up)),
                joined(of(last, Direction::Up)),
            )
        } else {
            (
                piece.checked_sub(1).map(|k| of(k, Direction::Up)),
                Some(of(piece, Direction::Down)),
            )
        }
    }

    fn switch(&self, branch: &Branch<'_, '_>) -> Result<DraftSwitch, RailMlError> {
        let Branch { link, node, leg } = *branch;
        let outgoing = is_outgoing(link.item)?;
        let (Some(before), Some(after)) = self.sides(link) else {
            return Err(node.fault(
                "lies at an end of its track that is joined to no other: it has one leg alone",
            ));
        };
        let (toe, own) = if outgoing {
            (before, after)
        } else {
            (after, before)
        };
        let course =
            link.item
                .attribute("course")
                .or_else(|| match node.attribute("trackContinueCourse") {
                    Some("left") => Some("right"),
                    Some("right") => Some("left"),
                    other => other,
                });
        let own_course = node.attribute("trackContinueCourse").unwrap_or("straight");
        let (through, diverging, diverges_left) = match (course, own_course) {
            (Some("left"), _) => (own, leg, true),
            (Some("right"), _) => (own, leg, false),
            // The track itself turns off.
            (Some("straight"), "left") => (leg, own, true),
            (Some("straight"), "right") => (leg, own, false),
            _ => {
                return Err(link.item.fault(format!(
                    "nothing tells on which side it leaves its switch: `course` is \"{}\", \"left\" or \"right\" is needed, or `trackContinueCourse` at the switch with \"straight\"",
                    short(course.unwrap_or_default())
                )));
            }
        };
        let speed = link
            .item
            .speed_kmh("maxSpeed")?
            .filter(|_| diverging == leg);
        Ok(DraftSwitch {
            name: node.label(),
            line: node.line(),
            toe,
            through,
            diverging,
            diverging_kmh: speed,
            diverges_left,
        })
    }

    /// A crossing: the tracks that meet there go on straight, and over a double slip from each to both others.
    fn cross(&mut self, branches: &[Branch<'_, '_>], fates: &mut Fates) -> Result<(), RailMlError> {
        let Some(Branch { link, node, .. }) = branches.first() else {
            return Ok(());
        };
        let (mut comes, mut leaves) = (Vec::new(), Vec::new());
        for branch in branches {
            let side = if is_outgoing(branch.link.item)? {
                &mut leaves
            } else {
                &mut comes
            };
            side.push(branch.leg);
        }
        let ([comes], [leaves]) = (comes.as_slice(), leaves.as_slice()) else {
            return Err(node.fault("needs two connections, one \"incoming\" and one \"outgoing\", to the track that crosses"));
        };
        self.join(*comes, *leaves);
        match (node.attribute("type"), self.sides(link)) {
            (Some("doubleSwitchCrossing"), (Some(before), Some(after))) => {
                self.join(*comes, after);
                self.join(before, *leaves);
                fates.take(*node);
            }
            (Some("simpleSwitchCrossing"), _) => {
                fates.leave(*node, "a single slip does not say between which tracks it leads: it is a crossing here");
            }
            _ => fates.take(*node),
        }
        Ok(())
    }
}

fn is_outgoing(item: Item<'_>) -> Result<bool, RailMlError> {
    match item.attribute("orientation") {
        Some("outgoing") => Ok(true),
        Some("incoming") => Ok(false),
        other => Err(item.fault(format!(
            "`orientation` is \"{}\": \"outgoing\" (the other track leaves towards growing `pos`) or \"incoming\" is needed",
            short(other.unwrap_or_default())
        ))),
    }
}
