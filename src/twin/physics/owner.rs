//! Who a body or a collider belongs to.

/// One of the things, cables, workers or other trains, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Thing(usize),
    Cable(usize),
    Worker(usize),
    /// Another train, not the one that a scenario is about.
    Train(usize),
}

impl Owner {
    /// As rapier keeps it with a body, in its `user_data`; 0 is nobody's.
    pub(super) fn id(self) -> u128 {
        let (kind, k) = match self {
            Self::Thing(k) => (1, k),
            Self::Cable(k) => (2, k),
            Self::Worker(k) => (3, k),
            Self::Train(k) => (4, k),
        };
        (kind << 64) | k as u128
    }

    /// From a `user_data`.
    pub(super) fn of(id: u128) -> Option<Self> {
        let k = id as u64 as usize;
        match id >> 64 {
            1 => Some(Self::Thing(k)),
            2 => Some(Self::Cable(k)),
            3 => Some(Self::Worker(k)),
            4 => Some(Self::Train(k)),
            _ => None,
        }
    }
}
