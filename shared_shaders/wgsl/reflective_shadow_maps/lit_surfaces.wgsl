// variants: textured, animated, receive_only, seen, kept
// The reflective shadow map of one light or of one cube face (Dachsbacher & Stamminger 2005), from the number of the
// first triangle on each texel's ray. That surface is lit, so no shadow test is needed. With `receive_only`, some
// surfaces send nothing. With `seen`, only surfaces that the camera sees send light. With `kept`, the map is written to the
// finest level of the pyramid over all maps.
import package::common::division::Division;
import package::common::form_factor::MIN_COS_BETA;
import package::common::math::{LARGEST_RADIANCE, PI};
import package::common::scene::{Vertex, Material, Light, LIGHT_DIRECTIONAL, vertex_normal, light_incidence};
@if(animated) import package::common::scene::{Object, transform_normal};
@if(textured) import package::common::scene::NO_TEXTURE;
@if(textured) import package::common::scene_textures::sample_texture;
@if(seen) import package::common::view::{View, pixel_of, view_position};
import package::reflective_shadow_maps::light_surface::pack_light;
import package::common::shadow_view::ShadowView;

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> shadow_view: ShadowView;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;
@group(0) @binding(3) var<storage, read> materials: array<Material>;
// The light whose map this is.
@group(0) @binding(4) var<uniform> source: Light;
@if(animated) @group(0) @binding(5) var<storage, read> objects: array<Object>;
// One word per material: 1 if it receives light but sends none.
@if(receive_only) @group(0) @binding(6) var<storage, read> receive_only: array<u32>;
// Number of the first triangle, counted from 1; 0 without a triangle.
@group(0) @binding(7) var triangles: texture_2d<u32>;
// World position.
@if(!kept) @group(0) @binding(8) var rsm_position: texture_storage_2d<rgba32float, write>;
// `pack_light`.
@if(!kept) @group(0) @binding(9) var light: texture_storage_2d<rgba32uint, write>;
@if(seen) @group(0) @binding(10) var<uniform> view: View;
@if(seen) @group(0) @binding(11) var depth: texture_2d<f32>;
@if(kept) @group(0) @binding(12) var<storage, read_write> light_pyramid: array<vec4u>;

// Relative depth tolerance between a pixel and the plane of the surface for the pixel to show that surface.
@if(seen)
const SAME_DEPTH: f32 = 0.01;

struct Corner {
    world: vec3f,
    normal: vec3f,
    uv: vec2f,
    // Clip-space x and y, and the depth.
    clip: vec3f,
}

fn corner(index: u32) -> Corner {
    let source = vertices[index];
    var world = vec4f(source.position, 1.0);
    var normal = vertex_normal(source);
    @if(animated) {
        let to_world = objects[source.object].to_world;
        world = to_world * world;
        normal = normalize(transform_normal(to_world, normal));
    }
    return Corner(world.xyz, normal, source.uv, (shadow_view.world_to_clip * world).xyw);
}

