//! The air and the balises: how a wayside device's message reaches a train.
//!
//! By radio every message takes `latency_ms` and is lost with probability `loss` (drawn for
//! every message from the stream `radio`), or surely while an outage lasts or no base station
//! reaches the train. A balise keeps the last message written to it and gives it to a train whose
//! antenna passes over it.

use crate::bus::{Delivery, ObstacleWarning, SimTime, TrainReport, Via};
use crate::settings::{Checker, settings};
use crate::track::BaseStation;
use crate::twin::random::Stream;
use std::collections::{BTreeMap, VecDeque};

settings! {
    /// A stretch of time without radio.
    #[derive(Copy)]
    pub struct Outage {
        /// Begins, seconds after the scenario's start.
        from_s: f64;
        /// Ends.
        to_s: f64;
    }
    also check_order
}

impl Outage {
    fn check_order(&self, check: &mut Checker<'_>) {
        if self.from_s.is_nan() || self.to_s.is_nan() || self.from_s >= self.to_s {
            check.problem(
                "to_s",
                format!(
                    "ends at {} s, before it begins at {} s",
                    self.to_s, self.from_s
                ),
                "give from_s < to_s",
            );
        }
    }
}

settings! {
    /// The radio link from wayside device to train (GSM-R class).
    pub struct RadioSettings {
        /// From sending to reception, milliseconds (IEEE 1474.1: 500 to 2000).
        latency_ms: f64 = 500.0;
        /// Probability that a message is lost, 0 to 1.
        loss: f64 = 0.0, in 0.0..=1.0;
        /// Times without any radio. Default: none.
        outages: Vec<Outage> = Vec::new(), nested;
    }
    also check_latency
}

impl RadioSettings {
    fn check_latency(&self, check: &mut Checker<'_>) {
        if !(self.latency_ms >= 0.0 && self.latency_ms.is_finite()) {
            check.problem(
                "latency_ms",
                format!("{} ms cannot be a latency", self.latency_ms),
                "give 0 or more milliseconds",
            );
        }
    }
}

/// A train that has not reported for this long may be anywhere.
const REPORT_LIFE_S: f64 = 5.0;

/// Messages on their way.
#[derive(Clone, Debug)]
pub struct Comms {
    settings: RadioSettings,
    stations: Vec<BaseStation>,
    stream: Stream,
    sent: u64,
    in_the_air: VecDeque<Delivery>,
    /// Reports of the train to the devices, with their times of arrival.
    reports: VecDeque<(SimTime, TrainReport)>,
    stored: BTreeMap<String, ObstacleWarning>,
}

impl Comms {
    /// An empty air. `stream` draws the losses.
    pub fn new(settings: &RadioSettings, stations: &[BaseStation], stream: Stream) -> Self {
        Self {
            settings: settings.clone(),
            stations: stations.to_vec(),
            stream,
            sent: 0,
            in_the_air: VecDeque::new(),
            reports: VecDeque::new(),
            stored: BTreeMap::new(),
        }
    }

    /// A device sends a message: it is written to its balise and goes on the air.
    pub fn send(&mut self, now: SimTime, balise: &str, warning: ObstacleWarning) {
        self.stored.insert(balise.to_owned(), warning.clone());
        if self.lost(now) {
            return;
        }
        self.in_the_air.push_back(Delivery {
            received: now.plus(self.settings.latency_ms * 1e-3),
            via: Via::Radio,
            warning,
        });
    }

    /// A train at `chainage_m` tells the devices where it takes itself to be.
    pub fn report_train(&mut self, now: SimTime, chainage_m: f64, report: TrainReport) {
        if !self.lost(now) && self.covered(chainage_m) {
            let arrival = now.plus(self.settings.latency_ms * 1e-3);
            self.reports.push_back((arrival, report));
        }
    }

