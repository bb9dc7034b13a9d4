//! Passes under construction.

use halflight_shared_shaders::Shader;
use serde::Serialize;

use super::{Draw, FramePlan, Pass, ResourceId, Work};

/// A square part of a layer of a depth target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Tile {
    /// Its upper left corner, texels.
    pub corner: [u32; 2],
    /// Its width and height, texels.
    pub size: u32,
}

/// A pass under construction.
pub struct PassBuilder<'a> {
    pub(super) plan: &'a mut FramePlan,
    pub(super) pass: Pass,
}

impl PassBuilder<'_> {
    /// Clears a buffer to zero before the pass.
    pub fn clear(mut self, buffer: ResourceId) -> Self {
        self.pass.cleared.push(buffer);
        self
    }

    /// Declares that the pass writes only this part of a buffer and reads nothing of it. Passes that write other parts do
    /// not run with it. The caller numbers the parts, which must not overlap.
    pub fn into_part(mut self, buffer: ResourceId, part: u32) -> Self {
        self.pass.parts.push((buffer, part));
        self
    }

    /// As [`PassBuilder::into_part`], for a pass that also reads the parts that earlier passes have written.
    pub fn after_parts(mut self, buffer: ResourceId, part: u32) -> Self {
        self.pass.continued.push(buffer);
        self.into_part(buffer, part)
    }

    /// Declares the work of one invocation, in fetches of a texel with the arithmetic around them: for a pass whose work
    /// grows with a setting. It decides into how many dispatches the pass is divided.
    pub fn costs(mut self, work: u64) -> Self {
        self.pass.cost = work;
        self
    }

    /// Gives the reason for the pass.
    pub fn because(mut self, reason: impl Into<String>) -> Self {
        self.pass.reason = reason.into();
        self
    }

    /// Adds the pass: a dispatch of its compute shader over this many invocations along x and y.
    pub fn over(self, size: [u32; 2]) {
        let entry = self.pass.shader.entry_points[0].name;
        self.add(Work::Dispatch { entry, size });
    }

    /// Adds the pass: draws triangles into these targets, cleared before. Each set of triangles has its own shader;
    /// `None` for the pass's shader.
    pub fn draw(
        self,
        triangles: impl IntoIterator<Item = (&'static str, Option<&'static Shader>)>,
        targets: Vec<ResourceId>,
        depth: (ResourceId, u32),
    ) {
        let draws = self.draws(triangles);
        self.add(Work::Draw { draws, targets, depth, tile: None });
    }

    /// As [`PassBuilder::draw`] without colour targets, into one tile of a depth target. Only the tile is cleared before,
    /// so the passes of the other tiles may run before or after it, or not at all.
    pub fn draw_tile(
        self,
        triangles: impl IntoIterator<Item = (&'static str, Option<&'static Shader>)>,
        depth: (ResourceId, u32),
        tile: Tile,
    ) {
        let draws = self.draws(triangles);
        self.add(Work::Draw { draws, targets: Vec::new(), depth, tile: Some(tile) });
    }

    /// Adds the pass: draws these triangles, hidden ones included, at the size of this depth target.
    pub fn voxelize(self, target: ResourceId, triangles: &'static str) {
        self.add(Work::Voxelize { target, triangles });
    }

    fn draws(&self, triangles: impl IntoIterator<Item = (&'static str, Option<&'static Shader>)>) -> Vec<Draw> {
        let draw = |(triangles, shader): (_, Option<_>)| Draw { shader: shader.unwrap_or(self.pass.shader), triangles };
        triangles.into_iter().map(draw).collect()
    }

    fn add(mut self, work: Work) {
        self.pass.work = work;
        self.plan.passes.push(self.pass);
    }
}
