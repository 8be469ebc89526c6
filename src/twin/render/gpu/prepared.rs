//! All that one view needs on the adapter.

use super::adapter::Gpu;
use super::areas::PartSearch;
use super::bodies::BodyMeshes;
use super::chunks::InSight;
use super::draw_list::DrawList;
use super::lamps::LampTable;
use super::layout::ViewConstants;
use super::rectangle::Rectangle;
use super::shadows::ViewShadows;
use super::target::COARSE_PX;
use super::texture::Texture;
use super::view::Framed;
use crate::twin::render::constants::{BRIGHTEST_E, SIGHT_M};
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::scene::Job;
use std::f64::consts::SQRT_2;

/// What of a view is drawn in full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All of it.
    Whole,
    /// Where a small picture does not do.
    Lit,
    /// Where it differs from a tunnel that is kept.
    Changed,
}

/// What is found out about a view before it is drawn. What several passes read is on the adapter;
/// lists of one pass go there with it.
pub struct PreparedView {
    /// The picture in full.
    pub full: Level,
    /// A small one under it.
    pub coarse: Option<Level>,
    /// Poses of its rows.
    pub poses: wgpu::Buffer,
    /// [`DrawList::placements`], on the adapter.
    pub placements: wgpu::Buffer,
    /// Tunnel and bodies.
    pub list: DrawList,
    /// Lamps' discs and glare.
    pub lamps: LampTable,
    /// Shadows of bodies.
    pub shadows: ViewShadows,
    /// What is drawn in full.
    pub parts: Vec<Rectangle>,
    /// The same with what is seen in it; over a tunnel that is kept, only where headlights light it.
    pub areas: Vec<Area>,
    /// Signal where nothing is drawn: of the air before what is too far away.
    pub beyond_e: f64,
}

/// A picture of a view, in full or small.
pub struct Level {
    /// The view's constants.
    pub constants: wgpu::Buffer,
    /// [`DrawList::shares`], on the adapter: a texture, since software adapters read it for many pixels
    /// at once, but a buffer one pixel after the other.
    pub shares: Texture,
}

/// A part of the picture, and what may be seen in it.
pub struct Area {
    pub part: Rectangle,
    /// Indices of the draw calls that may show in it.
    pub calls: Vec<usize>,
}

impl PreparedView {
    /// Of a job.
    pub fn new(
        gpu: &Gpu,
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        (in_sight, bodies): (&InSight, &BodyMeshes),
        extent: Extent,
    ) -> Self {
        let chunks = &in_sight.chunks;
        let list = DrawList::new(framed, job, scene, (in_sight, bodies));
        let airlight_cd_m2 = scene.airlight_cd_m2(in_sight.track, in_sight.s_m);
        let air_e = airlight_cd_m2 * framed.view.electrons_per_cd_m2();
        // In the picture, half the area of what lies beyond [`SIGHT_M`] is nearer than this.
        let beyond_m = SQRT_2 * SIGHT_M;
        let beyond_e = ((1.0 - scene.air.transmission(beyond_m)) * air_e).min(BRIGHTEST_E);
        let constants = ViewConstants {
            extinction_per_m: scene.air.extinction_per_m as f32,
            airlight_e: air_e as f32,
            mirrored: list.mirrored.len() as u32,
            beyond_e: beyond_e as f32,
            ..framed.constants(job)
        };
        let lamps = LampTable::new(framed, scene, airlight_cd_m2);
        let shadows = ViewShadows::new(framed, job, scene, chunks);
        let search = PartSearch {
            framed,
            job,
            scene,
            list: &list,
            lamps: &lamps,
            shadows: &shadows,
        };
        let parts = match extent {
            Extent::Whole => search.whole(),
            Extent::Lit => search.lit(),
            Extent::Changed => search.changed(),
        };
        let small = extent == Extent::Lit && parts.drawn != [framed.whole()];
        let areas = |parts: Vec<Rectangle>| {
            let area = |part| Area {
                calls: list.seen_in(framed, &part),
                part,
            };
            parts.into_iter().map(area).collect()
        };
        let rows = framed.view.camera.intrinsics.height_px;
        Self {
            full: Level {
                constants: gpu.upload(wgpu::BufferUsages::UNIFORM, &[constants], 1),
                shares: table(gpu, rows, &list.shares),
            },
            coarse: small.then(|| coarse_level(gpu, constants, rows, &list)),
            poses: gpu.storage(&framed.poses()),
            placements: gpu.upload(wgpu::BufferUsages::VERTEX, &list.placements, 1),
            parts: parts.drawn.clone(),
            areas: match extent {
                Extent::Changed => areas(parts.headlit),
                _ => areas(parts.drawn),
            },
            lamps,
            shadows,
            beyond_e,
            list,
        }
    }
}

/// Of a small picture.
fn coarse_level(gpu: &Gpu, constants: ViewConstants, rows: u32, list: &DrawList) -> Level {
    // Its texels may reach beyond the picture.
    let size_px = constants
        .size_px
        .map(|n| (n as u32).next_multiple_of(COARSE_PX) as f32);
    let constants = ViewConstants {
        size_px,
        ..constants
    };
    let lamps = list.shares.chunks_exact(rows as usize);
    let shares = lamps.flat_map(|lamp| lamp.chunks(COARSE_PX as usize).map(mean));
    Level {
        constants: gpu.upload(wgpu::BufferUsages::UNIFORM, &[constants], 1),
        shares: table(gpu, rows.div_ceil(COARSE_PX), &shares.collect::<Vec<f32>>()),
    }
}

fn mean(numbers: &[f32]) -> f32 {
    numbers.iter().sum::<f32>() / numbers.len() as f32
}

/// Shares of so many rows, lamp by lamp.
fn table(gpu: &Gpu, rows: u32, shares: &[f32]) -> Texture {
    let rows = rows.max(1);
    let size = (rows, shares.len() as u32 / rows);
    let format = wgpu::TextureFormat::R32Float;
    Texture::filled(gpu, size, 1, format, bytemuck::cast_slice(shares))
}
