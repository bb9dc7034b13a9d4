// Joint bilateral upsampling (Kopf et al. 2007): weights from depth and normal of both resolutions.

/// Weight of a coarse texel for a fine one, without the spatial kernel. It depends on the distance to the fine texel's
/// tangent plane, so that slanted surfaces interpolate freely; the distance is in units of the tolerance
/// (`inverse_tolerance`), at which the weight reaches zero. It also depends on the cosine between the normals.
fn surface_weight(distance: f32, cosine: f32) -> f32 {
    let near = max(1.0 - distance * distance, 0.0);
    let bend = max(cosine, 0.0);
    let bend_2 = bend * bend;
    let bend_4 = bend_2 * bend_2;
    return near * near * bend_4 * bend_4;
}

/// Inverse of the distance to the tangent plane at which a coarse texel stops to count: its own width at that depth.
fn inverse_tolerance(depth: f32, coarse_scale: f32, tan_half_fov_vertical: f32, display_height: f32) -> f32 {
    return display_height / (2.0 * tan_half_fov_vertical * coarse_scale * depth);
}

/// Lower bound of the sum of weights, which is at most one. Below it, no parent shows the surface.
const MIN_WEIGHT: f32 = 1e-4;

/// If no parent shows the surface, the one nearest in depth is used. Another one replaces it only if it is nearer by this
/// share of the depth, which is far above rounding: two walls that are equally far away would otherwise win at random, by
/// the rounding of their depths.
const NEARER: f32 = 3e-5;

/// Spatial weights of three texels in a row for a position `f` in -0.5..0.5 around the middle one: quadratic B-spline,
/// which is smooth and sums to one.
fn spline_weights(f: f32) -> vec3f {
    return vec3f(0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f));
}

/// The same for linear interpolation; two of the three weights are not zero.
fn linear_weights(f: f32) -> vec3f {
    return vec3f(max(-f, 0.0), 1.0 - abs(f), max(f, 0.0));
}

const KERNEL_NEAREST: u32 = 0u;
const KERNEL_LINEAR: u32 = 1u;
const KERNEL_SPLINE: u32 = 2u;

fn kernel_weights(kernel: u32, f: f32) -> vec3f {
    if kernel == KERNEL_SPLINE {
        return spline_weights(f);
    }
    if kernel == KERNEL_LINEAR {
        return linear_weights(f);
    }
    return vec3f(0.0, 1.0, 0.0);
}
