//! A 77 GHz FMCW radar at an end of a train: its output is the sampled beat signal of a frame, as its converter has it.
//!
//! | | |
//! |---|---|
//! | `settings` | what a scenario says; the sheet, and how the radar really is |
//! | `link` | radar equation, antennas, fog, thermal noise |
//! | [`scatterers`] | centres of bodies and of the tunnel, and which of them are seen |
//! | `ghosts` | mirror images in walls |
//! | [`signal`] | the beat of all echoes in all samples |
//! | [`interference`] | other radars in the band |
//! | `converter` | noise, rounding, ends of the converter |
//!
//! A frame is given when its last chirp is over; what moves is taken along straight lines within it. Echoes that stay 10 dB
//! below the noise of a whole frame are left out. Everything random follows from seed, frame and sample.
//!
//! Not modelled: diffraction, bounces between bodies, leakage of the transmitter, rain on the radome, a drift of the errors.

mod converter;
mod ghosts;
pub mod interference;
mod link;
pub mod scatterers;
mod scene;
mod settings;
pub mod signal;

pub use converter::Converter;
pub use link::{Antenna, Link, air_loss_db_m, noise_w, watts};
pub use settings::{RadarError, RadarSettings, TrueRadar};

use super::{Output, Sensor, SensorError};
use crate::bus::{Content, RadarFrame, SimTime, Ticker, TrainEnd, TrainId};
use crate::track::Track;
use crate::twin::air::Air;
use crate::twin::geometry::TunnelCaster;
use crate::twin::physics::World;
use crate::twin::random::Stream;
use scene::RadarScene;
use signal::BeatModel;
use std::sync::Arc;

/// A radar and the train that it is on.
#[derive(Clone, Debug)]
pub struct MountedRadar {
    /// Which train.
    pub train: TrainId,
    /// At which of its ends.
    pub end: TrainEnd,
    /// What it is.
    pub settings: RadarSettings,
    /// The seed of its train.
    pub seed: u64,
}

/// A radar at work.
pub struct Radar {
    mounted: MountedRadar,
    scene: RadarScene,
    converter: Converter,
    ticker: Ticker,
}

impl Radar {
    /// On its train, among the radars of other trains, in the tunnels of all tracks and their air.
    pub fn new(
        mounted: MountedRadar,
        others: &[MountedRadar],
        tracks: &[Arc<Track>],
        air: &Air,
    ) -> Self {
        let MountedRadar {
            end,
            seed,
            ref settings,
            ..
        } = mounted;
        let built = settings.built(end, seed);
        let noise = Stream::new(seed, end as u64, "radar noise");
        Self {
            converter: Converter::new(&built.figures, built.bits, noise),
            ticker: Ticker::new(settings.frames_per_s),
            scene: RadarScene::new(&mounted, built, others, (TunnelCaster::new(tracks), air)),
            mounted,
        }
    }

    /// The frame that began at a time of the recent past; none without its train.
    pub fn frame(&mut self, world: &World, number: u32, start: SimTime) -> Option<RadarFrame> {
        let received = self.scene.received(world, number, start)?;
        let built = self.scene.built();
        let model = BeatModel {
            figures: &built.figures,
            channels: &built.channels,
        };
        let mut samples = model.samples(&received.echoes);
        for interferer in &received.interferers {
            interferer.add(&built.figures, &built.channels, &mut samples);
        }
        Some(RadarFrame {
            end: self.mounted.end,
            number,
            start,
            counts: self.converter.counts(number, &samples),
        })
    }
}

impl Sensor for Radar {
    fn sample(&mut self, world: &World) -> Result<Vec<Output>, SensorError> {
        let clock = self.mounted.settings.clock;
        let local = clock.local(world.time());
        let span_s = self.mounted.settings.frame_s();
        let Some((number, start)) = self.ticker.due(local, span_s) else {
            return Ok(Vec::new());
        };
        let frame = self.frame(world, number, clock.time_of(start));
        let content = frame.map(|frame| Content::RadarFrame(RadarFrame { start, ..frame }));
        Ok(content
            .into_iter()
            .map(|content| Output::at_once(start, content))
            .collect())
    }
}

#[cfg(test)]
mod tests;
