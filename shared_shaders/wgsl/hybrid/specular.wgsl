// variants: lights, further, visibility
// Light that glossy surfaces reflect from their mirror direction (Lambru et al., section 3.2, Equation 4): the light of
// the pixel in the intersection map. With `lights`, where the map has none, the light of the surface that the ray hits
// in one reflective shadow map. With `visibility`, occluders of the scene block that ray. With `further`, surfaces
// behind those of the previous maps do not count. Ks is left out. The lobe is as narrow as a mirror's.
@if(lights) import package::common::form_factor::MIN_COS_BETA;
import package::common::division::Division;
import package::common::scene::Material;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
import package::hybrid::mirror_map::{NOTHING, unpack_pixel};
import package::hybrid::reflected::reflected;
@if(lights) import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light};
@if(lights) import package::common::shadow_view::ShadowView;
@if(lights) import package::reflective_shadow_maps::projection::{source_of, light_ray, area_across};
@if(lights && visibility) import package::scene_voxels::sees::{ray_end, sees};

struct Params {
    // Largest distance between two steps, texels of the map.
    stride: f32,
    // Length of a ray, scene units.
    reach: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@if(lights) @group(0) @binding(1) var<uniform> params: Params;
@if(lights) @group(0) @binding(14) var<uniform> shadow_view: ShadowView;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@group(0) @binding(4) var material: texture_2d<u32>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var mirror_map: texture_2d<u32>;
@if(!further) @group(0) @binding(7) var direct: texture_2d<f32>;
@if(further) @group(0) @binding(7) var partial_sum: texture_2d<f32>;
// Light in rgb. In a, distance to the surface of a reflective shadow map that sends it; 0 if none does.
@group(0) @binding(8) var specular: texture_storage_2d<rgba32float, write>;
@if(lights) @group(0) @binding(9) var rsm_position: texture_2d<f32>;
@if(lights) @group(0) @binding(10) var light: texture_2d<u32>;

// Whether directions are sampled from the lobe instead of taking its axis.
override LOBE: bool;
// Whether a temporal filter averages successive frames. The directions are then stratified over frames.
override OVER_FRAMES: bool;

/// Bisection steps that refine a crossing.
@if(lights) const HALVINGS: u32 = 6u;
/// A crossing counts if the ray ends this near to the surface, in widths of a texel. Farther behind, the ray passed
/// behind the occluder.
@if(lights) const TOLERANCE: f32 = 3.0;
/// A ray starts this far from its surface, in widths of a texel, because the map is a staircase.
@if(lights) const START: f32 = 1.0;
/// Surfaces of two lights at distances within this share of each other are the same surface: both count.
@if(lights) const SAME_DISTANCE: f32 = 0.02;

/// The surface of the map at the projection of a position, and the distance of the position behind it along the light's
/// ray; negative in front of it.
@if(lights)
struct Seen {
    surface: LightSurface,
    behind: f32,
    // Width of a texel there, scene units.
    texel: f32,
}

@if(lights)
fn seen_at(source: vec4f, point: vec3f) -> Seen {
    let size = vec2f(textureDimensions(rsm_position));
    let clip = shadow_view.world_to_clip * vec4f(point, 1.0);
    let uv = clip.xy / max(clip.w, 1e-30) * vec2f(0.5, -0.5) + 0.5;
    let at = vec2i(clamp(floor(uv * size), vec2f(0.0), size - 1.0));
    let surface = unpack_light(textureLoad(rsm_position, at, 0).xyz, textureLoad(light, at, 0));
    let ray = light_ray(source, point);
    // Distance to the plane of the surface, which faces the light.
    let height = dot(surface.normal, point - surface.position);
    let behind = -height / max(-dot(surface.normal, ray.direction), MIN_COS_BETA);
    let texel = sqrt(max(area_across(shadow_view.world_to_clip, ray, size.x), 0.0));
    return Seen(surface, select(-params.reach, behind, surface.area > 0.0), texel);
}

/// The part t = low..high of a ray, clip space, inside the map; empty if low > high.
@if(lights)
fn within_view(start: vec4f, direction: vec4f) -> vec2f {
    var range = vec2f(0.0, params.reach);
    // Left, right, bottom, top: w + x, w - x, w + y, w - y are positive inside. w stays clear of 0.
    let at = array<vec2f, 5>(
        vec2f(start.w + start.x, direction.w + direction.x),
        vec2f(start.w - start.x, direction.w - direction.x),
        vec2f(start.w + start.y, direction.w + direction.y),
        vec2f(start.w - start.y, direction.w - direction.y),
        vec2f(start.w - 1e-4 * params.reach * f32(direction.w != 0.0), direction.w),
    );
    for (var i = 0u; i < 5u; i++) {
        let height = at[i].x;
        let slope = at[i].y;
        let crossing = -height / select(slope, 1e-30, abs(slope) < 1e-30);
        if slope > 0.0 {
            range.x = max(range.x, crossing);
        } else if slope < 0.0 {
            range.y = min(range.y, crossing);
        } else if height < 0.0 {
            return vec2f(1.0, 0.0);
        }
    }
    return range;
}

/// Light of the surface that the ray hits in the map, and its distance; zeros without a hit or if an occluder lies
/// before it.
@if(lights)
fn march(position: vec3f, normal: vec3f, mirror: vec3f) -> vec4f {
    let source = source_of(shadow_view.world_to_clip);
    let size = f32(textureDimensions(rsm_position).x);
    let width = sqrt(max(area_across(shadow_view.world_to_clip, light_ray(source, position), size), 0.0));
    // In the shadow or behind the light there is no own surface to clear.
    let start = position + START * width * normal;
    let origin = shadow_view.world_to_clip * vec4f(start, 1.0);
    let along = shadow_view.world_to_clip * vec4f(mirror, 0.0);
    let range = within_view(origin, along);
    if range.x >= range.y {
        return vec4f(0.0);
    }
    let first = origin + range.x * along;
    let last = origin + range.y * along;
    let way = (last.xy / last.w - first.xy / first.w) * 0.5 * size;
    let steps = u32(clamp(ceil(length(way) / params.stride), 1.0, 2.0 * size));
    let inverse = 1.0 / vec2f(first.w, last.w);
    let ends = range * inverse;
    var before = range.x;
    var was_before = seen_at(source, start + before * mirror).behind <= 0.0;
    for (var i = 1u; i <= steps; i++) {
        // Steps are even in the map, where t / w and 1 / w are linear.
        let share = f32(i) / f32(steps);
        let after = mix(ends.x, ends.y, share) / mix(inverse.x, inverse.y, share);
        let is_behind = seen_at(source, start + after * mirror).behind > 0.0;
        if is_behind && was_before {
            var low = before;
            var high = after;
            for (var k = 0u; k < HALVINGS; k++) {
                let middle = 0.5 * (low + high);
                let in_front = seen_at(source, start + middle * mirror).behind <= 0.0;
                low = select(low, middle, in_front);
                high = select(middle, high, in_front);
            }
            let seen = seen_at(source, start + high * mirror);
            if dot(seen.surface.normal, mirror) < 0.0 && seen.behind < TOLERANCE * seen.texel {
                var light = vec4f(seen.surface.radiance, max(high, 1e-30));
                @if(visibility) {
                    let goal = ray_end(start + high * mirror, seen.surface.normal);
                    light = select(vec4f(0.0), light, sees(ray_end(position, normal), goal));
                }
                return light;
            }
        }
        was_before = !is_behind;
        before = after;
    }
    return vec4f(0.0);
}

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(specular)) {
        return;
    }
    let d = textureLoad(depth, id, 0).x;
    let own = materials[textureLoad(material, id, 0).x];
    var result = vec4f(0.0);
    @if(further) { result = textureLoad(partial_sum, id, 0); }
    // Without a surface the material is the first one.
    if d > SKY_DEPTH && any(own.specular > vec3f(0.0)) {
        let n = normalize(textureLoad(normal, id, 0).xyz);
        let position = view_position(uv_of_texel(id, 1.0, view.display_size), d, view.tan_half_fov);
        let mirror = reflected(position, n, own.phong_exponent, LOBE, id, view.frame, view.seed, OVER_FRAMES);
        let cosine = dot(mirror, n);
        // The modified Phong lobe of hierarchical/lobe.wgsl. Only light from the mirror direction arrives.
        let exponent = max(own.phong_exponent, 0.0);
        let lobe = max(cosine, 0.0) * (exponent + 2.0) / (exponent + 1.0);
        let word = textureLoad(mirror_map, id, 0).x;
        @if(!further) {
            if word != NOTHING {
                result = vec4f(textureLoad(direct, unpack_pixel(word), 0).rgb * lobe, 0.0);
            }
        }
        @if(lights) {
            if word == NOTHING && cosine > 0.0 {
                let world_position = (view.view_to_world * vec4f(position, 1.0)).xyz;
                let world_normal = (view.view_to_world * vec4f(n, 0.0)).xyz;
                let found = march(world_position, world_normal, (view.view_to_world * vec4f(mirror, 0.0)).xyz);
                if found.w > 0.0 {
                    // Among the surfaces of several lights the nearest one occludes the others. Light on one surface
                    // adds up.
                    let shown = vec4f(found.rgb * lobe, found.w);
                    let nearer = result.w == 0.0 || found.w < result.w * (1.0 - SAME_DISTANCE);
                    let same = abs(found.w - result.w) <= SAME_DISTANCE * result.w;
                    result = select(select(result, vec4f(result.rgb + shown.rgb, result.w), same), shown, nearer);
                }
            }
        }
    }
    textureStore(specular, id, result);
}
