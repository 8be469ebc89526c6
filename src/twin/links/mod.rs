//! Links between nodes: radio, wire, balises.
//!
//! What is sent on a node stays there; what is addressed to others goes by a link. Where a train
//! sends or receives it is the radio: every message takes its latency for each receiver, is lost with
//! a probability, or surely while an outage lasts or no base station reaches the train. Fixed nodes
//! are wired to each other. A balise keeps the last message written to it and gives it to a train
//! whose antenna passes over it.
//!
//! ```
//! use metrotwin::bus::{Content, Message, Node, Receiver, SimTime, TrainCommand, TrainId};
//! use metrotwin::track::{Place, Tunnel};
//! use metrotwin::twin::links::{Links, RadioSettings};
//! use metrotwin::twin::random::Stream;
//!
//! // With a base station at 500 m that reaches 600 m.
//! let tunnel = Tunnel::from_toml(include_str!("../../../tunnels/chengdu_line1.toml"))?;
//! let radio = Stream::new(1, 0, "radio");
//! let train = Node::Train(TrainId(0));
//! let nodes = vec![train.clone()];
//! let mut links = Links::new(&RadioSettings::default(), &tunnel.network, nodes, radio);
//! let head = |_| Some(Place::on_first_track(700.0));
//! let content = Content::Command(TrainCommand::default());
//! let now = SimTime::from_secs(1.0);
//! links.send(Message::to(Receiver::Node(train), Node::Control, now, content), head);
//! assert!(links.receive(now.plus(0.4), head).is_none());
//! assert!(links.receive(now.plus(0.5), head).is_some());
//! # Ok::<(), metrotwin::settings::FileError>(())
//! ```
//!
//! What it does not do: fields and antennas, handovers, bandwidth; a train is reached or it is not.

mod channel;
#[cfg(test)]
mod tests;

pub use channel::{Outage, RadioSettings};

use crate::bus::{Message, Node, Receiver, SimTime, TrainId, Via};
use crate::track::network::Network;
use crate::track::{BaseStation, Place, TrackId};
use crate::twin::random::Stream;
use channel::Channel;
use std::collections::BTreeMap;

/// All links of a scenario.
#[derive(Clone, Debug)]
pub struct Links {
    radio: Channel,
    wire: Channel,
    /// The tracks, and the base stations beside each.
    network: Network,
    stations: Vec<(TrackId, BaseStation)>,
    /// All nodes that have equipment.
    nodes: Vec<Node>,
    /// What each balise stores.
    stored: BTreeMap<String, Message>,
}

impl Links {
    /// Between `nodes`; `stream` says which messages the radio loses.
    pub fn new(radio: &RadioSettings, network: &Network, nodes: Vec<Node>, stream: Stream) -> Self {
        Self {
            radio: Channel::new(radio, stream),
            wire: Channel::new(&RadioSettings::wire(), stream),
            stations: stations(network),
            network: network.clone(),
            nodes,
            stored: BTreeMap::new(),
        }
    }

    /// Sends a message; `head` says where a train's head is now.
    pub fn send(&mut self, message: Message, head: impl Fn(TrainId) -> Option<Place>) {
        if let Receiver::Node(Node::Balise(name)) = &message.receiver {
            self.stored.insert(name.clone(), message);
            return;
        }
        for receiver in self.receivers(&message) {
            let copy = Message {
                receiver: Receiver::Node(receiver.clone()),
                ..message.clone()
            };
            if by_radio(&message.sender, &receiver) {
                let heard = self.reaches(&message.sender, &head);
                self.radio.send(copy, heard);
            } else {
                self.wire.send(copy, true);
            }
        }
    }

    /// The next message that has arrived by now at a node that can be reached.
    pub fn receive(
        &mut self,
        now: SimTime,
        head: impl Fn(TrainId) -> Option<Place>,
    ) -> Option<Message> {
        if let Some(message) = self.wire.receive(now) {
            return Some(message.arrived(now, Via::Wire));
        }
        while let Some(message) = self.radio.receive(now) {
            if let Receiver::Node(node) = &message.receiver
                && self.reaches(node, &head)
            {
                return Some(message.arrived(now, Via::Radio));
            }
        }
        None
    }

    /// What a train reads whose antenna passes over a balise.
    pub fn read_balise(&self, now: SimTime, name: &str, train: TrainId) -> Option<Message> {
        let message = self.stored.get(name)?.clone();
        let receiver = Receiver::Node(Node::Train(train));
        Some(
            Message {
                receiver,
                ..message
            }
            .arrived(now, Via::Balise),
        )
    }

    fn receivers(&self, message: &Message) -> Vec<Node> {
        let wanted = |node: &&Node| match &message.receiver {
            Receiver::Own => false,
            Receiver::Node(other) => *node == other,
            Receiver::Trains => matches!(node, Node::Train(_)),
            Receiver::Posts => matches!(node, Node::Post(_)),
            Receiver::All => true,
        };
        let others = self.nodes.iter().filter(|node| **node != message.sender);
        others.filter(wanted).cloned().collect()
    }

    /// Whether a node is within reach: a train where a base station is, all others always.
    fn reaches(&self, node: &Node, head: impl Fn(TrainId) -> Option<Place>) -> bool {
        let Node::Train(id) = node else {
            return true;
        };
        let head = head(*id);
        let covers = |(track, station): &(TrackId, BaseStation)| {
            head.is_some_and(|head| {
                let away_m = match head.track == *track {
                    true => Some((station.chainage_m - head.s_m).abs()),
                    false => self.apart_m(
                        head,
                        Place {
                            track: *track,
                            s_m: station.chainage_m,
                        },
                    ),
                };
                away_m.is_some_and(|away_m| away_m <= station.reach_m)
            })
        };
        self.stations.iter().any(covers)
    }

    /// Distance of two places in the world.
    fn apart_m(&self, a: Place, b: Place) -> Option<f64> {
        let at = |place: Place| {
            let line = self.network.alignment(place.track)?;
            Some(line.at(place.s_m).origin)
        };
        Some((at(a)? - at(b)?).norm())
    }
}

/// All base stations of a network.
fn stations(network: &Network) -> Vec<(TrackId, BaseStation)> {
    let tracks = (0u16..).zip(&network.tracks);
    let of = |(k, track): (u16, &std::sync::Arc<crate::track::Track>)| {
        let stations = track.base_stations.clone().into_iter();
        stations.map(move |station| (TrackId(k), station))
    };
    tracks.flat_map(of).collect()
}

fn by_radio(sender: &Node, receiver: &Node) -> bool {
    let moves = |node: &Node| matches!(node, Node::Train(_));
    moves(sender) || moves(receiver)
}
