//! Maps in OpenEXR files.

use std::io::Cursor;

use exr::image::{AnyChannels, FlatSamples, Layer};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, read as exr_read};

use super::area;

type Part = Layer<AnyChannels<FlatSamples>>;

/// Size and texels of the first part that has colours.
///
/// The map is the display window: pixels outside the data window are black, and those outside the display window are
/// left out.
pub(super) fn decode(bytes: &[u8]) -> Result<([usize; 2], Vec<[f32; 3]>), String> {
    let unreadable = |error: exr::error::Error| format!("is not a readable EXR image ({error})");
    check(&MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?, bytes.len())?;
    let image = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let found = image.layer_data.iter().find_map(|part| Some((part, colours(part)?)));
    let Some((part, channels)) = found else { return Err(format!("has {}", contents(&image.layer_data))) };
    let list = &part.channel_data.list;
    let stored = area([part.size.0, part.size.1])?;
    let channels = channels.map(|index| &list[index]);
    if channels.iter().any(|c| c.sampling.0 != 1 || c.sampling.1 != 1 || c.sample_data.len() != stored) {
        return Err("has subsampled channels".into());
    }
    let [r, g, b] = channels.map(|channel| channel.sample_data.values_as_f32().collect::<Vec<f32>>());
    let (position, window) = (part.attributes.layer_position, image.attributes.display_window);
    let size = [window.size.0, window.size.1];
    let mut texels = vec![[0.0; 3]; area(size)?];
    let offset = [0, 1].map(|axis| {
        let [a, b] = [position, window.position].map(|p| i64::from(if axis == 0 { p.0 } else { p.1 }));
        a - b
    });
    for (i, texel) in (0..stored).map(|i| (i, [r[i], g[i], b[i]])) {
        let x = offset[0] + (i % part.size.0) as i64;
        let y = offset[1] + (i / part.size.0) as i64;
        if (0..size[0] as i64).contains(&x) && (0..size[1] as i64).contains(&y) {
            texels[y as usize * size[0] + x as usize] = texel;
        }
    }
    Ok((size, texels))
}

/// A file's pixels may take this many times its size in memory. DWA makes a constant image some 10,000 times smaller, and
/// no other compression more than 1,400 times.
const DENSEST: usize = 1 << 14;

/// Largest display window, in texels, that may be nearly empty: 4,096 x 2,048.
const MOST_EMPTY: usize = 1 << 23;

/// A larger display window has data for at least one in so many of its texels.
const SPARSEST: usize = 64;

/// Refuses headers whose sizes the file cannot hold: a damaged size must not become an allocation.
fn check(meta: &MetaData, length: usize) -> Result<(), String> {
    let (mut chunks, mut pixels) = (0_usize, 0_usize);
    for header in &meta.headers {
        if header.deep {
            return Err("has deep pixels".into());
        }
        let stored = area([header.layer_size.0, header.layer_size.1])?;
        chunks = chunks.saturating_add(header.chunk_count);
        pixels = pixels.saturating_add(stored.saturating_mul(header.channels.bytes_per_pixel));
        let window = header.shared_attributes.display_window.size;
        let shown = area([window.0, window.1])?;
        if shown > MOST_EMPTY && shown / SPARSEST > stored {
            return Err(format!("shows {} x {} texels and has data for {stored} of them", window.0, window.1));
        }
    }
    // A table has the offset of each chunk, a number of eight bytes.
    if chunks > length / 8 || pixels / DENSEST > length {
        return Err("is cut off".into());
    }
    Ok(())
}

/// Indices of a part's red, green and blue: channels R, G and B, alone or of one layer (`sky.R`), else luminance Y.
fn colours(part: &Part) -> Option<[usize; 3]> {
    let list = &part.channel_data.list;
    let find = |name: &str| list.iter().position(|channel| channel.name.to_string() == name);
    let three = |layer: &str| {
        let [r, g, b] = ["R", "G", "B"].map(|name| find(&format!("{layer}{name}")));
        Some([r?, g?, b?])
    };
    let layer = || list.iter().find_map(|channel| three(channel.name.to_string().strip_suffix('R')?));
    three("").or_else(layer).or_else(|| find("Y").map(|y| [y; 3]))
}

/// The channels of all parts, for a message.
fn contents(parts: &[Part]) -> String {
    let part = |part: &Part| {
        let names: Vec<_> = part.channel_data.list.iter().take(8).map(|channel| channel.name.to_string()).collect();
        let more = if part.channel_data.list.len() > names.len() { " and others" } else { "" };
        match &part.attributes.layer_name {
            Some(name) => format!("{}{more} in the part `{name}`", names.join(", ")),
            None => format!("{}{more}", names.join(", ")),
        }
    };
    let parts: Vec<_> = parts.iter().take(4).map(part).collect();
    format!("the channels {}, and neither R, G and B nor Y", parts.join("; "))
}

#[cfg(test)]
mod tests {
    use exr::prelude::{
        AnyChannel, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, LayerAttributes, SmallVec, Text,
        Vec2, WritableImage,
    };

    use super::*;

