//! Where the train is, from lamps seen by a stereo camera.
//!
//! **What for.** Every pair of images of a lamp of known name and surveyed place gives the train's
//! position, by the method of Zhang et al. ([`Method::Stereo`](crate::bus::Method)) and by its
//! baseline with one camera ([`Method::Mono`](crate::bus::Method)).
//!
//! ```
//! use metrotwin::bus::*;
//! use metrotwin::stack::led::LedSettings;
//! use metrotwin::stack::positioning::LedPositioner;
//! use metrotwin::track::Tunnel;
//!
//! let map = Tunnel::from_toml("
//!     name = 'short'
//!     plan = [{ kind = 'straight', length_m = 100.0 }]
//!     lamps = { from_m = 10.0 }
//! ").unwrap();
//! let camera = CameraModel {
//!     intrinsics: Intrinsics::centred(64, 48, 52.0),
//!     shutter: Shutter { line_time_s: 22.2e-6, exposure_s: 30e-6, first_row: 0 },
//!     blur_px: 0.5,
//! };
//! let rig = RigCalibration::rectified(camera, 0.12, nalgebra::Isometry3::identity());
//! let mut positioner = LedPositioner::new(&LedSettings::default(), rig, map.first_track().clone());
//! let dark = Frame {
//!     number: 0,
//!     start: SimTime::ZERO,
//!     exposure_s: 30e-6,
//!     gain_db: 0.0,
//!     image: image::GrayImage::new(64, 48),
//! };
//! let report = positioner.on_pair(&StereoPair { left: dark.clone(), right: dark });
//! assert!(report.fixes.is_empty(), "nothing shines, nothing is claimed");
//! ```
//!
//! **Theory.** Y. Zhang et al., Acta Optica Sinica 2023, doi 10.3788/AOS221912: disparity d of the
//! lamp's centres gives z = f b / d, x = (u - cx) z / f, y = (v - cy) z / f, and train = lamp -
//! R (lamp in camera). The points are rectified, not the images (`stereo`).
//! R is the track's attitude at the expected chainage, from the map, turned by
//! what the gyro says of the car's swings. A fix belongs to the mid-exposure of the row of the
//! lamp's centre, not to the start of the image (16 ms apart, 0.27 m at 60 km/h); for how long rows
//! were exposed, each frame says.
//!
//! A curve needs care: the car's length axis is the chord between its pivots, not the tangent at
//! the head.
//!
//! **Sigma.** Of each fix along the track, from what its pixels scatter by (the fit of the lamp's
//! outline tells, in each eye) and from the stated uncertainties of calibration, attitude and survey
//! ([`LedSettings`](crate::stack::led::LedSettings)). Nothing is scaled to agree with a result.
//!
//! **What `mono` shares with `paper`.** Its distance comes from the left eye alone, and it chooses
//! its lamp by its own sigma. But there is one equipment that names lamps: the name, the position
//! that a lamp is expected by, and the track's attitude at it come from the `paper` fixes before. So
//! `mono` shows what one camera measures, not what a train with one camera would do.
//!
//! **What it does not do.** One fix rests on one pair and one lamp: nothing is filtered over time,
//! as in the paper; earlier fixes serve to expect the next lamp and the track's attitude only.
//! What the sheet says of the eyes it lives with: lenses that distort, eyes that differ, look past
//! each other, are triggered apart or read upwards. What the sheet gets wrong of that is in sigma as
//! a vergence only: errors of distortion, of a roll or pitch between the eyes, of the line time and
//! of the trigger times are not in it.
//! A lamp that a wall's end or a train hides in part is taken for a whole one: its centre is off, by more in one
//! eye than in the other (63 cm along the track, once, from 13 m), and sigma does not include it.
//! It takes its cab to look up the line, the train's rails to be where the map has them, and roll and
//! pitch swings slower than the gyro's fading to be nothing.

mod attitude;
mod equipment;
mod lamp_fix;
mod lamp_presence;
mod naming;
mod positioner;
mod reckoning;
mod sighting;
mod smear;
mod stereo;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

pub use equipment::{CabMount, LampPositioning};
pub use positioner::LedPositioner;
