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

/// Where the line is wet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wet {
    /// Ranges of chainage and whether they are; the last one that holds a place counts.
    pub ranges: Vec<(Range<f64>, bool)>,
}

impl Wet {
    /// Whether it is wet at a chainage.
    pub fn at(&self, s_m: f64) -> bool {
        let covers = self
            .ranges
            .iter()
            .rev()
            .find(|(range, _)| range.contains(&s_m));
        covers.is_some_and(|(_, wet)| *wet)
    }

    /// By how much the diffuse light of a surface is less.
    pub fn albedo_factor(&self, material: Material, s_m: f64) -> f64 {
        if material == Material::Bed && self.at(s_m) {
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
        let wet = Wet {
            ranges: vec![(all, true), (10.0..20.0, false), (15.0..18.0, true)],
        };
        assert!(wet.at(0.0) && !wet.at(12.0) && wet.at(16.0) && !wet.at(19.0) && wet.at(20.0));
        assert!(!Wet::default().at(0.0));
        assert!((wet.albedo_factor(Material::Bed, 0.0) - 0.6).abs() < 1e-12);
        assert!((wet.albedo_factor(Material::Lining, 0.0) - 1.0).abs() < 1e-12);
    }
}
