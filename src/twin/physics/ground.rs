//! What obstacles fall on: slabs behind the tunnel's outline and boxes for the rails, laid along
//! the line in short lengths, and only where there is something to fall.

use super::groups::{GROUND_GROUP, OBSTACLE_GROUP, groups};
use crate::track::network::Network;
use crate::track::{
    BED_M, CrossSection, Edge, Material, OutlinePoint, Place, RAIL_OFFSET_M, Track, TrackId,
    rail_outline,
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::{ColliderBuilder, PhysicsWorld};
use std::collections::BTreeSet;

/// Length of a slab: at a radius of 300 m it is 2 mm off the curve.
const SLAB_M: f64 = 2.0;
const SLAB_THICKNESS_M: f64 = 0.2;
/// Concrete.
const FRICTION: f64 = 0.6;
/// How far from a place the ground is laid down and up the line; hit by a train, things fly on.
const BEHIND_M: f64 = 12.0;
const AHEAD_M: f64 = 60.0;

/// The slabs laid so far, by track and number along it.
#[derive(Clone, Default)]
pub(super) struct Ground {
    laid: BTreeSet<(TrackId, i64)>,
}

impl Ground {
    /// Lays what is missing around a place; where that track shares the section of another one, around that too.
    pub(super) fn lay(&mut self, world: &mut PhysicsWorld, network: &Network, place: Place) {
        let Some(track) = network.track(place.track) else {
            return;
        };
        let first = ((place.s_m - BEHIND_M) / SLAB_M).floor() as i64;
        let last = ((place.s_m + AHEAD_M) / SLAB_M).ceil() as i64;
        for k in first..last {
            let s_m = (k as f64 + 0.5) * SLAB_M;
            if !self.laid.insert((place.track, k)) {
                continue;
            }
            lay_slabs(world, track, s_m);
            let host = network.host(Place { s_m, ..place });
            let host = host.filter(|host| {
                let k = (host.s_m / SLAB_M).floor() as i64;
                self.laid.insert((host.track, k))
            });
            if let Some((track, s_m)) = host.and_then(|h| Some((network.track(h.track)?, h.s_m))) {
                let middle_m = ((s_m / SLAB_M).floor() + 0.5) * SLAB_M;
                lay_slabs(world, track, middle_m);
            }
        }
    }
}

fn lay_slabs(world: &mut PhysicsWorld, track: &Track, s_m: f64) {
    let frame = track.alignment.at(s_m);
    let level = frame.world_from_line();
    match track.section_at(s_m) {
        Some(section) => lay_section(world, section, &level),
        None => {
            let edge = Edge {
                a: OutlinePoint::new(3.0, BED_M),
                b: OutlinePoint::new(-3.0, BED_M),
                material: Material::Bed,
            };
            lay_edge(world, &edge, &level);
        }
    }
    let rails = frame.world_from_rails();
    for centre_m in [RAIL_OFFSET_M, -RAIL_OFFSET_M] {
        let corners = rail_outline(centre_m).points;
        let (a, b) = (corners[0], corners[2]);
        let half = Vector3::new(
            0.5 * SLAB_M,
            0.5 * (a.l_m - b.l_m).abs(),
            0.5 * (a.h_m - b.h_m).abs(),
        );
        let centre = Isometry3::translation(0.0, 0.5 * (a.l_m + b.l_m), 0.5 * (a.h_m + b.h_m));
        insert(world, half, rails * centre);
    }
}

fn lay_section(world: &mut PhysicsWorld, section: &CrossSection, level: &Isometry3<f64>) {
    for edge in section.edges() {
        // A slab behind a rail's side would stick out of its other side: rails are boxes.
        if edge.material != Material::Rail && edge.length_m() > 1e-6 {
            lay_edge(world, &edge, level);
        }
    }
}

/// A slab whose face is the edge.
fn lay_edge(world: &mut PhysicsWorld, edge: &Edge, level: &Isometry3<f64>) {
    let (nl, nh) = edge.normal();
    let middle = Vector3::new(
        0.0,
        0.5 * (edge.a.l_m + edge.b.l_m) - 0.5 * SLAB_THICKNESS_M * nl,
        0.5 * (edge.a.h_m + edge.b.h_m) - 0.5 * SLAB_THICKNESS_M * nh,
    );
    // The slab's z axis is the normal into the tunnel.
    let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), (-nl).atan2(nh));
    let half = Vector3::new(0.5 * SLAB_M, 0.5 * edge.length_m(), 0.5 * SLAB_THICKNESS_M);
    insert(
        world,
        half,
        level * Isometry3::from_parts(Translation3::from(middle), roll),
    );
}

fn insert(world: &mut PhysicsWorld, half: Vector3<f64>, place: Isometry3<f64>) {
    let slab = ColliderBuilder::cuboid(half.x, half.y, half.z)
        .position(place.into())
        .friction(FRICTION)
        .collision_groups(groups(GROUND_GROUP, OBSTACLE_GROUP));
    world.insert_collider(slab, None);
}
