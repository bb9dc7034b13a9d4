//! Shared parts of the techniques that walk along slices (`common/slice.wgsl`): choices, surfels, the spatial filter
//! and the upsampling.

use wgpu::TextureFormat as Format;

use crate::gi::{
    Finds, Inputs, Resolution, Storage, UpsamplingKernel,
    denoise::denoised,
    resolution::{Upsampling, surfels_and_planes, to_display},
    sky_light::{Sky, plan_sky},
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::{Call, ambient::Ambient};

/// Stands for an unlimited radius, scene units. Its square is finite, and no scene is as large.
const FAR: f32 = 1e15;

/// Rays to the sky of a pixel: `RAYS` of ambient/ambient.wgsl.
const AMBIENT_RAYS: u64 = 16;

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
    /// Samples of a texel, and its rays to the sky: its work.
    pub samples: u32,
    /// See `samples`.
    pub sky_rays: u32,
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
    /// The sky, if its light is gathered.
    pub sky: Option<Sky>,
    /// Whether light is packed into surfels.
    pub packed: bool,
    /// Whether light is stored as float16.
    pub float16: bool,
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
        let lit = self.finds == Finds::Light;
        let sky = if lit { plan_sky(plan, inputs) } else { None };
        let (level, planes) = surfels_and_planes(plan, inputs, 1 << self.resolution as u32, lit);
        let level = &level;
        // Between gather and upsampling light is packed into the surfels that both passes read: half the fetches.
        let half = lit && self.storage == Storage::Float16;
        let (packed, float16) =
            (half && self.resolution == Resolution::Half, half && self.resolution == Resolution::Full);
        let (format, what) = match (lit, packed) {
            (true, false) if float16 => (Format::Rgba16Float, "light along slices"),
            (true, false) => (Format::Rgba32Float, "light along slices"),
            (true, true) => (Format::Rgba32Uint, "surfaces with light along slices"),
            (false, _) => (Format::R32Float, "ambient visibility along slices"),
        };
        let gathered = plan.texture("gathered", level.size, format, what);
        let of_ray = sky.map_or(0, |sky| sky.voxels.ray_cost(plan));
        let call = gather(SliceInputs {
            surfels: level.surfels,
            planes,
            gathered,
            sky,
            packed,
            float16,
            scale: level.scale as f32,
            radius: if self.radius > 0.0 { self.radius } else { FAR },
        });
        plan.pass(Part::Technique, "gather", call)
            .because(format!("{what}, {}", self.technique))
            .costs(u64::from(self.samples) + u64::from(self.sky_rays) * of_ray)
            .over(tiled(level.size));
        let found = denoised(plan, level, gathered, self.denoise);
        let upsampling = Upsampling { kernel: UpsamplingKernel::Linear, storage: self.storage };
        if lit {
            return Some(to_display(plan, inputs, &upsampling, level, found, "indirect"));
        }
        let open = to_display(plan, inputs, &upsampling, level, found, "ambient_occlusion");
        plan.outputs.insert("ambient_occlusion", open);
        plan.attributes.insert("ambient_occlusion.radius", self.radius);
        plan_sky(plan, inputs).map(|Sky { environment, voxels }| {
            let size = plan.display_size;
            let indirect =
                plan.texture("indirect", size, Format::Rgba32Float, "environment light times ambient visibility");
            let run = Ambient {
                normal: inputs.normal,
                depth: inputs.depth,
                ambient_occlusion: open,
                environment,
                indirect,
                grid: voxels.grid,
                voxels: voxels.voxels,
            };
            let cost = AMBIENT_RAYS * voxels.ray_cost(plan);
            plan.pass(Part::Technique, "ambient", run).because("the scene has an environment").costs(cost).over(size);
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
