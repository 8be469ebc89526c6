//! Constants of the image model that both renderers hold to.

/// A pixel sees no surface at a flatter angle than this sine (of the ray to the surface).
pub const MIN_SINE: f64 = 0.05;
/// Surfaces farther away than this are not seen.
pub const SIGHT_M: f64 = 160.0;
/// Lamps are seen up to this distance.
pub const LAMP_SIGHT_M: f64 = 80.0;
/// Surfaces nearer than a lamp's disc by less than this do not hide it: it may be flush with its wall.
pub const FLUSH_M: f64 = 0.01;
/// Reflectance of a lamp's disc while it is off.
pub const DARK_DISC_ALBEDO: f64 = 0.3;
/// Glare of a lamp is followed to where a part of it has fallen to this many electrons.
pub const FAINT_E: f64 = 1.5;
/// From one texel of glare to the next along a row, pixels.
pub const GLARE_STEP_PX: f64 = 4.0;
/// The largest finite number of half precision: a brighter signal, electrons, counts as this one.
pub const BRIGHTEST_E: f64 = 65_504.0;
/// Signals are followed up to this many times the full well.
pub const SATURATION: f64 = 4.0;
