//! What may touch what: two colliders meet where the groups of each are among those that the other
//! one touches.

use crate::bus::TrainId;
use rapier3d_f64::prelude::{Group, InteractionGroups, InteractionTestMode};

/// Obstacles, cables and workers.
pub(super) const OBSTACLE_GROUP: Group = Group::GROUP_2;
/// The ground is hit by obstacles only.
pub(super) const GROUND_GROUP: Group = Group::GROUP_3;
/// What cables lie on: they do not touch each other.
pub(super) const SOLID_GROUP: Group = Group::GROUP_4;
/// All trains. Each has a group of its own among these: cars of one train do not touch each other.
pub(super) const TRAIN_GROUPS: Group =
    Group::from_bits_retain(((1 << TrainId::MOST) - 1) << FIRST_TRAIN_BIT);
const FIRST_TRAIN_BIT: usize = 8;

/// The group of a train.
pub(super) fn train_group(id: TrainId) -> Group {
    Group::from_bits_retain(1 << (FIRST_TRAIN_BIT + id.index())) & TRAIN_GROUPS
}

/// A member of some groups that touches those of others.
pub(super) fn groups(member: Group, of: Group) -> InteractionGroups {
    InteractionGroups::new(member, of, InteractionTestMode::And)
}

/// A train hits obstacles and other trains.
pub(super) fn train(id: TrainId) -> InteractionGroups {
    let own = train_group(id);
    groups(own, OBSTACLE_GROUP | TRAIN_GROUPS.difference(own))
}

/// What lies or flies about.
pub(super) fn loose() -> InteractionGroups {
    let all = OBSTACLE_GROUP | TRAIN_GROUPS | GROUND_GROUP;
    groups(OBSTACLE_GROUP | SOLID_GROUP, all)
}

/// What is fixed would stop a train dead: the train meets it without force, which tears it off.
pub(super) fn fixed() -> InteractionGroups {
    groups(OBSTACLE_GROUP | SOLID_GROUP, OBSTACLE_GROUP | GROUND_GROUP)
}
