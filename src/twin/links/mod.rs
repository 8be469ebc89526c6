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
//! use metrotwin::track::BaseStation;
//! use metrotwin::twin::links::{Links, RadioSettings};
//! use metrotwin::twin::random::Stream;
//!
//! let station = BaseStation { name: "b".into(), chainage_m: 1000.0, reach_m: 500.0 };
//! let radio = Stream::new(1, 0, "radio");
//! let train = Node::Train(TrainId(0));
//! let mut links = Links::new(&RadioSettings::default(), &[station], vec![train.clone()], radio);
//! let head_m = |_| Some(1200.0);
//! let content = Content::Command(TrainCommand::default());
//! let now = SimTime::from_secs(1.0);
//! links.send(Message::to(Receiver::Node(train), Node::Control, now, content), head_m);
//! assert!(links.receive(now.plus(0.4), head_m).is_none());
//! assert!(links.receive(now.plus(0.5), head_m).is_some());
//! ```
//!
//! What it does not do: fields and antennas, handovers, bandwidth; a train is reached or it is not.

mod channel;
#[cfg(test)]
mod tests;

pub use channel::{Outage, RadioSettings};

use crate::bus::{Message, Node, Receiver, SimTime, TrainId, Via};
use crate::track::BaseStation;
use crate::twin::random::Stream;
use channel::Channel;
use std::collections::BTreeMap;

/// All links of a scenario.
#[derive(Clone, Debug)]
pub struct Links {
    radio: Channel,
    wire: Channel,
    stations: Vec<BaseStation>,
    /// All nodes that have equipment.
    nodes: Vec<Node>,
    /// What each balise stores.
    stored: BTreeMap<String, Message>,
}

impl Links {
    /// Between `nodes`; `stream` says which messages the radio loses.
    pub fn new(
        radio: &RadioSettings,
        stations: &[BaseStation],
        nodes: Vec<Node>,
        stream: Stream,
    ) -> Self {
        Self {
            radio: Channel::new(radio, stream),
            wire: Channel::new(&RadioSettings::wire(), stream),
            stations: stations.to_vec(),
            nodes,
            stored: BTreeMap::new(),
        }
    }

    /// Sends a message; `head_m` says where a train's head is now.
    pub fn send(&mut self, message: Message, head_m: impl Fn(TrainId) -> Option<f64>) {
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
                let heard = self.reaches(&message.sender, &head_m);
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
        head_m: impl Fn(TrainId) -> Option<f64>,
    ) -> Option<Message> {
        if let Some(message) = self.wire.receive(now) {
            return Some(message.arrived(now, Via::Wire));
        }
        while let Some(message) = self.radio.receive(now) {
            if let Receiver::Node(node) = &message.receiver
                && self.reaches(node, &head_m)
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
    fn reaches(&self, node: &Node, head_m: impl Fn(TrainId) -> Option<f64>) -> bool {
        let Node::Train(id) = node else {
            return true;
        };
        let head_m = head_m(*id);
        let covers = |station: &BaseStation| {
            head_m.is_some_and(|s_m| (station.chainage_m - s_m).abs() <= station.reach_m)
        };
        self.stations.iter().any(covers)
    }
}

fn by_radio(sender: &Node, receiver: &Node) -> bool {
    let moves = |node: &Node| matches!(node, Node::Train(_));
    moves(sender) || moves(receiver)
}
