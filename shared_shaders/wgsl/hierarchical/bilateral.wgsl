// Joint bilateral upsampling (Kopf et al. 2007): weights from depth and normal of both resolutions.

/// Weight of a coarse texel for a fine one, without the kernel's spatial part: from its distance to the fine texel's
/// tangent plane, so that slanted surfaces interpolate freely, in tolerances (`inverse_tolerance`), where it reaches
/// zero, and from the cosine between the two normals.
fn surface_weight(distance: f32, cosine: f32) -> f32 {
    let near = max(1.0 - distance * distance, 0.0);
    let bend = max(cosine, 0.0);
    let bend_2 = bend * bend;
    let bend_4 = bend_2 * bend_2;
    return near * near * bend_4 * bend_4;
}

/// Distance to the tangent plane at which a coarse texel stops counting: its own width at that depth.
fn inverse_tolerance(depth: f32, coarse_scale: f32, tan_half_fov_vertical: f32, display_height: f32) -> f32 {
    return display_height / (2.0 * tan_half_fov_vertical * coarse_scale * depth);
}

/// Weights sum to at most one; under this the parents agree on nothing.
const MIN_WEIGHT: f32 = 1e-4;

/// Spatial weights of three texels in a row (quadratic B-spline: smooth, and they sum to one) for a
/// position `f` in -0.5..0.5 around the middle one.
fn spline_weights(f: f32) -> vec3f {
    return vec3f(0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f));
}

/// Same for linear interpolation: two of the three count.
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
