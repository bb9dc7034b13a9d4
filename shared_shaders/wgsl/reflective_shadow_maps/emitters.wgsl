// variants: animated, chosen
// Points on the scene's emitters. Each point is a small disc that stands for its share of the emitting area and sends
// light to both sides. The density of points is proportional to the emitted power. With `chosen`, the points are in the
// camera's view space, after the surfaces of the maps, and have an importance like those of `collect.wgsl`; otherwise
// they are in world space.
import package::common::math::{PI, random3};
@if(chosen) import package::common::streams::IMPORTANCE_STREAM;
import package::common::scene::{Vertex, Material};
@if(animated) import package::common::scene::Object;
@if(chosen) import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::View;
@if(chosen) import package::common::view::SKY_DEPTH;
import package::common::streams::EMITTER_STREAM;
import package::reflective_shadow_maps::light_surface::{LightSurface, pack_light};
@if(chosen) import package::reflective_shadow_maps::importance::{ANY_WAY, RECEIVERS};
@if(chosen) import package::reflective_shadow_maps::transfer::{transfer, nearness};

struct Params {
    // Index of the first point's surfaces in the buffers.
    first: u32,
    points: u32,
    // Number of emitting triangles.
    triangles: u32,
    // Width of a texel of `surfels` in full-resolution pixels.
    @if(chosen) scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
// For each emitting triangle, the cumulative power up to it (float32, as a share of the total) and its first index.
@group(0) @binding(2) var<storage, read> emitters: array<vec2u>;
@group(0) @binding(3) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(4) var<storage, read> indices: array<u32>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@if(animated) @group(0) @binding(6) var<storage, read> objects: array<Object>;
@group(0) @binding(7) var<storage, read_write> positions: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> lights: array<vec4u>;
@if(chosen) @group(0) @binding(9) var surfels: texture_2d<u32>;
@if(chosen) @group(0) @binding(10) var<storage, read_write> importances: array<f32>;

fn corner(index: u32) -> vec3f {
    let source = vertices[indices[index]];
    var world = vec4f(source.position, 1.0);
    @if(animated) {
        world = objects[source.object].to_world * world;
    }
    return world.xyz;
}

fn power_up_to(triangle: u32) -> f32 {
    return bitcast<f32>(emitters[triangle].x);
}

fn write(index: u32, surface: LightSurface) {
    @if(!chosen) {
        positions[index] = vec4f(surface.position, 1.0);
        lights[index] = pack_light(surface.area, surface.normal, surface.radiance);
    }
    @if(chosen) {
        var seen = surface;
        seen.position = (view.world_to_view * vec4f(surface.position, 1.0)).xyz;
        seen.normal = (view.world_to_view * vec4f(surface.normal, 0.0)).xyz;
        positions[index] = vec4f(seen.position, 1.0);
        lights[index] = pack_light(seen.area, seen.normal, seen.radiance);
        var sum = 0.0;
        let grid = vec2f(textureDimensions(surfels)) / f32(RECEIVERS);
        for (var i = 0u; i < RECEIVERS * RECEIVERS; i++) {
            // The same receivers as for the surfaces of the maps.
            let jitter = random3(vec2u(i, 0u), view.frame, IMPORTANCE_STREAM, view.seed).xy;
            let texel = vec2u((vec2f(vec2u(i % RECEIVERS, i / RECEIVERS)) + jitter) * grid);
            let words = textureLoad(surfels, texel, 0);
            if surfel_depth(words) > SKY_DEPTH {
                let at = surfel_position(words, texel, params.scale, view.display_size, view.tan_half_fov);
                sum += transfer(at, surfel_normal(words), seen) + ANY_WAY * nearness(at, seen);
            }
        }
        importances[index] = sum * max(seen.radiance.x, max(seen.radiance.y, seen.radiance.z));
    }
}

@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.points {
        return;
    }
    let start = random3(vec2u(0u), view.frame, EMITTER_STREAM, view.seed).xy;
    let share = (f32(id.x) + random3(vec2u(id.x, 0u), view.frame, EMITTER_STREAM, view.seed).z) / f32(params.points);
    // The first triangle whose cumulative power exceeds the share.
    var low = 0u;
    var high = params.triangles - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if power_up_to(middle) > share {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    var power = power_up_to(low);
    if low > 0u {
        power -= power_up_to(low - 1u);
    }
    let first = emitters[low].y;
    let a = corner(first);
    let ab = corner(first + 1u) - a;
    let ac = corner(first + 2u) - a;
    // Successive points lie on successive parts of the emitters. The R2 lattice (Roberts 2018) distributes those of a
    // triangle evenly over a square, whose other half is folded back.
    let spread = fract(start + f32(id.x) * vec2f(0.7548776662466927, 0.5698402909980532));
    let at = select(spread, 1.0 - spread, spread.x + spread.y > 1.0);
    let longest = max(max(length(ab), length(ac)), 1e-30);
    let across = cross(ab / longest, ac / longest);
    let twice = length(across);
    let normal = across / max(twice, 1e-30);
    let area = 0.5 * twice * longest * longest / max(power * f32(params.points), 1e-30);
    let emission = materials[vertices[indices[first]].material].emission;
    let surface = LightSurface(a + ab * at.x + ac * at.y, area, normal, 1.0, emission);
    let back = LightSurface(surface.position, area, -normal, 1.0, emission);
    write(params.first + 2u * id.x, surface);
    write(params.first + 2u * id.x + 1u, back);
}
