// variants: alpha_tested, textured, moving, receive_only
// What one light (or one of the six faces around it) sees: a reflective shadow map (Dachsbacher & Stamminger 2005). The
// first surface from the light is lit by it, so no shadow is looked up. With `receive_only`, some surfaces send nothing on.
import package::common::form_factor::MIN_COS_BETA;
import package::common::math::{LARGEST_RADIANCE, PI};
import package::common::scene::{Vertex, Material, Light, LIGHT_DIRECTIONAL, vertex_normal, light_incidence};
@if(textured) import package::common::scene::NO_TEXTURE;
@if(moving) import package::common::scene::{Object, transform_normal};
@if(alpha_tested) import package::common::scene_textures::is_hole;
@if(textured) import package::common::scene_textures::sample_texture;
import package::light_views::light_surface::pack_light;

struct Params {
    world_to_clip: mat4x4f,
    // Index of the light.
    light: u32,
    // Width of a texel: scene units (directional), or for each unit of distance along the map's axis.
    texel_width: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> materials: array<Material>;
@group(0) @binding(3) var<storage, read> lights: array<Light>;
@if(moving) @group(0) @binding(4) var<storage, read> objects: array<Object>;
// One word a material: 1 where it only receives.
@if(receive_only) @group(0) @binding(5) var<storage, read> receive_only: array<u32>;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) depth: f32,
    @location(4) @interpolate(flat, either) material: u32,
}

struct Targets {
    // World position.
    @location(0) place: vec4f,
    // `pack_light`.
    @location(1) light: vec4u,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let source = vertices[index];
    var world = vec4f(source.position, 1.0);
    var normal = vertex_normal(source);
    @if(moving) {
        let to_world = objects[source.object].to_world;
        world = to_world * world;
        normal = normalize(transform_normal(to_world, normal));
    }
    let clip = params.world_to_clip * world;
    return Varyings(clip, world.xyz, normal, source.uv, clip.w, source.material);
}

@fragment
fn fragment(in: Varyings) -> Targets {
    let flat_normal = cross(dpdx(in.position), dpdy(in.position));
    let material = materials[in.material];
    @if(alpha_tested) {
        if is_hole(material.alpha_texture, in.uv) {
            discard;
        }
    }
    var albedo = material.albedo;
    @if(textured) {
        if material.albedo_texture != NO_TEXTURE {
            albedo *= sample_texture(material.albedo_texture, in.uv).rgb;
        }
    }
    @if(receive_only) {
        albedo *= f32(1u - receive_only[in.material]);
    }
    let light = lights[params.light];
    let incidence = light_incidence(light, in.position);
    // Surfaces are two-sided: the normal is that of the lit side.
    var normal = normalize(select(flat_normal, in.normal, dot(in.normal, in.normal) > 1e-8));
    normal *= select(1.0, -1.0, dot(normal, incidence.direction) < 0.0);
    let cosine = dot(normal, incidence.direction);
    let irradiance = min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * cosine;
    // The texel's area across its ray, then along the surface. Near the edge of what a light sees shading normals are
    // off by more than the bound, as in a camera's view.
    var across = params.texel_width * params.texel_width;
    if light.kind != LIGHT_DIRECTIONAL {
        // Seen by a pinhole: the texel's solid angle shrinks with the cube of the cosine to the map's axis, the square
        // of the distance grows with its inverse square.
        across *= in.depth * in.depth * in.depth / max(incidence.distance, 1e-30);
    }
    let area = across / max(cosine, MIN_COS_BETA);
    return Targets(vec4f(in.position, 1.0), pack_light(area, normal, irradiance * albedo / PI));
}
