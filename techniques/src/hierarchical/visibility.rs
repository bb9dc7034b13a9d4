//! The froxel grid, which holds the occluders between a surface and its source (Soler & Hoel 2010).

use wgpu::TextureFormat as Format;

use super::{Hierarchical, Visibility, VisibilityDownsampling};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::{
    gi::{Inputs, resolution::Level},
    parameters::SettingsError,
    scene::{SceneFacts, triangles},
};
use halflight_shared_shaders::hierarchical::{
    depth_range::DepthRange,
    voxel_pyramid::{self, VoxelPyramid},
    voxelize::{self, Voxelize},
};

/// Depth slices: bits of a column.
pub const SLICES: u32 = 128;

/// Twin of `SQUARE` in `hierarchical/depth_range.wgsl`: width of the square that one invocation reads, texels.
const DEPTH_RANGE_SQUARE: u32 = 8;

/// The grids of all levels.
pub(super) struct Froxels {
    levels: Vec<ResourceId>,
    depth_range: ResourceId,
}

/// Inputs of the gather of one level.
#[derive(Clone, Copy)]
pub(super) struct LevelFroxels {
    pub(super) froxels: ResourceId,
    pub(super) depth_range: ResourceId,
}

impl Froxels {
    pub(super) fn level(&self, k: usize) -> LevelFroxels {
        LevelFroxels { froxels: self.levels[k], depth_range: self.depth_range }
    }
}

/// Plans the grids of these levels; `None` if visibility is off.
pub(super) fn plan_froxels(
    plan: &mut FramePlan,
    inputs: &Inputs,
    parameters: &Hierarchical,
    levels: &[Level],
) -> Result<Option<Froxels>, SettingsError> {
    if parameters.visibility == Visibility::Off {
        return Ok(None);
    }
    let Some(scene) = inputs.scene else {
        return Err(SettingsError(
            "hierarchical.visibility needs the scene's triangles and only textures were given: \
             set it to off, or plan with the facts of a scene"
                .into(),
        ));
    };
    let depth_range = plan.buffer("depth_range", 8, "depth range of the froxel grid");
    plan.pass(Part::Technique, "depth_range", DepthRange { surfels: levels[0].surfels, depth_range })
        .clear(depth_range)
        .because("slices reach from the nearest to the farthest visible surface")
        .over(levels[0].size.map(|v| v.div_ceil(DEPTH_RANGE_SQUARE)));
    let finest_froxels = plan_finest_froxels(plan, scene, &levels[0], parameters.visibility, depth_range);
    let mut grids: Vec<ResourceId> = Vec::new();
    for level in levels {
        let name = format!("voxels_{}", level.scale);
        let reason = format!("{SLICES} slices for each square of {} pixels", level.scale);
        let froxels = plan.texture_array(&name, level.size, SLICES / u32::BITS, Format::R32Uint, reason);
        let children = grids.last().copied();
        let run = VoxelPyramid {
            froxels,
            finest: children.is_none().then_some(finest_froxels),
            children,
            constants: voxel_pyramid::Constants {
                any_child: parameters.visibility_downsampling == VisibilityDownsampling::Or,
            },
        };
        plan.pass(Part::Technique, &name, run)
            .because(match children {
                None => "rays read textures faster than buffers",
                Some(_) => "rays of a level stay in its own grid",
            })
            .over(level.size);
        grids.push(froxels);
    }
    Ok(Some(Froxels { levels: grids, depth_range }))
}

/// A raster pass into the grid.
struct Raster {
    name: &'static str,
    triangles: &'static str,
    solid: bool,
    alpha_masked: bool,
    reason: &'static str,
}

/// The raster passes of a scene. Only alpha-masked meshes test alpha, because for triangles with few fragments in the
/// grid the test dominates the cost.
fn rasters(scene: &SceneFacts, visibility: Visibility) -> Vec<Raster> {
    let solid = |triangles, alpha_masked| Raster {
        name: "voxelize_solid",
        triangles,
        solid: true,
        alpha_masked,
        reason: "meshes as solids",
    };
    let surfaces = |triangles| Raster {
        name: "voxelize_surfaces",
        triangles,
        solid: false,
        alpha_masked: false,
        reason: "meshes as surfaces",
    };
    let alpha_masked = Raster {
        name: "voxelize_cut_outs",
        triangles: triangles::ALPHA_TESTED,
        solid: false,
        alpha_masked: true,
        reason: "alpha-masked meshes, as surfaces",
    };
    let alpha_masked = scene.needs.alpha_tested.then_some(alpha_masked);
    let whole = match visibility {
        Visibility::Solid => return vec![solid(triangles::ALL, scene.needs.alpha_tested)],
        Visibility::Surface | Visibility::Off if alpha_masked.is_none() => vec![surfaces(triangles::ALL)],
        Visibility::Surface | Visibility::Off => {
            let any = scene.open_meshes() || scene.solid_meshes();
            any.then(|| surfaces(triangles::OPAQUE)).into_iter().collect()
        }
        Visibility::Auto => {
            // Flipping slices comes first and setting them last. An empty scene has one pass that draws nothing, to
            // clear the grid.
            let open = scene.open_meshes() || !scene.solid_meshes() && alpha_masked.is_none();
            let both =
                [scene.solid_meshes().then(|| solid(triangles::SOLID, false)), open.then(|| surfaces(triangles::OPEN))];
            both.into_iter().flatten().collect()
        }
    };
    whole.into_iter().chain(alpha_masked).collect()
}

/// The finest grid, written by the raster passes.
fn plan_finest_froxels(
    plan: &mut FramePlan,
    scene: &SceneFacts,
    level: &Level,
    visibility: Visibility,
    depth_range: ResourceId,
) -> ResourceId {
    let [width, height] = level.size;
    let bytes = u64::from(width) * u64::from(height) * u64::from(SLICES / 8);
    let froxels = plan.buffer("columns", bytes, "froxels while triangles are drawn");
    let target = plan.texture("voxel_target", level.size, Format::Depth16Unorm, "defines the size of the pass");
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let objects = scene.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));
    let mut first = true;
    for Raster { name, triangles, solid, alpha_masked: alpha_tested, reason } in rasters(scene, visibility) {
        let alpha_tested = alpha_tested.then(|| {
            let [materials, texels] = ["materials", "texels"]
                .map(|name| plan.scene_buffer(&format!("scene.{name}"), "alpha-masked surfaces"));
            voxelize::AlphaTested { materials, texels }
        });
        let run = Voxelize {
            vertices,
            depth_range,
            froxels,
            alpha_tested,
            animated: objects,
            params: voxelize::Params { grid: level.size.map(|v| v as f32), scale: level.scale as f32 },
            constants: voxelize::Constants { solid },
        };
        let mut pass = plan.pass(Part::Technique, name, run).because(reason);
        if first {
            pass = pass.clear(froxels);
        }
        pass.voxelize(target, triangles);
        first = false;
    }
    froxels
}
