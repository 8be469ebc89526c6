//! What one view of a job uploads.

use super::adapter::Gpu;
use super::draw_list::DrawList;
use super::lamps::LampTable;
use super::layout::{Glare, GlareRow, Instant, Lamp, LampRow, Mirrored, Pose, View};
use super::shadows::{ShadowBuffers, Shadows};
use super::upload::{Table, Upload};
use std::mem::size_of;

/// The buffers of a view, used again in every job.
pub struct ViewBuffers {
    /// Its constants.
    pub view: Upload,
    /// Its poses.
    pub poses: Upload,
    /// Light of lamps over their mean, row by row.
    pub shares: Table,
    /// Where its meshes are.
    pub placements: Upload,
    /// Lamps that glossy surfaces mirror.
    pub mirrored: Upload,
    /// Lamps' discs.
    pub lamps: Upload,
    /// Rows of the discs.
    pub rows: Upload,
    /// Instants of the rows.
    pub instants: Upload,
    /// Lamps' glare.
    pub glares: Upload,
    /// Rows of the glare.
    pub glare_rows: Upload,
    /// Shadows of bodies.
    pub shadows: ShadowBuffers,
    /// Signal where nothing is drawn: of the air before what is too far away.
    pub beyond_e: f64,
}

/// What is written to the buffers of a view.
pub struct ViewData<'a> {
    /// Its constants.
    pub constants: View,
    /// Its poses.
    pub poses: &'a [Pose],
    /// Tunnel and bodies.
    pub list: &'a DrawList,
    /// Its lamps.
    pub lamps: &'a LampTable,
    /// Shadows of bodies.
    pub shadows: &'a Shadows,
    /// Signal where nothing is drawn.
    pub beyond_e: f64,
}

impl ViewBuffers {
    /// Empty.
    pub fn new(gpu: &Gpu) -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            view: Upload::new(gpu, wgpu::BufferUsages::UNIFORM, size_of::<View>()),
            poses: Upload::new(gpu, storage, 2 * size_of::<Pose>()),
            shares: Table::new(gpu),
            placements: Upload::new(gpu, wgpu::BufferUsages::VERTEX, 1 << 10),
            mirrored: Upload::new(gpu, storage, size_of::<Mirrored>()),
            lamps: Upload::new(gpu, storage, size_of::<Lamp>()),
            rows: Upload::new(gpu, storage, size_of::<LampRow>()),
            instants: Upload::new(gpu, storage, size_of::<Instant>()),
            glares: Upload::new(gpu, storage, size_of::<Glare>()),
            glare_rows: Upload::new(gpu, storage, size_of::<GlareRow>()),
            shadows: ShadowBuffers::new(gpu),
            beyond_e: 0.0,
        }
    }

    /// Takes the next job's view.
    pub fn write(&mut self, gpu: &Gpu, data: &ViewData<'_>) {
        self.view.write(gpu, &[data.constants]);
        self.poses.write(gpu, data.poses);
        let rows = data.constants.size_px[1] as u32;
        self.shares.write(gpu, &data.list.shares, rows);
        self.placements.write(gpu, &data.list.placements);
        self.mirrored.write(gpu, &data.list.mirrored);
        let table = data.lamps;
        self.lamps.write(gpu, &table.lamps);
        self.rows.write(gpu, &table.rows);
        self.instants.write(gpu, &table.instants);
        self.glares.write(gpu, &table.glares);
        self.glare_rows.write(gpu, &table.glare_rows);
        self.shadows.write(gpu, data.shadows);
        self.beyond_e = data.beyond_e;
    }
}
