//! What a view draws: which triangles, at which instants of the exposure, under which lamps' blinking.

use super::bodies::BodyMeshes;
use super::chunks::{Chunk, InSight};
use super::layout::{Mirrored, Placement};
use super::rectangle::Rectangle;
use super::smear::Smear;
use super::textures;
use super::view::{BESIDE, Framed, single};
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::paint::{self, TEXEL_M};
use crate::twin::render::photometry::{BlinkingLamp, headlights_lx};
use crate::twin::render::scene::Job;
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use std::sync::Arc;

/// Grey levels by headlights below which they are left out.
const UNLIT_GREY: f64 = 0.1;
/// Grey levels, on the brightest paint, below which lamps are drawn without their blinking.
const BLINKS_GREY: f64 = 0.1;
/// Grey levels below which motion does not show.
const MOVES_GREY: f64 = 0.1;
/// Chunks nearer than this may mirror in any row.
const MIRRORS_ALL_OVER_M: f64 = 15.0;
/// Lamps farther than this from a camera are not mirrored in what it sees.
const MIRRORED_M: f64 = 80.0;
/// Nor are those farther behind it: surfaces would have to lean towards it.
const MIRRORED_BEHIND_M: f64 = 5.0;
/// Light that changes by less than the shot noise of a full pixel of 10,000 electrons shows no bands.
const BAND: f32 = 0.01;

/// Triangles of one mesh with one painting.
pub struct DrawCall {
    /// The chunk that they are of; none for bodies.
    pub chunk: Option<Arc<Chunk>>,
    /// Which of its parts.
    pub part: usize,
    /// Index of its texture.
    pub texture: usize,
    /// Index of its placement in mid-exposure.
    pub mesh: u32,
    /// Whether headlights light them.
    pub headlit: bool,
    /// Their indices.
    pub indices: Range<u32>,
    /// Indices of those that mirror.
    pub glossy: Range<u32>,
}

/// All that a view draws of tunnel and bodies.
#[derive(Default)]
pub struct DrawList {
    /// Of the tunnel, near ones first; then of the bodies.
    pub calls: Vec<DrawCall>,
    /// Of every mesh in the middle of the exposure; then, one after the other, at instants that show motion
    /// and at those that show what is mirrored.
    pub placements: Vec<Placement>,
    /// How many meshes there are.
    meshes: u32,
    /// Instants that show motion; the middle alone where nothing moves.
    pub instants: Range<u32>,
    /// Those that show what is mirrored.
    pub mirrored_instants: Range<u32>,
    /// Part of the picture in which instants differ.
    pub moving: Rectangle,
    /// The instants at which the small picture of the tunnel is drawn: [`Self::instants`] if what moves is the
    /// whole picture, else the middle alone.
    pub tunnel_instants: Range<u32>,
    /// Light of lamps over their mean: for every lamp a row, in which every row of the picture has a
    /// number; the first row is 1.
    pub shares: Vec<f32>,
    /// Whether any of it differs from 1 so that one can see it.
    pub banded: bool,
    /// Whether more than a texel of any paint passes a pixel in the exposure.
    pub smeared: bool,
    /// Lamps that glossy surfaces mirror.
    pub mirrored: Vec<Mirrored>,
    /// Rows in which they may be.
    mirror_rows: Range<u32>,
    /// The lamps that have rows in the table of shares, from its second row on.
    pub lamps: Vec<usize>,
    /// Whether anything is so bright that motion shows.
    lit: bool,
}

impl DrawList {
    /// What it draws of the tunnel: the first of all that it draws.
    pub fn tunnel(&self) -> impl Iterator<Item = &DrawCall> {
        self.calls.iter().take_while(|call| call.chunk.is_some())
    }

    /// What it draws of the bodies.
    pub fn bodies(&self) -> &[DrawCall] {
        &self.calls[self.tunnel().count()..]
    }

    /// Row of a lamp in the table of shares; the first where it does not blink here.
    pub fn share_row(&self, lamp: usize) -> usize {
        let known = self.lamps.iter().position(|k| *k == lamp);
        known.map_or(0, |at| at + 1)
    }

    /// Indices of the draw calls that may show in a part of the picture.
    pub fn seen_in(&self, framed: &Framed<'_>, part: &Rectangle) -> Vec<usize> {
        let window = framed.window(part);
        let shows = |call: &DrawCall| match &call.chunk {
            Some(chunk) => {
                let around = chunk.parts[call.part].around;
                framed.may_see_in(&window, around.map(|p| chunk.origin + p.cast()))
            }
            None => true,
        };
        let calls = self.calls.iter().enumerate();
        calls
            .filter(|(_, call)| shows(call))
            .map(|(k, _)| k)
            .collect()
    }