    /// A part of 4 x 2 pixels whose channels hold 100 times their number plus the pixel's number.
    fn part(name: &str, channels: &[&str]) -> Layer<AnyChannels<FlatSamples>> {
        let list: SmallVec<[_; 4]> = channels
            .iter()
            .enumerate()
            .map(|(c, &name)| AnyChannel::new(name, FlatSamples::F32((0..8).map(|i| (100 * c + i) as f32).collect())))
            .collect();
        let attributes = LayerAttributes { layer_name: Some(Text::from(name)), ..LayerAttributes::default() };
        Layer::new((4, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list))
    }

    fn bytes(parts: Vec<Layer<AnyChannels<FlatSamples>>>, window: Option<([i32; 2], [usize; 2])>) -> Vec<u8> {
        let ([x, y], [width, height]) = window.unwrap_or(([0, 0], [4, 2]));
        let attributes = ImageAttributes::new(IntegerBounds::new((x, y), (width, height)));
        let image = Image::from_layers(attributes, exr::image::Layers::from(parts));
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).expect("a small image");
        bytes.into_inner()
    }

    #[test]
    fn pixels_outside_the_data_are_black_and_those_outside_the_display_are_left_out() {
        // Channels are sorted by name: B, G, R.
        let pixel = |i: usize| [200.0 + i as f32, 100.0 + i as f32, i as f32];
        let mut lower = part("a", &["B", "G", "R"]);
        lower.attributes.layer_position = Vec2(1, 2);
        let (size, texels) = decode(&bytes(vec![lower.clone()], Some(([0, 0], [6, 4])))).expect("cropped");
        assert_eq!(size, [6, 4]);
        for (i, texel) in texels.iter().enumerate() {
            let (x, y) = (i % 6, i / 6);
            let wanted = if (1..5).contains(&x) && y >= 2 { pixel(x - 1 + 4 * (y - 2)) } else { [0.0; 3] };
            assert_eq!(*texel, wanted, "{x} {y}");
        }
        // Overscan, with a display window that does not begin at 0.
        lower.attributes.layer_position = Vec2(-1, 5);
        let (size, texels) = decode(&bytes(vec![lower], Some(([0, 6], [2, 1])))).expect("overscan");
        assert_eq!((size, texels), ([2, 1], vec![pixel(5), pixel(6)]));
    }

    #[test]
    fn the_first_part_with_colours_is_used() {
        let mask = part("mask", &["A"]);
        let parts = vec![mask.clone(), part("sky", &["B", "G", "R"]), part("other", &["B", "G", "R"])];
        assert_eq!(decode(&bytes(parts, None)).expect("two parts").1[3], [203.0, 103.0, 3.0]);
        let layers = vec![part("sky", &["A", "view.B", "view.G", "view.R"])];
        assert_eq!(decode(&bytes(layers, None)).expect("a layer").1[3], [303.0, 203.0, 103.0]);
        assert_eq!(decode(&bytes(vec![part("grey", &["Y"])], None)).expect("luminance").1[3], [3.0; 3]);
        let why = decode(&bytes(vec![mask, part("depth", &["Z"])], None)).expect_err("no colours");
        assert!(why.contains("A in the part `mask`; Z in the part `depth`") && why.contains("R, G and B"), "{why}");
    }

    #[test]
    fn sizes_that_the_file_cannot_hold_are_refused() {
        let good = bytes(vec![part("a", &["B", "G", "R"])], None);
        let resized = |attribute: &str, size: [i32; 2]| {
            let name = format!("{attribute}\0box2i\0");
            let at = good.windows(name.len()).position(|window| window == name.as_bytes()).expect("it is written");
            // The length of the value and the lowest x and y come first.
            let at = at + name.len() + 12;
            let mut bytes = good.clone();
            bytes[at..at + 8].copy_from_slice(&size.map(|x| (x - 1).to_le_bytes()).concat());
            bytes
        };
        assert_eq!(resized("dataWindow", [4, 2]), good);
        // 1.5 GB of pixels, a table of as many chunks, and 1.5 GB of black around eight pixels.
        for (bytes, why) in [
            (resized("dataWindow", [1 << 26, 2]), "cut off"),
            (resized("dataWindow", [4, 1 << 20]), "cut off"),
            (resized("displayWindow", [1 << 14, 1 << 13]), "shows 16384 x 8192 texels and has data for 8 of them"),
            (resized("displayWindow", [1 << 14, 1 << 14]), "texels, more than"),
        ] {
            let sentence = decode(&bytes).expect_err(why);
            assert!(sentence.contains(why), "{sentence}");
        }
        assert_eq!(decode(&resized("displayWindow", [4096, 2048])).expect("a small part of a map").0, [4096, 2048]);
    }

    #[test]
    fn large_values_stay() {
        let mut bright = part("a", &["B", "G", "R"]);
        bright.channel_data.list.iter_mut().for_each(|c| c.sample_data = FlatSamples::F32(vec![3e37; 8]));
        assert_eq!(decode(&bytes(vec![bright], None)).expect("bright").1[0], [3e37; 3]);
    }
}
