//! Latency, loss, outages, reach, order, balises.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::bus::{Content, DangerLevel, ObstacleWarning};
use crate::track::{Alignment, PlanElement, Track};
use nalgebra::Point3;

fn links(settings: RadioSettings) -> Links {
    let station = BaseStation {
        name: "b".into(),
        chainage_m: 1000.0,
        reach_m: 500.0,
    };
    let nodes = vec![train(0), train(1), Node::Post("w".into()), Node::Control];
    let line = Alignment::new(Point3::origin(), 0.0, &[PlanElement::straight(3000.0)], &[]);
    let track = Track {
        base_stations: vec![station],
        ..Track::bare("t", line)
    };
    let network = Network::of_one(track);
    Links::new(&settings, &network, nodes, Stream::new(1, 0, "radio"))
}

fn train(id: u8) -> Node {
    Node::Train(TrainId(id))
}

fn warning(number: u32, sent_s: f64, receiver: Receiver) -> Message {
    let warning = ObstacleWarning {
        device: "w".into(),
        number,
        issued: SimTime::ZERO,
        danger: DangerLevel::High,
        track: TrackId::default(),
        from_chainage_m: 10.0,
        to_chainage_m: 11.0,
        blind: false,
    };
    let time = SimTime::from_secs(sent_s);
    Message::to(
        receiver,
        Node::Post("w".into()),
        time,
        Content::Warning(warning),
    )
}

fn number(message: &Message) -> u32 {
    match &message.content {
        Content::Warning(warning) => warning.number,
        _ => unreachable!(),
    }
}

/// Train 0 at 1000 m, train 1 out of reach.
fn heads(id: TrainId) -> Option<Place> {
    let s_m = if id == TrainId(0) { 1000.0 } else { 1501.0 };
    Some(Place::on_first_track(s_m))
}

/// A message that arrives early, twice, at its sender, or at a train out of reach.
#[test]
fn radio_takes_its_latency_and_reaches_whom_it_reaches() {
    let mut l = links(RadioSettings::default());
    l.send(warning(1, 1.0, Receiver::Trains), heads);
    assert_eq!(l.receive(SimTime::from_secs(1.499), heads), None);
    let got = l.receive(SimTime::from_secs(1.5), heads).unwrap();
    assert_eq!(got.receiver, Receiver::Node(train(0)));
    assert_eq!((got.via, number(&got)), (Via::Radio, 1));
    assert!((got.received_at.secs() - 1.5).abs() < 1e-9);
    assert_eq!(l.receive(SimTime::from_secs(9.0), heads), None);
    // A train out of reach is not heard either.
    let far = Message {
        sender: train(1),
        ..warning(2, 1.0, Receiver::All)
    };
    l.send(far, heads);
    assert_eq!(l.receive(SimTime::from_secs(9.0), heads), None);
}

/// A wire that takes time, or a message to the control centre that goes by radio.
#[test]
fn fixed_nodes_are_wired() {
    let mut l = links(RadioSettings {
        loss: 1.0,
        ..RadioSettings::default()
    });
    l.send(warning(1, 1.0, Receiver::All), heads);
    let got = l.receive(SimTime::from_secs(1.0), heads).unwrap();
    assert_eq!(got.receiver, Receiver::Node(Node::Control));
    assert_eq!(got.via, Via::Wire);
    assert_eq!(l.receive(SimTime::from_secs(9.0), heads), None);
}

/// Losses at the wrong rate, or of all receivers together; outages that let messages through.
#[test]
fn losses_and_outages() {
    let mut l = links(RadioSettings {
        loss: 0.3,
        ..RadioSettings::default()
    });
    let here = |_: TrainId| Some(Place::on_first_track(1000.0));
    (0..2000).for_each(|k| l.send(warning(k, 0.0, Receiver::Trains), here));
    let mut got = [Vec::new(), Vec::new()];
    while let Some(message) = l.receive(SimTime::from_secs(1.0), here) {
        let second = message.receiver == Receiver::Node(train(1));
        got[usize::from(second)].push(number(&message));
    }
    for got in &got {
        // 2000 draws at 0.7: sigma 20.5.
        assert!((1318..1482).contains(&got.len()), "{} of 2000", got.len());
    }
    assert_ne!(got[0], got[1]);

    let outages = vec![Outage {
        from_s: 0.0,
        to_s: 1.0,
    }];
    let mut l = links(RadioSettings {
        outages,
        ..RadioSettings::default()
    });
    l.send(warning(1, 0.5, Receiver::Trains), here);
    assert_eq!(l.receive(SimTime::from_secs(2.0), here), None);
    l.send(warning(2, 1.0, Receiver::Trains), here);
    assert!(l.receive(SimTime::from_secs(2.0), here).is_some());
}

/// Jitter that reorders what must be in order, or does not where it may.
#[test]
fn messages_keep_their_order_where_asked() {
    for in_order in [true, false] {
        let mut l = links(RadioSettings {
            jitter_ms: 400.0,
            in_order,
            ..RadioSettings::default()
        });
        for k in 0..200 {
            let to_first = Receiver::Node(train(0));
            l.send(warning(k, 0.01 * f64::from(k), to_first), heads);
        }
        let late = SimTime::from_secs(9.0);
        let got: Vec<u32> = std::iter::from_fn(|| l.receive(late, heads))
            .map(|m| number(&m))
            .collect();
        assert_eq!(got.len(), 200);
        assert_eq!(got.is_sorted(), in_order);
    }
}

/// A balise that forgets, gives an old message, or another's.
#[test]
fn a_balise_keeps_the_last_message() {
    let mut l = links(RadioSettings {
        loss: 1.0,
        ..RadioSettings::default()
    });
    let to_balise = |name: &str| Receiver::Node(Node::Balise(name.into()));
    l.send(warning(1, 0.0, to_balise("b1")), heads);
    l.send(warning(2, 1.0, to_balise("b1")), heads);
    let now = SimTime::from_secs(5.0);
    let read = l.read_balise(now, "b1", TrainId(0)).unwrap();
    assert_eq!(
        (number(&read), read.via, read.received_at),
        (2, Via::Balise, now)
    );
    assert!(l.read_balise(now, "b2", TrainId(0)).is_none());
}