    /// Of the chunks in sight and of the bodies.
    pub fn new(
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        (in_sight, bodies): (&InSight, &BodyMeshes),
    ) -> Self {
        let rows = framed.view.camera.intrinsics.height_px;
        let mut list = Self {
            shares: vec![1.0; rows as usize],
            ..Self::default()
        };
        let (reference, chunks) = (framed.reference(), &in_sight.chunks);
        for chunk in chunks {
            list.add_chunk(framed, job, scene, chunk);
        }
        if let Some(sky) = &in_sight.sky {
            list.add_sky(framed, sky);
        }
        let seen = job.bodies.iter().zip(&bodies.ranges);
        for (body, range) in seen.filter(|(_, range)| !range.is_empty()) {
            list.calls.push(DrawCall {
                chunk: None,
                part: 0,
                texture: textures::BLANK,
                mesh: list.placements.len() as u32,
                headlit: !job.headlights.is_empty(),
                indices: range.clone(),
                glossy: 0..0,
            });
            list.lit = true;
            let place = Point3::from(body.world_from_body.translation.vector);
            list.placements.push(Placement {
                offset_m: single(&(place - reference)),
                velocity_mps: single(&body.velocity_mps),
                ..Placement::default()
            });
        }
        // Before those are added that are mirrored alone.
        list.banded = (list.shares.iter()).any(|share| (share - 1.0).abs() > BAND);
        list.mirror(framed, scene.lamps.lamps());
        list.expose(framed, job, chunks);
        list
    }

    fn add_chunk(&mut self, framed: &Framed<'_>, job: &Job, scene: &LitScene, chunk: &Arc<Chunk>) {
        let grey_per_cd_m2 = framed.view.grey_per_cd_m2();
        let headlit_cd_m2 = (chunk.probes.iter())
            .map(|probe| {
                let lux = headlights_lx(&job.headlights, &scene.air, &probe.at, &probe.normal);
                lux * f64::from(probe.reflected_per_lx)
            })
            .fold(0.0, f64::max);
        let headlit_grey = headlit_cd_m2 * grey_per_cd_m2;
        let mirrors = self.find_mirrors(framed, chunk);
        let period = chunk.key.start_m() / paint::PERIOD_M;
        let away_m = (chunk.origin - framed.reference()).norm();
        for (number, part) in chunk.parts.iter().enumerate() {
            let around = part.around.map(|p| chunk.origin + p.cast());
            if !framed.may_see_between(around) {
                continue;
            }
            let lamps_grey = f64::from(part.peak_cd_m2) * grey_per_cd_m2;
            self.lit |= headlit_grey + lamps_grey > MOVES_GREY;
            let painting = part.painting;
            self.calls.push(DrawCall {
                chunk: Some(Arc::clone(chunk)),
                part: number,
                texture: textures::slanted(painting, away_m),
                mesh: self.placements.len() as u32,
                headlit: headlit_grey > UNLIT_GREY,
                indices: part.indices.clone(),
                glossy: if mirrors { part.glossy.clone() } else { 0..0 },
            });
            let rows = framed.view.camera.intrinsics.height_px;
            let shares = match chunk.lamp.filter(|_| lamps_grey > BLINKS_GREY) {
                Some(lamp) => self.shares_of(framed, scene.lamps.lamps(), lamp, 0..rows),
                None => 0,
            };
            self.placements.push(Placement {
                offset_m: single(&(chunk.origin - framed.reference())),
                period_share: (period - period.floor()) as f32,
                shares,
                paint_per_m: textures::per_m(&scene.paintings.all[painting]),
                along: single(&chunk.along),
                ..Placement::default()
            });
        }
    }

    /// Adds what is the same from everywhere.
    fn add_sky(&mut self, framed: &Framed<'_>, sky: &Arc<Chunk>) {
        for (number, part) in sky.parts.iter().enumerate() {
            let grey = f64::from(part.peak_cd_m2) * framed.view.grey_per_cd_m2();
            self.lit |= grey > MOVES_GREY;
            self.calls.push(DrawCall {
                chunk: Some(Arc::clone(sky)),
                part: number,
                texture: textures::BLANK,
                mesh: self.placements.len() as u32,
                headlit: false,
                indices: part.indices.clone(),
                glossy: 0..0,
            });
            self.placements.push(Placement::default());
        }
    }

    /// Whether a chunk mirrors anything in the picture; notes the rows.
    fn find_mirrors(&mut self, framed: &Framed<'_>, chunk: &Chunk) -> bool {
        let rows = f64::from(framed.view.camera.intrinsics.height_px);
        let near = (chunk.origin - framed.reference()).norm() < MIRRORS_ALL_OVER_M;
        let mut mirrors = false;
        for v in chunk.glossy.iter().filter_map(|place| framed.row_of(place)) {
            let [first, last] = if near {
                [0.0, rows]
            } else {
                [v - BESIDE * rows, v + BESIDE * rows]
            };
            let (first, last) = (first.max(0.0) as u32, last.clamp(0.0, rows) as u32);
            let noted = &mut self.mirror_rows;
            *noted = if noted.start >= noted.end {
                first..last
            } else {
                noted.start.min(first)..noted.end.max(last)
            };
            mirrors = true;
        }
        mirrors
    }

