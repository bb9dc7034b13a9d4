// variants: alpha_tested, animated, triangles
// Depth from one light or one cube face; with `triangles`, also the number of the visible triangle.
import package::common::scene::Vertex;
@if(alpha_tested) import package::common::scene::Material;
@if(animated) import package::common::scene::Object;
@if(alpha_tested) import package::common::scene_textures::is_hole;
import package::common::shadow_view::ShadowView;

@group(0) @binding(0) var<uniform> shadow_view: ShadowView;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@if(alpha_tested) @group(0) @binding(2) var<storage, read> materials: array<Material>;
@if(animated) @group(0) @binding(3) var<storage, read> objects: array<Object>;
// A vertex, and the number of the triangle that begins with it (`NumberedTriangles` of
// renderer/src/scene/numbered_triangles.rs).
@if(triangles) @group(0) @binding(4) var<storage, read> corners: array<vec2u>;

struct Varyings {
    @builtin(position) clip: vec4f,
    @if(alpha_tested) @location(0) uv: vec2f,
    @if(alpha_tested) @location(1) @interpolate(flat, either) material: u32,
    // Number of the triangle from its first corner, counted from 1; 0 is none.
    @if(triangles) @location(2) @interpolate(flat, first) triangle: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    @if(triangles) let source = vertices[corners[index].x];
    @if(!triangles) let source = vertices[index];
    var out: Varyings;
    @if(triangles) {
        out.triangle = corners[index].y;
    }
    var world = vec4f(source.position, 1.0);
    @if(animated) {
        world = objects[source.object].to_world * world;
    }
    out.clip = shadow_view.world_to_clip * world;
    @if(alpha_tested) {
        out.uv = source.uv;
        out.material = source.material;
    }
    return out;
}

@if(triangles)
@fragment
fn fragment(in: Varyings) -> @location(0) u32 {
    @if(alpha_tested) {
        if is_hole(materials[in.material].alpha_texture, in.uv) {
            discard;
        }
    }
    return in.triangle;
}

@if(alpha_tested && !triangles)
@fragment
fn fragment(in: Varyings) {
    if is_hole(materials[in.material].alpha_texture, in.uv) {
        discard;
    }
}
