//! The lamps of a view: for every row that one touches, where its disc is and how much of the
//! exposure it is on, in double precision. See the image model in [`super`].

use super::layout::{Lamp, LampRow};
use super::view::Framed;
use crate::twin::render::scene::LampLight;
use crate::twin::render::surface;
use nalgebra::{Isometry3, Point3};
use std::f64::consts::PI;

/// Glare fainter than this many electrons is not drawn.
const FAINT_E: f64 = 0.4;
/// No disc nearer than this in optical depth is drawn.
const MIN_DEPTH_M: f64 = 0.1;

/// A row's middle, and the poses of the camera in the middle of each quarter of its exposure and
/// at its own middle: `camera_from_world`.
struct RowPoses {
    open_s: f64,
    quarters: [Isometry3<f64>; 4],
    middle: Isometry3<f64>,
}

/// Lamps of the view at hand, and the buffers to make them in.
#[derive(Default)]
pub struct LampTable {
    poses: Vec<RowPoses>,
    /// One a lamp in sight, far ones first.
    pub lamps: Vec<Lamp>,
    /// Entries of all of them.
    pub rows: Vec<LampRow>,
}

impl LampTable {
    /// Makes the tables of all lamps that the view may see.
    pub fn fill(&mut self, framed: &Framed<'_>, lamps: &[LampLight], ambient_lx: f64) {
        self.lamps.clear();
        self.rows.clear();
        let from = framed.reference();
        let mut near: Vec<(f64, &LampLight)> = lamps
            .iter()
            .map(|lamp| ((lamp.centre - from).norm(), lamp))
            .filter(|(d, _)| *d < surface::LAMP_SIGHT_M)
            .collect();
        if near.is_empty() {
            return;
        }
        near.sort_by(|a, b| f64::total_cmp(&b.0, &a.0));
        self.fill_poses(framed);
        for (_, lamp) in near {
            self.add(framed, lamp, ambient_lx);
        }
    }

    fn fill_poses(&mut self, framed: &Framed<'_>) {
        let (view, shutter) = (framed.view, &framed.view.camera.shutter);
        let rows = view.camera.intrinsics.height_px;
        let still = (view.motion.poses.len() == 1).then(|| view.motion.pose_at(view.start));
        let pose = |t| still.unwrap_or_else(|| view.motion.pose_at(t)).inverse();
        self.poses.clear();
        self.poses.extend((0..rows).map(|v| {
            let open = shutter.row_open(view.start, f64::from(v));
            let at = |share: f64| open.plus(share * shutter.exposure_s);
            RowPoses {
                open_s: open.secs(),
                quarters: [0.125, 0.375, 0.625, 0.875].map(|share| pose(at(share))),
                middle: pose(at(0.5)),
            }
        }));
    }

    fn add(&mut self, framed: &Framed<'_>, lamp: &LampLight, ambient_lx: f64) {
        let signal_e = framed.view.electrons_per_cd_m2();
        let mut bounds = Bounds::default();
        let table = self.rows.len();
        let mut first_row = 0;
        for (v, poses) in self.poses.iter().enumerate() {
            let row = bounds.row(framed, lamp, poses, v as f64, signal_e);
            if let Some(row) = row {
                if self.rows.len() == table {
                    first_row = v;
                }
                // Rows between that do not see the lamp hold a disc that no ray hits.
                self.rows.resize(table + v - first_row, LampRow::default());
                self.rows.push(row);
            }
        }
        if self.rows.len() == table {
            return;
        }
        let last_row = first_row + self.rows.len() - table - 1;
        let [disc_low, disc_high] = bounds.disc.clipped(framed, first_row, last_row);
        let [halo_low, halo_high] = bounds.halo.clipped(framed, first_row, last_row);
        self.lamps.push(Lamp {
            disc_low,
            disc_high,
            halo_low,
            halo_high,
            first_row: first_row as i32,
            table: table as u32,
            radius_m: lamp.radius_m as f32,
            exponent: (lamp.exponent - 1.0) as f32,
            dark_e: (surface::DARK_DISC_ALBEDO * ambient_lx / PI * signal_e) as f32,
            unused: [0; 1],
        });
    }
}

/// Bounds of a lamp's disc and glare over the rows seen so far.
#[derive(Default)]
struct Bounds {
    disc: Rect,
    halo: Rect,
}

