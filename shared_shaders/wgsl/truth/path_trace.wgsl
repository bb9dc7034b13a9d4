// Progressive path tracing. `primary` traces the pixel centres once. Every dispatch of `paths` then adds samples to the
// sums of a range of 8 x 8 blocks of pixels.
//
// At each vertex of a path, light comes from one ray drawn from the cosine and, where the scene has emitters or an uneven
// sky, from one point drawn from those (next-event estimation). The balance heuristic weights the two (Veach 1997,
// Section 9.2.2), so that neither small lamps nor large ones near a surface are noisy.
import package::common::hemisphere::tangents_of;
import package::common::math::{PI, octahedral_encode, octahedral_decode, random3, random_words};
import package::common::scene::{Light, light_incidence};
import package::common::view::view_position;
import package::common::streams::{PATH_GLOSSY_STREAM, PATH_LIGHT_STREAM};
import package::truth::params::params;
import package::truth::traversal::{FAR, Ray, Hit, traverse};
import package::truth::surface::{Surface, albedo_of_pixel, materials, surface_at, unit_or, offset_length, ray_from};
import package::truth::emitters::emitter_density;
import package::truth::sources::{all_emitters_of_scene, draw_source};
import package::truth::sky::{sky_radiance, sky_density};

// Binding 0 belongs to package::truth::params, 1 to 3 to traversal, 5 to surface, 8 to sky, 10 to sources,
// 22 to scene_textures.
@group(0) @binding(6) var<storage, read> lights: array<Light>;
// Primary hits, one per pixel.
@group(0) @binding(7) var<storage, read_write> surfaces: array<PrimarySurface>;
// SUM_WORDS words per pixel: the number of traced rays (a bit pattern), then the sums at the offsets below.
@group(0) @binding(9) var<storage, read_write> sums: array<f32>;

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
/// Whether points on emitters are drawn.
override DRAW_EMITTERS: bool;
/// Whether directions to the sky are drawn. An even sky is left to the rays drawn from the cosine.
override DRAW_SKY: bool;
/// Whether some material is translucent.
override TRANSLUCENT: bool;
/// Whether any triangle is alpha-masked.
override HOLES: bool;
/// Whether textures are averaged over the pixels that show them.
override MIPS: bool;

/// Paths of lower weight may end early. Russian roulette compensates.
const ROULETTE_WEIGHT: f32 = 0.1;

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

/// Radiance of the sky, black without an environment.
fn sky(direction: vec3f) -> vec3f {
    if !ENVIRONMENT {
        return vec3f(0.0);
    }
    return sky_radiance(direction) * params.radiance_scale;
}

fn trace(ray: Ray, reach: f32, any: bool) -> Hit {
    return traverse(ray, reach, any, HOLES);
}

fn is_open(ray: Ray, reach: f32) -> bool {
    return trace(ray, reach, true).distance == FAR;
}

/// Radiance that leaves the surface after direct lighting, plus emission: the output `direct`.
fn direct_radiance(surface: Surface, rays: ptr<function, u32>) -> vec3f {
    return surface.emission * params.radiance_scale + reflected_radiance(surface, rays);
}

