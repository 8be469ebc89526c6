//! Constants of the image model that both renderers hold to, and the one place where the shaders
//! get theirs from: [`wgsl`].

use super::gloss::MIRROR_REACH_M;
use crate::twin::lights::HEADLIGHT_RADIUS_M;
use std::fmt::Write;

/// A pixel sees no surface at a flatter angle than this sine (of the ray to the surface).
pub const MIN_SINE: f64 = 0.05;
/// Surfaces farther away than this are not seen.
pub const SIGHT_M: f64 = 160.0;
/// Lamps are seen up to this distance.
pub const LAMP_SIGHT_M: f64 = 80.0;
/// Reflectance of a lamp's disc while it is off.
pub const DARK_DISC_ALBEDO: f64 = 0.3;
/// Glare of a lamp is followed to where a part of it has fallen to this many electrons.
pub const FAINT_E: f64 = 1.5;
/// From one texel of glare to the next along a row, pixels.
pub const GLARE_STEP_PX: f64 = 4.0;
/// Signals are followed up to this many times the full well.
pub const SATURATION: f64 = 4.0;

/// The constants that the shaders need, as WGSL declarations to stand in front of every shader.
pub fn wgsl() -> String {
    let mut text = String::from("// Written by twin/render/constants.rs.\n");
    // Writing to a String cannot fail.
    for (name, value) in [
        ("GLARE_STEP_PX", GLARE_STEP_PX),
        ("MIRROR_REACH_M", MIRROR_REACH_M),
        ("HEADLIGHT_RADIUS_M", HEADLIGHT_RADIUS_M),
    ] {
        let _ = writeln!(text, "const {name}: f32 = {value:?};");
    }
    text
}
