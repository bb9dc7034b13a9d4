// Origin and direction of a light's rays, from its matrix alone.

/// The light's position (w = 1), or the unit direction of travel of a directional light's rays (w = 0); world space.
fn source_of(world_to_clip: mat4x4f) -> vec4f {
    let rows = transpose(world_to_clip);
    // The last row of a perspective projection is its unit axis. That of a parallel projection is 0 0 0 1.
    if dot(rows[3].xyz, rows[3].xyz) > 0.5 {
        // The position where x, y and w are all 0. The rows are orthogonal.
        let x = rows[0].xyz / dot(rows[0].xyz, rows[0].xyz);
        let y = rows[1].xyz / dot(rows[1].xyz, rows[1].xyz);
        return vec4f(-(rows[0].w * x + rows[1].w * y + rows[3].w * rows[3].xyz), 1.0);
    }
    // z increases towards the light. It is scaled before its length is taken, because a scene may be tiny.
    let largest = max(max(abs(rows[2].x), abs(rows[2].y)), max(abs(rows[2].z), 1e-36));
    return vec4f(-normalize(rows[2].xyz / largest), 0.0);
}

/// A ray of the light's view at a position.
struct LightRay {
    // Unit direction of travel.
    direction: vec3f,
    // Distance from the origin of the rays; negative for parallel rays.
    distance: f32,
}

fn light_ray(source: vec4f, position: vec3f) -> LightRay {
    let way = position - source.xyz;
    let distance = max(length(way), 1e-30);
    let point = source.w > 0.5;
    return LightRay(select(source.xyz, way / distance, point), select(-1.0, distance, point));
}

/// Area of a texel across the view's rays at a position on `ray`, scene units squared. `size` is the width of the map
/// in texels.
fn area_across(world_to_clip: mat4x4f, ray: LightRay, size: f32) -> f32 {
    let rows = transpose(world_to_clip);
    // Scene units for parallel rays, otherwise per unit of distance along the axis.
    let width = 2.0 / (length(rows[0].xyz) * size);
    let height = 2.0 / (length(rows[1].xyz) * size);
    let cosine = dot(rows[3].xyz, ray.direction);
    let at_distance = cosine * cosine * cosine * ray.distance * ray.distance;
    return width * height * select(1.0, at_distance, ray.distance > 0.0);
}
