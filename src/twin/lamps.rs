//! The lamps of the tunnel as they really shine: each begins to send at a time of its own, by a clock of
//! its own, and fails as the scenario has it.

use super::faults::{LampFaultSettings, age};
use super::lights::LampLight;
use super::random::Stream;
use crate::track::Tunnel;

/// One sigma of a lamp's clock: a crystal without temperature compensation.
const CLOCK_SIGMA: f64 = 20e-6;

/// The lamps of a tunnel, with the phases, clocks and faults of a run's seed.
pub fn shining(tunnel: &Tunnel, faults: &[LampFaultSettings], seed: u64) -> Vec<LampLight> {
    let phase = Stream::new(seed, 0, "lamp phase");
    let clock = Stream::new(seed, 0, "lamp clock");
    let mut lamps: Vec<_> = (0u64..)
        .zip(tunnel.lamps())
        .map(|(k, site)| {
            let mut lamp = LampLight::from_site(site, phase.uniform(k));
            lamp.waveform.chip_s *= 1.0 + CLOCK_SIGMA * clock.normal(k);
            lamp
        })
        .collect();
    age(&mut lamps, faults, tunnel, seed);
    lamps
}
