//! What every piece of equipment does: take messages in, work, send messages.

use crate::bus::{Message, SimTime};

/// A piece of equipment on a train, in a wayside post or in the control centre.
///
/// It is handed every message that arrives at its node, in order, by [`on`](Self::on). Then, at
/// least a thousand times a second, [`cycle`](Self::cycle) lets it do what is due. It has no clock
/// but the times that it is given.
pub trait Equipment {
    /// Takes a message in. Most messages concern others.
    fn on(&mut self, message: &Message);

    /// Does what is due at `now`, and gives the messages that come of it.
    fn cycle(&mut self, now: SimTime) -> Vec<Message>;
}
