//! Lamps in rolling-shutter images: where their centres are, and what their stripes say.
//!
//! **What for.** A lamp on the tunnel wall switches on and off thousands of times a second. A
//! camera that exposes its rows one after the other sees this as bright and dark stripes across
//! the lamp, which spell the lamp's name; and it sees the lamp's outline, from which
//! [`positioning`](super::positioning) takes a bearing and a distance.
//!
//! ```
//! use metrotwin::stack::led::decode_cyclic;
//! use metrotwin::track::uid::{LineCode, Uid};
//! let uid = Uid { line: 1, lamp: 613 };
//! // 48 successive chips of the lamp, read from some chip on, name it.
//! let chips = uid.frame(LineCode::Manchester).bits;
//! let read_from_chip_20 = chips >> 20 | chips << 28;
//! assert_eq!(decode_cyclic(read_from_chip_20, u64::MAX, LineCode::Manchester), Some(uid));
//! ```
//!
//! **Theory.** Y. Zhang, N. Meng, X. Xiao, X. Zhu, "Autonomous metro train positioning by fusion of
//! visible light communication and binocular stereo vision", Acta Optica Sinica 2023, doi
//! 10.3788/AOS221912. Its steps, one file each: median filter, Otsu's threshold, region of
//! interest, closing of the stripes into one spot and its outline, centre by log-Gaussian grey
//! centroid and least-squares ellipse weighted by roundness, Wiener filter against motion blur;
//! for the name: stripes upright, cropped, their widths to bits, header, footer, check sum. Where
//! the paper leaves a choice, the file's header states it with its reason. What is added:
//! names are joined from several images, since a lamp at 8 m shows only a third of its code in
//! one. And the lens: images stay as they were read, since rows are times; the points measured in
//! them are moved to where a lens without distortion would have them, before an ellipse is fitted.
//!
//! Departures from the paper, with reasons: the median filter serves the search and the threshold
//! only, as a 3x3 median deletes stripes of a single row (a dark chip of 45 us beside saturated
//! rows is 28 us, 1.3 rows); edge points come from lit rows only, as the closed spot ends wrongly
//! where a dark stripe touches its end; stripes are rotated only if measurably tilted.
//!
//! **What it does not do.** It expects one chip time and one code on a line. Through a global shutter
//! lamps show no stripes: they are found, but cannot be named. Two lamps whose images overlap are one
//! spot to it. Where the sensor saturates, fitted outlines are too large (centres are not affected);
//! what is taken off for it is good to 0.06 px (one sigma) behind a sharp lens, and to 0.1 px behind
//! one that blurs by half a pixel and a lamp that saturates it fourfold, while the glare beside the
//! lamp stays under the half of its plateau.

mod centroid;
mod code;
mod ellipse;
mod finder;
mod median;
mod otsu;
mod outline;
mod patch;
mod profile;
mod search;
mod settings;
mod spill;
mod stripes;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
pub mod testing;
mod wiener;

pub use code::{ChipVotes, decode_cyclic};
pub use ellipse::fit_ellipse;
pub use finder::{LampFinder, LampImage};
pub use settings::LedSettings;
pub use stripes::StripeReading;