    /// Lists the lamps that what mirrors may show, where anything does.
    fn mirror(&mut self, framed: &Framed<'_>, lamps: &[BlinkingLamp]) {
        if self.calls.iter().all(|call| call.glossy.is_empty()) {
            return;
        }
        let (reference, ahead) = (framed.reference(), framed.middle * Vector3::z());
        for (k, lamp) in lamps.iter().enumerate() {
            let away = lamp.centre - reference;
            let ahead_m = ahead.dot(&away);
            if away.norm() > MIRRORED_M || ahead_m < -MIRRORED_BEHIND_M || lamp.duty() <= 0.0 {
                continue;
            }
            let rows = self.mirror_rows.clone();
            let shares = self.shares_of(framed, lamps, k, rows);
            self.mirrored.push(Mirrored {
                position_m: single(&away),
                intensity_cd: (lamp.duty() * lamp.axial_intensity_cd()) as f32,
                axis: single(&lamp.facing),
                exponent: lamp.exponent as f32,
                radius_m: lamp.radius_m as f32,
                shares,
                ..Mirrored::default()
            });
        }
    }

    /// Row of a lamp in the table of shares, which is made at the first call, for some of the
    /// rows; in the others it is 1.
    fn shares_of(
        &mut self,
        framed: &Framed<'_>,
        lamps: &[BlinkingLamp],
        lamp: usize,
        asked: Range<u32>,
    ) -> u32 {
        let rows = framed.view.camera.intrinsics.height_px;
        let known = self.lamps.iter().position(|k| *k == lamp);
        let at = known.unwrap_or(self.lamps.len()) as u32;
        if known.is_none() {
            self.lamps.push(lamp);
            let shutter = &framed.view.camera.shutter;
            let light = &lamps[lamp];
            let mean = light.duty().max(1e-9);
            self.shares.extend((0..rows).map(|v| {
                if !asked.contains(&v) {
                    return 1.0;
                }
                let open = shutter.row_open(framed.view.start, f64::from(v)).secs();
                (light.share(open, open + shutter.exposure_s) / mean) as f32
            }));
        }
        at + 1
    }

    /// Finds the instants to be drawn, and copies the placements for each.
    fn expose(&mut self, framed: &Framed<'_>, job: &Job, chunks: &[Arc<Chunk>]) {
        self.meshes = self.placements.len() as u32;
        let smear = Smear::of(framed, job.time);
        for call in &self.calls {
            let along_m = call
                .chunk
                .as_ref()
                .map_or(0.0, |chunk| smear.along_m(chunk));
            self.placements[call.mesh as usize].smear_m = along_m as f32;
        }
        let way_m = |placed: &Placement| f64::from(placed.smear_m.abs());
        self.smeared = self.lit && self.placements.iter().any(|p| way_m(p) > TEXEL_M);
        let (mut count, mut mirrored) = (1, 1);
        if self.lit {
            (count, self.moving) = smear.instants(&job.bodies, chunks);
        }
        if !self.mirrored.is_empty() {
            mirrored = smear.mirrored_instants(chunks);
        }
        let exposure_s = framed.view.camera.shutter.exposure_s;
        self.instants = self.add_instants(count, exposure_s);
        self.mirrored_instants = self.add_instants(mirrored, exposure_s);
        self.tunnel_instants = if self.moving == framed.whole() {
            self.instants.clone()
        } else {
            0..1
        };
    }

    /// Copies the placements for so many instants; one is the middle that is there already.
    fn add_instants(&mut self, count: u32, exposure_s: f64) -> Range<u32> {
        if count <= 1 {
            return 0..1;
        }
        let first = self.placements.len() as u32 / self.meshes.max(1);
        for k in 0..count {
            // The middle comes last: its depths decide what hides the lamps.
            let k = (k + count / 2 + 1) % count;
            let late_s = ((f64::from(k) + 0.5) / f64::from(count) - 0.5) * exposure_s;
            for mesh in 0..self.meshes as usize {
                let middle = self.placements[mesh];
                self.placements.push(Placement {
                    late_s: late_s as f32,
                    smear_m: middle.smear_m / count as f32,
                    ..middle
                });
            }
        }
        first..first + count
    }

    /// Number of a mesh's placement at an instant.
    pub fn placed(&self, call: &DrawCall, instant: u32) -> u32 {
        instant * self.meshes + call.mesh
    }
}
