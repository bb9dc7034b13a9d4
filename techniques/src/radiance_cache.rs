//! A cache of incident light on surfaces in world space. Records keep the exact rays that they have traced as links to what
//! was hit: links are lit again when lights change, and carry light from record to record for all further bounces.
//!
//! Related: irradiance caching (Ward et al. 1988), spatial hashing of light (Binder et al. 2018), surfels that gather
//! over frames (Halen et al. 2021), and two-level caches (Boissé et al. 2023).

use glam::Vec3;
use halflight_shared_shaders::{
    hierarchical::upsample_linear::UpsampleLinear,
    radiance_cache::{
        collect::{self, Collect},
        draw::{self, Draw},
        fill::Fill,
        mix_levels::MixLevels,
        publish::Publish,
        relight::{self, Relight},
        resolve::{self, Resolve},
        seek::Seek,
        settle::Settle,
        sweep::Sweep,
        trace::{self, Trace},
        update::{self, Update},
        weigh::Weigh,
    },
};
use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::{
    gi::{
        GBufferNeeds, Inputs, LightSources, Reach, StartResolution, Storage, Technique, UpsamplingKernel,
        bvh::plan_bvh,
        denoise::denoised,
        resolution::{LINEAR_COST, Upsampling, dark_surfels, to_display},
        shadow_maps::{ShadowMaps, plan_shadow_maps},
    },
    parameters,
    parameters::{Settings, SettingsError},
    scene::SceneFacts,
};

