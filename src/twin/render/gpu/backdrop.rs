//! What cameras that stand still see of the tunnel, kept from frame to frame: bodies are drawn over a
//! copy.

use super::draw_list::DrawList;
use super::target::SurfaceLayers;
use super::view::Framed;
use crate::bus::Intrinsics;
use crate::twin::render::cache::Cache;
use nalgebra::Isometry3;

/// Cameras whose tunnel is kept.
pub const KEPT_BACKDROPS: usize = 4;

/// Tunnels as seen.
pub type Backdrops = Cache<BackdropKey, SurfaceLayers>;

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
