// variants: alpha_tested, moving
// Depth as one light (or one of the six faces around it) sees it.
import package::common::scene::Vertex;
@if(alpha_tested) import package::common::scene::Material;
@if(moving) import package::common::scene::Object;
@if(alpha_tested) import package::common::scene_textures::is_hole;

struct Params {
    world_to_clip: mat4x4f,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@if(alpha_tested) @group(0) @binding(2) var<storage, read> materials: array<Material>;
@if(moving) @group(0) @binding(3) var<storage, read> objects: array<Object>;

struct Varyings {
    @builtin(position) clip: vec4f,
    @if(alpha_tested) @location(0) uv: vec2f,
    @if(alpha_tested) @location(1) @interpolate(flat, either) material: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let source = vertices[index];
    var out: Varyings;
    var world = vec4f(source.position, 1.0);
    @if(moving) {
        world = objects[source.object].to_world * world;
    }
    out.clip = params.world_to_clip * world;
    @if(alpha_tested) {
        out.uv = source.uv;
        out.material = source.material;
    }
    return out;
}

@if(alpha_tested)
@fragment
fn fragment(in: Varyings) {
    if is_hole(materials[in.material].alpha_texture, in.uv) {
        discard;
    }
}