    /// The last report that has arrived, while it is younger than 5 s.
    pub fn train_report(&mut self, now: SimTime) -> Option<TrainReport> {
        while self.reports.get(1).is_some_and(|next| next.0 <= now) {
            self.reports.pop_front();
        }
        let (arrival, report) = *self.reports.front()?;
        (arrival <= now && now.since(report.time) <= REPORT_LIFE_S).then_some(report)
    }

    fn lost(&mut self, now: SimTime) -> bool {
        let lost = self.stream.uniform(self.sent) < self.settings.loss;
        self.sent += 1;
        let out = |o: &Outage| (o.from_s..o.to_s).contains(&now.secs());
        lost || self.settings.outages.iter().any(out)
    }

    fn covered(&self, chainage_m: f64) -> bool {
        let reached = |b: &BaseStation| (b.chainage_m - chainage_m).abs() <= b.reach_m;
        self.stations.iter().any(reached)
    }

    /// The next message that has arrived by radio at a train at `chainage_m`.
    pub fn receive(&mut self, now: SimTime, chainage_m: f64) -> Option<Delivery> {
        while self.in_the_air.front().is_some_and(|d| d.received <= now) {
            let delivery = self.in_the_air.pop_front()?;
            if self.covered(chainage_m) {
                return Some(delivery);
            }
        }
        None
    }

    /// What a train reads that passes over `balise`.
    pub fn read_balise(&self, now: SimTime, balise: &str) -> Option<Delivery> {
        self.stored.get(balise).map(|warning| Delivery {
            received: now,
            via: Via::Balise,
            warning: warning.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::DangerLevel;

    fn comms(settings: RadioSettings) -> Comms {
        let station = BaseStation {
            name: "b".into(),
            chainage_m: 1000.0,
            reach_m: 500.0,
        };
        Comms::new(&settings, &[station], Stream::new(1, 0, "radio"))
    }

    fn warning(number: u32) -> ObstacleWarning {
        ObstacleWarning {
            device: "w".into(),
            number,
            issued: SimTime::ZERO,
            danger: DangerLevel::High,
            from_chainage_m: 10.0,
            to_chainage_m: 11.0,
            blind: false,
        }
    }

    /// A message that arrives early, or twice, shows here.
    #[test]
    fn radio_takes_its_latency() {
        let mut c = comms(RadioSettings::default());
        c.send(SimTime::from_secs(1.0), "b1", warning(1));
        assert_eq!(c.receive(SimTime::from_secs(1.499), 1000.0), None);
        let got = c.receive(SimTime::from_secs(1.5), 1000.0);
        assert_eq!(got.map(|d| d.warning.number), Some(1));
        assert_eq!(c.receive(SimTime::from_secs(9.0), 1000.0), None);
    }

    /// Losses at the wrong rate, outages that let messages through, and trains that hear a
    /// station out of reach.
    #[test]
    fn losses_outages_and_reach() {
        let mut c = comms(RadioSettings {
            loss: 0.3,
            ..RadioSettings::default()
        });
        (0..2000).for_each(|k| c.send(SimTime::ZERO, "b1", warning(k)));
        let mut got = 0;
        while c.receive(SimTime::from_secs(1.0), 1000.0).is_some() {
            got += 1;
        }
        // 2000 draws at 0.7: sigma 20.5.
        assert!((1318..1482).contains(&got), "{got} of 2000 arrived");

        let outages = vec![Outage {
            from_s: 0.0,
            to_s: 1.0,
        }];
        let mut c = comms(RadioSettings {
            outages,
            ..RadioSettings::default()
        });
        c.send(SimTime::ZERO, "b1", warning(1));
        assert_eq!(c.receive(SimTime::from_secs(2.0), 1000.0), None);
        c.send(SimTime::from_secs(1.5), "b1", warning(2));
        assert_eq!(c.receive(SimTime::from_secs(3.0), 1501.0), None);
        // The balise has the message all the same.
        assert!(
            c.read_balise(SimTime::ZERO, "b1")
                .is_some_and(|d| d.warning.number == 2)
        );
        assert!(c.read_balise(SimTime::ZERO, "b2").is_none());
    }
}
