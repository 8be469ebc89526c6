#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
use super::super::tunnel::TunnelCaster;
use super::*;
use crate::track::{
    Alignment, CrossSection, Grade, OutlinePoint, PlanElement, RAIL_OFFSET_M, SectionRange,
    TrackPoint, rail_outline,
};
use crate::twin::random::Stream;
use std::sync::Arc;

use parry3d_f64::math::Vector as DVec3;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;
use std::f64::consts::TAU;

const LENGTH_M: f64 = 200.0;

/// A clothoid into an arc of 200 m radius, over a crest.
fn alignment() -> Alignment {
    let element = |length_m: f64, start_per_m: f64, end_per_m: f64| PlanElement {
        length_m,
        start_per_m,
        end_per_m,
        start_cant_m: 0.0,
        end_cant_m: 0.0,
    };
    let grade = |from_m: f64, slope: f64, radius_m: f64| Grade {
        from_m,
        slope,
        radius_m,
    };
    Alignment::new(
        Point3::new(5000.0, -3000.0, 40.0),
        2.1,
        &[
            element(60.0, 0.0, 0.0),
            element(40.0, 0.0, 1.0 / 200.0),
            element(100.0, 1.0 / 200.0, 1.0 / 200.0),
        ],
        &[grade(0.0, 0.02, 0.0), grade(90.0, -0.025, 1500.0)],
    )
}

/// A circle with a flat bed and a walkway that makes it concave.
fn section() -> CrossSection {
    let corner = |l_m: f64, h_m: f64| OutlinePoint { l_m, h_m };
    let mut points = vec![
        corner(2.0, -0.17),
        corner(-1.6, -0.17),
        corner(-1.6, 0.9),
        corner(-2.5, 0.9),
    ];
    points.extend((0..=30).map(|k| {
        let a = 0.5 * TAU + 0.3 - (0.5 * TAU + 0.6) * f64::from(k) / 30.0;
        corner(2.75 * a.cos(), 1.7 + 2.75 * a.sin())
    }));
    let mut materials = vec![Material::Lining; points.len()];
    materials[..3].fill(Material::Walkway);
    materials[0] = Material::Bed;
    CrossSection {
        points,
        materials,
        closed: true,
    }
}

fn track() -> Track {
    Track {
        sections: vec![SectionRange {
            from_m: 0.0,
            to_m: LENGTH_M,
            missing_rail: None,
            section: section(),
        }],
        ..Track::bare("test", alignment())
    }
}

/// The same surface as triangles between stations.
/// What a ray meets, if anything.
fn hit(followed: Followed) -> Option<TrackHit> {
    match followed {
        Followed::Hit(hit) => Some(hit),
        Followed::Left { .. } | Followed::Nothing { .. } => None,
    }
}

