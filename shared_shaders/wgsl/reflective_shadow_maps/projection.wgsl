// Where the rays of a light's view come from, told from its matrix alone.

/// A place (w = 1), or for a directional light the unit direction in which its rays travel (w = 0); world space.
fn source_of(world_to_clip: mat4x4f) -> vec4f {
    let rows = transpose(world_to_clip);
    // The last row of a perspective is its unit axis; that of a parallel projection is 0 0 0 1.
    if dot(rows[3].xyz, rows[3].xyz) > 0.5 {
        // The place where x, y and w are all 0; the rows are at right angles to one another.
        let x = rows[0].xyz / dot(rows[0].xyz, rows[0].xyz);
        let y = rows[1].xyz / dot(rows[1].xyz, rows[1].xyz);
        return vec4f(-(rows[0].w * x + rows[1].w * y + rows[3].w * rows[3].xyz), 1.0);
    }
    // z grows towards the light. Scaled before its length is taken: a scene may be tiny.
    let largest = max(max(abs(rows[2].x), abs(rows[2].y)), max(abs(rows[2].z), 1e-36));
    return vec4f(-normalize(rows[2].xyz / largest), 0.0);
}

/// A ray of the view at a place.
struct LightRay {
    // Unit direction of travel.
    direction: vec3f,
    // Distance from where the rays begin; negative for parallel ones.
    distance: f32,
}

fn light_ray(source: vec4f, position: vec3f) -> LightRay {
    let way = position - source.xyz;
    let distance = max(length(way), 1e-30);
    let point = source.w > 0.5;
    return LightRay(select(source.xyz, way / distance, point), select(-1.0, distance, point));
}

/// Area across the view's rays that a texel covers at a place on `ray`, scene units squared. `size` is the width of the
/// map in texels.
fn area_across(world_to_clip: mat4x4f, ray: LightRay, size: f32) -> f32 {
    let rows = transpose(world_to_clip);
    // Scene units for parallel rays, otherwise for each unit of distance along the axis.
    let width = 2.0 / (length(rows[0].xyz) * size);
    let cosine = dot(rows[3].xyz, ray.direction);
    let at_distance = cosine * cosine * cosine * ray.distance * ray.distance;
    return width * width * select(1.0, at_distance, ray.distance > 0.0);
}
