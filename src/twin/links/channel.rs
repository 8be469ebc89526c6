//! One way for messages: they take time, are lost, and come in order or not.

use crate::bus::{Message, SimTime};
use crate::track::{Checker, Problem};
use crate::twin::random::Stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A stretch of time without radio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outage {
    /// Begins, seconds after the scenario's start.
    pub from_s: f64,
    /// Ends.
    pub to_s: f64,
}

/// The radio between trains, wayside devices and control centre (GSM-R class).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RadioSettings {
    /// From sending to reception, milliseconds (IEEE 1474.1: 500 to 2000). Default 500.
    pub latency_ms: f64,
    /// A message may take longer by up to this, milliseconds, drawn evenly for each. Default 0.
    pub jitter_ms: f64,
    /// Messages of one sender to one receiver arrive in the order in which they were sent. Default
    /// true.
    pub in_order: bool,
    /// Probability that a message is lost, 0 to 1. Default 0.
    pub loss: f64,
    /// Times without any radio. Default none.
    pub outages: Vec<Outage>,
}

impl Default for RadioSettings {
    fn default() -> Self {
        Self {
            latency_ms: 500.0,
            jitter_ms: 0.0,
            in_order: true,
            loss: 0.0,
            outages: Vec::new(),
        }
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

    /// Appends what is wrong, with keys below `at`.
    pub fn check(&self, at: &str, problems: &mut Vec<Problem>) {
        if !(self.latency_ms >= 0.0 && self.latency_ms.is_finite()) {
            problems.push(Problem::new(
                format!("{at}.latency_ms"),
                format!("{} ms cannot be a latency", self.latency_ms),
                "give 0 or more milliseconds",
            ));
        }
        let mut check = Checker::new(at, problems);
        check.within("jitter_ms", self.jitter_ms, 0.0..=60_000.0, "ms");
        check.within("loss", self.loss, 0.0..=1.0, "");
        for (k, outage) in self.outages.iter().enumerate() {
            if outage.from_s.is_nan() || outage.to_s.is_nan() || outage.from_s >= outage.to_s {
                problems.push(Problem::new(
                    format!("{at}.outages[{k}]"),
                    format!(
                        "ends at {} s, before it begins at {} s",
                        outage.to_s, outage.from_s
                    ),
                    "give from_s < to_s",
                ));
            }
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
