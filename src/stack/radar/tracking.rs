//! The radar's processing as a piece of equipment of a train.

use super::clustering::{Gates, clusters};
use super::detector::{Detector, FrameState, Sighting};
use super::ghosts::Ghosts;
use super::own_motion::{Mount, OwnMotions};
use super::settings::RadarTrackingSettings;
use super::target::{Target, View};
use super::tracker::Tracker;
use crate::bus::{
    Content, Message, Node, RadarFrame, RadarReport, RadarSheet, RadarTrack, SimTime,
};
use crate::stack::Equipment;

/// After a gap between frames that is longer than this, targets are begun anew, seconds.
const LONGEST_GAP_S: f64 = 2.0;

/// Takes frames of one radar, speed and yaw rate, and reports detections and targets. Frames of another size than the
/// sheet's, and such as are no later than the last one, are dropped.
pub struct RadarTracking {
    node: Node,
    sheet: RadarSheet,
    detector: Detector,
    gates: Gates,
    mount: Mount,
    own: OwnMotions,
    tracker: Tracker,
    ghosts: Ghosts,
    waiting: Vec<RadarFrame>,
    /// Middle of the last frame.
    last: Option<SimTime>,
}

impl RadarTracking {
    /// On a node, for the radar of a sheet.
    pub fn new(node: Node, settings: RadarTrackingSettings, sheet: &RadarSheet) -> Self {
        let detector = Detector::new(sheet, &settings);
        let transmitters = sheet.transmitters_m.len();
        let span_mps = 2.0 * sheet.waveform.most_speed_mps(transmitters);
        let resolution = detector.resolution();
        let resolutions = settings.cluster_resolutions;
        Self {
            node,
            gates: Gates::new(&resolution, resolutions, settings.body_length_m, span_mps),
            mount: Mount::new(sheet),
            own: OwnMotions::new(sheet.end),
            tracker: Tracker::new(settings),
            ghosts: Ghosts::new(settings),
            waiting: Vec::new(),
            last: None,
            sheet: sheet.clone(),
            detector,
        }
    }

    fn process(&mut self, frame: &RadarFrame) -> Option<RadarReport> {
        let transmitters = self.sheet.transmitters_m.len();
        let waveform = &self.sheet.waveform;
        let time = frame
            .start
            .plus(0.5 * waveform.loop_s(transmitters) * f64::from(waveform.loops));
        if self.last.is_some_and(|last| time <= last) {
            return None;
        }
        let last = self.last.unwrap_or(time);
        let view = View {
            mount: self.mount,
            own: self.own.between(last, time),
            span_mps: self.gates.span_mps,
            transmitters,
        };
        let own_mps = view.along_boresight();
        let (sightings, state) = self.detector.detect(&frame.counts, own_mps)?;
        if time.since(last) > LONGEST_GAP_S {
            self.tracker.clear();
        }
        self.last = Some(time);
        self.tracker
            .on_frame(&clusters(sightings, &self.gates), &view);
        self.ghosts
            .on_frame(sightings, self.tracker.targets_mut(), &view);
        let tracks = self
            .tracker
            .targets()
            .iter()
            .filter(|target| target.is_confirmed);
        let tracks = tracks.map(track).collect();
        Some(report(frame, time, sightings, state, tracks))
    }
}

fn report(
    frame: &RadarFrame,
    time: SimTime,
    sightings: &[Sighting],
    state: FrameState,
    tracks: Vec<RadarTrack>,
) -> RadarReport {
    RadarReport {
        end: frame.end,
        number: frame.number,
        time,
        detections: sightings.iter().map(|seen| seen.detection).collect(),
        tracks,
        is_saturated: state.is_saturated,
        noise_rise_db: state.noise_rise_db,
    }
}

fn track(target: &Target) -> RadarTrack {
    let covariance = &target.covariance;
    RadarTrack {
        id: target.id,
        place_m: target.place().into(),
        velocity_mps: target.velocity().into(),
        covariance: [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| covariance[(i, j)])),
        cross_section_m2: target.cross_section_m2,
        frames: target.frames,
        is_ghost: target.is_ghost,
    }
}

impl Equipment for RadarTracking {
    fn on(&mut self, message: &Message) {
        match &message.content {
            Content::Odometer(sample) => self.own.on_odometer(sample),
            Content::Imu(sample) => self.own.on_imu(sample),
            Content::RadarFrame(frame)
                if frame.end == self.sheet.end
                    && frame.counts.len() == self.sheet.frame_samples() =>
            {
                self.waiting.push(frame.clone());
            }
            _ => {}
        }
    }

    fn cycle(&mut self, now: SimTime) -> Vec<Message> {
        let frames = std::mem::take(&mut self.waiting);
        let mut messages = Vec::with_capacity(frames.len());
        for frame in &frames {
            if let Some(report) = self.process(frame) {
                let node = self.node.clone();
                messages.push(Message::own(node, now, Content::Radar(report)));
            }
        }
        messages
    }
}
