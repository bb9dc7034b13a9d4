//! Shared parts of the techniques that walk along slices (`common/slice.wgsl`): choices, surfels, the spatial filter
//! and the upsampling.

use wgpu::TextureFormat as Format;

use crate::gi::{
    Finds, Inputs, Resolution, Storage, UpsamplingKernel,
    resolution::{Level, Upsampling, surfels_and_planes, to_display},
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::{
    Call,
    ambient::Ambient,
    denoise::{self, Denoise},
};

/// Stands for an unlimited radius, scene units. Its square is finite, and no scene is as large.
const FAR: f32 = 1e15;

/// A gather along slices.
pub struct SliceGather {
    /// Name of the technique, for the reason of the pass.
    pub technique: &'static str,
    /// The result.
    pub finds: Finds,
    /// Scene units; 0 for unlimited.
    pub radius: f32,
    /// Resolution of the gather.
    pub resolution: Resolution,
    /// Passes of the spatial filter.
    pub denoise: u32,
    /// Storage of light at full resolution.
    pub storage: Storage,
}

/// Inputs and outputs of a technique's gather.
pub struct SliceInputs {
    /// Surfaces of the texels.
    pub surfels: ResourceId,
    /// The same surfaces as planes.
    pub planes: ResourceId,
    /// Destination of the light or ambient visibility.
    pub gathered: ResourceId,
    /// The scene's environment, if its light is gathered.
    pub environment: Option<ResourceId>,
    /// Whether light is packed into surfels.
    pub packed: bool,
    /// Width of a texel in full-resolution pixels.
    pub scale: f32,
    /// Scene units.
    pub radius: f32,
}

impl SliceGather {
    /// Plans surfels, gather, filter and upsampling. `gather` is the technique's shader. Returns light at full
    /// resolution. If ambient visibility is wanted, adds it to the outputs and returns the environment's light, if the
    /// scene has an environment.
    pub fn plan(
        &self,
        plan: &mut FramePlan,
        inputs: &Inputs,
        gather: impl FnOnce(SliceInputs) -> Call<ResourceId>,
    ) -> Option<ResourceId> {
        let environment = environment_of(plan, inputs).filter(|_| self.finds == Finds::Light);
        let (level, planes) = surfels_and_planes(plan, inputs, 1 << self.resolution as u32);
        let level = &level;
        let lit = self.finds == Finds::Light;
        // Between gather and upsampling light is packed into the surfels that both passes read: half the fetches.
        let packed = lit && self.resolution == Resolution::Half && self.storage == Storage::Float16;
        let (format, what) = match (lit, packed) {
            (true, false) => (Format::Rgba32Float, "light along slices"),
            (true, true) => (Format::Rgba32Uint, "surfaces with light along slices"),
            (false, _) => (Format::R32Float, "ambient visibility along slices"),
        };
        let gathered = plan.texture("gathered", level.size, format, what);
        let call = gather(SliceInputs {
            surfels: level.surfels,
            planes,
            gathered,
            environment,
            packed,
            scale: level.scale as f32,
            radius: if self.radius > 0.0 { self.radius } else { FAR },
        });
        plan.pass(Part::Technique, "gather", call)
            .because(format!("{what}, {}", self.technique))
            .over(tiled(level.size));
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
                plan.texture("indirect", size, Format::Rgba32Float, "environment light times ambient visibility");
            let run = Ambient { normal: inputs.normal, ambient_occlusion: open, environment, indirect };
            plan.pass(Part::Technique, "ambient", run).because("the scene has an environment").over(size);
            indirect
        })
    }
}

/// Dispatch size of a pass that takes its pixels from `common/tile.wgsl`: all rows of a tile along x, tiles along y.
fn tiled([width, height]: [u32; 2]) -> [u32; 2] {
    /// Workgroups across a tile, and pixels across a workgroup.
    const TILE: u32 = 16;
    const GROUP: u32 = 8;
    [TILE * height.next_multiple_of(GROUP), width.div_ceil(TILE * GROUP) * GROUP]
}

/// The scene's environment, if it has one.
pub fn environment_of(plan: &mut FramePlan, inputs: &Inputs) -> Option<ResourceId> {
    let any = inputs.scene.is_some_and(|scene| scene.needs.environment);
    any.then(|| plan.scene_buffer("scene.environment", "environment light"))
}

/// Plans the spatial filter: `count` passes. The distance of the taps doubles with each pass.
pub fn denoised(plan: &mut FramePlan, level: &Level, noisy: ResourceId, count: u32) -> ResourceId {
    let format = plan.resources[noisy.0].format().unwrap_or(Format::Rgba32Float);
    let ambient_visibility = format == Format::R32Float;
    let packed = format == Format::Rgba32Uint;
    (0..count).fold(noisy, |noisy, turn| {
        let spacing = 1u32 << turn;
        let smoothed = plan.texture(format!("denoised_{turn}"), level.size, format, "light after the spatial filter");
        let run = Denoise {
            surfels: if packed { noisy } else { level.surfels },
            smoothed,
            ambient_visibility,
            packed,
            noisy: (!packed).then_some(noisy),
            params: denoise::Params { scale: level.scale as f32, spacing },
        };
        plan.pass(Part::Technique, format!("denoise_{turn}"), run)
            .because(format!("few samples leave noise: taps {spacing} texels apart"))
            .over(level.size);
        smoothed
    })
}
