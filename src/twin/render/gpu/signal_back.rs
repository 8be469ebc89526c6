//! A view's signal on its way back to memory, in layers, and what becomes of it there: where a part of the
//! picture was drawn in full, that; elsewhere what lies under it, a small picture or a tunnel that is kept;
//! glare on top.

use super::adapter::Gpu;
use super::kept::{KeptTunnel, Planes};
use super::pieces::{Piece, Pieces, widen};
use super::prepared::PreparedView;
use super::target::{COARSE_PX, ViewTarget};
use crate::twin::render::develop::Developer;
use crate::twin::render::pixel_map::PixelMap;
use crate::twin::render::{Image, RenderError};
use image::{ImageBuffer, Primitive};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::sync::Arc;

/// What lies under the parts that were drawn.
pub enum Under {
    /// Nothing: all of the picture was drawn.
    Nothing,
    /// A picture in texels of [`COARSE_PX`].
    Coarse(Piece),
    /// A tunnel that is kept, with a table of shares and those of its rows that it needs.
    Kept(Arc<Planes>, Vec<f32>, Vec<usize>),
}

/// See the module's page.
pub struct SignalBack {
    pub buffer: wgpu::Buffer,
    /// In it.
    pub bytes: u64,
    pub size_px: (u32, u32),
    pub parts: Vec<Piece>,
    pub under: Under,
    pub glare: Piece,
    pub map: Arc<PixelMap>,
    pub developer: Developer,
}

impl SignalBack {
    /// Records the copies of what was drawn of a view.
    pub fn of(
        gpu: &Gpu,
        (encoder, free): (&mut wgpu::CommandEncoder, &mut Vec<wgpu::Buffer>),
        target: &ViewTarget,
        view: PreparedView,
        kept: Option<&KeptTunnel>,
        (map, developer): (&Arc<PixelMap>, Developer),
    ) -> Self {
        let mut pieces = Pieces::default();
        let under = match (kept, &view.coarse) {
            (Some(kept), _) => {
                let rows = kept.share_rows(&view.list);
                Under::Kept(Arc::clone(&kept.planes), view.list.shares, rows)
            }
            (None, Some(_)) => {
                let coarse = &target.coarse.signal;
                Under::Coarse(pieces.add(coarse, coarse.whole(), 1))
            }
            (None, None) => Under::Nothing,
        };
        let parts = view.parts.iter();
        let parts = parts.map(|part| pieces.add(&target.layers.signal, *part, 1));
        Self {
            size_px: target.size_px,
            parts: parts.collect(),
            under,
            glare: pieces.add(&target.glare, target.glare.whole(), 1),
            map: Arc::clone(map),
            developer,
            bytes: pieces.size(),
            buffer: pieces.copy(&gpu.device, encoder, free),
        }
    }

    /// Asks for access as soon as the copies are done.
    pub fn request(&self) {
        self.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// The finished image, each digital number converted to a pixel. Frees the buffer.
    pub fn image<T: Primitive + Send>(
        &self,
        convert: impl Fn(u32) -> T + Copy + Sync,
    ) -> Result<Image<T>, RenderError> {
        let (width, height) = self.size_px;
        let mut image = vec![T::DEFAULT_MIN_VALUE; width as usize * height as usize];
        {
            let bytes = (self.buffer.get_mapped_range(..))
                .map_err(|e| RenderError::Device(e.to_string()))?;
            let bytes: &[u8] = &bytes;
            let arch = Arch::new();
            let rows = image.par_chunks_mut((width as usize).max(1)).enumerate();
            rows.for_each_init(
                || RowBuffers::new(width as usize),
                |buffers, (v, out)| {
                    arch.dispatch(ComposedRow {
                        back: self,
                        bytes,
                        v,
                        buffers,
                        out,
                        convert,
                    });
                },
            );
        }
        self.buffer.unmap();
        ImageBuffer::from_raw(width, height, image)
            .ok_or_else(|| RenderError::Device("an image came back too short".into()))
    }
}

/// What a thread works in.
struct RowBuffers {
    signals_e: Vec<f32>,
    /// A row of a small picture, with its ends once more.
    coarse_e: Vec<f32>,
}

impl RowBuffers {
    fn new(width: usize) -> Self {
        let texels = width.div_ceil(COARSE_PX as usize);
        Self {
            signals_e: vec![0.0; texels * COARSE_PX as usize],
            coarse_e: vec![0.0; texels + 2],
        }
    }
}

/// A row of the image.
struct ComposedRow<'a, T, F> {
    back: &'a SignalBack,
    bytes: &'a [u8],
    v: usize,
    buffers: &'a mut RowBuffers,
    out: &'a mut [T],
    convert: F,
}

