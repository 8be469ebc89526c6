//! The parts of a picture that a software adapter draws in full.
//!
//! Most of a dark tunnel is less than a grey level bright. What a moving camera sees of it is drawn with one
//! pixel for 4 x 4, and in full only where there is more light ([`LIT_GREY`]), or where something is seen
//! that the small picture does not have: bodies, shadows, lamps, mirrored light. What a camera at rest sees
//! is kept from frame to frame, but for just these.

use super::draw_list::DrawList;
use super::lamps::LampTable;
use super::layout::NEAR_M;
use super::rectangle::Rectangle;
use super::shadows::ViewShadows;
use super::surface::SurfaceCell;
use super::tiles::{Eyes, Marks, TILE_PX, TileBounds, TileGrid};
use super::view::Framed;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::photometry::headlights_lx;
use crate::twin::render::scene::Job;
use nalgebra::{Isometry3, Point2, Point3};

/// Grey levels, on the brightest paint, from which on a moving camera's picture is drawn in full.
const LIT_GREY: f64 = 1.5;
/// Grey levels by headlights, on the brightest paint, from which on a picture differs from one that is kept.
const HEADLIT_GREY: f64 = 0.03;
/// Where more of the picture than this has to be drawn, all of it is.
const MOST_SHARE: f64 = 0.6;
/// Parts that a moving camera's picture is drawn in: each costs a look at everything that may be in it.
const MOST_PARTS: usize = 2;
/// Poses of the camera through a frame.
const POSES: usize = 33;
/// How many times a cell that reaches behind the camera is split into quarters.
const MOST_SPLITS: u32 = 4;
/// Headlights are taken to be no nearer than this to what they light.
const LEAST_AWAY_M: f64 = 0.05;
/// Marks of a tile: it is drawn, it is in the light of headlights.
const DRAWN: u64 = 1;
const HEADLIT: u64 = 2;

/// Parts of a picture.
#[derive(Debug, Default)]
pub struct Parts {
    /// That are drawn in full.
    pub drawn: Vec<Rectangle>,
    /// In which headlights light the tunnel.
    pub headlit: Vec<Rectangle>,
}

/// What is known of a view when its parts are chosen.
pub struct PartSearch<'a> {
    pub framed: &'a Framed<'a>,
    pub job: &'a Job,
    pub scene: &'a LitScene,
    pub list: &'a DrawList,
    pub lamps: &'a LampTable,
    pub shadows: &'a ViewShadows,
}

impl PartSearch<'_> {
    /// All of the picture.
    pub fn whole(&self) -> Parts {
        Parts {
            drawn: vec![self.framed.whole()],
            headlit: Vec::new(),
        }
    }

    /// The parts in which a picture differs from one that is kept.
    pub fn changed(&self) -> Parts {
        self.parts(HEADLIT_GREY, false)
    }

    /// The parts in which a picture differs from a small one.
    pub fn lit(&self) -> Parts {
        self.parts(LIT_GREY, true)
    }

    /// The parts with more light than so much, by headlights or by lamps too.
    fn parts(&self, grey: f64, by_lamps: bool) -> Parts {
        let size_px = self.framed.size_px();
        let mut marks = Marks::new(TileGrid::new(size_px), 1);
        let luminance_cd_m2 = grey / self.framed.view.grey_per_cd_m2();
        self.mark_tunnel(&mut marks, luminance_cd_m2, by_lamps);
        self.mark_bodies(&mut marks);
        for tile in &self.shadows.tiles {
            marks.add_part(&self.between(tile.low_px, tile.high_px), &[DRAWN]);
        }
        for lamp in &self.lamps.lamps {
            marks.add_part(&self.between(lamp.low, lamp.high), &[DRAWN]);
        }
        let [mut drawn, mut headlit] =
            [DRAWN, HEADLIT].map(|mark| rectangles(&marks, mark, size_px));
        join(&mut headlit);
        if by_lamps {
            join(&mut drawn);
        }
        let area: u32 = drawn.iter().map(Rectangle::area).sum();
        if f64::from(area) > MOST_SHARE * f64::from(self.framed.whole().area()) {
            drawn = vec![self.framed.whole()];
        }
        Parts { drawn, headlit }
    }

    fn between(&self, low: [f32; 2], high: [f32; 2]) -> Rectangle {
        let [low, high] = [low, high].map(|p| Point2::from(p.map(f64::from)));
        Rectangle::between(low, high, self.framed.size_px())
    }

    fn mark_tunnel(&self, marks: &mut Marks, luminance_cd_m2: f64, by_lamps: bool) {
        let eyes = ShutterEyes::of(self.framed);
        let eye = (self.framed.reference(), eyes.travel_m());
        let air = &self.scene.air;
        for call in self.list.tunnel() {
            let patches = call.chunk.iter().flat_map(|c| &c.parts[call.part].patches);
            for patch in patches {
                let dark_lx = luminance_cd_m2 / f64::from(patch.reflected_per_lx);
                let bright = |p: &Point3<f64>| {
                    let normal = patch.cell.normal.unwrap_or_default();
                    headlights_lx(&self.job.headlights, air, p, &normal) > dark_lx
                };
                let lit = by_lamps && f64::from(patch.peak_cd_m2) > luminance_cd_m2;
                let mirrors = patch.glossy && !call.glossy.is_empty();
                let headlit = call.headlit
                    && self.most_lx(&patch.cell) > dark_lx
                    && (bright(&patch.cell.centre) || patch.cell.corners().iter().any(bright));
                if (lit || mirrors || headlit) && !patch.cell.turns_away(eye) {
                    let mark = if headlit { DRAWN | HEADLIT } else { DRAWN };
                    eyes.mark(
                        (marks, mark),
                        &patch.cell,
                        self.framed.size_px(),
                        MOST_SPLITS,
                    );
                }
            }
        }
    }

    /// More than headlights give anywhere on a cell, whichever way it and they face.
    fn most_lx(&self, cell: &SurfaceCell) -> f64 {
        let beams = self.job.headlights.iter().map(|light| {
            let away_m = (cell.centre - light.place()).norm() - cell.half_diagonal_m();
            light.intensity_cd / away_m.max(LEAST_AWAY_M).powi(2)
        });
        beams.sum()
    }

    fn mark_bodies(&self, marks: &mut Marks) {
        let eyes = Eyes::exposed(self.framed, self.job.time);
        for body in &self.job.bodies {
            let bounds = TileBounds::of_outline(self.framed, &eyes, body);
            marks.add_part(&bounds.rectangle(self.framed.size_px()), &[DRAWN]);
        }
    }
}

