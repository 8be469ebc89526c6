//! A wall across the line, which closes a cross-section where it ends and what follows is narrower.

use super::free_space::Trapezoid;
use crate::track::{BED_M, CrossSection, Direction, Material};
use nalgebra::{Point3, Vector2, Vector3};

/// A wall across a track.
#[derive(Clone, Debug)]
pub struct EndWall {
    /// Chainage of its plane.
    pub s_m: f64,
    /// It is seen by who looks up or down the line.
    pub seen_looking: Direction,
    /// The section range of the track that it closes.
    pub range: usize,
    /// All of it, left of the track's centreline and over its top of rail.
    pub pieces: Vec<Trapezoid>,
    /// Whose paint it bears.
    pub paint: WallPaint,
}

/// A stretch of painted wall.
#[derive(Clone, Copy, Debug)]
pub struct WallPaint {
    /// The section range of the track that it is of.
    pub of_range: usize,
    /// Where it begins over the bed, metres along the outline.
    foot_m: f64,
    /// Whether the outline runs up (1) or down (-1) there.
    pub rise: f64,
}

/// A vertical plane across a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub origin: Point3<f64>,
    /// Up the line in plan.
    pub forward: Vector2<f64>,
}

impl Plane {
    pub fn left(&self) -> Vector3<f64> {
        Vector3::new(-self.forward.y, self.forward.x, 0.0)
    }

    /// Left and up of its origin.
    pub fn across(&self, p: &Point3<f64>) -> (f64, f64) {
        let from = p - self.origin;
        (self.left().dot(&from), from.z)
    }
}

impl EndWall {
    /// Whether (l, h) is on it.
    pub(super) fn contains(&self, across: &Vector2<f64>) -> bool {
        let mut pieces = self.pieces.iter();
        pieces.any(|piece| piece.contains(across.x, across.y))
    }

    /// Towards who sees it, where the line runs this way in plan.
    pub fn normal(&self, forward: &Vector2<f64>) -> Vector3<f64> {
        forward.push(0.0) * -self.seen_looking.sign()
    }
}

impl WallPaint {
    /// That of the highest upright wall of a section, if it has any.
    pub(super) fn of(range: usize, section: &CrossSection) -> Option<Self> {
        let mut q_m = 0.0;
        let mut best: Option<(f64, Self)> = None;
        for edge in section.edges() {
            let climb_m = edge.b.h_m - edge.a.h_m;
            let upright = edge.material == Material::Lining && climb_m != 0.0;
            if upright && best.is_none_or(|(most_m, _)| climb_m.abs() > most_m) {
                let rise = climb_m.signum();
                let foot_m = q_m - rise * (edge.a.h_m - BED_M);
                let paint = Self {
                    of_range: range,
                    foot_m,
                    rise,
                };
                best = Some((climb_m.abs(), paint));
            }
            q_m += edge.length_m();
        }
        best.map(|(_, paint)| paint)
    }

    /// Where the paint of a place of a wall is on the painting: along the line and along the outline.
    pub fn place_m(&self, s_m: f64, l_m: f64, h_m: f64) -> [f64; 2] {
        [s_m + l_m, self.foot_m + self.rise * (h_m - BED_M)]
    }
}
