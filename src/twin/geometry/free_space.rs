//! Free space in a plane across the line, and what is left of it without that of others.

use crate::track::CrossSection;
use nalgebra::Vector2;

/// A piece of a plane across the line: level below and above, straight on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trapezoid {
    /// Heights of its bottom and of its top over top of rail.
    pub h_m: [f64; 2],
    /// l of its right side at the bottom and at the top, metres left of the centreline.
    pub right_m: [f64; 2],
    /// The same of its left side.
    pub left_m: [f64; 2],
}

/// What is narrower or lower is no piece.
const LEAST_M: f64 = 1e-3;

impl Trapezoid {
    /// Whether (l, h) is in it.
    pub fn contains(&self, l_m: f64, h_m: f64) -> bool {
        let share = self.share(h_m);
        let at = |side: [f64; 2]| side[0] + share * (side[1] - side[0]);
        (0.0..=1.0).contains(&share) && (at(self.right_m)..=at(self.left_m)).contains(&l_m)
    }

    /// How far up a height is: 0 at the bottom, 1 at the top.
    fn share(&self, h_m: f64) -> f64 {
        (h_m - self.h_m[0]) / (self.h_m[1] - self.h_m[0])
    }

    fn width_m(&self) -> f64 {
        0.5 * (self.left_m[0] + self.left_m[1] - self.right_m[0] - self.right_m[1])
    }

    /// Both in one, where one goes on above the other in the same lines.
    fn joined(&self, above: &Self) -> Option<Self> {
        let both = Self {
            h_m: [self.h_m[0], above.h_m[1]],
            right_m: [self.right_m[0], above.right_m[1]],
            left_m: [self.left_m[0], above.left_m[1]],
        };
        let share = both.share(self.h_m[1]);
        let straight = |whole: [f64; 2], here: [f64; 2], next: [f64; 2]| {
            let middle = whole[0] + share * (whole[1] - whole[0]);
            (middle - here[1]).abs() < 1e-9 && (middle - next[0]).abs() < 1e-9
        };
        let meet = (self.h_m[1] - above.h_m[0]).abs() < 1e-12;
        let straight = straight(both.right_m, self.right_m, above.right_m)
            && straight(both.left_m, self.left_m, above.left_m);
        (meet && straight).then_some(both)
    }
}

/// The free space of a cross-section as corners (l, h); that of an open one ends at a height.
pub fn free_space(section: &CrossSection, top_m: f64) -> Vec<Vector2<f64>> {
    let points = section.points.iter().map(|p| Vector2::new(p.l_m, p.h_m));
    let mut corners: Vec<_> = points.collect();
    if let (false, [first, .., last]) = (section.closed, corners.as_slice()) {
        let over = [last.x, first.x].map(|l_m| Vector2::new(l_m, top_m));
        corners.extend(over);
    }
    corners
}

/// A polygon without others, in pieces.
pub fn difference(polygon: &[Vector2<f64>], others: &[Vec<Vector2<f64>>]) -> Vec<Trapezoid> {
    let mut pieces: Vec<Trapezoid> = Vec::new();
    for pair in levels(polygon, others).windows(2) {
        let slab = [pair[0], pair[1]];
        let mut left_over = intervals(polygon, slab);
        for cut in others.iter().flat_map(|other| intervals(other, slab)) {
            left_over = left_over.iter().flat_map(|i| cut_out(i, &cut)).collect();
        }
        for piece in left_over.into_iter().filter(|i| i.width_m() > LEAST_M) {
            let grown = pieces.iter_mut().rev().find_map(|below| {
                let both = below.joined(&piece)?;
                *below = both;
                Some(())
            });
            if grown.is_none() {
                pieces.push(piece);
            }
        }
    }
    pieces.retain(|piece| piece.h_m[1] - piece.h_m[0] > LEAST_M);
    pieces
}

/// The heights between which no side begins, ends or crosses another.
fn levels(polygon: &[Vector2<f64>], others: &[Vec<Vector2<f64>>]) -> Vec<f64> {
    let polygons = || std::iter::once(polygon).chain(others.iter().map(Vec::as_slice));
    let sides: Vec<_> = polygons().flat_map(sides).collect();
    let mut all: Vec<f64> = polygons().flatten().map(|corner| corner.y).collect();
    for (k, [a, b]) in sides.iter().enumerate() {
        for [c, d] in &sides[..k] {
            let (u, v, w) = (b - a, d - c, c - a);
            let det = u.perp(&v);
            let [on_first, on_second] = [w.perp(&v) / det, w.perp(&u) / det];
            let both = 0.0..=1.0;
            if det.abs() > 1e-12 && both.contains(&on_first) && both.contains(&on_second) {
                all.push(a.y + on_first * u.y);
            }
        }
    }
    all.sort_by(f64::total_cmp);
    all.dedup_by(|b, a| *b - *a < 1e-9);
    all
}

