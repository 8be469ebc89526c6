//! All that one view needs on the adapter.

use super::adapter::Gpu;
use super::bodies::BodyBuffers;
use super::chunks::{AHEAD_M, Chunks};
use super::draw_list::DrawList;
use super::lamps::LampTable;
use super::layout::{BRIGHTEST_E, Pose, ViewConstants};
use super::shadows::ViewShadows;
use super::upload::Upload;
use super::view::Framed;
use crate::twin::render::lit_scene::LitScene;
use crate::twin::render::scene::Job;
use std::f64::consts::SQRT_2;

/// What is found out about a view before it is drawn, with its buffers, used again in every job.
pub struct PreparedView {
    /// Its constants.
    pub constants: Upload<ViewConstants>,
    /// Poses of its rows.
    pub poses: Upload<Pose>,
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
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            constants: Upload::new(gpu, wgpu::BufferUsages::UNIFORM, 1),
            poses: Upload::storage(gpu),
            list: DrawList::new(gpu),
            lamps: LampTable::new(gpu),
            shadows: ViewShadows::new(gpu),
            beyond_e: 0.0,
        }
    }

    /// Takes a view of the next job.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        framed: &Framed<'_>,
        job: &Job,
        scene: &LitScene,
        (chunks, bodies): (&mut Chunks, &BodyBuffers),
    ) {
        let (s_m, chunks) = chunks.in_sight(gpu, scene, framed);
        self.list.fill(gpu, framed, job, scene, (&chunks, bodies));
        self.shadows.fill(gpu, framed, job, scene, &chunks);
        let airlight_cd_m2 = scene.airlight_cd_m2(s_m);
        self.lamps.fill(gpu, framed, scene, airlight_cd_m2);
        self.poses.send_all(gpu, framed.poses());
        let constants = ViewConstants {
            extinction_per_m: scene.air.extinction_per_m as f32,
            airlight_e: (airlight_cd_m2 * framed.view.electrons_per_cd_m2()) as f32,
            mirrored: self.list.mirrored.items.len() as u32,
            ..framed.constants(job)
        };
        self.constants.send_all(gpu, vec![constants]);
        // Half of what lies beyond the end of what is drawn, as it is seen, is nearer than this.
        let beyond_m = SQRT_2 * AHEAD_M;
        let air_e = airlight_cd_m2 * framed.view.electrons_per_cd_m2();
        self.beyond_e = ((1.0 - scene.air.transmission(beyond_m)) * air_e).min(BRIGHTEST_E);
    }
}
