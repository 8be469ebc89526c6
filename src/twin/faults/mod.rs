//! What is broken: lamps that are out, dim or flicker, and cameras that freeze, lose frames, go
//! dead or deliver late.
//!
//! ```
//! use metrotwin::settings::read_toml;
//! use metrotwin::track::Tunnel;
//! use metrotwin::twin::faults::FaultSettings;
//!
//! let faults: FaultSettings = read_toml(r#"
//!     [[lamps]] # 22 % of all lamps are out
//!     share = 0.22
//!     fault = { kind = "dead" }
//!
//!     [[cameras]] # a stuck frame grabber
//!     camera = "W1530"
//!     fault = { kind = "freeze" }
//!     from_s = 20.0
//!     to_s = 26.0
//! "#)?;
//! let tunnel = Tunnel::from_toml("
//!     name = 'short'
//!     plan = [{ kind = 'straight', length_m = 1000.0 }]
//!     lamps = { from_m = 5.0 }
//! ")?;
//! assert_eq!(faults.lamps[0].chosen(0, &tunnel, 1).count(), 22);
//! # Ok::<(), metrotwin::settings::FileError>(())
//! ```
//!
//! Every fault has a stretch of time in which it acts; by default that is the whole run. What is
//! drawn at random comes from the run's seed and the name of what is struck, so that nothing
//! depends on the order of frames, and a larger share strikes all that a smaller one does.
//!
//! The stack learns nothing of all this but by what it measures.
//!
//! What it does not do: dirt and blocked lenses (they are the lens's: `rig.lens`), calibration
//! errors (`rig.calibration_error`), and faults of inertial unit, odometer, radar, lidar and radio.

mod camera;
mod lamp;

pub use camera::{CameraFaultKind, CameraFaultSettings, CameraFaults, rig_cameras};
pub use lamp::{LampFaultKind, LampFaultSettings, age};

use crate::settings::{Checker, settings};
use crate::track::Tunnel;

settings! {
    /// All faults of a scenario.
    pub struct FaultSettings {
        /// Of the tunnel's lamps. Default: none.
        lamps: Vec<LampFaultSettings> = Vec::new(), nested;
        /// Of the cameras. Default: none.
        cameras: Vec<CameraFaultSettings> = Vec::new(), nested;
    }
}

impl FaultSettings {
    /// Adds what does not fit the tunnel.
    pub fn check_in(&self, tunnel: &Tunnel, check: &mut Checker<'_>) {
        for (k, lamp) in self.lamps.iter().enumerate() {
            lamp.check_in(tunnel, check, &format!("lamps[{k}]"));
        }
    }
}

/// A fault must last for a step at least.
fn check_times(from_s: f64, to_s: Option<f64>, check: &mut Checker<'_>) {
    if from_s.is_finite() {
        check.within("to_s", to_s, from_s + 1e-3..=f64::INFINITY);
    }
}
