//! How surfaces look: reflectance of each material and the patterns on it. The one source of
//! these numbers: both renderers read them here, and [`wgsl`] hands them to the shaders.
//!
//! Reflectances are those of old concrete, ballastless track and worn steel as lighting handbooks
//! table them (CIE 88:2004 takes 0.2 to 0.6 for tunnel walls). Ring joints repeat with the 1.5 m
//! rings of shield-driven metro tunnels, sleepers with the usual 0.6 m.
//!
//! # Patterns
//!
//! The plain renderer looks at the [painting](super::paint) of a cross-section. These patterns are
//! what the GPU renderer still draws instead.
//!
//! Ring joints and sleepers are pulse trains in chainage s, each pulse centred on a multiple of
//! the period. Through a pixel that spans `w` metres of s around `s` one sees their mean,
//!
//! ```text
//! share(s, w) = (P((s + w/2 + width/2) / period) - P((s - w/2 + width/2) / period)) * period / w
//! P(x)        = floor(x) * duty + min(x - floor(x), duty),   duty = width / period
//! factor      = 1 + (pulse factor - 1) * share
//! ```
//!
//! Stains are value noise over (s, q), q being metres along the outline from its first point: the
//! lattice point (i, j) holds the first word of
//! `pcg4d([i as u32, j as u32, material, 0])` over 2^32, between lattice points runs smoothstep,
//! and the albedo is multiplied by 1 + contrast * (noise - 0.5) * clamp(2 - w / fade, 0, 1).

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

/// Distance between lattice points of the stains.
pub const STAIN_CELL_M: f64 = 0.5;
/// Peak to peak of the stains' factor on albedo.
pub const STAIN_CONTRAST: f64 = 0.3;
/// Stains begin to fade when a pixel spans this much, and are gone at twice.
pub const STAIN_FADE_M: f64 = 0.25;

/// A mark that repeats along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// From mark to mark, metres of chainage; marks are centred on its multiples.
    pub period_m: f64,
    /// Length of a mark along the line.
    pub width_m: f64,
    /// Albedo inside a mark over albedo outside.
    pub factor: f64,
    /// Marks reach this far to either side of the centreline.
    pub half_width_m: f64,
}

/// Joints between the rings of the lining.
pub const RING_JOINT: Pulse = Pulse {
    period_m: 1.5,
    width_m: 0.03,
    factor: 0.4,
    half_width_m: f64::INFINITY,
};

/// Sleepers, flush in the bed.
pub const SLEEPER: Pulse = Pulse {
    period_m: 0.6,
    width_m: 0.26,
    factor: 1.6,
    half_width_m: 1.25,
};

/// All marks, in the order in which shaders number them (from 1; 0 is none).
pub const PULSES: [Pulse; 2] = [RING_JOINT, SLEEPER];

/// The look of one material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Third word of the stains' hash.
    pub id: u32,
    /// Share of light reflected (Lambert).
    pub albedo: f64,
    /// Its repeating mark.
    pub pulse: Option<Pulse>,
}

/// What a material looks like.
pub const fn look(material: Material) -> Look {
    let (id, albedo, pulse) = match material {
        Material::Lining => (0, 0.30, Some(RING_JOINT)),
        Material::Bed => (1, 0.22, Some(SLEEPER)),
        Material::Walkway => (2, 0.35, None),
        Material::Rail => (3, 0.45, None),
        Material::Platform => (4, 0.50, None),
    };
    Look { id, albedo, pulse }
}

/// The constants that the shaders need, as WGSL declarations to stand in front of every shader.
pub fn wgsl() -> String {
    let mut text = String::from("// Written by twin/render/surface.rs.\n");
    let floats = [
        ("MIN_SINE", MIN_SINE),
        ("HALO_REACH", HALO_REACH),
        ("STAIN_CELL_M", STAIN_CELL_M),
        ("STAIN_CONTRAST", STAIN_CONTRAST),
        ("STAIN_FADE_M", STAIN_FADE_M),
    ];
    for (name, value) in floats {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "const {name}: f32 = {value:?};");
    }
    // Period, width, factor; the first stands for no mark.
    text.push_str("const PULSES = array(vec3f(1.0, 0.5, 1.0)");
    for p in PULSES {
        let _ = write!(
            text,
            ", vec3f({:?}, {:?}, {:?})",
            p.period_m, p.width_m, p.factor
        );
    }
    text.push_str(");\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes two materials that share a hash word, which would repeat stains.
    #[test]
    fn ids_differ() {
        let materials = [
            Material::Lining,
            Material::Bed,
            Material::Walkway,
            Material::Rail,
            Material::Platform,
        ];
        for (k, m) in materials.iter().enumerate() {
            assert_eq!(look(*m).id as usize, k);
            assert!((0.0..=1.0).contains(&look(*m).albedo));
            if let Some(p) = look(*m).pulse {
                assert!(p.width_m < p.period_m && p.factor * look(*m).albedo < 1.0);
            }
        }
    }
}
