// Progressive path tracing. `primary` traces the pixel centres once. Every dispatch of `paths` then adds samples to the
// sums of a range of 8 x 8 blocks of pixels.
//
// Radiance here is multiplied by params.radiance_scale, a power of two that scales the brightest source to about 1, so
// that its square neither overflows nor vanishes. The Rust twin is renderer/src/truth/.
import package::common::math::{PI, octahedral_encode, octahedral_decode, random3};
import package::common::scene::{Material, Light, NO_TEXTURE, light_incidence};
import package::common::texture_pool::{texture_footprint, filter_footprint};
import package::common::environment::{MAP, latlong};
import package::common::view::view_position;
import package::common::streams::PATH_GLOSSY_STREAM;
import package::truth::traversal::{
    FAR, Ray, Hit, texels, triangles, texel_coordinates, traverse, cross_triangle, attributes_at,
};

struct Params {
    world_to_view: mat4x4f,
    view_to_world: mat4x4f,
    tan_half_fov: vec2f,
    width: u32,
    height: u32,
    // First 8 x 8 block of the dispatch and number of blocks, row by row.
    first_block: u32,
    block_count: u32,
    // First sample of the dispatch and number of samples.
    first_sample: u32,
    sample_count: u32,
    seed: u32,
    light_count: u32,
    // Half the diagonal of the scene's bounding box.
    scene_radius: f32,
    radiance_scale: f32,
    // Range of the ambient occlusion; FAR for unlimited.
    occlusion_radius: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Bindings 1 to 4 belong to package::truth::traversal.
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var<storage, read> lights: array<Light>;
// Primary hits, one per pixel.
@group(0) @binding(7) var<storage, read_write> surfaces: array<PrimarySurface>;
// SUM_WORDS words per pixel: the number of traced rays (a bit pattern), then the sums at the offsets below.
@group(0) @binding(8) var<storage, read_write> sums: array<f32>;

// Layout as in `common/environment.wgsl`.
@group(0) @binding(9) var<storage, read> environment: array<vec4f>;

/// Offset of an output's sums in a pixel's words, 0 if it is not requested. An output has a sum of three channels and a
/// sum of their squares; ambient visibility has the count of open rays.
override SUM_WORDS: u32;
override BOUNCE1: u32;
override INDIRECT: u32;
override ON_SCREEN: u32;
override OCCLUSION: u32;
override GLOSSY: u32;
/// Bounces of the longest path; 0 if only ambient visibility is requested.
override BOUNCES: u32;
/// Whether the scene has an environment.
override ENVIRONMENT: bool;
/// Whether some material is translucent.
override TRANSLUCENT: bool;
/// Whether any triangle is alpha-masked.
override HOLES: bool;

/// Offset of a ray from its surface, relative to the larger of |position| and the scene's radius: 64 rounding steps of
/// float32.
const OFFSET: f32 = 7.62939453125e-6;
/// Paths of lower weight may end early. Russian roulette compensates.
const ROULETTE_WEIGHT: f32 = 0.1;
/// Bit of a triangle's material for receive-only surfaces. Twin of renderer/src/truth/bvh.rs.
const RECEIVE_ONLY: u32 = 0x80000000u;

/// The surface at the centre of a pixel.
struct PrimarySurface {
    position: vec3f,
    // Planar view depth; 0 without a surface.
    depth: f32,
    normal: vec3f,
    // Geometric normal, facing the eye: octahedral, two signed 16-bit numbers.
    geometric_normal: u32,
    albedo: vec3f,
    rays: u32,
    // `radiance_scale` included.
    direct: vec3f,
    material: u32,
    // Light from the far side, `radiance_scale` included.
    transmitted: vec3f,
    unused: u32,
}

/// A point on a surface. Its normals face the ray that found it.
struct Surface {
    position: vec3f,
    // Shading normal.
    normal: vec3f,
    geometric_normal: vec3f,
    albedo: vec3f,
    emission: vec3f,
    material: u32,
    // Whether it sends light to other surfaces.
    sends: bool,
}

fn sample_texture(start: u32, uv: vec2f) -> vec4f {
    let size = vec2u(texels[start], texels[start + 1u]);
    let at = texture_footprint(start, size, uv);
    let words = vec4u(texels[at.indices.x], texels[at.indices.y], texels[at.indices.z], texels[at.indices.w]);
    return filter_footprint(words, at.weights);
}

/// Radiance of the environment.
fn sky(direction: vec3f) -> vec3f {
    if !ENVIRONMENT {
        return vec3f(0.0);
    }
    return environment[MAP + latlong(direction, environment[0].xy)].rgb * params.radiance_scale;
}

fn trace(ray: Ray, reach: f32, any: bool) -> Hit {
    return traverse(ray, reach, any, HOLES);
}

fn is_open(ray: Ray, reach: f32) -> bool {
    return trace(ray, reach, true).distance == FAR;
}

/// The unit vector, or `fallback` for a vector without a direction.
fn unit_or(v: vec3f, fallback: vec3f) -> vec3f {
    let square = dot(v, v);
    return select(fallback, v * inverseSqrt(square), square > 1e-30 && square < 1e30);
}

fn surface_at(hit: Hit, ray: Ray) -> Surface {
    let corner = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u)).xyz);
    let edge_1 = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u + 1u)).xyz);
    let edge_2 = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u + 2u)).xyz);
    let weights = cross_triangle(hit.slot, ray).weights;
    let on_it = attributes_at(hit.slot, weights);
    // Edges are scaled by their length, because the cross product of tiny ones would vanish.
    let size = max(max(abs(edge_1.x), abs(edge_1.y)), max(abs(edge_1.z), 1e-30));
    var geometric = unit_or(cross(edge_1 / size, edge_2 / size), -normalize(ray.direction));
    geometric = select(geometric, -geometric, dot(geometric, ray.direction) > 0.0);
    var normal = unit_or(on_it.normal, geometric);
    normal = select(normal, -normal, dot(normal, ray.direction) > 0.0);
    let index = on_it.material & ~RECEIVE_ONLY;
    let material = materials[index];
    var albedo = material.albedo;
    if material.albedo_texture != NO_TEXTURE {
        albedo *= sample_texture(material.albedo_texture, on_it.uv).rgb;
    }
    return Surface(
        corner + edge_1 * weights.x + edge_2 * weights.y,
        normal,
        geometric,
        saturate(albedo),
        material.emission * params.radiance_scale,
        index,
        (on_it.material & RECEIVE_ONLY) == 0u,
    );
}

