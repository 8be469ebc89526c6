//! One way for messages: they take time, are lost, and come in order or not.

use crate::bus::{Message, SimTime};
use crate::settings::{Checker, settings};
use crate::twin::random::Stream;
use std::collections::BTreeMap;

settings! {
    /// A stretch of time without radio.
    #[derive(Copy)]
    pub struct Outage {
        /// Begins, seconds after the scenario's start.
        from_s: f64, in -1e6..=1e6;
        /// Ends.
        to_s: f64, in -1e6..=1e6;
    }
    also check_order
}

impl Outage {
    fn check_order(&self, check: &mut Checker<'_>) {
        if self.from_s.is_finite() {
            check.within("to_s", self.to_s, self.from_s + 1e-3..=f64::INFINITY);
        }
    }
}

settings! {
    /// The radio between trains, wayside devices and control centre (GSM-R class).
    pub struct RadioSettings {
        /// From sending to reception, milliseconds (IEEE 1474.1: 500 to 2000).
        latency_ms: f64 = 500.0, in 0.0..=600_000.0;
        /// A message may take longer by up to this, milliseconds, drawn evenly for each.
        jitter_ms: f64 = 0.0, in 0.0..=60_000.0;
        /// Messages of one sender to one receiver arrive in the order in which they were sent.
        in_order: bool = true;
        /// Probability that a message is lost, 0 to 1.
        loss: f64 = 0.0, in 0.0..=1.0;
        /// Times without any radio. Default: none.
        outages: Vec<Outage> = Vec::new(), nested;
    }
}

impl RadioSettings {
    /// What a wire does: nothing is lost or late.
    pub(super) fn wire() -> Self {
        Self {
            latency_ms: 0.0,
            ..Self::default()
        }
    }
}

/// Messages under way.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    settings: RadioSettings,
    stream: Stream,
    sent: u64,
    /// By arrival, and then by order of sending.
    under_way: BTreeMap<(SimTime, u64), Message>,
}

impl Channel {
    pub fn new(settings: &RadioSettings, stream: Stream) -> Self {
        Self {
            settings: settings.clone(),
            stream,
            sent: 0,
            under_way: BTreeMap::new(),
        }
    }

    /// Sends a message to its one receiver; it is lost where the sender is not `heard`. Whether it is
    /// lost on the way does not depend on that.
    pub fn send(&mut self, message: Message, heard: bool) {
        let number = self.sent;
        self.sent += 1;
        let lost = self.stream.uniform(number) < self.settings.loss;
        if lost || !heard || self.is_out(message.sent_at) {
            return;
        }
        let late_ms = self.settings.jitter_ms
            * self.stream.words(number as u32, u32::MAX)[0] as f64
            / f64::from(u32::MAX);
        let mut arrival = message
            .sent_at
            .plus(1e-3 * (self.settings.latency_ms + late_ms));
        if self.settings.in_order {
            let same_way = |other: &&Message| {
                (&other.sender, &other.receiver) == (&message.sender, &message.receiver)
            };
            let before = self.under_way.iter().rev();
            let before = before.map(|((at, _), other)| (at, other));
            if let Some((at, _)) = before.into_iter().find(|(_, other)| same_way(other)) {
                arrival = arrival.max(*at);
            }
        }
        self.under_way.insert((arrival, number), message);
    }

    /// The next message that has arrived by now.
    pub fn receive(&mut self, now: SimTime) -> Option<Message> {
        let first = self.under_way.first_entry()?;
        (first.key().0 <= now).then(|| first.remove())
    }

    fn is_out(&self, now: SimTime) -> bool {
        let out = |o: &Outage| (o.from_s..o.to_s).contains(&now.secs());
        self.settings.outages.iter().any(out)
    }
}