parameters! {
    /// Parameters of the radiance cache.
    pub struct RadianceCache("radiance-cache") {
        /// Rays of a frame. All records share them.
        rays: u32 = 4096, in 64..=131_072, unit "1", grid [2048, 8192, 32768], role Plan;
        /// Width of a record on the screen.
        spacing: f32 = 8.0, in 2.0..=64.0, unit "px", grid [4.0, 8.0, 16.0], role Plan;
        /// Links that a record keeps, for changes of light and for further bounces.
        links: u32 = 8, in 1..=256, unit "1", grid [8, 16], role Override;
        /// Bounces of indirect light; 0 for all of them. Each frame adds one.
        bounces: u32 = 0, in 0..=16, unit "1", grid [0, 1, 2], role Plan;
        /// Rays of a record at which it counts as much as the coarser ones around it.
        trusted: f32 = 16.0, in 0.001..=1e6, unit "1", grid [16.0], role Plan;
        /// Resolution at which records are interpolated.
        start_resolution: StartResolution = StartResolution::Half, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Passes of the spatial filter that interpolates between records.
        denoise: u32 = 1, in 0..=4, unit "1", grid [1, 2, 3], role Plan;
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: RadianceCache::TECHNIQUE,
    title: "Radiance cache",
    summary: "records in world space keep exact rays as links, which are lit again when lights change",
    parameters: RadianceCache::parameters,
    main: &["rays", "spacing", "links", "bounces", "denoise"],
    complete: |settings| Ok(RadianceCache::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources { lamps: Reach::Scene, emitters: Reach::Scene, sky: Reach::Scene }),
    plan,
};

/// Bytes of a slot in its bucket, of the record and of its total: twins of `Bucket`, `Record` and `totals` in
/// radiance_cache/cells.wgsl.
const CELL_BYTES: u64 = 28;
const RECORD_BYTES: u64 = 64;
const TOTAL_BYTES: u64 = 16;
/// Bytes of the numbers of the whole cache: twin of radiance_cache/counters.wgsl.
const COUNTERS_BYTES: u64 = 48;
/// Bytes of a link and of a ray with its link: twins of radiance_cache/links.wgsl.
const LINK_BYTES: u64 = 16;
const RAY_BYTES: u64 = 64;
/// Slots for each record that the display would need if surfaces faced the camera: surfaces are slanted, and records have
/// coarser ones.
const SLOTS_PER_RECORD: f32 = 4.3;
/// Slots for records that only hits refer to.
const SLOTS_OF_HITS: u32 = 28 << 10;
/// Most slots: twin of `LARGEST_20` in radiance_cache/links.wgsl, rounded to whole workgroups.
const MOST_SLOTS: u32 = (1 << 20) - 64;
/// Width of the squares of pixels of which one is looked at in a frame. Twin of `SQUARE` in radiance_cache/squares.wgsl.
const SQUARE: u32 = 4;
/// Slots, or pixels, for each invocation of a pass over a list: an estimate, as each invocation takes what is left.
const SHARE: u32 = 8;
/// Unit of the grid, as a share of the scene's diagonal. Only its ratio to a power of two matters.
const UNIT: f32 = 1.0 / 4096.0;

/// Least width of records that hits refer to, as a share of what is looked at.
const HIT_WIDTH: f32 = 1.0 / 32.0;
/// Rays that a record counts for at most while objects move, without emitters in the scene and with some.
const RAYS_IN_MOTION: f32 = 16.0;
const RAYS_IN_MOTION_OF_EMITTERS: f32 = 8.0;
/// Further rays of a frame for new records, relative to the budget.
const NEW_RAYS: f32 = 8.0;

/// Number of slots of the table.
fn slots([width, height]: [u32; 2], spacing: f32) -> u32 {
    let records = width as f32 * height as f32 / (spacing * spacing);
    (SLOTS_OF_HITS + (SLOTS_PER_RECORD * records) as u32).next_multiple_of(64).min(MOST_SLOTS)
}

/// `Grid` of radiance_cache/cells.wgsl.
fn grid(scene: &SceneFacts, parameters: &RadianceCache) -> Vec<u8> {
    let (low, high) = scene.extent.scene;
    let least = f32::MIN_POSITIVE * 1e10;
    let unit = UNIT * low.distance(high).max(least);
    let focus = Vec3::from(scene.bounds[0]).distance(scene.bounds[1].into());
    let level_of_hits = (HIT_WIDTH * focus / unit).max(f32::MIN_POSITIVE).log2().round() as i32;
    let size = (high - low).max_element().max(least);
    let sizes = [unit, parameters.spacing, parameters.trusted].map(f32::to_bits);
    let scene_box = [low.x, low.y, low.z, size].map(f32::to_bits);
    sizes.into_iter().chain([level_of_hits as u32]).chain(scene_box).flat_map(u32::to_le_bytes).collect()
}

/// `array<ObjectBox>` of radiance_cache/relight.wgsl.
fn boxes(scene: &SceneFacts) -> Vec<u8> {
    let corner = |[x, y, z]: [f32; 3]| [x, y, z, 0.0].map(f32::to_le_bytes);
    scene.object_boxes.iter().flatten().flat_map(|&v| corner(v)).flatten().collect()
}

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = RadianceCache::from_settings(settings)?;
    let Some(scene) = inputs.scene else {
        return Err(SettingsError(
            "radiance-cache traces rays through the scene's triangles, and only textures were given: give the scene"
                .into(),
        ));
    };
    let level = dark_surfels(plan, inputs, parameters.start_resolution.divisor());
    let slots = slots(plan.display_size, parameters.spacing);
    let (low, high) = scene.extent.scene;
    let diagonal = low.distance(high).max(f32::MIN_POSITIVE * 1e10);
    let grid = plan.data("grid", grid(scene, &parameters), "sizes of cells");
    let pixels = plan.display_size.map(u64::from).iter().product::<u64>();
    let mut buffer = |name: &str, bytes: u64, reason: &str| plan.buffer(name, bytes, reason);
    let each = u64::from(slots);
    let buckets = buffer("buckets", each * CELL_BYTES, "table of records by their cells");
    let records = buffer("records", each * RECORD_BYTES, "incident light of surfaces in a cell");
    let layers = 2 * u64::from(parameters.bounces.max(1));
    let totals = buffer("totals", layers * each * TOTAL_BYTES, "light of records in this frame and in the last one");
    let mixed = buffer("mixed", each * TOTAL_BYTES, "light of records, mixed with that of coarser ones");
    let linked = parameters.bounces != 1;
    let links = (linked || scene.needs.lights > 0 || scene.animated()).then(|| {
        buffer("links", each * u64::from(parameters.links) * LINK_BYTES, "what the newest rays of each record hit")
    });
    // The shares of the records are rounded at random, so their sum varies.
    let most_rays = ((1.0 + NEW_RAYS) * 1.1 * parameters.rays as f32) as u32 + 1024;
    let rays = buffer("rays", u64::from(most_rays) * RAY_BYTES, "rays of this frame");
    let counters = buffer(
        "counters",
        COUNTERS_BYTES + 4 * (2 * each + pixels.div_ceil(2)),
        "numbers and lists of the whole cache",
    );
    let over_slots = [slots, 1];
    let over_taken = [slots.div_ceil(SHARE), 1];
    let over_rays = [parameters.rays, 1];
    let light_count = scene.needs.lights as u32;
    let shadows = plan_shadow_maps(plan, scene, settings)?;
    let lamps = shadows.map(|shadows| (plan.changing_scene_buffer("scene.lights", "the scene's lights"), shadows));
    let objects = scene.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));

    let run = Sweep { buckets, counters, totals, mixed, lit: lamps.map(|(lights, _)| lights), animated: objects };
    plan.pass(Part::Technique, "sweep", run).because("removes records that nothing refers to").over(over_slots);

    let &Inputs { depth, normal, .. } = inputs;
    let squares = plan.display_size.map(|v| v.div_ceil(SQUARE));
    let run = Seek { depth, normal, grid, buckets, records, counters };
    plan.pass(Part::Technique, "seek", run).because("records of what the camera sees").over(squares);

    let run = Weigh { buckets, records, counters, totals };
    plan.pass(Part::Technique, "weigh", run).because("lists records; those with few rays get more").over(over_slots);

    let params = draw::Params { budget: parameters.rays as f32, budget_of_new: NEW_RAYS * parameters.rays as f32 };
    let run = Draw { buckets, records, counters, rays, totals, params };
    plan.pass(Part::Technique, "draw", run).because(format!("{} rays a frame", parameters.rays)).over(over_taken);

    let bvh = plan_bvh(plan, scene);
    let environment = scene.needs.environment.then(|| plan.scene_buffer("scene.environment", "environment light"));
    let materials = plan.scene_buffer("scene.materials", "the scene's materials");
    let texels = plan.scene_buffer("scene.texels", "materials with textures");
    let run = Trace {
        nodes: bvh.nodes,
        triangles: bvh.triangles,
        attributes: bvh.attributes,
        emitting: bvh.emitters,
        materials,
        texels,
        depth,
        normal,
        grid,
        buckets,
        records,
        counters,
        rays,
        lit: lamps.map(|(lights, ShadowMaps { maps, layers })| trace::Lit { lights, maps, layers }),
        environment,
        params: trace::Params { scene_radius: 0.5 * diagonal },
        constants: trace::Constants {
            lights: light_count,
            holes: scene.needs.alpha_tested,
            draw_sky: scene.uneven_sky,
            bounces: linked,
        },
    };
    plan.pass(Part::Technique, "trace", run).because("light at the ends of rays").over(over_rays);

    let run = Settle { grid, buckets, records, counters, rays };
    plan.pass(Part::Technique, "settle", run).because("positions of records that hits refer to").over(over_rays);

    let boxes = scene.animated().then(|| plan.data("object_boxes", boxes(scene), "boxes of objects at rest"));
    if let Some(links) = links.filter(|_| lamps.is_some() || objects.is_some()) {
        let run = Relight {
            grid: Some(grid),
            records,
            counters,
            links,
            lit: lamps.map(|(lights, ShadowMaps { maps, layers })| relight::Lit { lights, maps, layers }),
            animated: objects.zip(boxes).map(|(objects, boxes)| relight::Animated { objects, boxes }),
            constants: relight::Constants {
                links: parameters.links,
                lights: light_count,
                rays_in_motion: if scene.emitters.is_empty() { RAYS_IN_MOTION } else { RAYS_IN_MOTION_OF_EMITTERS },
            },
        };
        plan.pass(Part::Technique, "relight", run)
            .because("lights links again where lights or objects have changed")
            .over(over_taken);
    }
    let constants = update::Constants { links: parameters.links, bounces: parameters.bounces };
    let kept = links.is_some();
    let run = Update { buckets, records, counters, rays, links, totals, kept, linked, constants };
    plan.pass(Part::Technique, "update", run)
        .because("adds rays to records; further bounces, through links")
        .over(over_taken);
    let run = Publish { counters, totals };
    plan.pass(Part::Technique, "publish", run).because("the next light of the records").over(over_taken);
    for (name, parity) in [("collect_0", 1), ("collect_1", 0), ("collect_2", 1), ("collect_3", 0)] {
        let run = Collect { buckets, records, counters, totals, params: collect::Params { parity } };
        plan.pass(Part::Technique, name, run)
            .because("coarse records collect the light of finer ones")
            .over(over_taken);
    }
    let run = MixLevels { grid, buckets, records, counters, totals, mixed };
    plan.pass(Part::Technique, "mix_levels", run)
        .because("records with few rays take the light of coarser ones")
        .over(over_taken);

    let float16 = parameters.storage == Storage::Float16;
    // Light is packed into the surfels that the next passes read as well: half the fetches.
    let packed = float16 && level.scale == 2;
    let format = if packed { Format::Rgba32Uint } else { Format::Rgba32Float };
    let gathered = plan.texture("gathered", level.size, format, "light of the records");
    let run = Resolve {
        grid,
        buckets,
        mixed,
        surfels: level.surfels,
        gathered,
        packed,
        params: resolve::Params { scale: level.scale as f32 },
    };
    plan.pass(Part::Technique, "resolve", run).because("light of the records at each surfel").over(level.size);
    let light = denoised(plan, &level, gathered, parameters.denoise);
    if level.scale != 2 {
        let upsampling = Upsampling { kernel: UpsamplingKernel::Linear, storage: parameters.storage };
        return Ok(Some(to_display(plan, inputs, &upsampling, &level, light, "indirect")));
    }
    let format = if float16 { Format::Rgba16Float } else { Format::Rgba32Float };
    let indirect = plan.texture("indirect", plan.display_size, format, "indirect light at full resolution");
    let run = UpsampleLinear {
        coarse_surfels: if packed { light } else { level.surfels },
        indirect,
        depth,
        normal,
        float16,
        ambient_visibility: false,
        packed,
        records: Some(counters),
        coarse_indirect: (!packed).then_some(light),
    };
    plan.pass(Part::Technique, "upsample", run)
        .because("interpolates at half resolution, and lists pixels where no surfel fits")
        .costs(LINEAR_COST)
        .over(level.size.map(|v| v + 1));
    let run = Fill { depth, normal, grid, buckets, counters, mixed, indirect, float16 };
    plan.pass(Part::Technique, "fill", run)
        .because("looks records up where no surfel fits")
        .over([(pixels as u32).div_ceil(SHARE), 1]);
    Ok(Some(indirect))
}
