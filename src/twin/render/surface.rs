//! How surfaces look in the mean, and how far things are seen. The one source of these numbers:
//! both renderers read them here, and [`wgsl`] hands them to the shaders.
//!
//! Reflectances are those of old concrete, ballastless track and worn steel as lighting handbooks
//! table them (CIE 88:2004 takes 0.2 to 0.6 for tunnel walls). What is painted around these means
//! is told in [`paint`](super::paint).

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
/// The glare of a lamp ends this many decay lengths outside its disc.
pub const HALO_REACH: f64 = 8.0;
/// Signals are followed up to this many times the full well.
pub const SATURATION: f64 = 4.0;

/// The look of one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Share of light reflected (Lambert), in the mean over what is painted on it.
    pub albedo: f64,
}

/// What a material looks like.
pub const fn look(material: Material) -> Look {
    let albedo = match material {
        Material::Lining => 0.30,
        Material::Bed => 0.22,
        Material::Walkway => 0.35,
        Material::Rail => 0.45,
        Material::Platform => 0.50,
    };
    Look { albedo }
}

/// The constants that the shaders need, as WGSL declarations to stand in front of every shader.
pub fn wgsl() -> String {
    let mut text = String::from("// Written by twin/render/surface.rs.\n");
    let floats = [("MIN_SINE", MIN_SINE), ("HALO_REACH", HALO_REACH)];
    for (name, value) in floats {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "const {name}: f32 = {value:?};");
    }
    text
}
