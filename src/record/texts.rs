//! The event log and the driver's display.

use super::observer_error::Result;
use super::stream::RowStream;
use super::{palette, path_of};
use crate::bus::{
    BrakeDemand, CameraFault, DangerLevel, DriverDisplay, LedReport, Message, Node,
    ObstacleWarning, ProtectionReport, SimTime, TrainId, Via, WaysideReport,
};
use crate::session::Opening;
use crate::track::network::Network;
use crate::track::{Place, Stretch, TrackId};
use re_sdk_types::archetypes::{TextDocument, TextLog};
use re_sdk_types::components::{Color, TextLogLevel};
use std::collections::BTreeMap;

/// The log.
pub(super) const EVENTS: &str = "events";
/// The display.
pub(super) const DISPLAY: &str = "display";

/// Turns what happens into words; says again only what changed.
pub(super) struct Texts {
    stream: RowStream,
    /// Chainages are told as its tracks state them.
    network: Network,
    /// The track that each wayside device watches.
    watched: Vec<TrackId>,
    /// Of each train.
    brake: BTreeMap<TrainId, BrakeDemand>,
    /// Of each wayside device, with the number of its obstacles.
    danger: Vec<(DangerLevel, usize)>,
    /// What each train last heard of each device each way.
    heard: BTreeMap<(TrainId, String, &'static str), DangerLevel>,
    /// What the display of each train shows.
    shown: BTreeMap<TrainId, String>,
}

impl Texts {
    /// Begins the log with what is run.
    pub(super) fn open(stream: RowStream, opening: &Opening<'_>) -> Result<Self> {
        let tunnel = opening.tunnel;
        let tracks = tunnel.network.tracks.iter();
        let text = format!(
            "{}, seed {}: {:.0} m of line, {} lamps, {} balises",
            opening.scenario,
            opening.seed,
            tracks.clone().map(|t| t.alignment.length_m()).sum::<f64>(),
            tunnel.lamps().count(),
            tracks.map(|t| t.balises.len()).sum::<usize>(),
        );
        let texts = Self {
            stream,
            network: tunnel.network.clone(),
            watched: opening.wayside.iter().map(|d| d.track).collect(),
            brake: BTreeMap::new(),
            danger: vec![(DangerLevel::None, 0); opening.wayside.len()],
            heard: BTreeMap::new(),
            shown: BTreeMap::new(),
        };
        texts.note(SimTime::ZERO, &text)?;
        Ok(texts)
    }

    /// Anything.
    pub(super) fn note(&self, time: SimTime, text: &str) -> Result {
        self.log(time, TextLogLevel::INFO, text)
    }

    /// The stack says that a camera has failed, or is well again.
    pub(super) fn camera(
        &self,
        time: SimTime,
        node: &Node,
        camera: &str,
        fault: Option<CameraFault>,
    ) -> Result {
        let of = match node {
            Node::Train(id) => of_train(*id),
            _ => String::new(),
        };
        let (level, text) = match fault {
            Some(fault) => (TextLogLevel::ERROR, format!("{of}camera {camera}: {fault}")),
            None => (
                TextLogLevel::INFO,
                format!("{of}camera {camera} sees again"),
            ),
        };
        self.log(time, level, &text)
    }

    /// Lamps have gone by without shining.
    pub(super) fn dark_lamps(&self, id: TrainId, report: &LedReport) -> Result {
        for uid in &report.dark {
            let text = format!("{}lamp {uid} is dark", of_train(id));
            self.log(report.time, TextLogLevel::WARN, &text)?;
        }
        Ok(())
    }

    /// A warning reached a train. Devices repeat theirs; the log does not.
    pub(super) fn warning(
        &mut self,
        id: TrainId,
        message: &Message,
        warning: &ObstacleWarning,
    ) -> Result {
        let via = match message.via {
            Via::Balise => "balise",
            Via::Radio => "radio",
            Via::Wire => "wire",
        };
        let (device, number) = (&warning.device, warning.number);
        let before = (self.heard).insert((id, device.clone(), via), warning.danger);
        if before == Some(warning.danger) {
            return Ok(());
        }
        let delay_s = message.received_at.since(warning.issued);
        let stretch = self.stretch(&warning.stretch());
        let what = match warning.danger {
            DangerLevel::None => "all clear".to_owned(),
            _ if warning.blind => format!("track not watched, {stretch}"),
            danger => format!("danger {}, {stretch}", danger_name(danger)),
        };
        let level = level(warning.danger);
        let of = of_train(id);
        let text = format!("{of}{device} #{number} by {via} ({delay_s:.2} s): {what}");
        self.log(message.received_at, level, &text)
    }

