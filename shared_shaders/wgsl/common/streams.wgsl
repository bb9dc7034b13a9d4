// The registry of random-number streams: the third argument of `random3` and `spread2`. Passes of one frame that draw
// from different streams are independent. Add new streams here and take a free range.
//
// Streams of techniques that never run in one plan may overlap. These ranges do:
//   2048, 2049: the slice-based techniques, and the choice of virtual point lights of the hybrid technique
//   5120 and up: the lights of the hierarchical technique, and the far pattern of the hybrid technique
// The path tracer runs alone: its streams 0 to 128 overlap those of the hierarchical gather.

// Path tracer: one stream a bounce, 0 to 63. Stream 0 also serves a trace of ambient occlusion alone.
/// Path tracer, mirror lobe of glossy surfaces: 1 stream.
const PATH_GLOSSY_STREAM: u32 = 64u;
/// Path tracer, points on emitters and the sky: one stream a bounce, from here.
const PATH_LIGHT_STREAM: u32 = 65u;

// Hierarchical gather: one stream for each level of each bounce, from 0 (`params.level`), below 1024.
/// Hierarchical gather, choice of the sample that is tested for visibility: as many streams as the gather, from here.
const HIERARCHICAL_VISIBILITY_STREAM: u32 = 1024u;

/// Slice-based techniques (bitmask, gtao, horizon), azimuth and jitter: 1 stream. They share it, so that all of them see
/// the same samples.
const SLICE_STREAM: u32 = 2048u;
/// Bitmask, rounding of sectors: 1 stream.
const SECTOR_STREAM: u32 = 2049u;

/// Virtual point lights, receivers that estimate importance: 1 stream, shared by `collect` and `emitters`.
const IMPORTANCE_STREAM: u32 = 2048u;
/// Virtual point lights, start of the systematic sampling: 1 stream.
const CHOICE_STREAM: u32 = 2049u;
/// Points on emitters: 1 stream.
const EMITTER_STREAM: u32 = 2050u;

/// Ray march, directions of the rays: 1 stream.
const RAY_STREAM: u32 = 2056u;
/// Ray march, jitter of the steps: 1 stream.
const RAY_JITTER_STREAM: u32 = 2057u;

/// Sky light, directions of the rays: 1 stream.
const SKY_STREAM: u32 = 2058u;

/// Hybrid, screen samples: 1 stream.
const NEAR_STREAM: u32 = 3072u;
/// Hybrid, virtual point lights: 1 stream.
const FAR_STREAM: u32 = 3073u;
/// SSDO: 1 stream.
const SSDO_STREAM: u32 = 3074u;
/// SSAO: 1 stream.
const SSAO_STREAM: u32 = 3075u;
/// Hybrid, near pattern: 1 stream.
const PATTERN_NEAR_STREAM: u32 = 3076u;
/// Hybrid, ambient visibility: 1 stream.
const AMBIENT_VISIBILITY_STREAM: u32 = 3077u;
/// Hybrid, directions drawn from the mirror lobe: 1 stream.
const REFLECTION_STREAM: u32 = 3078u;

/// Radiance cache, the square of pixels that stands for a cell: 1 stream.
const CACHE_SQUARE_STREAM: u32 = 3079u;
/// Radiance cache, the pixel that stands for a square: 1 stream.
const CACHE_PIXEL_STREAM: u32 = 3080u;
/// Radiance cache, rounding of the shares of rays: 1 stream.
const CACHE_SHARE_STREAM: u32 = 3081u;
/// Radiance cache, interpolation between cells: 2 streams.
const CACHE_RESOLVE_STREAM: u32 = 3082u;
/// Radiance cache, directions of rays: 1 stream.
const CACHE_DIRECTION_STREAM: u32 = 3084u;
/// Radiance cache, the hit that stands for a cell: 1 stream.
const CACHE_HIT_STREAM: u32 = 3085u;
/// Radiance cache, rounding of albedos: 1 stream.
const CACHE_ALBEDO_STREAM: u32 = 3086u;
/// Radiance cache, directions to the sky: 1 stream.
const CACHE_SKY_STREAM: u32 = 3087u;
/// Radiance cache, points on emitters: 1 stream.
const CACHE_EMITTER_STREAM: u32 = 3088u;

/// RSM technique: one stream a map, from here.
const RSM_STREAM: u32 = 4096u;

/// Lights of the hierarchical technique, choice of the sample that is tested for visibility: 1 stream.
const LIGHT_VISIBILITY_STREAM: u32 = 5119u;
/// Lights of the hierarchical technique: eight streams (one a level) for each map, from here.
const LIGHT_STREAM: u32 = 5120u;
/// Hybrid, far pattern: one stream a light, from here.
const PATTERN_FAR_STREAM: u32 = 5120u;

/// Pyramid over the reflective shadow maps: one stream a level, from here.
const LIGHT_PYRAMID_STREAM: u32 = 6144u;

/// Hybrid, far pattern, choice of the sample that is tested for visibility: one stream a light, from here.
const PATTERN_FAR_VISIBILITY_STREAM: u32 = 7168u;
