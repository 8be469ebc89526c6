//! All that one view needs on the adapter.

use super::adapter::Gpu;
use super::bodies::BodyMeshes;
use super::chunks::{AHEAD_M, Chunks};
use super::draw_list::DrawList;
use super::lamps::LampTable;
use super::layout::{BRIGHTEST_E, ViewConstants};
use super::shadows::ViewShadows;
use super::texture::Texture;
use super::view::Framed;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::scene::Job;
use std::f64::consts::SQRT_2;

/// What is found out about a view before it is drawn. What several passes read is on the adapter;
/// lists of one pass go there with it.
pub struct PreparedView {
    /// Its constants.
    pub constants: wgpu::Buffer,
    /// Poses of its rows.
    pub poses: wgpu::Buffer,
    /// [`DrawList::placements`], on the adapter.
    pub placements: wgpu::Buffer,
    /// [`DrawList::shares`], on the adapter: a texture, since software adapters read it for many pixels
    /// at once, but a buffer one pixel after the other.
    pub shares: Texture,
    /// Tunnel and bodies.
    pub list: DrawList,
    /// Lamps' discs and glare.
    pub lamps: LampTable,
    /// Shadows of bodies.
    pub shadows: ViewShadows,
    /// Signal where nothing is drawn: of the air before what is too far away.
    pub beyond_e: f64,
}

impl PreparedView {
    /// Of a job.
    pub fn new(
        gpu: &Gpu,
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        (chunks, bodies): (&mut Chunks, &BodyMeshes),
    ) -> Self {
        let (s_m, chunks) = chunks.in_sight(gpu, scene, framed);
        let list = DrawList::new(framed, job, scene, (&chunks, bodies));
        let airlight_cd_m2 = scene.airlight_cd_m2(s_m);
        let air_e = airlight_cd_m2 * framed.view.electrons_per_cd_m2();
        let constants = ViewConstants {
            extinction_per_m: scene.air.extinction_per_m as f32,
            airlight_e: air_e as f32,
            mirrored: list.mirrored.len() as u32,
            ..framed.constants(job)
        };
        // Half of what lies beyond the end of what is drawn, as it is seen, is nearer than this.
        let beyond_m = SQRT_2 * AHEAD_M;
        let rows = framed.view.camera.intrinsics.height_px.max(1);
        Self {
            constants: gpu.upload(wgpu::BufferUsages::UNIFORM, &[constants], 1),
            poses: gpu.storage(&framed.poses()),
            placements: gpu.upload(wgpu::BufferUsages::VERTEX, &list.placements, 1),
            shares: Texture::filled(
                gpu,
                (rows, list.shares.len() as u32 / rows),
                1,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(&list.shares),
            ),
            lamps: LampTable::new(framed, scene, airlight_cd_m2),
            shadows: ViewShadows::new(framed, job, scene, &chunks),
            beyond_e: ((1.0 - scene.air.transmission(beyond_m)) * air_e).min(BRIGHTEST_E),
            list,
        }
    }
}
