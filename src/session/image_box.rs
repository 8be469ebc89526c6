//! Where a thing is in a camera's picture: the truth that reported regions are held against.

use crate::bus::{Intrinsics, PixelBox};
use nalgebra::{Isometry3, Point3, Vector3};

/// Distance of the points of a face that are looked at: what is partly out of the picture must not be lost
/// between its corners. A face has at most so many each way.
const POINT_M: f64 = 0.5;
const MOST_POINTS: f64 = 64.0;

/// The rectangle around a thing in the picture, in pixels; cut off at the picture's border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageBox {
    /// Left, upper, right and lower side.
    pub sides_px: [f64; 4],
}

impl From<&PixelBox> for ImageBox {
    fn from(b: &PixelBox) -> Self {
        let [left, top, right, bottom] = [b.u0, b.v0, b.u1, b.v1].map(f64::from);
        Self {
            sides_px: [left - 0.5, top - 0.5, right + 0.5, bottom + 0.5],
        }
    }
}

impl ImageBox {
    /// Of a box by its half extents; `None` where nothing of it is in the picture.
    pub fn of_box(
        camera: &Intrinsics,
        camera_from_box: &Isometry3<f64>,
        half_extents_m: &Vector3<f64>,
    ) -> Option<Self> {
        let faces = (0..3).flat_map(|axis| [-1.0, 1.0].map(|side| (axis, side)));
        let points = faces.flat_map(|(axis, side)| {
            let [a, b] = [1, 2].map(|k| (axis + k) % 3);
            let along = |axis: usize| steps(half_extents_m[axis]);
            along(a).flat_map(move |of_a| {
                along(b).map(move |of_b| {
                    let mut p = Vector3::zeros();
                    (p[axis], p[a], p[b]) = (side, of_a, of_b);
                    p
                })
            })
        });
        let seen = points.filter_map(|p| {
            let p = camera_from_box * Point3::from(p.component_mul(half_extents_m));
            camera.project(&p).filter(|pixel| camera.contains(pixel))
        });
        let around = seen.map(|p| [p.x, p.y, p.x, p.y]).reduce(|a, b| {
            [
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[2].max(b[2]),
                a[3].max(b[3]),
            ]
        });
        around.map(|sides_px| Self { sides_px })
    }

    fn area(&self) -> f64 {
        let [left, top, right, bottom] = self.sides_px;
        (right - left).max(0.0) * (bottom - top).max(0.0)
    }

    fn common(&self, other: &Self) -> f64 {
        let [a, b] = [self.sides_px, other.sides_px];
        let common = Self {
            sides_px: [
                a[0].max(b[0]),
                a[1].max(b[1]),
                a[2].min(b[2]),
                a[3].min(b[3]),
            ],
        };
        common.area()
    }

    /// What both have in common over what either has.
    pub fn over_union(&self, other: &Self) -> f64 {
        let common = self.common(other);
        common / (self.area() + other.area() - common).max(1e-9)
    }

    /// What both have in common over the smaller of them.
    pub fn over_smaller(&self, other: &Self) -> f64 {
        self.common(other) / self.area().min(other.area()).max(1e-9)
    }
}

/// From -1 to 1, in steps of [`POINT_M`] or less of a half extent.
fn steps(half_m: f64) -> impl Iterator<Item = f64> {
    let count = (2.0 * half_m / POINT_M).ceil().clamp(1.0, MOST_POINTS) as u32;
    (0..=count).map(move |k| 2.0 * f64::from(k) / f64::from(count) - 1.0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use nalgebra::Translation3;

    fn camera() -> Intrinsics {
        Intrinsics::centred(1000, 600, 500.0)
    }

    fn seen(x: f64, z: f64, half_m: [f64; 3]) -> Option<ImageBox> {
        let place = Isometry3::from(Translation3::new(x, 0.0, z));
        ImageBox::of_box(&camera(), &place, &half_m.into())
    }

    /// A cube of 1 m whose face is 5 m away has 100 px at 500 px focal length; one behind the camera or
    /// beside the picture has nothing; one that reaches past the camera is cut at the border.
    #[test]
    fn a_box_has_the_outline_of_its_nearest_face() {
        let sides = seen(0.0, 5.5, [0.5; 3]).unwrap().sides_px;
        for (side, expected) in sides.into_iter().zip([449.5, 249.5, 549.5, 349.5]) {
            assert!((side - expected).abs() < 1e-9, "{sides:?}");
        }
        assert_eq!(seen(0.0, -5.0, [0.5; 3]), None);
        assert_eq!(seen(20.0, 5.5, [0.5; 3]), None);
        let long = seen(2.0, 0.0, [0.5, 0.5, 20.0]).unwrap().sides_px;
        assert!(long[0] < 550.0 && long[2] > 850.0, "{long:?}");
    }

    /// A box within another has all of itself in common with it, and little of both.
    #[test]
    fn shares_of_what_is_common() {
        let [large, small, apart] = [[0.0, 0.0, 10.0, 10.0], [2.0, 2.0, 4.0, 4.0], [20.0; 4]]
            .map(|sides_px| ImageBox { sides_px });
        assert!((large.over_smaller(&small) - 1.0).abs() < 1e-12);
        assert!((large.over_union(&small) - 0.04).abs() < 1e-12);
        assert!(large.over_union(&apart).abs() < 1e-12);
    }
}
