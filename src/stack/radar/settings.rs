//! How the signal of a radar is worked up.

use super::window::Window;
use crate::settings::settings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a cell is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "RadarCfar")]
pub enum CfarKind {
    /// The mean of its reference cells: the least loss in even noise (Finn and Johnson 1968).
    Ca,
    /// One of them in order of power: a second target or the edge of clutter among them raises it little (Rohling
    /// 1983).
    #[default]
    Os,
}

settings! {
    /// Settings of the onboard radar.
    #[derive(Copy)]
    pub struct RadarSettings {
        /// Of the samples of a chirp. Its side lobes have to hide below the noise: a train of 100 square metres has a
        /// million times the power of what can just be detected at its range.
        range_window: Window = Window::Chebyshev;
        /// Of the chirps of a frame. Echoes of the standing tunnel beside a target have another speed than it.
        speed_window: Window = Window::Chebyshev;
        /// Highest side lobe of a Chebyshev window below its main lobe, dB: see `range_window`.
        chebyshev_db: f64 = 60.0, in 30.0..=120.0;
        /// What a cell is compared with.
        cfar: CfarKind = CfarKind::default();
        /// Cells that it is compared with, half of them nearer, half farther. 16 cost 2 dB or so (Rohling 1983); more
        /// would reach over the edges of clutter.
        reference_cells: u32 = 16, in 4.0..=128.0;
        /// Which of them, in order of power, as a share of all: 12 of 16 (Rohling 1983).
        ordered_share: f64 = 0.75, in 0.25..=1.0;
        /// Cells left out on either side, which a target's own main lobe reaches into: with a Chebyshev window of 60 dB
        /// its half width is 2 cells.
        guard_cells: u32 = 2, in 0.0..=32.0;
        /// A cell of noise is taken for a detection so often. A frame has some hundred thousand cells: one in several
        /// frames has a false detection, and one alone never becomes a target.
        false_alarm_probability: f64 = 1e-6, in 1e-12..=0.1;
    }
}