fn offset_length(position: vec3f) -> f32 {
    let a = abs(position);
    return OFFSET * max(max(max(a.x, a.y), max(a.z, params.scene_radius)), 1e-30);
}

/// A ray from a surface, offset to the side that it leads to.
fn ray_from(position: vec3f, geometric_normal: vec3f, direction: vec3f) -> Ray {
    let offset = offset_length(position);
    return Ray(position + geometric_normal * select(-offset, offset, dot(geometric_normal, direction) >= 0.0), direction);
}

/// Radiance that leaves the surface after direct lighting, plus emission: the output `direct`.
fn direct_radiance(surface: Surface, rays: ptr<function, u32>) -> vec3f {
    var irradiance = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        let light = light_incidence(lights[i], surface.position);
        let cosine = dot(surface.normal, light.direction);
        if cosine <= 0.0 || all(light.irradiance <= vec3f(0.0)) {
            continue;
        }
        let reach = select(light.distance - offset_length(surface.position), FAR, light.distance < 0.0);
        *rays += 1u;
        if is_open(ray_from(surface.position, surface.geometric_normal, light.direction), reach) {
            irradiance += light.irradiance * cosine;
        }
    }
    return surface.emission + surface.albedo / PI * (irradiance * params.radiance_scale);
}

/// Radiance that leaves a translucent surface from the light on its far side. Light travels straight from the entry
/// point, is absorbed over the distance inside (Beer-Lambert), and leaves like from a diffuse surface. A sheet has no
/// inside. There is one body: other occluders between the light and the entry point block it.
fn transmitted_radiance(surface: Surface, rays: ptr<function, u32>) -> vec3f {
    let material = materials[surface.material];
    var sum = vec3f(0.0);
    if !any(material.translucency > vec3f(0.0)) {
        return sum;
    }
    for (var i = 0u; i < params.light_count; i++) {
        let light = light_incidence(lights[i], surface.position);
        let cosine = -dot(surface.normal, light.direction);
        if cosine <= 0.0 || all(light.irradiance <= vec3f(0.0)) {
            continue;
        }
        let reach = select(light.distance - offset_length(surface.position), FAR, light.distance < 0.0);
        let ray = ray_from(surface.position, surface.geometric_normal, light.direction);
        *rays += 1u;
        let hit = trace(ray, reach, false);
        var inside = 0.0;
        var open = hit.distance == FAR;
        if !open {
            let entry = surface_at(hit, ray);
            if entry.material == surface.material {
                inside = hit.distance;
                *rays += 1u;
                open = is_open(ray_from(entry.position, entry.geometric_normal, light.direction), reach - inside);
            }
        }
        if open {
            sum += light.irradiance * cosine * exp(-material.absorption * inside);
        }
    }
    return material.translucency / PI * (sum * params.radiance_scale);
}

