//! Who may touch whom: two colliders meet where the groups of each are among those that the other
//! one touches.

use rapier3d_f64::prelude::{Group, InteractionGroups, InteractionTestMode};

/// The train that a scenario is about hits obstacles and other trains.
pub(super) const TRAIN_GROUP: Group = Group::GROUP_1;
/// Things, cables and workers.
pub(super) const OBSTACLE_GROUP: Group = Group::GROUP_2;
/// The ground is hit by obstacles only.
pub(super) const GROUND_GROUP: Group = Group::GROUP_3;
/// What cables lie on: they do not touch each other.
pub(super) const SOLID_GROUP: Group = Group::GROUP_4;
/// Trains that a scenario is not about.
pub(super) const OTHER_TRAIN_GROUP: Group = Group::GROUP_5;

/// A member of some groups that touches those of others.
pub(super) fn groups(member: Group, of: Group) -> InteractionGroups {
    InteractionGroups::new(member, of, InteractionTestMode::And)
}

/// What lies or flies about.
pub(super) fn loose() -> InteractionGroups {
    let all = OBSTACLE_GROUP | TRAIN_GROUP | GROUND_GROUP;
    groups(OBSTACLE_GROUP | SOLID_GROUP, all)
}

/// What is fixed would stop the train dead: the train meets it without force, which tears it off.
pub(super) fn fixed() -> InteractionGroups {
    groups(OBSTACLE_GROUP | SOLID_GROUP, OBSTACLE_GROUP | GROUND_GROUP)
}
