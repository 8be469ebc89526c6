//! Which elements come near a place, by squares of the plane.

use super::TrackElement;
use nalgebra::Point2;
use std::collections::BTreeMap;

/// Side of a square.
const SIDE_M: f64 = 50.0;
/// Straights that are longer are put into all squares that their ends span, so many at most.
const MOST_SQUARES: i64 = 1 << 14;

/// Numbers of elements by square.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    squares: BTreeMap<(i64, i64), Vec<usize>>,
    /// Elements with a straight that spans too many squares.
    everywhere: Vec<usize>,
}

impl Grid {
    pub fn of(elements: &[TrackElement]) -> Self {
        let mut grid = Self::default();
        for (number, element) in elements.iter().enumerate() {
            let points: Vec<_> = element.points().map(|(p, _)| *p).collect();
            for pair in points.windows(2) {
                grid.add(number, &pair[0].inf(&pair[1]), &pair[0].sup(&pair[1]));
            }
        }
        grid
    }

    fn add(&mut self, number: usize, low: &Point2<f64>, high: &Point2<f64>) {
        let (from, to) = (square(low), square(high));
        let spanned = (to.0 - from.0 + 1).saturating_mul(to.1 - from.1 + 1);
        if spanned > MOST_SQUARES {
            if self.everywhere.last() != Some(&number) {
                self.everywhere.push(number);
            }
            return;
        }
        for x in from.0..=to.0 {
            for y in from.1..=to.1 {
                let square = self.squares.entry((x, y)).or_default();
                if square.last() != Some(&number) {
                    square.push(number);
                }
            }
        }
    }

    /// Elements that may come so near, each once, in order.
    pub fn near(&self, place: &Point2<f64>, within_m: f64) -> Vec<usize> {
        let reach = nalgebra::Vector2::repeat(within_m);
        let (from, to) = (square(&(place - reach)), square(&(place + reach)));
        let rows = self.squares.range((from.0, from.1)..=(to.0, to.1));
        let squares = rows.filter(|((_, y), _)| (from.1..=to.1).contains(y));
        let mut found = self.everywhere.clone();
        found.extend(squares.flat_map(|(_, numbers)| numbers));
        found.sort_unstable();
        found.dedup();
        found
    }
}

fn square(place: &Point2<f64>) -> (i64, i64) {
    let [x, y] = [place.x, place.y].map(|m| (m / SIDE_M).floor() as i64);
    (x, y)
}