fn mesh(track: &Track) -> TriMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let rails = [1.0, -1.0].map(|side| rail_outline(side * RAIL_OFFSET_M));
    for outline in [section()].into_iter().chain(rails) {
        let n = outline.points.len() as u32;
        let base = vertices.len() as u32;
        for k in 0..=LENGTH_M as u32 {
            for p in &outline.points {
                let at = TrackPoint {
                    s_m: f64::from(k),
                    l_m: p.l_m,
                    h_m: p.h_m,
                };
                let p = track.alignment.world_from_track(at);
                vertices.push(DVec3::new(p.x, p.y, p.z));
            }
        }
        for k in 0..LENGTH_M as u32 {
            for i in 0..if outline.closed { n } else { n - 1 } {
                let (a, b) = (base + k * n + i, base + k * n + (i + 1) % n);
                triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

struct Cast {
    inside: TrackPoint,
    o: Point3<f64>,
    d: Vector3<f64>,
}

/// Random rays from inside the tunnel, many of them nearly along it.
fn rays(track: &Track, count: u64) -> impl Iterator<Item = Cast> {
    let random = Stream::new(3, 0, "rays");
    (0..count).map(move |k| {
        let number = |j: u64| random.uniform(8 * k + j);
        let inside = TrackPoint {
            s_m: 10.0 + 180.0 * number(0),
            l_m: 3.0 * number(1) - 1.5,
            h_m: 0.2 + 3.0 * number(2),
        };
        let d = track.alignment.at(inside.s_m).world_from_line()
            * Vector3::new(
                (2.0 * number(3) - 1.0) * 8.0,
                2.0 * number(4) - 1.0,
                2.0 * number(5) - 1.0,
            );
        Cast {
            inside,
            o: track.alignment.world_from_track(inside),
            d: d.normalize(),
        }
    })
}

/// Fails where the walk skips a segment or a cell, or meets an edge of the wrong side: parry's
/// bounding volumes over the same surface as triangles. A triangulated quad on a curve differs
/// from the ruled surface by fractions of a millimetre, seen at the ray's grazing angle.
#[test]
fn rays_meet_the_tunnel_where_they_meet_its_triangles() {
    let track = track();
    let (caster, mesh) = (TrackCaster::new(&track, 0), mesh(&track));
    let (mut hits, mut odd) = (0, 0);
    for Cast { o, d, inside } in rays(&track, 10_000) {
        let segment = caster.segment_of(&o, None);
        assert_eq!(segment, inside.s_m.floor() as usize);
        let ours = hit(caster.follow(segment, (&o, &d), 0.0, 160.0));
        let ray = Ray::new(DVec3::new(o.x, o.y, o.z), DVec3::new(d.x, d.y, d.z));
        let theirs = mesh.cast_local_ray_and_get_normal(&ray, 160.0, false);
        let (Some(ours), Some(theirs)) = (ours, theirs) else {
            odd += usize::from(ours.is_some() != theirs.is_some());
            continue;
        };
        hits += 1;
        let at = caster.surface_at(&o, &d, &ours);
        let off = (ours.t - theirs.time_of_impact).abs() * at.normal.dot(&d).abs();
        let normal = Vector3::new(theirs.normal.x, theirs.normal.y, theirs.normal.z);
        if off > 1e-3 {
            // Past an edge one ray may go on to the next face.
            odd += 1;
        } else {
            assert!(at.normal.dot(&d) < 0.0 && at.normal.dot(&normal).abs() > 0.999);
        }
    }
    assert!(hits > 9000, "{hits}");
    assert!(odd <= 20, "{odd} of 10000 rays differ");
}

/// Fails where a hit's track coordinates are not those of its place in the world.
#[test]
fn hits_know_where_they_are_on_the_line() {
    let track = track();
    let caster = TrackCaster::new(&track, 0);
    for Cast { o, d, .. } in rays(&track, 1000) {
        let Some(hit) = hit(caster.follow(caster.segment_of(&o, None), (&o, &d), 0.0, 160.0))
        else {
            continue;
        };
        let at = caster.surface_at(&o, &d, &hit);
        let truth = track.alignment.track_from_world(&at.position, at.s_m);
        // Between stations the tunnel is straight, the line is not: a sagitta of 0.6 mm.
        assert!((at.s_m - truth.s_m).abs() < 2e-3, "{at:?} {truth:?}");
        assert!((at.l_m - truth.l_m).abs() < 2e-3, "{at:?} {truth:?}");
        assert!(at.painted_m[1] >= -1e-6 && at.painted_m[1] < 25.0);
    }
}

/// Fails where a tunnel shows through the wall between two cross-sections, where that wall is not in their plane,
/// or is seen from its back.
#[test]
fn a_wall_closes_a_wide_section_before_a_narrow_one() {
    let mut track = track();
    let mut wide = section();
    for p in &mut wide.points {
        p.l_m *= 1.5;
    }
    let range = |from_m: f64, to_m: f64, section: CrossSection| SectionRange {
        from_m,
        to_m,
        missing_rail: None,
        section,
    };
    track.sections = vec![range(0.0, 20.3, wide), range(20.3, 40.0, section())];
    let caster = TunnelCaster::new(&[Arc::new(track.clone())])
        .tracks
        .remove(0);
    let frame = track.alignment.at(10.0).world_from_line();
    let cast = |l_m: f64, up_m: f64, d: Vector3<f64>| {
        let o = frame * Point3::new(0.0, l_m, up_m);
        let d = frame * d;
        let hit = hit(caster.follow(caster.segment_of(&o, None), (&o, &d), 0.0, 160.0));
        hit.map(|s| caster.surface_at(&o, &d, &s).s_m)
    };
    // Straight at the wall, from the wide side; beside it, on into the narrow one.
    let s_m = cast(3.4, 1.7, Vector3::x()).unwrap();
    assert!((s_m - 20.3).abs() < 1e-9, "{s_m}");
    let s_m = cast(0.0, 1.7, Vector3::new(1.0, 0.2, 0.0)).unwrap();
    assert!((s_m - 23.75).abs() < 0.1, "{s_m}");
    // The wide one ends at 20.3 m and not at a ring.
    let s_m = cast(0.0, 1.7, Vector3::new(1.0, 4.1 / 10.25, 0.0)).unwrap();
    assert!((s_m - 20.25).abs() < 0.1, "{s_m}");
    // Out of the end, and from outside.
    assert_eq!(cast(0.0, 1.7, Vector3::x()), None);
    assert_eq!(cast(0.0, 1.7, Vector3::repeat(f64::NAN)), None);
    let outside = frame * Point3::new(-30.0, 0.0, 1.0);
    assert_eq!(
        hit(caster.follow(0, (&outside, &(frame * Vector3::y())), 0.0, 160.0)),
        None
    );
}