fn sides(polygon: &[Vector2<f64>]) -> impl Iterator<Item = [Vector2<f64>; 2]> + '_ {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// Where a polygon is between two heights, from right to left.
fn intervals(polygon: &[Vector2<f64>], h_m: [f64; 2]) -> Vec<Trapezoid> {
    let middle_m = 0.5 * (h_m[0] + h_m[1]);
    let across = sides(polygon).filter(|[a, b]| (a.y > middle_m) != (b.y > middle_m));
    let mut lines: Vec<[f64; 2]> = across
        .map(|[a, b]| h_m.map(|h| a.x + (b.x - a.x) * (h - a.y) / (b.y - a.y)))
        .collect();
    lines.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
    let (pairs, _) = lines.as_chunks::<2>();
    let piece = |[right_m, left_m]: &[[f64; 2]; 2]| Trapezoid {
        h_m,
        right_m: *right_m,
        left_m: *left_m,
    };
    pairs.iter().map(piece).collect()
}

/// What is left of a piece on both sides of another one between the same heights.
fn cut_out(piece: &Trapezoid, cut: &Trapezoid) -> Vec<Trapezoid> {
    let right = Trapezoid {
        left_m: cut.right_m,
        ..*piece
    };
    let left = Trapezoid {
        right_m: cut.left_m,
        ..*piece
    };
    let apart = |a: [f64; 2], b: [f64; 2]| a[0] + a[1] <= b[0] + b[1];
    if apart(cut.left_m, piece.right_m) || apart(piece.left_m, cut.right_m) {
        return vec![*piece];
    }
    let rest = [right, left].into_iter();
    rest.filter(|part| part.width_m() > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Side;
    use crate::twin::random::Stream;

    fn rectangle(l: [f64; 2], h: [f64; 2]) -> Vec<Vector2<f64>> {
        [(l[0], h[0]), (l[0], h[1]), (l[1], h[1]), (l[1], h[0])]
            .map(|(l, h)| Vector2::new(l, h))
            .into()
    }

    fn area(pieces: &[Trapezoid]) -> f64 {
        let of = |p: &Trapezoid| p.width_m() * (p.h_m[1] - p.h_m[0]);
        pieces.iter().map(of).sum()
    }

    /// By hand: a hall of 10 m by 4 m without a tunnel and half of another.
    #[test]
    fn rectangles_are_cut_out() {
        let hall = rectangle([-3.0, 7.0], [0.0, 4.0]);
        let tunnels = [
            rectangle([-2.0, 2.0], [0.0, 3.0]),
            rectangle([5.0, 9.0], [-1.0, 5.0]),
        ];
        let pieces = difference(&hall, &tunnels);
        assert!((area(&pieces) - (40.0 - 12.0 - 8.0)).abs() < 1e-9);
        let inside = |l, h| pieces.iter().any(|p| p.contains(l, h));
        assert!(inside(-2.5, 1.0) && inside(0.0, 3.5) && inside(4.9, 2.0));
        assert!(!inside(0.0, 2.9) && !inside(5.1, 2.0) && !inside(0.0, 4.1));
        assert!(difference(&tunnels[0], &[hall]).is_empty());
    }

    /// Fails where a piece is lost, doubled or in the wrong place: against the definition, point by point.
    #[test]
    fn pieces_hold_what_is_in_one_but_not_in_the_other() {
        let bored = CrossSection::circular(3.0, 2.26, Some(Side::Left));
        let hall = CrossSection::rectangular(7.4, 2.9, 4.6, None, None);
        let trough = CrossSection::trough(2.9, 2.9, 5.0);
        let all = [&bored, &hall, &trough];
        let stream = Stream::new(7, 0, "free space");
        for (a, b) in [(0, 1), (1, 0), (2, 0), (2, 1), (0, 2)] {
            let [free, other] = [all[a], all[b]].map(|section| free_space(section, 6.0));
            let pieces = difference(&free, std::slice::from_ref(&other));
            let within = |polygon: &[Vector2<f64>], l: f64, h: f64| {
                sides(polygon).fold(false, |inside, [p, q]| {
                    let crosses =
                        (p.y > h) != (q.y > h) && l < p.x + (q.x - p.x) * (h - p.y) / (q.y - p.y);
                    inside != crosses
                })
            };
            let (mut wrong, mut held) = (0, 0);
            for k in 0..4000 {
                let [l, h] = [0, 1].map(|axis| stream.uniform(2 * k + axis));
                let (l, h) = (-8.0 + 16.0 * l, -1.0 + 8.0 * h);
                let count = pieces.iter().filter(|p| p.contains(l, h)).count();
                let expected = within(&free, l, h) && !within(&other, l, h);
                held += count;
                wrong += usize::from(count != usize::from(expected));
            }
            // Slivers are left out.
            assert!(wrong <= 4, "{wrong} of 4000");
            assert!(held > 0, "{a} without {b}: {held}");
        }
    }
}
