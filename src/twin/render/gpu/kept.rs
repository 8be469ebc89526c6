//! What cameras at rest see of the tunnel, kept from frame to frame.
//!
//! Each pixel keeps its steady light and that of the lamp whose blinking shows there, apart, so the picture
//! of any exposure is steady + share * blinking, with the share of the row. Headlights, bodies, shadows and
//! mirrored light come on top.

use super::chunks::InSight;
use super::draw_list::DrawList;
use super::pieces::{Piece, Pieces, Uploaded, narrow, widen};
use super::rectangle::Rectangle;
use super::target::kept_texture;
use super::texture::Texture;
use super::view::Framed;
use super::{adapter::Gpu, pipeline};
use crate::bus::Intrinsics;
use crate::twin::render::RenderError;
use crate::twin::render::cache::Cache;
use crate::twin::render::constants::BRIGHTEST_E;
use nalgebra::Isometry3;
use pulp::Arch;
use std::iter;
use std::ops::Range;
use std::sync::Arc;

/// Cameras whose tunnel is kept, each as last exposed: of 1920 x 1080 pixels it takes 16 MB.
pub const MOST_KEPT: usize = 16;

/// Tunnels as seen.
pub type KeptTunnels = Cache<KeptKey, KeptTunnel>;

/// What the picture of a tunnel depends on, but for blinking and headlights.
#[derive(Clone, Debug)]
pub struct KeptKey {
    lens: Intrinsics,
    pose: Isometry3<f64>,
    electrons_per_cd_m2: f64,
    /// Decides which lamps' blinking shows.
    grey_per_cd_m2: f64,
}

/// Exposures that differ by this share make the same picture.
const SAME_EXPOSURE: f64 = 1e-9;

impl PartialEq for KeptKey {
    fn eq(&self, other: &Self) -> bool {
        let same = |a: f64, b: f64| (a - b).abs() <= SAME_EXPOSURE * a.abs();
        self.is_of_same_camera(other)
            && same(self.electrons_per_cd_m2, other.electrons_per_cd_m2)
            && same(self.grey_per_cd_m2, other.grey_per_cd_m2)
    }
}

impl KeptKey {
    /// Of a view; none where the camera moves.
    pub fn of(framed: &Framed<'_>) -> Option<Self> {
        let view = framed.view;
        framed.rests().then(|| Self {
            lens: view.camera.intrinsics,
            pose: framed.middle,
            electrons_per_cd_m2: view.electrons_per_cd_m2(),
            grey_per_cd_m2: view.grey_per_cd_m2(),
        })
    }

    /// Whether it is of the same camera, exposed in whatever way.
    pub fn is_of_same_camera(&self, other: &Self) -> bool {
        self.lens == other.lens && self.pose == other.pose
    }
}

/// A tunnel: its light in memory, its depth on the adapter.
pub struct KeptTunnel {
    pub planes: Arc<Planes>,
    /// What of the tunnel was drawn: so what is drawn over it has the same meshes.
    pub in_sight: InSight,
    /// Lamps of the scene whose blinking shows in it.
    lamps: Vec<usize>,
    pub depth: Texture,
}

impl KeptTunnel {
    /// For the rows that its planes name, those of a picture's table of shares.
    pub fn share_rows(&self, list: &DrawList) -> Vec<usize> {
        let rows = self.lamps.iter().map(|lamp| list.share_row(*lamp));
        iter::once(0).chain(rows).collect()
    }
}

/// A tunnel as it is drawn, to be kept.
pub struct KeptLayers {
    /// Steady and blinking light, electrons.
    pub light: Texture,
    /// Whose blinking it is: the lamp's row in the table of shares.
    pub lamp: Texture,
    pub depth: Texture,
}

impl KeptLayers {
    /// Empty.
    pub fn new(gpu: &Gpu, size_px: (u32, u32)) -> Self {
        let texture = |format| kept_texture(&gpu.device, size_px, format);
        Self {
            light: texture(pipeline::LIGHT),
            lamp: texture(pipeline::LAMP),
            depth: texture(pipeline::DEPTH),
        }
    }