    /// The danger that a wayside device sees, or the number of things there, has changed.
    pub(super) fn wayside(&mut self, device: (usize, &str), report: &WaysideReport) -> Result {
        let watched = self.watched.get(device.0).copied();
        let (Some(track), Some(danger)) = (watched, self.danger.get_mut(device.0)) else {
            return Ok(());
        };
        let now = (report.danger, report.obstacles.len());
        if std::mem::replace(danger, now) == now {
            return Ok(());
        }
        let mut text = format!("{}: danger {}", device.1, danger_name(report.danger));
        for o in &report.obstacles {
            let s_m = o.from_chainage_m;
            let place = self.place(Place { track, s_m });
            text += &format!("; {:.2} x {:.2} m at {place}", o.width_m, o.height_m);
        }
        self.log(report.time, level(report.danger), &text)
    }

    /// The protection changed its demand.
    pub(super) fn protection(&mut self, id: TrainId, report: &ProtectionReport) -> Result {
        let brake = report.command.brake;
        if self.brake.insert(id, brake).unwrap_or_default() == brake {
            return Ok(());
        }
        let (level, what) = match brake {
            BrakeDemand::None => (TextLogLevel::INFO, "brake released"),
            BrakeDemand::Service => (TextLogLevel::WARN, "service brake"),
            BrakeDemand::Emergency => (TextLogLevel::ERROR, "emergency brake"),
        };
        let speed_kmh = report.speed_mps * 3.6;
        let of = of_train(id);
        let text = format!("{of}{what} at {speed_kmh:.1} km/h");
        self.log(report.time, level, &text)
    }

    /// What the driver sees, when it changed.
    pub(super) fn display(
        &mut self,
        id: TrainId,
        time: SimTime,
        display: &DriverDisplay,
    ) -> Result {
        let text = self.markdown(display);
        if self.shown.get(&id) == Some(&text) {
            return Ok(());
        }
        self.stream.at(time);
        self.stream.log(
            &path_of(id, DISPLAY),
            &TextDocument::from_markdown(text.as_str()),
        )?;
        self.shown.insert(id, text);
        Ok(())
    }

    /// A stretch, as `km 0.1000 to 0.1010` or `DK12+340.0 to DK12+341.0`.
    fn stretch(&self, stretch: &Stretch) -> String {
        let track = stretch.track;
        let ends = [stretch.from_m, stretch.to_m];
        let [from, to] = ends.map(|s_m| self.place(Place { track, s_m }));
        format!("{from} to {}", to.trim_start_matches("km "))
    }

    fn place(&self, at: Place) -> String {
        let stated = self.network.stated_chainage(at);
        stated.unwrap_or_else(|| format!("km {:.4}", at.s_m / 1000.0))
    }

    fn markdown(&self, display: &DriverDisplay) -> String {
        let (lamp, meaning) = palette::driver_lamp(display.lamp);
        let unknown = || "-".to_owned();
        let power = if display.power { "on" } else { "off" };
        let position = display
            .position
            .map_or_else(unknown, |at| self.position(at));
        let distance = display.distance_to_obstacle_m;
        let distance = distance.map_or_else(unknown, |m| format!("{m:.1} m"));
        let text = &display.text;
        format!(
            "## {lamp}: {meaning}\n\n{text}\n\n| Power | {power} |\n|---|---|\n\
             | Position | {position} |\n| Distance to obstacle | {distance} |\n"
        )
    }

    /// In metres, where the track states nothing else.
    fn position(&self, at: Place) -> String {
        let stated = self.network.stated_chainage(at);
        stated.unwrap_or_else(|| format!("{:.1} m", at.s_m))
    }

    fn log(&self, time: SimTime, level: &'static str, text: &str) -> Result {
        let colour = match level {
            TextLogLevel::ERROR => palette::danger(DangerLevel::High),
            TextLogLevel::WARN => palette::danger(DangerLevel::Low),
            _ => Color::from_rgb(210, 215, 220),
        };
        let line = TextLog::new(text).with_level(level).with_color(colour);
        self.stream.at(time);
        self.stream.log(EVENTS, &line)
    }
}

/// Whose a line of the log is, where it is not the first train's.
fn of_train(id: TrainId) -> String {
    if id == TrainId::default() {
        String::new()
    } else {
        format!("{id}: ")
    }
}

fn danger_name(danger: DangerLevel) -> &'static str {
    match danger {
        DangerLevel::None => "none",
        DangerLevel::Low => "low",
        DangerLevel::High => "high",
    }
}

fn level(danger: DangerLevel) -> &'static str {
    match danger {
        DangerLevel::None => TextLogLevel::INFO,
        DangerLevel::Low => TextLogLevel::WARN,
        DangerLevel::High => TextLogLevel::ERROR,
    }
}
