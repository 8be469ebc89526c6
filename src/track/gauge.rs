//! What must stay free around the track, and the rails themselves.
//!
//! The gauge is that of a B1 car (2.8 m wide, 3.8 m high), after GB 50157 and CJJ 96 simplified
//! to a symmetrical polygon: the standards give dozens of corner points for every kind of line,
//! here eight keep their governing widths (platform edge at 1.5 m below floor level, equipment at
//! 1.6 m above it, 0.2 m over the roof). In curves it widens by what a car's ends swing out.

use super::section::OutlinePoint;

/// Height of a rail: its foot is this far under top of rail (176 mm for 60 kg/m rail, rounded).
pub const RAIL_FOOT_M: f64 = -0.17;
/// Distance of a rail's centre from the centreline (1435 mm gauge and a 70 mm head).
pub const RAIL_CENTRE_M: f64 = 0.7525;
/// Width of a rail's head; rails are drawn as boxes of it.
pub const RAIL_WIDTH_M: f64 = 0.07;

/// The rails as rectangles: left, bottom, right and top as (l, h) of two opposite corners.
pub fn rail_boxes() -> [(OutlinePoint, OutlinePoint); 2] {
    [RAIL_CENTRE_M, -RAIL_CENTRE_M].map(|l| {
        (
            OutlinePoint::new(l + 0.5 * RAIL_WIDTH_M, RAIL_FOOT_M),
            OutlinePoint::new(l - 0.5 * RAIL_WIDTH_M, 0.0),
        )
    })
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

    /// Whether any of a box (between two opposite corners) is inside.
    pub fn meets(&self, a: OutlinePoint, b: OutlinePoint) -> bool {
        let nearest_l = if a.l_m * b.l_m <= 0.0 {
            0.0
        } else {
            a.l_m.abs().min(b.l_m.abs())
        };
        let (low, high) = (a.h_m.min(b.h_m), a.h_m.max(b.h_m));
        // The half width is linear between corners: its largest value is at an end or a corner.
        [low, high]
            .into_iter()
            .chain(HALF_WIDTHS.iter().map(|w| w.0))
            .filter(|h| (low..=high).contains(h))
            .any(|h| self.contains(nearest_l, h))
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

    /// Provokes: a box that surrounds the gauge or lies across it being missed.
    #[test]
    fn boxes_meet_it_as_dense_samples_do() {
        let gauge = Gauge::b1(1.0 / 400.0);
        let boxes = [
            (-3.0, -1.0, 3.0, 6.0),
            (1.55, 1.0, 1.8, 4.0),
            (1.75, 0.0, 2.0, 4.0),
            (-0.2, -0.17, 0.2, -0.05),
            (-0.2, -0.17, 0.2, 0.23),
            (1.45, 3.5, 2.0, 3.9),
            (1.6, 3.2, 2.0, 3.4),
        ];
        for (l0, h0, l1, h1) in boxes {
            let sampled = (0..=400).any(|i| {
                (0..=400).any(|k| {
                    gauge.contains(
                        l0 + (l1 - l0) * f64::from(i) / 400.0,
                        h0 + (h1 - h0) * f64::from(k) / 400.0,
                    )
                })
            });
            let met = gauge.meets(OutlinePoint::new(l0, h0), OutlinePoint::new(l1, h1));
            assert_eq!(met, sampled, "{l0} {h0} {l1} {h1}");
        }
    }

    /// Provokes: a rail drawn at the wrong gauge: 1435 mm between the heads' inner faces.
    #[test]
    fn val_rails_are_standard_gauge() {
        let [(_, left_inner), (right_inner, _)] = rail_boxes();
        assert!((left_inner.l_m - right_inner.l_m - 1.435).abs() < 1e-12);
    }
}
