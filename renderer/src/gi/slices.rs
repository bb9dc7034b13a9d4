//! What all techniques that walk along slices share (`common/slice.wgsl`): choices, the surfels that they read, the filter
//! and the way back to the display.

use wgpu::TextureFormat as Format;

use crate::gi::{
    Finds, Inputs, Resolution, Storage, UpsamplingKernel,
    resolution::{Level, Upsampling, surfels_and_planes, to_display},
};
use halflight_frame_graph::{FramePlan, Part, PassBuilder, ResourceId, variant};

/// What stands for no end of the radius, scene units: its square is a number, and no scene is as large.
const FAR: f32 = 1e15;

/// A gather along slices.
pub struct SliceGather<'a> {
    pub technique: &'static str,
    pub shader: &'static str,
    /// Features of the shader, in its order.
    pub features: &'a [(&'static str, bool)],
    pub constants: &'a [(&'static str, f64)],
    pub finds: Finds,
    /// Scene units; 0 for unlimited.
    pub radius: f32,
    pub resolution: Resolution,
    /// Passes of the filter.
    pub denoise: u32,
    pub storage: Storage,
}

impl SliceGather<'_> {
    /// Plans surfels, the gather, filter and upsampling; `bind` adds what only this technique's gather reads. Returns
    /// light at full resolution; or leaves openness among the outputs, and returns the environment's light where the scene has
    /// one.
    pub fn plan(
        &self,
        plan: &mut FramePlan,
        inputs: &Inputs,
        bind: impl for<'b> FnOnce(PassBuilder<'b>) -> PassBuilder<'b>,
    ) -> Option<ResourceId> {
        let environment = environment_of(plan, inputs).filter(|_| self.finds == Finds::Light);
        let (level, planes) = surfels_and_planes(plan, inputs, 1 << self.resolution as u32);
        let level = &level;
        let lit = self.finds == Finds::Light;
        // On its way through filter and upsampling light is packed into the surfels that both read: half the fetches.
        let packed = lit && self.resolution == Resolution::Half && self.storage == Storage::Float16;
        let (format, what) = match (lit, packed) {
            (true, false) => (Format::Rgba32Float, "light along slices"),
            (true, true) => (Format::Rgba32Uint, "surfaces with light along slices"),
            (false, _) => (Format::R32Float, "openness along slices"),
        };
        let gathered = plan.texture("gathered", level.size, format, what);
        let shader =
            variant(self.shader, &[self.features, &[("ambient", environment.is_some()), ("packed", packed)]].concat());
        let pass = plan
            .pass(Part::Technique, "gather", shader)
            .constants(self.constants)
            .param("scale", level.scale as f32)
            .param("radius", if self.radius > 0.0 { self.radius } else { FAR })
            .bind("surfels", level.surfels)
            .bind("planes", planes)
            .bind("gathered", gathered)
            .because(format!("{what}, {}", self.technique));
        let pass = match environment {
            Some(environment) => pass.bind("environment", environment),
            None => pass,
        };
        bind(pass).over(tiled(level.size));
        let found = denoised(plan, level, gathered, self.denoise);
        let upsampling = Upsampling { kernel: UpsamplingKernel::Linear, storage: self.storage };
        if lit {
            return Some(to_display(plan, inputs, &upsampling, level, found, "indirect"));
        }
        let open = to_display(plan, inputs, &upsampling, level, found, "ambient_occlusion");
        plan.outputs.insert("ambient_occlusion", open);
        plan.attributes.insert("ambient_occlusion.radius", self.radius);
        environment_of(plan, inputs).map(|environment| {
            let size = plan.display_size;
            let indirect =
                plan.texture("indirect", size, Format::Rgba32Float, "light from outside through what is open");
            plan.pass(Part::Technique, "ambient", "ambient/ambient")
                .bind("normal", inputs.normal)
                .bind("ambient_occlusion", open)
                .bind("environment", environment)
                .bind("indirect", indirect)
                .because("the scene has an environment")
                .over(size);
            indirect
        })
    }
}

/// What to dispatch for a pass that takes its pixels from `common/tile.wgsl`: all rows of a tile along x, tiles along y.
fn tiled([width, height]: [u32; 2]) -> [u32; 2] {
    /// Workgroups across a tile, and pixels across a workgroup.
    const TILE: u32 = 16;
    const GROUP: u32 = 8;
    [TILE * height.next_multiple_of(GROUP), width.div_ceil(TILE * GROUP) * GROUP]
}

/// The scene's environment, where it has one.
pub fn environment_of(plan: &mut FramePlan, inputs: &Inputs) -> Option<ResourceId> {
    let any = inputs.scene.is_some_and(|scene| scene.needs.environment);
    any.then(|| plan.scene_buffer("scene.environment", "light from outside"))
}

/// Plans the spatial filter: `count` passes, the taps of each twice as far apart as those of the one before.
pub fn denoised(plan: &mut FramePlan, level: &Level, noisy: ResourceId, count: u32) -> ResourceId {
    let format = plan.resources[noisy.0].format().unwrap_or(Format::Rgba32Float);
    let openness = format == Format::R32Float;
    let packed = format == Format::Rgba32Uint;
    (0..count).fold(noisy, |noisy, turn| {
        let spacing = 1u32 << turn;
        let smoothed = plan.texture(format!("denoised_{turn}"), level.size, format, "neighbours averaged");
        let features = [("openness", openness), ("packed", packed)];
        let pass = plan
            .pass(Part::Technique, format!("denoise_{turn}"), variant("denoise/denoise", &features))
            .param("scale", level.scale as f32)
            .param("spacing", spacing)
            .bind("surfels", if packed { noisy } else { level.surfels });
        let pass = if packed { pass } else { pass.bind("noisy", noisy) };
        pass.bind("smoothed", smoothed)
            .because(format!("few samples leave noise: taps {spacing} apart"))
            .over(level.size);
        smoothed
    })
}
