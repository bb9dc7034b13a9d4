//! Passes that draw into a part of a depth target.

use halflight_shared_shaders::Shader;
use serde::Serialize;

use super::{PassBuilder, ResourceId, Work};

/// A square part of a layer of a depth target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Tile {
    /// Its upper left corner, texels.
    pub corner: [u32; 2],
    /// Its width and height, texels.
    pub size: u32,
}

impl PassBuilder<'_> {
    /// As [`PassBuilder::draw`] without colour targets, into one tile of a depth target. Only the tile is cleared before,
    /// so the passes of the other tiles may run before or after it, or not at all.
    pub fn draw_tile(
        self,
        triangles: impl IntoIterator<Item = (&'static str, Option<&'static Shader>)>,
        target: (ResourceId, u32),
        own: Tile,
    ) {
        let PassBuilder { plan, pass } = self;
        PassBuilder { plan: &mut *plan, pass }.draw(triangles, Vec::new(), target);
        if let Some(Work::Draw { tile, .. }) = plan.passes.last_mut().map(|pass| &mut pass.work) {
            *tile = Some(own);
        }
    }
}