/// Where a camera is while it exposes its rows: `camera_from_world` at equal steps through the frame.
struct ShutterEyes<'a> {
    framed: &'a Framed<'a>,
    poses: Vec<Isometry3<f64>>,
    step_s: f64,
}

impl<'a> ShutterEyes<'a> {
    fn of(framed: &'a Framed<'a>) -> Self {
        let view = framed.view;
        let span_s = (view.camera.shutter).frame_span_s(view.camera.intrinsics.height_px);
        let count = if view.motion.poses.len() > 1 {
            POSES
        } else {
            1
        };
        let step_s = span_s / (count.max(2) - 1) as f64;
        let at = |k: usize| view.motion.pose_at(view.start.plus(k as f64 * step_s));
        Self {
            framed,
            poses: (0..count).map(|k| at(k).inverse()).collect(),
            step_s,
        }
    }

    fn travel_m(&self) -> f64 {
        let from = self.framed.reference();
        let away = |eye: &Isometry3<f64>| (eye * from).coords.norm();
        self.poses.iter().map(away).fold(0.0, f64::max)
    }

    fn at(&self, s: f64) -> &Isometry3<f64> {
        let last = self.poses.len() - 1;
        &self.poses[((s / self.step_s).round().max(0.0) as usize).min(last)]
    }

    /// Where a place is seen, by the row that sees it, when its exposure begins and ends.
    fn seen(&self, place: &Point3<f64>) -> Option<[Point2<f64>; 2]> {
        let camera = &self.framed.view.camera;
        let project = |s: f64| {
            let place = self.at(s) * place;
            (place.z > NEAR_M).then(|| camera.intrinsics.project(&place))?
        };
        let rows = f64::from(camera.intrinsics.height_px);
        let half_s = 0.5 * camera.shutter.exposure_s;
        let mut row = 0.5 * rows;
        for _ in 0..2 {
            row = project(camera.shutter.delay_s(row) + half_s)?
                .y
                .clamp(0.0, rows);
        }
        let open_s = camera.shutter.delay_s(row);
        Some([project(open_s)?, project(open_s + 2.0 * half_s)?])
    }

    /// Marks the tiles in which a cell is seen.
    fn mark(
        &self,
        (marks, mark): (&mut Marks, u64),
        cell: &SurfaceCell,
        size_px: [u32; 2],
        splits: u32,
    ) {
        let seen = cell.corners().map(|corner| self.seen(&corner));
        if seen.iter().all(Option::is_none) {
            return;
        }
        if seen.iter().any(Option::is_none) && splits > 0 {
            for quarter in cell.quarters() {
                self.mark((marks, mark), &quarter, size_px, splits - 1);
            }
            return;
        }
        let none = (Point2::from([f64::MAX; 2]), Point2::from([f64::MIN; 2]));
        let (low, high) = (seen.iter().flatten().flatten())
            .fold(none, |(low, high), p| (low.inf(p), high.sup(p)));
        marks.add_part(&Rectangle::between(low, high, size_px), &[mark]);
    }
}

/// The tiles with a mark, as rectangles: runs along a row, and runs of the same columns below each other.
fn rectangles(marks: &Marks, mark: u64, size_px: [u32; 2]) -> Vec<Rectangle> {
    let mut runs: Vec<Rectangle> = Vec::new();
    for (column, row, set) in marks.tiles() {
        if set.first().is_none_or(|word| word & mark == 0) {
            continue;
        }
        let at = [column, row].map(|k| k * TILE_PX);
        match runs.last_mut() {
            Some(run) if run.at[1] == at[1] && run.ends()[0] == at[0] => run.size[0] += TILE_PX,
            _ => runs.push(Rectangle {
                at,
                size: [TILE_PX; 2],
            }),
        }
    }
    let mut parts: Vec<Rectangle> = Vec::new();
    for run in runs {
        let above = |part: &&mut Rectangle| {
            part.ends()[1] == run.at[1] && part.at[0] == run.at[0] && part.size[0] == run.size[0]
        };
        match parts.iter_mut().rev().find(above) {
            Some(part) => part.size[1] += TILE_PX,
            None => parts.push(run),
        }
    }
    let whole = Rectangle::whole(size_px);
    parts.iter().map(|part| part.overlap(&whole)).collect()
}

/// Joins parts that it costs least to join while there are too many.
fn join(parts: &mut Vec<Rectangle>) {
    while parts.len() > MOST_PARTS {
        let mut least = (i64::MAX, 0, 0);
        for i in 1..parts.len() {
            for j in 0..i {
                let area = |r: &Rectangle| i64::from(r.area());
                let (a, b) = (&parts[i], &parts[j]);
                let more = area(&a.around(b)) - area(a) - area(b);
                least = least.min((more, i, j));
            }
        }
        let (_, i, j) = least;
        let joined = parts[i].around(&parts[j]);
        parts[j] = joined;
        parts.swap_remove(i);
    }
}