/// The direction with the component `radius` across `normal` and `height` along it, rotated around it by `angle`.
fn direction_around(normal: vec3f, radius: f32, height: f32, angle: f32) -> vec3f {
    // Branchless orthonormal basis (Duff et al. 2017).
    let side = select(-1.0, 1.0, normal.z >= 0.0);
    let a = -1.0 / (side + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = vec3f(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    let bitangent = vec3f(b, side + normal.y * normal.y * a, -normal.y);
    return normalize(tangent * (radius * cos(angle)) + bitangent * (radius * sin(angle)) + normal * height);
}

/// A direction around `normal` with a cosine-weighted density.
fn cosine_direction(normal: vec3f, random: vec2f) -> vec3f {
    return direction_around(normal, sqrt(random.x), sqrt(max(1.0 - random.x, 1e-12)), 2.0 * PI * random.y);
}

/// Pixel of an invocation; outside the image for padding.
fn pixel_of(workgroup: vec3u, workgroups: vec3u, local: vec2u) -> vec2u {
    let index = workgroup.y * workgroups.x + workgroup.x;
    let block = params.first_block + index;
    let per_row = (params.width + 7u) / 8u;
    let pixel = vec2u(block % per_row, block / per_row) * 8u + local;
    return select(vec2u(params.width, params.height), pixel, index < params.block_count);
}

@compute @workgroup_size(8, 8)
fn primary(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let pixel = pixel_of(workgroup, workgroups, local.xy);
    if pixel.x >= params.width || pixel.y >= params.height {
        return;
    }
    // Not normalized: its length along the axis is 1, so that distances are planar depths.
    let uv = (vec2f(pixel) + 0.5) / vec2f(f32(params.width), f32(params.height));
    let direction = (params.view_to_world * vec4f(view_position(uv, 1.0, params.tan_half_fov), 0.0)).xyz;
    let ray = Ray(params.view_to_world[3].xyz, direction);
    let hit = trace(ray, FAR, false);
    var rays = 1u;
    var result = PrimarySurface();
    if hit.distance < FAR {
        let surface = surface_at(hit, ray);
        result.position = surface.position;
        result.depth = hit.distance;
        result.normal = surface.normal;
        result.geometric_normal = pack2x16snorm(octahedral_encode(surface.geometric_normal));
        result.albedo = surface.albedo;
        result.direct = direct_radiance(surface, &rays);
        result.material = surface.material;
        if TRANSLUCENT {
            result.transmitted = transmitted_radiance(surface, &rays);
        }
    }
    if hit.distance == FAR {
        result.direct = sky(direction);
    }
    result.rays = rays;
    surfaces[pixel.y * params.width + pixel.x] = result;
}

/// Whether the eye sees this point inside the image, on the side that `from` sees.
fn is_on_screen(position: vec3f, geometric_normal: vec3f, rays: ptr<function, u32>) -> bool {
    let p = (params.world_to_view * vec4f(position, 1.0)).xyz;
    let eye = params.view_to_world[3].xyz;
    if p.z >= 0.0 || any(abs(p.xy) > params.tan_half_fov * -p.z) || dot(eye - position, geometric_normal) <= 0.0 {
        return false;
    }
    *rays += 1u;
    // From the surface to the eye, at distance 1.
    let start = position + geometric_normal * offset_length(position);
    return is_open(Ray(start, eye - start), 1.0);
}

/// One sample of all requested outputs.
struct Sample {
    bounce1: vec3f,
    indirect: vec3f,
    on_screen: vec3f,
    open: f32,
}

fn sample_path(pixel: vec2u, start: PrimarySurface, index: u32, rays: ptr<function, u32>) -> Sample {
    var result = Sample();
    var position = start.position;
    var normal = start.normal;
    var geometric = octahedral_decode(unpack2x16snorm(start.geometric_normal));
    var weight = vec3f(1.0);
    for (var bounce = 0u; bounce < BOUNCES; bounce++) {
        let random = random3(pixel, index, bounce, params.seed);
        let ray = ray_from(position, geometric, cosine_direction(normal, random.xy));
        *rays += 1u;
        let hit = trace(ray, FAR, false);
        if bounce == 0u {
            result.open = f32(hit.distance >= params.occlusion_radius);
        }
        if hit.distance == FAR {
            let radiance = sky(ray.direction);
            result.indirect += weight * radiance;
            if bounce == 0u {
                result.bounce1 = radiance;
                result.on_screen = radiance;
            }
            break;
        }
        let surface = surface_at(hit, ray);
        if !surface.sends {
            break;
        }
        let radiance = direct_radiance(surface, rays);
        if bounce == 0u {
            result.bounce1 = radiance;
            if ON_SCREEN != 0u && any(radiance > vec3f(0.0)) {
                result.on_screen = select(vec3f(0.0), radiance, is_on_screen(surface.position, surface.geometric_normal, rays));
            }
        }
        result.indirect += weight * radiance;
        weight *= surface.albedo;
        // Russian roulette: paths survive with a probability that keeps their weight near ROULETTE_WEIGHT.
        let heaviest = max(weight.x, max(weight.y, weight.z));
        let survival = min(heaviest / ROULETTE_WEIGHT, 1.0);
        if random.z >= survival {
            break;
        }
        weight /= survival;
        position = surface.position;
        normal = surface.normal;
        geometric = surface.geometric_normal;
    }
    return result;
}

/// Radiance that the surface's mirror lobe sends to the eye, Ks included, from other surfaces after direct light: the
/// modified Phong lobe Ks (s + 2) / (2 pi) cos^s of `hierarchical/lobe.wgsl`. Directions are sampled with density (s +
/// 1) / (2 pi) cos^s.
fn sample_lobe(pixel: vec2u, start: PrimarySurface, index: u32, rays: ptr<function, u32>) -> vec3f {
    let material = materials[start.material];
    if !any(material.specular > vec3f(0.0)) {
        return vec3f(0.0);
    }
    let eye = params.view_to_world[3].xyz;
    let mirror = reflect(unit_or(start.position - eye, -start.normal), start.normal);
    let random = random3(pixel, index, PATH_GLOSSY_STREAM, params.seed);
    let exponent = max(material.phong_exponent, 0.0);
    // The logarithm of a number in (0, 1]. Narrow lobes have cosines close to 1, whose distance from 1 needs precision.
    let logarithm = log(1.0 - random.x) / (exponent + 1.0);
    let height = exp(logarithm);
    // 1 - exp(2 l), without cancellation.
    let square = select(1.0 - height * height, -2.0 * logarithm, logarithm > -1e-3);
    let direction = direction_around(mirror, sqrt(max(square, 0.0)), height, 2.0 * PI * random.y);
    let cosine = dot(start.normal, direction);
    if cosine <= 0.0 {
        return vec3f(0.0);
    }
    let geometric = octahedral_decode(unpack2x16snorm(start.geometric_normal));
    let ray = ray_from(start.position, geometric, direction);
    *rays += 1u;
    let hit = trace(ray, FAR, false);
    if hit.distance == FAR {
        return vec3f(0.0);
    }
    let surface = surface_at(hit, ray);
    if !surface.sends {
        return vec3f(0.0);
    }
    return material.specular * (direct_radiance(surface, rays) * (cosine * (exponent + 2.0) / (exponent + 1.0)));
}

/// Only ambient visibility is requested: any hit within the radius suffices.
fn sample_occlusion(pixel: vec2u, start: PrimarySurface, index: u32, rays: ptr<function, u32>) -> Sample {
    var result = Sample();
    let direction = cosine_direction(start.normal, random3(pixel, index, 0u, params.seed).xy);
    let geometric = octahedral_decode(unpack2x16snorm(start.geometric_normal));
    *rays += 1u;
    result.open = f32(is_open(ray_from(start.position, geometric, direction), params.occlusion_radius));
    return result;
}

fn store_sum(at: u32, values: array<vec3f, 2>) {
    for (var i = 0u; i < 3u; i++) {
        sums[at + i] = values[0][i];
        sums[at + 3u + i] = values[1][i];
    }
}

fn load_sum(at: u32) -> array<vec3f, 2> {
    return array(
        vec3f(sums[at], sums[at + 1u], sums[at + 2u]),
        vec3f(sums[at + 3u], sums[at + 4u], sums[at + 5u]),
    );
}

@compute @workgroup_size(8, 8)
fn paths(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let pixel = pixel_of(workgroup, workgroups, local.xy);
    if pixel.x >= params.width || pixel.y >= params.height {
        return;
    }
    let index = pixel.y * params.width + pixel.x;
    let start = surfaces[index];
    if start.depth <= 0.0 {
        return;
    }
    // Sums stay in registers over the samples and are added one by one, so that the result does not depend on how
    // samples are split into dispatches.
    let at = index * SUM_WORDS;
    var bounce1: array<vec3f, 2>;
    var indirect: array<vec3f, 2>;
    var on_screen: array<vec3f, 2>;
    var glossy: array<vec3f, 2>;
    var open = 0.0;
    var rays = bitcast<u32>(sums[at]);
    if BOUNCE1 != 0u {
        bounce1 = load_sum(at + BOUNCE1);
    }
    if INDIRECT != 0u {
        indirect = load_sum(at + INDIRECT);
    }
    if ON_SCREEN != 0u {
        on_screen = load_sum(at + ON_SCREEN);
    }
    if GLOSSY != 0u {
        glossy = load_sum(at + GLOSSY);
    }
    if OCCLUSION != 0u {
        open = sums[at + OCCLUSION];
    }
    for (var i = 0u; i < params.sample_count; i++) {
        var result: Sample;
        if BOUNCES != 0u {
            result = sample_path(pixel, start, params.first_sample + i, &rays);
        } else if OCCLUSION != 0u {
            result = sample_occlusion(pixel, start, params.first_sample + i, &rays);
        }
        if GLOSSY != 0u {
            let sent = sample_lobe(pixel, start, params.first_sample + i, &rays);
            glossy[0] += sent;
            glossy[1] += sent * sent;
        }
        bounce1[0] += result.bounce1;
        bounce1[1] += result.bounce1 * result.bounce1;
        indirect[0] += result.indirect;
        indirect[1] += result.indirect * result.indirect;
        on_screen[0] += result.on_screen;
        on_screen[1] += result.on_screen * result.on_screen;
        open += result.open;
    }
    sums[at] = bitcast<f32>(rays);
    if BOUNCE1 != 0u {
        store_sum(at + BOUNCE1, bounce1);
    }
    if INDIRECT != 0u {
        store_sum(at + INDIRECT, indirect);
    }
    if ON_SCREEN != 0u {
        store_sum(at + ON_SCREEN, on_screen);
    }
    if GLOSSY != 0u {
        store_sum(at + GLOSSY, glossy);
    }
    if OCCLUSION != 0u {
        sums[at + OCCLUSION] = open;
    }
}