impl<T, F: Fn(u32) -> T> WithSimd for ComposedRow<'_, T, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (back, v) = (self.back, self.v);
        let RowBuffers {
            signals_e,
            coarse_e,
        } = self.buffers;
        match &back.under {
            Under::Nothing => {}
            Under::Coarse(piece) => enlarge(piece, self.bytes, v, coarse_e, signals_e),
            Under::Kept(planes, shares, rows) => planes.row(v, (shares, rows), signals_e),
        }
        for piece in back.parts.iter().filter(|piece| piece.has_row(v as u32)) {
            let [from, end] = [piece.part.at[0], piece.part.ends()[0]].map(|u| u as usize);
            let words = piece.row(self.bytes, v as u32);
            for (to, word) in signals_e[from..end].iter_mut().zip(words) {
                *to = widen(u16::from_le_bytes(*word));
            }
        }
        add_glare(back.glare.row(self.bytes, v as u32), signals_e);
        let words = back.map.row(v);
        let signals_e = &signals_e[..self.out.len()];
        back.developer
            .row(v, signals_e, words, self.out, self.convert);
    }
}

/// Row `v` of a picture from one in texels of [`COARSE_PX`], straight between their middles.
#[inline(always)]
fn enlarge(piece: &Piece, bytes: &[u8], v: usize, coarse_e: &mut [f32], out: &mut [f32]) {
    let down = (v as f32 + 0.5) / COARSE_PX as f32 - 0.5;
    let last = piece.part.size[1] as i32 - 1;
    let above = down.floor();
    let [a, b] = [0, 1].map(|k| piece.row(bytes, (above as i32 + k).clamp(0, last) as u32));
    let share = down - above;
    let texels = a.len();
    let inner = &mut coarse_e[1..=texels];
    for (to, (a, b)) in inner.iter_mut().zip(a.iter().zip(b)) {
        let [a, b] = [a, b].map(|word| widen(u16::from_le_bytes(*word)));
        *to = a + (b - a) * share;
    }
    coarse_e[0] = coarse_e[1];
    coarse_e[texels + 1] = coarse_e[texels];
    let (fours, _) = out.as_chunks_mut::<{ COARSE_PX as usize }>();
    let (before, after) = (&coarse_e[..texels], &coarse_e[2..]);
    let near = before.iter().zip(&coarse_e[1..]).zip(after);
    for (four, ((before, here), after)) in fours.iter_mut().zip(near) {
        let (left, right) = (before - here, after - here);
        four[0] = here + 0.375 * left;
        four[1] = here + 0.125 * left;
        four[2] = here + 0.125 * right;
        four[3] = here + 0.375 * right;
    }
}

/// Adds glare, which has a texel for every fourth pixel and one more.
#[inline(always)]
fn add_glare(words: &[[u8; 2]], out: &mut [f32]) {
    let (fours, _) = out.as_chunks_mut::<4>();
    let pairs = words.iter().zip(&words[1..]);
    for (four, (here, next)) in fours.iter_mut().zip(pairs) {
        let [here, next] = [here, next].map(|word| widen(u16::from_le_bytes(*word)));
        let step = 0.25 * (next - here);
        four[0] += here;
        four[1] += here + step;
        four[2] += here + 2.0 * step;
        four[3] += here + 3.0 * step;
    }
}