fn cross_2d(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

/// Barycentric weights of a triangle at `ndc`, from homogeneous edge functions (Olano & Greer 1997) relative to that
/// ray, so that the edges of a small triangle do not cancel. If rounding makes the ray miss, as on an edge or a sliver,
/// these are the nearest weights inside.
fn weights_at(ndc: vec2f, a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    let from_a = a.xy - ndc * a.z;
    let from_b = b.xy - ndc * b.z;
    let from_c = c.xy - ndc * c.z;
    let edges = vec3f(cross_2d(from_b, from_c), cross_2d(from_c, from_a), cross_2d(from_a, from_b));
    let inside = max(edges * sign(edges.x + edges.y + edges.z), vec3f(0.0));
    let sum = inside.x + inside.y + inside.z;
    return select(vec3f(1.0 / 3.0), inside / sum, sum > 0.0);
}

/// Whether the camera sees this position from the side of `normal`; both in world space.
@if(seen)
fn is_seen(position: vec3f, normal: vec3f) -> bool {
    let p = (view.world_to_view * vec4f(position, 1.0)).xyz;
    let n = (view.world_to_view * vec4f(normal, 0.0)).xyz;
    if p.z >= 0.0 || any(abs(p.xy) > view.tan_half_fov * -p.z) || dot(n, p) >= 0.0 {
        return false;
    }
    let pixel = min(vec2u(pixel_of(p, view.tan_half_fov, view.display_size)), vec2u(view.display_size) - 1u);
    let shown = textureLoad(depth, pixel, 0).x;
    // The surface's plane intersects the ray through the pixel's centre at the depth dot(n, p) / slope. Seen edge-on,
    // it does not.
    let slope = dot(n, view_position((vec2f(pixel) + 0.5) / view.display_size, 1.0, view.tan_half_fov));
    let on_plane = abs(shown * slope - dot(n, p)) < SAME_DEPTH * shown * abs(slope);
    return on_plane || abs(shown + p.z) < SAME_DEPTH * shown;
}

/// Writes a texel of the map: the world position, and `pack_light`. Zeros where nothing is lit.
fn write_texel(texel: vec2u, size: vec2u, position: vec4f, surface: vec4u) {
    @if(!kept) {
        textureStore(rsm_position, texel, position);
        textureStore(light, texel, surface);
    }
    @if(kept) {
        let index = 2u * ((shadow_view.index * size.y + texel.y) * size.x + texel.x);
        light_pyramid[index] = bitcast<vec4u>(position);
        light_pyramid[index + 1u] = surface;
    }
}

@compute @workgroup_size(8, 8)
fn lit_surfaces(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let size = textureDimensions(triangles);
    if any(id >= size) {
        return;
    }
    let triangle = textureLoad(triangles, id, 0).x;
    if triangle == 0u {
        write_texel(id, size, vec4f(0.0), vec4u(0u));
        return;
    }
    let first = 3u * (triangle - 1u);
    let a = corner(indices[first]);
    let b = corner(indices[first + 1u]);
    let c = corner(indices[first + 2u]);
    let ndc = (vec2f(id) + 0.5) / vec2f(size) * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let weights = weights_at(ndc, a.clip, b.clip, c.clip);
    let position = mat3x3f(a.world, b.world, c.world) * weights;
    let material_index = vertices[indices[first]].material;
    let material = materials[material_index];
    var albedo = material.albedo;
    @if(textured) {
        if material.albedo_texture != NO_TEXTURE {
            albedo *= sample_texture(material.albedo_texture, mat3x2f(a.uv, b.uv, c.uv) * weights).rgb;
        }
    }
    @if(receive_only) {
        albedo *= f32(1u - receive_only[material_index]);
    }
    let incidence = light_incidence(source, position);
    // If opposite normals cancel, use the normal of the triangle. Surfaces are two-sided: the normal faces the light.
    var normal = mat3x3f(a.normal, b.normal, c.normal) * weights;
    if dot(normal, normal) <= 1e-8 {
        normal = normalize(b.world - a.world);
        normal = cross(normal, normalize(c.world - a.world));
    }
    normal = normalize(normal);
    normal *= select(1.0, -1.0, dot(normal, incidence.direction) < 0.0);
    let cosine = dot(normal, incidence.direction);
    let irradiance = min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * cosine;
    // The texel's area across its ray, then along the surface. Near the edge of the light's view the error of shading
    // normals exceeds the bound, as in a camera's view.
    // Width of a texel: scene units (directional), otherwise per unit of distance along the map's axis.
    let texel_width = shadow_view.width / f32(size.x);
    var across = texel_width * texel_width;
    if source.kind != LIGHT_DIRECTIONAL {
        // Perspective map: the solid angle of the texel is proportional to the cubed cosine to the map's axis. The
        // squared distance is proportional to the inverse of the squared cosine.
        let depth = dot(vec3f(a.clip.z, b.clip.z, c.clip.z), weights);
        across *= depth * depth * depth / max(incidence.distance, 1e-30);
    }
    let area = across / max(cosine, MIN_COS_BETA);
    @if(seen) {
        albedo *= f32(is_seen(position, normal));
    }
    write_texel(id, size, vec4f(position, 1.0), pack_light(area, normal, irradiance * albedo / PI));
}
