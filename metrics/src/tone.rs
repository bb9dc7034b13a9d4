//! From linear radiance to display values. The same three steps everywhere, so that pictures can be compared:
//! exposure, a shoulder that keeps the hue, the sRGB curve. `common/tone.wgsl` is its twin on the device.

/// One linear RGB value, Rec. 709 primaries.
pub type Rgb = [f32; 3];

/// Display-linear value up to which the picture is exactly proportional to radiance.
const SHOULDER_START: f32 = 0.8;

/// The percentile of luminance that [`auto_exposure`] places at [`SHOULDER_START`].
const EXPOSED_PERCENTILE: f64 = 0.95;

/// Rec. 709 luminance of a linear RGB value.
pub fn luminance([r, g, b]: Rgb) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Display value (sRGB-encoded, 0..1) of linear radiance.
///
/// Radiance times `exposure` is shown as it is up to 0.8; above, the brightest channel follows
/// `1 - 0.2 exp(-(x - 0.8) / 0.2)`, which continues with the same slope and never reaches 1, and the other channels are
/// scaled along with it: highlights bend but keep their hue. Negative and NaN inputs show as black.
pub fn tone_map(radiance: Rgb, exposure: f32) -> Rgb {
    let exposed = radiance.map(|value| (value * exposure).max(0.0));
    let peak = exposed[0].max(exposed[1]).max(exposed[2]);
    let scale = if peak.is_infinite() {
        return exposed.map(|value| f32::from(value.is_infinite()));
    } else if peak > SHOULDER_START {
        let room = 1.0 - SHOULDER_START;
        (1.0 - room * (-(peak - SHOULDER_START) / room).exp()) / peak
    } else {
        1.0
    };
    exposed.map(|value| srgb_encode(value * scale))
}

/// [`tone_map`] of a whole image.
pub fn tone_map_all(pixels: &[Rgb], exposure: f32) -> Vec<Rgb> {
    pixels.iter().map(|&pixel| tone_map(pixel, exposure)).collect()
}

/// Exposure under which 95 % of the lit pixels stay on the straight part of [`tone_map`]: 0.8 over the 95th percentile
/// of positive luminance. Taken once from the reference of a scene and used for all its images. 1 when nothing is lit.
///
/// `mask`: pixels that count (true); None counts all.
pub fn auto_exposure(pixels: &[Rgb], mask: Option<&[bool]>) -> f32 {
    let counts = |index: usize| mask.is_none_or(|mask| mask[index]);
    let mut lit: Vec<f32> = pixels
        .iter()
        .enumerate()
        .filter(|&(index, _)| counts(index))
        .map(|(_, &pixel)| luminance(pixel))
        .filter(|value| value.is_finite() && *value > 0.0)
        .collect();
    if lit.is_empty() {
        return 1.0;
    }
    let rank = ((lit.len() - 1) as f64 * EXPOSED_PERCENTILE).round() as usize;
    let (_, percentile, _) = lit.select_nth_unstable_by(rank, f32::total_cmp);
    SHOULDER_START / *percentile
}

/// Linear 0..1 to sRGB 0..1 (IEC 61966-2-1).
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB 0..1 to linear 0..1 (IEC 61966-2-1).
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}
