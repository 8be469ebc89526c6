//! What a body or a collider belongs to.

use crate::bus::TrainId;

/// One of the obstacles, cables, workers or trains, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Entity {
    Obstacle(usize),
    Cable(usize),
    Worker(usize),
    Train(TrainId),
}

impl Entity {
    /// As rapier keeps it with a body or a collider; 0 is nothing of these.
    pub(super) fn user_data(self) -> u128 {
        let (kind, k) = match self {
            Self::Obstacle(k) => (1, k),
            Self::Cable(k) => (2, k),
            Self::Worker(k) => (3, k),
            Self::Train(id) => (4, id.index()),
        };
        (kind << 64) | k as u128
    }

    /// From what rapier keeps.
    pub(super) fn of(user_data: u128) -> Option<Self> {
        let k = user_data as u64 as usize;
        match user_data >> 64 {
            1 => Some(Self::Obstacle(k)),
            2 => Some(Self::Cable(k)),
            3 => Some(Self::Worker(k)),
            4 => Some(Self::Train(TrainId::from_index(k))),
            _ => None,
        }
    }
}

/// Name of a train in messages and summaries.
pub(super) fn train_name(id: TrainId) -> String {
    match id.index() {
        0 => "train".to_owned(),
        number => format!("other train {number}"),
    }
}
