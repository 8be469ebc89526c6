//! Mirror images of bodies in the walls of a tunnel.
//!
//! A wall that is smooth to the wave at grazing angles mirrors it. By the method of images, what comes over a wall comes
//! from where the body's mirror image is, in a straight line: its length and its direction are those of the image. An echo
//! may take the wall on the way out, on the way back, or on both; the first two are as long as each other and are seen
//! between the body and its image, the third where the image is.
//!
//! Around a body the section halfway to it is cut into the planes of its walls, straight along the line there. A plane
//! gives an image where the point of reflection lies on that piece of the outline, where the radar meets the wall there
//! first, and where that point sees the body. Each bounce costs `wall_loss_db`.
//!
//! Not modelled: two bounces on one way, walls that curve along the way, the bed, other bodies as mirrors. The body has
//! the cross-section that it has straight towards the radar.

use super::scatterers::{Centre, RadarSight};
use crate::track::{Edge, Material, TrackFrame};
use nalgebra::{Point3, Vector3};

/// Shorter pieces of outline are no mirrors.
const MIRROR_M: f64 = 0.3;
/// Points of reflection so far off the ends of a piece still count.
const EDGE_M: f64 = 1e-3;

/// A wall, straight along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// A point of it, the begin of its piece of outline.
    pub place: Point3<f64>,
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Unit vector along the outline.
    pub along: Vector3<f64>,
    /// Length of the piece of outline.
    pub length_m: f64,
}

/// A body's centre as it is seen over a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Where it seems to be.
    pub place: Point3<f64>,
    /// How it seems to move.
    pub velocity_mps: Vector3<f64>,
    /// Where the wave meets the wall.
    pub bounce: Point3<f64>,
}

impl Mirror {
    /// The walls of an outline in the frame of a place on the line; floors are none.
    pub fn of_outline(frame: &TrackFrame, edges: impl Iterator<Item = Edge>) -> Vec<Self> {
        let line = frame.world_from_line().rotation;
        let wall = |edge: Edge| {
            let is_wall = !matches!(edge.material, Material::Bed | Material::Rail);
            let length_m = edge.length_m();
            let (across, up) = edge.normal();
            (is_wall && length_m >= MIRROR_M).then(|| Self {
                place: frame.world_from_section(edge.a.l_m, edge.a.h_m),
                normal: line * Vector3::new(0.0, across, up),
                along: line * Vector3::new(0.0, edge.b.l_m - edge.a.l_m, edge.b.h_m - edge.a.h_m)
                    / length_m,
                length_m,
            })
        };
        edges.filter_map(wall).collect()
    }

    /// The image of a centre for a radar; none where the reflection would not be on this piece of wall, between the two.
    pub fn image(
        &self,
        radar: &Point3<f64>,
        place: &Point3<f64>,
        velocity: &Vector3<f64>,
    ) -> Option<Image> {
        let [near_m, far_m] = [radar, place].map(|p| self.normal.dot(&(p - self.place)));
        if near_m <= 0.0 || far_m <= 0.0 {
            return None;
        }
        let image = place - self.normal * (2.0 * far_m);
        let bounce = radar + (image - radar) * (near_m / (near_m + far_m));
        let along_m = self.along.dot(&(bounce - self.place));
        (-EDGE_M..=self.length_m + EDGE_M)
            .contains(&along_m)
            .then(|| Image {
                place: image,
                velocity_mps: velocity - self.normal * (2.0 * self.normal.dot(velocity)),
                bounce,
            })
    }
}

/// The images of a centre that a radar really sees.
pub fn images<'a>(
    centre: &'a Centre,
    mirrors: &'a [Mirror],
    sight: &'a RadarSight<'_>,
) -> impl Iterator<Item = Image> + 'a {
    let radar = sight.radar();
    let all = mirrors.iter();
    let all =
        all.filter_map(move |mirror| mirror.image(&radar, &centre.place, &centre.velocity_mps));
    all.filter(|image| {
        let off = image.bounce + (centre.place - image.bounce).normalize() * 0.1;
        sight.meets_wall_at(&image.bounce)
            && sight.is_between_free(&off, &centre.place, centre.owner)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Alignment, CrossSection, PlanElement};

    fn straight() -> Alignment {
        let elements = [PlanElement::straight(200.0)];
        Alignment::new(Point3::new(10.0, 20.0, 0.0), 0.4, &elements, &[])
    }

    fn walls() -> Vec<Mirror> {
        let line = straight();
        let section = CrossSection::rectangular(2.5, 2.0, 4.5, None, None);
        Mirror::of_outline(&line.at(50.0), section.edges())
    }

    /// Against mirrors by hand: walls 2.5 m to the left and 2 m to the right, a ceiling at 4.5 m, and no bed.
    #[test]
    fn images_are_mirrored_exactly() {
        let line = straight();
        let at = |s: f64, l: f64, h: f64| line.at(s).world_from_section(l, h);
        let (radar, body) = (at(10.0, 0.5, 1.0), at(90.0, -0.5, 1.5));
        let velocity = line.at(90.0).left() * 1.5 + line.at(90.0).ahead() * -3.0;
        let images: Vec<Image> = walls()
            .iter()
            .filter_map(|m| m.image(&radar, &body, &velocity))
            .collect();
        assert_eq!(images.len(), 3);
        for expected in [at(90.0, 5.5, 1.5), at(90.0, -3.5, 1.5), at(90.0, -0.5, 7.5)] {
            let image = images.iter().find(|i| (i.place - expected).norm() < 1e-9);
            assert!(image.is_some(), "{expected} is none of {images:?}");
            // Angle in is angle out: the bent way is as long as the straight one to the image.
            let bent = image.map_or(0.0, |i| {
                (i.bounce - radar).norm() + (body - i.bounce).norm()
            });
            assert!((bent - (expected - radar).norm()).abs() < 1e-9);
        }
        let left = images
            .iter()
            .find(|i| (i.place - at(90.0, 5.5, 1.5)).norm() < 1e-9);
        let seen = left.map(|i| {
            [
                i.velocity_mps.dot(&line.at(90.0).left()),
                i.velocity_mps.norm(),
            ]
        });
        assert!(seen.is_some_and(
            |[across, all]| (across + 1.5).abs() < 1e-9 && (all - velocity.norm()).abs() < 1e-9
        ));
    }

    /// A low wall mirrors nothing that passes over it, and nothing on its far side.
    #[test]
    fn a_wall_mirrors_only_where_it_is() {
        let line = straight();
        let trough = CrossSection::trough(2.5, 2.5, 0.8);
        let mirrors = Mirror::of_outline(&line.at(50.0), trough.edges());
        let at = |l: f64, h: f64, s: f64| line.at(s).world_from_section(l, h);
        let count = |h: f64, l: f64| {
            let seen = mirrors
                .iter()
                .filter_map(|m| m.image(&at(0.0, h, 10.0), &at(l, h, 60.0), &Vector3::zeros()));
            seen.count()
        };
        assert_eq!(
            [count(0.5, 0.0), count(1.0, 0.0), count(0.5, 3.0)],
            [2, 0, 1]
        );
    }
}
