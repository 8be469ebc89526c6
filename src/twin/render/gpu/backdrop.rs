//! What cameras that stand still see of the tunnel, kept from frame to frame: bodies are drawn over a
//! copy.

use super::adapter::Gpu;
use super::draw_list::DrawList;
use super::target::Layers;
use super::view::Framed;
use crate::bus::Intrinsics;
use nalgebra::Isometry3;
use std::collections::VecDeque;

/// Cameras whose tunnel is kept.
const KEPT: usize = 4;

/// What the picture of a tunnel in steady light depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct BackdropKey {
    lens: Intrinsics,
    pose: Isometry3<f64>,
    electrons_per_cd_m2: f64,
    grey_per_cd_m2: f64,
}

impl BackdropKey {
    /// Of a view; none where the camera moves, or the light on the tunnel.
    pub fn of(framed: &Framed<'_>, list: &DrawList) -> Option<Self> {
        let view = framed.view;
        let still = view.motion.poses.len() == 1;
        let steady = !list.banded && list.tunnel().all(|call| !call.headlit);
        (still && steady).then(|| Self {
            lens: view.camera.intrinsics,
            pose: framed.middle,
            electrons_per_cd_m2: view.electrons_per_cd_m2(),
            grey_per_cd_m2: view.grey_per_cd_m2(),
        })
    }
}

/// Tunnels as seen, the latest last.
#[derive(Default)]
pub struct Backdrops {
    kept: VecDeque<(BackdropKey, Layers)>,
}

impl Backdrops {
    /// Where the light has changed, nothing holds any more.
    pub fn clear(&mut self) {
        self.kept.clear();
    }

    /// Copies a tunnel that was kept; whether there was one.
    pub fn show(
        &self,
        key: &BackdropKey,
        onto: &Layers,
        encoder: &mut wgpu::CommandEncoder,
    ) -> bool {
        let kept = self.kept.iter().find(|(k, _)| k == key);
        if let Some((_, layers)) = kept {
            layers.copy_to(onto, encoder);
        }
        kept.is_some()
    }

    /// Keeps a tunnel.
    pub fn keep(
        &mut self,
        gpu: &Gpu,
        key: BackdropKey,
        of: &Layers,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let oldest = if self.kept.len() >= KEPT {
            self.kept.pop_front()
        } else {
            None
        };
        let layers = oldest
            .map(|(_, layers)| layers)
            .filter(|layers| layers.size_px() == of.size_px())
            .unwrap_or_else(|| Layers::new(&gpu.device, of.size_px()));
        of.copy_to(&layers, encoder);
        self.kept.push_back((key, layers));
    }
}
