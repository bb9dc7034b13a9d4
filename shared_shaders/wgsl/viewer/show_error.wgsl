// Shows the error of indirect light: the square root of each pixel's share of relMSE, in the colours of a scale given
// by the caller.

// 1 if `image` holds indirect light, 0 if the frame has none.
override INDIRECT: u32;

struct Params {
    // The `0.01 m^2` of relMSE, with m the mean of the reference.
    relative_floor: f32,
    // Relative error shown in the last colour.
    full_scale: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Incident indirect light, albedo not included.
@group(0) @binding(1) var image: texture_2d<f32>;
// The reference's albedo * indirect. Its fourth channel is 0 without a surface.
@group(0) @binding(2) var truth: texture_2d<f32>;
@group(0) @binding(3) var albedo: texture_2d<f32>;
@group(0) @binding(4) var display: texture_storage_2d<rgba8unorm, write>;
// Colours of the scale, evenly spaced, sRGB-encoded.
@group(0) @binding(5) var<storage, read> colours: array<vec4f>;

// Grey of pixels without a surface.
const LEFT_OUT: vec3f = vec3f(0.376);

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(display)) {
        return;
    }
    let wanted = textureLoad(truth, id.xy, 0);
    var light = vec3f(0.0);
    if INDIRECT != 0u {
        light = textureLoad(image, id.xy, 0).rgb * textureLoad(albedo, id.xy, 0).rgb;
    }
    let difference = light - wanted.rgb;
    let share = difference * difference / (wanted.rgb * wanted.rgb + params.relative_floor);
    let error = sqrt(dot(share, vec3f(1.0 / 3.0)));
    let last = arrayLength(&colours) - 1u;
    let colour_index = clamp(error / params.full_scale, 0.0, 1.0) * f32(last);
    let below = min(u32(colour_index), last - 1u);
    let colour = mix(colours[below], colours[below + 1u], colour_index - f32(below)).rgb;
    textureStore(display, id.xy, vec4f(select(LEFT_OUT, colour, wanted.a > 0.0), 1.0));
}
