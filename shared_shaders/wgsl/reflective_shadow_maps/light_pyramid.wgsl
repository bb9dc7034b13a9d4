// Layout of the pyramid over the reflective shadow maps in one buffer, two vec4u per texel: level by level from the
// finest, in each level map by map, rows from the top. The width of the maps is a multiple of the coarsest texel.
import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light};

/// Index of a level's first texel.
fn level_start(level: u32, size: u32, views: u32) -> u32 {
    var start = 0u;
    for (var k = 0u; k < level; k++) {
        start += views * (size >> k) * (size >> k);
    }
    return start;
}

/// A texel: position in world space, then area, normal and radiance as packed by `pack_light`.
fn unpack_texel(position: vec4u, light: vec4u) -> LightSurface {
    return unpack_light(bitcast<vec3f>(position.xyz), light);
}
