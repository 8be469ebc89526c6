//! Everything that travels on the bus can be written down and read back.

use crate::common::small_scenario;
use metrotwin::bus::{Content, Message, Node};
use metrotwin::session::{
    Event, Observer, ObserverError, Opening, RendererChoice, RunOptions, run,
};
use std::collections::BTreeSet;

/// A second train, and all sensors that there are.
const MORE: &str = r#"
    [wayside.lidar]
    step_deg = 5.0
    [doppler]
    [[other_trains]]
    cars = 1
    start_chainage_m = 1200.0
    start_speed_kmh = 60.0
    [[onboard]]
    train = 1
    protection = { initial_chainage_m = 1200.0 }
"#;

/// Kinds of content that were written and read back.
#[derive(Default)]
struct Copied(BTreeSet<String>);

impl Copied {
    fn copy(&mut self, message: &Message) {
        let text = serde_json::to_string(message).unwrap();
        let again: Message = serde_json::from_str(&text).unwrap();
        assert_eq!(&again, message);
        let kind = format!("{:?}", message.content);
        let end = kind.find(|c: char| !c.is_alphanumeric()).unwrap();
        self.0.insert(kind[..end].to_owned());
    }
}

impl Observer for Copied {
    fn open(&mut self, opening: &Opening<'_>) -> Result<(), ObserverError> {
        for train in opening.trains {
            let rig = train.rig.map(Content::RigCalibration);
            let device = Content::WaysideCalibration(opening.wayside[0].clone());
            for content in rig.into_iter().chain([device]) {
                self.copy(&Message::own(
                    Node::Train(train.id),
                    Default::default(),
                    content,
                ));
            }
        }
        Ok(())
    }

    fn observe(&mut self, event: &Event<'_>) -> Result<(), ObserverError> {
        let own = |node, time, content| Message::own(node, time, content);
        match event {
            Event::Message { message, .. } => self.copy(message),
            Event::Pair {
                train: id,
                pair,
                report,
                ..
            } => {
                let (node, time) = (Node::Train(*id), report.time);
                self.copy(&own(node.clone(), time, Content::Pair((*pair).clone())));
                self.copy(&own(node, time, Content::Led((*report).clone())));
            }
            Event::Wayside { frame, report, .. } => {
                let (node, time) = (Node::Post("W1530".into()), report.time);
                self.copy(&own(node.clone(), time, Content::Frame((*frame).clone())));
                self.copy(&own(node, time, Content::Wayside((*report).clone())));
            }
            _ => {}
        }
        Ok(())
    }
}

/// A field that is skipped, written in another form than it is read, or loses digits.
#[test]
fn every_message_is_read_back_as_it_was_written() {
    let scenario = small_scenario(MORE);
    let options = RunOptions {
        renderer: RendererChoice::Cpu,
        ..RunOptions::default()
    };
    let mut copied = Copied::default();
    run(&scenario, &options, &mut [&mut copied]).unwrap();
    let kinds = [
        "Command",
        "Doppler",
        "Frame",
        "Heartbeat",
        "Imu",
        "Led",
        "Odometer",
        "Pair",
        "Position",
        "Protection",
        "RigCalibration",
        "Scan",
        "Train",
        "Wayside",
        "WaysideCalibration",
    ];
    for kind in kinds {
        assert!(copied.0.contains(kind), "no {kind} in {:?}", copied.0);
    }
}
