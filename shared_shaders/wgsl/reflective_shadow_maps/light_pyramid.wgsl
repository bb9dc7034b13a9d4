// Where the texels of a pyramid over the lights' views stand in one buffer, two words of four numbers each: level by level
// from the finest, in each level view by view, rows from the top. The views' size is a multiple of the coarsest texel.
import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light};

/// Index of a level's first texel.
fn level_start(level: u32, size: u32, views: u32) -> u32 {
    var start = 0u;
    for (var k = 0u; k < level; k++) {
        start += views * (size >> k) * (size >> k);
    }
    return start;
}

/// A texel: its position in world space, then area, normal and radiance as `pack_light` leaves them.
fn unpack_texel(position: vec4u, light: vec4u) -> LightSurface {
    return unpack_light(bitcast<vec3f>(position.xyz), light);
}