impl Bounds {
    /// The lamp as row `v` sees it; `None` where the row sees neither disc nor glare.
    fn row(
        &mut self,
        framed: &Framed<'_>,
        lamp: &LampLight,
        poses: &RowPoses,
        v: f64,
        electrons_per_cd_m2: f64,
    ) -> Option<LampRow> {
        let (lens, glass) = (&framed.view.camera.intrinsics, &framed.view.lens);
        let exposure_s = framed.view.camera.shutter.exposure_s;
        let c = poses.middle * lamp.centre;
        let normal = poses.middle.rotation * lamp.facing.into_inner();
        let cosine = -normal.dot(&c.coords) / c.coords.norm();
        if c.z <= MIN_DEPTH_M || cosine <= 0.0 {
            return None;
        }
        let centre = lens.project(&c)?;
        let apparent_px = lens.fx_px * lamp.radius_m * cosine.sqrt() / c.z;
        let axial_e = lamp.luminance_cd_m2 * electrons_per_cd_m2;
        let glare_e =
            glass.halo_share * axial_e * cosine.powf(lamp.exponent - 1.0) * apparent_px.powi(2)
                / (apparent_px.powi(2) + glass.halo_px.powi(2));
        let decays = (glare_e / FAINT_E).ln().min(surface::HALO_REACH);
        let halo_reach_px = if decays > 0.0 {
            apparent_px + decays * glass.halo_px
        } else {
            0.0
        };
        let quarters = poses.quarters.map(|pose| pose * lamp.centre);
        let disc_reach_px = quarters
            .iter()
            .map(|q| disc_reach_px(framed, lamp, q))
            .fold(0.0, f64::max);
        let moved_px = quarters
            .iter()
            .filter_map(|q| lens.project(q))
            .map(|q| (q - centre).amax())
            .fold(0.0, f64::max);
        let disc_reach_px = disc_reach_px + moved_px + 1.0;
        let off_px = (v - centre.y).abs();
        if off_px > disc_reach_px.max(halo_reach_px) {
            return None;
        }
        if off_px <= disc_reach_px {
            self.disc.add(centre.x, disc_reach_px, v);
        }
        if off_px <= halo_reach_px {
            self.halo.add(centre.x, halo_reach_px, v);
        }
        let on = |from: f64, to: f64| {
            lamp.waveform.on_share(
                poses.open_s + from * exposure_s,
                poses.open_s + to * exposure_s,
            )
        };
        let glare = glare_e * on(0.0, 1.0);
        let mut row = LampRow {
            normal_halo: [normal.x, normal.y, normal.z, glare].map(|x| x as f32),
            image_px: [centre.x, centre.y, apparent_px, 0.0].map(|x| x as f32),
            ..LampRow::default()
        };
        for (k, (entry, q)) in row.quarters.iter_mut().zip(quarters).enumerate() {
            let share = on(0.25 * k as f64, 0.25 * (k + 1) as f64);
            *entry = [q.x, q.y, q.z, share * axial_e].map(|x| x as f32);
        }
        Some(row)
    }
}

/// How far from its projected centre a disc may reach: a point within R of the centre c moves by
/// at most f R (1 + |x|/z) / (z - R) in the image. Unbounded when it may reach the camera's plane.
fn disc_reach_px(framed: &Framed<'_>, lamp: &LampLight, c: &Point3<f64>) -> f64 {
    let lens = &framed.view.camera.intrinsics;
    let clear_m = c.z - lamp.radius_m;
    if clear_m <= 0.0 {
        return f64::INFINITY;
    }
    let steep = 1.0 + c.x.abs().max(c.y.abs()) / c.z;
    lens.fx_px.max(lens.fy_px) * lamp.radius_m * steep / clear_m
}

/// Columns and rows touched so far.
struct Rect {
    u: (f64, f64),
    v: (f64, f64),
}

impl Default for Rect {
    fn default() -> Self {
        let nothing = (f64::INFINITY, f64::NEG_INFINITY);
        Self {
            u: nothing,
            v: nothing,
        }
    }
}

impl Rect {
    fn add(&mut self, u: f64, reach_px: f64, v: f64) {
        self.u = (self.u.0.min(u - reach_px), self.u.1.max(u + reach_px));
        self.v = (self.v.0.min(v), self.v.1.max(v));
    }

    /// Corners for the rasteriser, inside the image and the rows that have entries.
    fn clipped(&self, framed: &Framed<'_>, first_row: usize, last_row: usize) -> [[f32; 2]; 2] {
        if self.u.0 > self.u.1 {
            return [[0.0; 2]; 2];
        }
        let width = f64::from(framed.view.camera.intrinsics.width_px);
        let u = |x: f64| x.clamp(-0.5, width - 0.5) as f32;
        let rows = (first_row as f64 - 0.5, last_row as f64 + 0.5);
        let v = |y: f64| y.clamp(rows.0, rows.1) as f32;
        [
            [u(self.u.0.floor() - 0.5), v(self.v.0 - 0.5)],
            [u(self.u.1.ceil() + 0.5), v(self.v.1 + 0.5)],
        ]
    }
}
