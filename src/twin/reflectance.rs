//! How much light the surfaces of the tunnel reflect, dry and wet.

use crate::track::Material;
use std::ops::Range;

/// Concrete under a film of water is darker by this: light is caught between the two (Lekner and
/// Dorf, "Why some things are darker when wet", Applied Optics 27(7), 1988).
const WET_ALBEDO: f64 = 0.6;

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

/// A stretch that is wet, or is not.
#[derive(Clone, Debug, PartialEq)]
pub struct WetRange {
    /// The track, by number; of all tracks without.
    pub track: Option<usize>,
    /// Its chainages.
    pub chainage_m: Range<f64>,
    /// Whether it is.
    pub wet: bool,
}

/// Where tracks are wet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wet {
    /// The last one that holds a place counts.
    pub ranges: Vec<WetRange>,
}

impl Wet {
    /// Whether it is wet at a chainage of a track.
    pub fn at(&self, track: usize, s_m: f64) -> bool {
        let covers = self.ranges.iter().rev().find(|range| {
            range.track.is_none_or(|t| t == track) && range.chainage_m.contains(&s_m)
        });
        covers.is_some_and(|range| range.wet)
    }

    /// By how much the diffuse light of a surface is less.
    pub fn albedo_factor(&self, material: Material, track: usize, s_m: f64) -> f64 {
        if material == Material::Bed && self.at(track, s_m) {
            WET_ALBEDO
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes ranges that count in the wrong order.
    #[test]
    fn the_last_range_counts() {
        let all = f64::NEG_INFINITY..f64::INFINITY;
        let range = |chainage_m, wet| WetRange {
            track: None,
            chainage_m,
            wet,
        };
        let mut wet = Wet {
            ranges: vec![
                range(all, true),
                range(10.0..20.0, false),
                range(15.0..18.0, true),
            ],
        };
        let at = |wet: &Wet, s_m| wet.at(0, s_m);
        assert!(at(&wet, 0.0) && !at(&wet, 12.0) && at(&wet, 16.0) && !at(&wet, 19.0));
        assert!(at(&wet, 20.0) && !at(&Wet::default(), 0.0));
        assert!((wet.albedo_factor(Material::Bed, 0, 0.0) - 0.6).abs() < 1e-12);
        assert!((wet.albedo_factor(Material::Lining, 0, 0.0) - 1.0).abs() < 1e-12);
        wet.ranges[1].track = Some(1);
        assert!(at(&wet, 12.0) && !wet.at(1, 12.0));
    }
}
