//! What a group of balises is, if a hypothesis is right: the train's own, of a track abreast, or from anywhere.

use nalgebra::Point2;

/// Probability that a group of balises is not of the train's track: cross-talk (a balise 1.4 m beside the antenna must not
/// be read, SUBSET-036), or a map with the group on a wrong track.
pub const FOREIGN: f64 = 1e-6;
/// Of these, the share that is from anywhere, and not from a track abreast.
const FROM_ANYWHERE: f64 = 0.5;

/// Balises of a group are no farther from one to the next, metres: 12 m (SUBSET-040) and what a map may be off.
const GROUP_M: f64 = 15.0;

/// A group of balises, if a hypothesis is right.
#[derive(Clone, Copy, Debug)]
pub struct BaliseGroup {
    pub element: usize,
    /// Of its last balise that was read, on the map.
    pub place: Point2<f64>,
    pub of: GroupOf,
}

/// Probabilities of what a group is: the train's own, of a track abreast, from anywhere.
#[derive(Clone, Copy, Debug)]
pub struct GroupOf {
    pub own: f64,
    pub abreast: f64,
    pub anywhere: f64,
}

impl BaliseGroup {
    /// Whether a balise of an element is one of it.
    pub fn has(&self, element: usize, place: &Point2<f64>) -> bool {
        self.element == element && (self.place - place).norm() < GROUP_M
    }
}

impl GroupOf {
    /// Before one of its balises is read.
    pub const UNREAD: Self = Self {
        own: 1.0 - FOREIGN,
        abreast: FOREIGN * (1.0 - FROM_ANYWHERE),
        anywhere: FOREIGN * FROM_ANYWHERE,
    };

    /// After a reading that has these densities, and the density of the reading. No group is ever the train's own for certain,
    /// or not.
    pub fn after(&self, density: &Self) -> (Self, f64) {
        let [own, abreast, anywhere] = [
            self.own * density.own,
            self.abreast * density.abreast,
            self.anywhere * density.anywhere,
        ];
        let sum = own + abreast + anywhere;
        let after = Self {
            own: (own / sum).clamp(FOREIGN, 1.0 - FOREIGN),
            abreast: abreast / sum,
            anywhere: anywhere / sum,
        };
        (after, sum)
    }
}