    /// Draws what the encoder holds of a list, waits for it, and brings the light to memory.
    pub fn keep(
        self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        in_sight: &InSight,
        list: &DrawList,
    ) -> Result<KeptTunnel, RenderError> {
        let mut pieces = Pieces::default();
        let back = [(&self.light, 2), (&self.lamp, 1)]
            .map(|(texture, words)| pieces.add(texture, texture.whole(), words));
        let buffer = pieces.copy(&gpu.device, &mut encoder, &mut Vec::new());
        let submission = gpu.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.wait_for(submission)?;
        let bytes =
            (buffer.get_mapped_range(..)).map_err(|e| RenderError::Device(e.to_string()))?;
        Ok(KeptTunnel {
            planes: Arc::new(Planes::of(&bytes, back.each_ref())),
            in_sight: in_sight.clone(),
            lamps: list.lamps.clone(),
            depth: self.depth,
        })
    }
}

/// A kept tunnel in memory.
pub struct Planes {
    width: usize,
    /// In half precision, row by row.
    steady: Vec<u16>,
    blinking: Vec<u16>,
    /// Pixels in a row with the same lamp, each as its end and the lamp's row in the table of shares.
    runs: Vec<(usize, usize)>,
    /// Those of each row.
    rows: Vec<Range<usize>>,
}

impl Planes {
    /// From textures that have come back.
    pub fn of(bytes: &[u8], [light, lamp]: [&Piece; 2]) -> Self {
        let [width, height] = light.part.size.map(|n| n as usize);
        let mut planes = Self {
            width,
            steady: Vec::with_capacity(width * height),
            blinking: Vec::with_capacity(width * height),
            runs: Vec::new(),
            rows: Vec::with_capacity(height),
        };
        for v in 0..height as u32 {
            let (pairs, _) = light.row(bytes, v).as_chunks::<2>();
            planes
                .steady
                .extend(pairs.iter().map(|p| u16::from_le_bytes(p[0])));
            (planes.blinking).extend(pairs.iter().map(|p| u16::from_le_bytes(p[1])));
            let first = planes.runs.len();
            let mut lamps = lamp
                .row(bytes, v)
                .iter()
                .map(|word| u16::from_le_bytes(*word));
            let mut of_run = lamps.next().unwrap_or(0);
            for (u, lamp) in (1..).zip(lamps) {
                if lamp != of_run {
                    planes.runs.push((u, usize::from(of_run)));
                    of_run = lamp;
                }
            }
            planes.runs.push((width, usize::from(of_run)));
            planes.rows.push(first..planes.runs.len());
        }
        planes
    }

    /// The signal of row `v` under a table of shares, see [`KeptTunnel::share_rows`].
    #[inline(always)]
    pub fn row(&self, v: usize, shares: (&[f32], &[usize]), out: &mut [f32]) {
        self.part_of_row((v, 0), shares, out, |signal_e| signal_e);
    }

    /// That of a part of the picture, for the adapter to draw over.
    pub fn upload(&self, gpu: &Gpu, parts: &[Rectangle], shares: (&[f32], &[usize])) -> Uploaded {
        let arch = Arch::new();
        Uploaded::new(gpu, parts, |u, v, out| {
            arch.dispatch(|| {
                let at = (v as usize, u as usize);
                self.part_of_row(at, shares, out, |signal_e| {
                    narrow(signal_e.min(BRIGHTEST_E as f32))
                });
            });
        })
    }

    /// From column `u` of row `v` on, as `make` makes it of the signal.
    #[inline(always)]
    fn part_of_row<T>(
        &self,
        (v, u): (usize, usize),
        (shares, share_rows): (&[f32], &[usize]),
        out: &mut [T],
        make: impl Fn(f32) -> T,
    ) {
        let (height, end) = (self.rows.len(), self.width.min(u + out.len()));
        let row = v * self.width..(v + 1) * self.width;
        let (steady, blinking) = (&self.steady[row.clone()], &self.blinking[row]);
        let mut from = u;
        for (run_end, lamp) in &self.runs[self.rows[v].clone()] {
            let to = end.min(*run_end);
            if to <= from {
                continue;
            }
            let row = share_rows.get(*lamp).copied().unwrap_or(0);
            let share = shares.get(row * height + v).copied().unwrap_or(1.0);
            let pixels = steady[from..to].iter().zip(&blinking[from..to]);
            for (to, (steady, blinking)) in out[from - u..to - u].iter_mut().zip(pixels) {
                *to = make(widen(*steady) + share * widen(*blinking));
            }
            from = to;
        }
    }
}
