//! The onboard radar: from the sampled beat signal of a 77 GHz FMCW radar to echoes that stand out of the noise.
//!
//! [`RangeDoppler`] turns a frame into power by range, radial speed and azimuth; [`Cfar`] says which of its cells are no noise.
//!
//! ```
//! use metrotwin::bus::{RadarFrame, RadarSheet, RadarWaveform, SimTime, TrainEnd};
//! use metrotwin::stack::radar::{Cfar, RadarSettings, RangeDoppler};
//!
//! let waveform = RadarWaveform {
//!     start_hz: 76.5e9, slope_hzps: 16.26e12, sample_rate_hz: 25e6,
//!     samples: 64, loops: 32, chirp_interval_s: 12.5e-6,
//! };
//! let sheet = RadarSheet {
//!     end: TrainEnd::Front, waveform,
//!     transmitters_m: vec![[0.0, 0.0]], receivers_m: vec![[0.0, 0.0], [0.00196, 0.0]],
//!     power_dbm: 12.0, transmit_gain_dbi: 12.0, receive_gain_dbi: 12.0,
//!     noise_figure_db: 13.0, full_scale_dbm: -45.0, vehicle_from_radar: nalgebra::Isometry3::identity(),
//! };
//! let settings = RadarSettings::default();
//! let mut transform = RangeDoppler::new(&sheet, &settings);
//! let counts = vec![[0, 0]; sheet.frame_samples()];
//! let silence = RadarFrame { end: TrainEnd::Front, number: 0, start: SimTime::ZERO, counts };
//! let cells = transform.transform(&silence).unwrap();
//! let mut cfar = Cfar::new(&settings, cells.layout.columns());
//! cfar.detect(cells.powers, |range, column| panic!("nothing echoes: {range}, {column}"));
//! ```
//!
//! What it does not do yet: places of echoes finer than a cell, targets followed over frames, ghosts told from targets.

mod cfar;
mod range_doppler;
mod settings;
#[cfg(test)]
pub(crate) mod testing;
mod window;

pub use cfar::{Cfar, cell_averaging_factor, ordered_statistic_factor};
pub use range_doppler::{Cells, Layout, RangeDoppler};
pub use settings::{CfarKind, RadarSettings};
pub use window::{Weights, Window};
