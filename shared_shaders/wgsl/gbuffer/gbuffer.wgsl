// variants: alpha_tested, textured, mips, material_id, animated, object_id
// The G-buffer: depth, normal and albedo of what the camera sees, and, where a later pass needs them, the index of the
// material and of the animated object.
import package::common::view::{View, project};
import package::common::scene::{Vertex, Material, vertex_normal};
@if(textured) import package::common::scene::NO_TEXTURE;
@if(animated) import package::common::scene::{Object, transform_normal};
@if(alpha_tested) import package::common::scene_textures::is_hole;
@if(textured && !mips) import package::common::scene_textures::sample_texture;
@if(mips) import package::common::scene_textures::sample_pixel;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> materials: array<Material>;
@if(animated) @group(0) @binding(3) var<storage, read> objects: array<Object>;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat, either) material: u32,
    @if(object_id) @location(4) @interpolate(flat, either) object: u32,
}

struct Targets {
    @location(0) depth: f32,
    @location(1) normal: vec4f,
    @location(2) albedo: vec4f,
    @if(material_id) @location(3) material: u32,
    @if(object_id && material_id) @location(4) object: u32,
    @if(object_id && !material_id) @location(3) object: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let source = vertices[index];
    var world = vec4f(source.position, 1.0);
    var world_normal = vertex_normal(source);
    @if(animated) {
        let to_world = objects[source.object].to_world;
        world = to_world * world;
        world_normal = normalize(transform_normal(to_world, world_normal));
    }
    let position = (view.world_to_view * world).xyz;
    let normal = (view.world_to_view * vec4f(world_normal, 0.0)).xyz;
    let clip = project(position, view.tan_half_fov, view.near);
    @if(object_id) {
        return Varyings(clip, position, normal, source.uv, source.material, source.object);
    }
    @if(!object_id) {
        return Varyings(clip, position, normal, source.uv, source.material);
    }
}

@fragment
fn fragment(in: Varyings) -> Targets {
    // If opposite vertex normals cancel, use the normal of the triangle.
    let flat_normal = cross(dpdx(in.position), dpdy(in.position));
    @if(mips) let across = dpdxFine(in.uv);
    @if(mips) let down = dpdyFine(in.uv);
    let material = materials[in.material];
    @if(alpha_tested) {
        if is_hole(material.alpha_texture, in.uv) {
            discard;
        }
    }
    var albedo = material.albedo;
    @if(textured) {
        if material.albedo_texture != NO_TEXTURE {
            @if(mips) {
                albedo *= sample_pixel(material.albedo_texture, in.uv, across, down).rgb;
            }
            @if(!mips) {
                albedo *= sample_texture(material.albedo_texture, in.uv).rgb;
            }
        }
    }
    var normal = select(flat_normal, in.normal, dot(in.normal, in.normal) > 1e-8);
    normal = normalize(normal) * select(1.0, -1.0, dot(normal, in.position) > 0.0);
    var targets: Targets;
    targets.depth = -in.position.z;
    targets.normal = vec4f(normal, 0.0);
    targets.albedo = vec4f(albedo, 1.0);
    @if(material_id) {
        targets.material = in.material;
    }
    @if(object_id) {
        targets.object = in.object;
    }
    return targets;
}
