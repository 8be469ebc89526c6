//! Constants of the image model that both renderers hold to, and the one place where the shaders
//! get theirs from: [`wgsl`]. What surfaces look like is painted, see [`paint`](super::paint).

use super::gloss::MIRROR_REACH_M;
use super::light::HEADLIGHT_RADIUS_M;
use crate::track::Material;
use std::fmt::Write;

/// Stations of the tunnel surface lie at multiples of this chainage; between them it is ruled.
pub const RING_M: f64 = 1.0;
/// A pixel sees no surface at a flatter angle than this sine (of the ray to the surface).
pub const MIN_SINE: f64 = 0.05;
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

/// Share of light that a material reflects in the mean. Concrete as lighting handbooks table it (0.2
/// to 0.4); the others are assumed.
pub const fn mean_albedo(material: Material) -> f64 {
    match material {
        Material::Lining => 0.30,
        Material::Bed => 0.22,
        Material::Walkway => 0.35,
        Material::Rail => 0.45,
        Material::Platform => 0.50,
    }
}

/// The constants that the shaders need, as WGSL declarations to stand in front of every shader.
pub fn wgsl() -> String {
    let mut text = String::from("// Written by twin/render/surface.rs.\n");
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
