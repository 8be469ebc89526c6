//! What must stay free around the track, and the rails themselves.
//!
//! The gauge is that of a B1 car (2.8 m wide, 3.8 m high), after GB 50157 and CJJ 96 simplified
//! to a symmetrical polygon: the standards give dozens of corner points for every kind of line,
//! here eight keep their governing widths (platform edge at 1.5 m below floor level, equipment at
//! 1.6 m above it, 0.2 m over the roof). In curves it widens by what a car's ends swing out.

use super::section::{BED_M, CrossSection, Material, OutlinePoint, SectionRange, Side};

/// Distance of a rail's centre from the centreline (1435 mm gauge and a 70 mm head).
pub const RAIL_OFFSET_M: f64 = 0.7525;
/// Width of a rail's head; rails are drawn as boxes of it.
pub const RAIL_WIDTH_M: f64 = 0.07;

/// Outline of a rail whose centre is `centre_m` left of the centreline, under the conventions of
/// [`CrossSection`]: up its left side, over the head, down its right side.
pub fn rail_outline(centre_m: f64) -> CrossSection {
    let (left_m, right_m) = (centre_m + 0.5 * RAIL_WIDTH_M, centre_m - 0.5 * RAIL_WIDTH_M);
    CrossSection {
        points: vec![
            OutlinePoint::new(left_m, BED_M),
            OutlinePoint::new(left_m, 0.0),
            OutlinePoint::new(right_m, 0.0),
            OutlinePoint::new(right_m, BED_M),
        ],
        materials: vec![Material::Rail; 4],
        closed: false,
    }
}

/// Throw of a B1 car's end in a curve of 1 m radius: (19.52^2 - 12.6^2) / 8, with the length over
/// couplers and the distance of bogie centres in metres.
const END_THROW_M2: f64 = 27.8;

/// Half widths of the structure gauge, from below to above: (h, l).
const HALF_WIDTHS: [(f64, f64); 5] = [
    (0.0, 1.35),
    (0.3, 1.45),
    (1.1, 1.45),
    (3.3, 1.60),
    (4.0, 1.20),
];

/// The structure gauge: nothing may stand inside of it.
///
/// ```
/// use metrotwin::track::Gauge;
///
/// let gauge = Gauge::b1(0.0);
/// assert!(gauge.contains(0.0, 0.2)); // a toolbox between the rails
/// assert!(!gauge.contains(2.7, 3.2)); // a lamp on the wall
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    widening_m: f64,
}

impl Gauge {
    /// Of a B1 car where the track has a plan curvature (either sign).
    pub fn b1(curvature_per_m: f64) -> Self {
        Self {
            widening_m: END_THROW_M2 * curvature_per_m.abs(),
        }
    }

    /// Half of its width where it is widest.
    pub fn widest_m(&self) -> f64 {
        let widest = HALF_WIDTHS.iter().map(|(_, l_m)| *l_m).fold(0.0, f64::max);
        widest + self.widening_m
    }

    /// Its height over top of rail.
    pub fn top_m(&self) -> f64 {
        HALF_WIDTHS[HALF_WIDTHS.len() - 1].0
    }

    /// Half of its width at a height; `None` under top of rail and over its top.
    pub fn half_width_m(&self, h_m: f64) -> Option<f64> {
        HALF_WIDTHS
            .windows(2)
            .find(|w| (w[0].0..=w[1].0).contains(&h_m))
            .map(|w| {
                let ((h0, l0), (h1, l1)) = (w[0], w[1]);
                l0 + (l1 - l0) * (h_m - h0) / (h1 - h0) + self.widening_m
            })
    }

    /// Whether (l, h) is inside.
    pub fn contains(&self, l_m: f64, h_m: f64) -> bool {
        self.half_width_m(h_m).is_some_and(|w| l_m.abs() <= w)
    }

    /// Whether any of a box is inside: its centre left of the centreline and above top of rail, and
    /// half of its width and height. Under top of rail the train's own gear hangs, as wide as the
    /// gauge's foot.
    pub fn fouled_by(&self, centre: [f64; 2], half: [f64; 2]) -> bool {
        let low_m = (centre[1] - half[1]).max(0.0);
        let half_m = self.half_width_m(low_m);
        half_m.is_some_and(|half_m| centre[0].abs() - half[0] < half_m)
    }

    /// Its corners: up the right side, down the left one.
    pub fn outline(&self) -> Vec<OutlinePoint> {
        let corner = |sign: f64| {
            move |&(h, l): &(f64, f64)| OutlinePoint::new(sign * (l + self.widening_m), h)
        };
        let right = HALF_WIDTHS.iter().map(corner(-1.0));
        right
            .chain(HALF_WIDTHS.iter().rev().map(corner(1.0)))
            .collect()
    }
}

impl SectionRange {
    /// Lateral offsets of its rails' centres, metres, positive to the left.
    pub fn rails_m(&self) -> impl Iterator<Item = f64> + use<> {
        let missing = self.missing_rail;
        let sides = [Side::Left, Side::Right].into_iter();
        let fixed = sides.filter(move |side| missing != Some(*side));
        fixed.map(|side| side.sign() * RAIL_OFFSET_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Provokes: a gauge narrower than the car that runs in it, or one that the platform edge
    /// or a walkway would foul.
    #[test]
    fn val_holds_a_b1_car_and_clears_the_platform() {
        let gauge = Gauge::b1(0.0);
        for (l, h) in [(1.4, 0.2), (1.4, 1.1), (1.3, 3.8), (0.0, 3.99)] {
            assert!(gauge.contains(l, h) && gauge.contains(-l, h), "{l} {h}");
        }
        assert!(!gauge.contains(1.5, 1.05));
        assert!(!gauge.contains(1.6, 0.9));
        assert!(!gauge.contains(0.0, -0.1) && !gauge.contains(0.0, 4.1));
    }

    /// Provokes: a rail drawn at the wrong gauge: 1435 mm between the heads' inner faces.
    #[test]
    fn val_rails_are_standard_gauge() {
        let [left, right] = [RAIL_OFFSET_M, -RAIL_OFFSET_M].map(|c| rail_outline(c).points);
        assert!((left[2].l_m - right[1].l_m - 1.435).abs() < 1e-12);
    }

    /// Provokes: a rail whose faces look inwards: going round it, the metal is on the right.
    #[test]
    fn rails_face_outwards() {
        for edge in rail_outline(RAIL_OFFSET_M).edges() {
            let (l, h) = (
                0.5 * (edge.a.l_m + edge.b.l_m),
                0.5 * (edge.a.h_m + edge.b.h_m),
            );
            let (nl, nh) = edge.normal();
            assert!((l - RAIL_OFFSET_M) * nl + (h - 0.5 * BED_M) * nh > 0.0);
        }
    }
}