/// Radiance of punctual lights that the surface reflects.
fn reflected_radiance(surface: Surface, rays: ptr<function, u32>) -> vec3f {
    var irradiance = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        let light = light_incidence(lights[i], surface.position);
        let cosine = dot(surface.normal, light.direction);
        if cosine <= 0.0 || all(light.irradiance <= vec3f(0.0)) {
            continue;
        }
        let reach = select(light.distance - offset_length(surface.position, params.scene_radius), FAR, light.distance < 0.0);
        *rays += 1u;
        if is_open(ray_from(surface.position, surface.geometric_normal, light.direction, params.scene_radius), reach) {
            irradiance += light.irradiance * cosine;
        }
    }
    return surface.albedo / PI * (irradiance * params.radiance_scale);
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
        let reach = select(light.distance - offset_length(surface.position, params.scene_radius), FAR, light.distance < 0.0);
        let ray = ray_from(surface.position, surface.geometric_normal, light.direction, params.scene_radius);
        *rays += 1u;
        let hit = trace(ray, reach, false);
        var inside = 0.0;
        var open = hit.distance == FAR;
        if !open {
            let entry = surface_at(hit, ray);
            if entry.material == surface.material {
                inside = hit.distance;
                *rays += 1u;
                open = is_open(ray_from(entry.position, entry.geometric_normal, light.direction, params.scene_radius), reach - inside);
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
    return normalize(radius * (tangents_of(normal) * vec2f(cos(angle), sin(angle))) + normal * height);
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

/// Direction from the eye through the centre of a pixel. Not normalized: its length along the axis is 1, so that distances
/// are planar depths.
fn direction_of(pixel: vec2u) -> vec3f {
    let uv = (vec2f(pixel) + 0.5) / vec2f(f32(params.width), f32(params.height));
    return (params.view_to_world * vec4f(view_position(uv, 1.0, params.tan_half_fov), 0.0)).xyz;
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
    let direction = direction_of(pixel);
    let ray = Ray(params.view_to_world[3].xyz, direction);
    let hit = trace(ray, FAR, false);
    var rays = 1u;
    var result = PrimarySurface();
    if hit.distance < FAR {
        var surface = surface_at(hit, ray);
        if MIPS {
            // The other pixels of its group of 2x2, from which rasterizers take differences.
            let right = direction_of(vec2u(pixel.x ^ 1u, pixel.y));
            surface.albedo = albedo_of_pixel(hit, ray, right, direction_of(vec2u(pixel.x, pixel.y ^ 1u)));
        }
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
    let start = position + geometric_normal * offset_length(position, params.scene_radius);
    return is_open(Ray(start, eye - start), 1.0);
}

/// One sample of all requested outputs.
struct Sample {
    bounce1: vec3f,
    indirect: vec3f,
    on_screen: vec3f,
    open: f32,
}

/// Share of a source's points among all points that are drawn at a vertex.
fn source_share() -> f32 {
    return select(1.0, 0.5, DRAW_EMITTERS && DRAW_SKY);
}

/// Irradiance over pi of one point drawn on a source, weighted against rays drawn from the cosine. `on_screen` is the
/// part whose source the eye sees, or the sky.
struct Drawn {
    light: vec3f,
    on_screen: vec3f,
}

fn draw_light(
    position: vec3f,
    normal: vec3f,
    geometric: vec3f,
    random: vec3u,
    first: bool,
    rays: ptr<function, u32>,
) -> Drawn {
    var result = Drawn();
    let source = draw_source(position, random, DRAW_EMITTERS, DRAW_SKY);
    let direction = unit_or(source.to_source / select(max(params.scene_radius, 1e-30), 1.0, source.is_sky), normal);
    let cosine = dot(normal, direction);
    if cosine <= 0.0 || all(source.radiance <= vec3f(0.0)) {
        return result;
    }
    var ray = ray_from(position, geometric, direction, params.scene_radius);
    var reach = FAR;
    if !source.is_sky {
        // Straight to the point, and not quite to it: rounding must not find its own triangle.
        let end = position + source.to_source;
        ray.direction = end - ray.origin;
        reach = 1.0 - 2.0 * offset_length(end, params.scene_radius) / max(length(source.to_source), 1e-30);
    }
    if reach <= 0.0 {
        return result;
    }
    *rays += 1u;
    if is_open(ray, reach) {
        let of_cosine = cosine / PI;
        result.light = source.radiance * (of_cosine / (source.density * source_share() + of_cosine));
        if ON_SCREEN != 0u && first {
            result.on_screen = result.light;
            if !source.is_sky && !is_on_screen(position + source.to_source, source.normal, rays) {
                result.on_screen = vec3f(0.0);
            }
        }
    }
    return result;
}

/// Weight of a source found by a ray that was drawn from the cosine, against points drawn on sources with this density.
fn weight_of_cosine(cosine: f32, density: f32) -> f32 {
    let of_cosine = cosine / PI;
    return of_cosine / max(of_cosine + density * source_share(), 1e-30);
}

fn sample_path(pixel: vec2u, start: PrimarySurface, index: u32, rays: ptr<function, u32>) -> Sample {
    var result = Sample();
    var position = start.position;
    var normal = start.normal;
    var geometric = octahedral_decode(unpack2x16snorm(start.geometric_normal));
    var weight = vec3f(1.0);
    for (var bounce = 0u; bounce < BOUNCES; bounce++) {
        if DRAW_EMITTERS || DRAW_SKY {
            let words = random_words(pixel, index, PATH_LIGHT_STREAM + bounce, params.seed);
            let drawn = draw_light(position, normal, geometric, words, bounce == 0u, rays);
            result.indirect += weight * drawn.light;
            if bounce == 0u {
                result.bounce1 = drawn.light;
                result.on_screen = drawn.on_screen;
            }
        }
        let random = random3(pixel, index, bounce, params.seed);
        let ray = ray_from(position, geometric, cosine_direction(normal, random.xy), params.scene_radius);
        *rays += 1u;
        let hit = trace(ray, FAR, false);
        if bounce == 0u {
            result.open = f32(hit.distance >= params.occlusion_radius);
        }
        let cosine = max(dot(normal, ray.direction), 0.0);
        if hit.distance == FAR {
            var radiance = sky(ray.direction);
            if DRAW_SKY {
                radiance *= weight_of_cosine(cosine, sky_density(ray.direction));
            }
            result.indirect += weight * radiance;
            if bounce == 0u {
                result.bounce1 += radiance;
                result.on_screen += radiance;
            }
            break;
        }
        let surface = surface_at(hit, ray);
        if !surface.sends {
            break;
        }
        var emission = surface.emission * params.radiance_scale;
        if DRAW_EMITTERS && any(emission > vec3f(0.0)) {
            let along = ray.direction * hit.distance;
            let cosine_there = dot(surface.geometric_normal, ray.direction);
            let density = emitter_density(all_emitters_of_scene(), surface.emission, along, cosine_there);
            emission *= weight_of_cosine(cosine, density);
        }
        let radiance = emission + reflected_radiance(surface, rays);
        if bounce == 0u {
            result.bounce1 += radiance;
            if ON_SCREEN != 0u && any(radiance > vec3f(0.0)) {
                result.on_screen += select(vec3f(0.0), radiance, is_on_screen(surface.position, surface.geometric_normal, rays));
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
    let ray = ray_from(start.position, geometric, direction, params.scene_radius);
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
    result.open = f32(is_open(ray_from(start.position, geometric, direction, params.scene_radius), params.occlusion_radius));
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
        var result = Sample();
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
