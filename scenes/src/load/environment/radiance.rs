//! Maps in Radiance files (`.hdr`, `.pic`).
//!
//! The reader is our own: that of the crate `image` leaves the exposure in the values, refuses XYZE and seven of the eight
//! orders of pixels, and overflows over damaged run lengths.

use super::area;

/// Size and texels, rows from top to bottom. Values are divided by the exposure of the header.
pub(super) fn decode(bytes: &[u8]) -> Result<([usize; 2], Vec<[f32; 3]>), String> {
    let mut rest = bytes;
    let mut scale = [1.0_f32; 3];
    let mut xyz = false;
    let bad_header = || "is not a readable Radiance image (its header is damaged)".to_owned();
    loop {
        let line = line(&mut rest).ok_or_else(bad_header)?;
        if line.is_empty() {
            break;
        }
        let Some((key, value)) = line.split_once('=') else { continue };
        let numbers: Vec<f32> = value.split_whitespace().map_while(|word| word.parse().ok()).collect();
        match (key.trim(), numbers[..].first_chunk::<3>(), numbers.first()) {
            ("FORMAT", ..) => match value.trim() {
                "32-bit_rle_rgbe" => {}
                "32-bit_rle_xyze" => xyz = true,
                other => return Err(format!("has the Radiance format `{other}`")),
            },
            ("EXPOSURE", _, Some(&exposure)) if exposure > 0.0 => scale = scale.map(|s| s / exposure),
            ("COLORCORR", Some(correction), _) if correction.iter().all(|&c| c > 0.0) => {
                scale.iter_mut().zip(correction).for_each(|(s, c)| *s /= c);
            }
            _ => {}
        }
    }
    let resolution = line(&mut rest).ok_or_else(bad_header)?;
    let words: Vec<_> = resolution.split_whitespace().collect();
    // The outer axis, then the inner one: `-Y rows +X columns` are rows from top to bottom, each from left to right.
    let axis = |name: &str, count: &str| {
        let count = count.parse::<usize>().ok()?;
        let mut letters = name.chars();
        let ascending = letters.next()? == '+';
        Some((letters.as_str().to_owned(), ascending, count))
    };
    let (outer, inner) = match words[..] {
        [a, b, c, d] => (axis(a, b).ok_or_else(bad_header)?, axis(c, d).ok_or_else(bad_header)?),
        _ => return Err(bad_header()),
    };
    let transposed = match (outer.0.as_str(), inner.0.as_str()) {
        ("Y", "X") => false,
        ("X", "Y") => true,
        _ => return Err(bad_header()),
    };
    let size = if transposed { [outer.2, inner.2] } else { [inner.2, outer.2] };
    // Runs of up to 127 pixels take two bytes for each of four components.
    if area(size)? / 127 > rest.len() * 127 {
        return Err("is cut off".into());
    }
    let mut texels = vec![[0.0; 3]; area(size)?];
    let mut line = vec![[0; 4]; inner.2];
    for i in 0..outer.2 {
        scan_line(&mut rest, &mut line).ok_or("is cut off or damaged")?;
        for (j, &pixel) in line.iter().enumerate() {
            // Y ascends upwards in Radiance files.
            let along = |(name, ascending, count): &(String, bool, usize), index: usize| {
                if *ascending == (name == "X") { index } else { count - 1 - index }
            };
            let (first, second) = (along(&outer, i), along(&inner, j));
            let (x, y) = if transposed { (first, second) } else { (second, first) };
            let value = radiance(pixel);
            let value = if xyz { from_xyz(value) } else { value };
            texels[y * size[0] + x] = std::array::from_fn(|c| value[c] * scale[c]);
        }
    }
    Ok((size, texels))
}

/// The next line without its end.
fn line(rest: &mut &[u8]) -> Option<String> {
    let end = rest.iter().position(|&byte| byte == b'\n')?;
    let line = String::from_utf8_lossy(&rest[..end]).trim_end_matches('\r').to_owned();
    *rest = &rest[end + 1..];
    Some(line)
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (first, others) = rest.split_first_chunk::<N>()?;
    *rest = others;
    Some(*first)
}

/// Reads one line of pixels: plain, with repeated pixels, or with runs in each component.
fn scan_line(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let first = take::<4>(rest)?;
    let width = line.len();
    if first[0] == 2 && first[1] == 2 && first[2] < 128 {
        if usize::from(u16::from_be_bytes([first[2], first[3]])) != width {
            return None;
        }
        for component in 0..4 {
            let mut at = 0;
            while at < width {
                let [count] = take(rest)?;
                let run = count > 128;
                let count = usize::from(if run { count - 128 } else { count });
                if count == 0 || at + count > width {
                    return None;
                }
                let mut value = 0;
                for (i, pixel) in line[at..at + count].iter_mut().enumerate() {
                    if i == 0 || !run {
                        [value] = take(rest)?;
                    }
                    pixel[component] = value;
                }
                at += count;
            }
        }
        return Some(());
    }
    let (mut at, mut shift, mut pixel) = (0, 0, first);
    loop {
        match pixel {
            // The pixel before is repeated; further counts are its higher digits.
            [1, 1, 1, count] if at > 0 => {
                let count = usize::from(count).checked_shl(shift).filter(|&count| count <= width - at)?;
                let value = line[at - 1];
                line[at..at + count].fill(value);
                at += count;
                shift += 8;
                if shift > 24 {
                    return None;
                }
            }
            _ => {
                line[at] = pixel;
                at += 1;
                shift = 0;
            }
        }
        if at == width {
            return Some(());
        }
        pixel = take::<4>(rest)?;
    }
}

/// Three mantissas with one exponent.
fn radiance([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    if exponent == 0 {
        return [0.0; 3];
    }
    let unit = (f64::from(exponent) - 136.0).exp2();
    [r, g, b].map(|mantissa| (f64::from(mantissa) * unit) as f32)
}

/// CIE XYZ to linear RGB with the primaries of Rec. 709. The equal-energy white of Radiance is divided by 179 lm/W by its
/// own tools; here values stay as they are.
fn from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_97 * x - 1.537_383 * y - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
        0.055_63 * x - 0.203_977 * y + 1.056_972 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, pixels: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n# a comment\n{header}\n").as_bytes(), pixels].concat()
    }

    const PLAIN: [u8; 16] = [128, 64, 0, 129, 0, 0, 0, 0, 255, 255, 255, 136, 1, 2, 4, 137];

    #[test]
    fn plain_pixels_are_read_in_every_order() {
        let (a, b, c, d) = ([1.0, 0.5, 0.0], [0.0; 3], [255.0; 3], [2.0, 4.0, 8.0]);
        for (order, wanted) in [
            ("-Y 2 +X 2", [a, b, c, d]),
            ("+Y 2 +X 2", [c, d, a, b]),
            ("-Y 2 -X 2", [b, a, d, c]),
            ("+X 2 -Y 2", [a, c, b, d]),
            ("-X 2 +Y 2", [d, b, c, a]),
        ] {
            let (size, texels) = decode(&file(&format!("FORMAT=32-bit_rle_rgbe\n\n{order}"), &PLAIN)).expect(order);
            assert_eq!((size, &texels[..]), ([2, 2], &wanted[..]), "{order}");
        }
        assert_eq!(decode(&file("\n-Y 1 +X 4", &PLAIN)).expect("a row").0, [4, 1]);
    }

    #[test]
    fn exposure_and_correction_are_taken_out() {
        let header = "EXPOSURE=2\nEXPOSURE = 0.5\nEXPOSURE=4\nCOLORCORR=1 2 4\n\n-Y 2 +X 2";
        assert_eq!(decode(&file(header, &PLAIN)).expect("valid").1[3], [0.5, 0.5, 0.5]);
    }

    #[test]
    fn runs_are_read() {
        // Runs in each component: a run of 8, eight values, a run of 5 and three values, a run.
        let runs = [2, 2, 0, 8, 136, 128, 8, 0, 1, 2, 3, 4, 5, 6, 7, 133, 9, 3, 1, 2, 3, 136, 136];
        let row = decode(&file("\n-Y 1 +X 8", &runs)).expect("runs").1;
        assert_eq!(row[0], [128.0, 0.0, 9.0]);
        assert_eq!(row[7], [128.0, 7.0, 3.0]);
        // Repeated pixels, with a count of 258 in two digits.
        let repeated = [8, 8, 8, 136, 1, 1, 1, 2, 1, 1, 1, 1, 9, 9, 9, 136];
        let row = decode(&file("\n-Y 1 +X 260", &repeated)).expect("repeated").1;
        assert!(row[..259].iter().all(|texel| *texel == [8.0; 3]) && row[259] == [9.0; 3]);
    }

    #[test]
    fn the_largest_values_stay() {
        let row = decode(&file("\n-Y 1 +X 1", &[255, 1, 0, 255])).expect("bright").1;
        assert_eq!(row, [[255.0 * 119.0_f32.exp2(), 119.0_f32.exp2(), 0.0]]);
    }

    #[test]
    fn xyz_becomes_rgb() {
        // The white of Rec. 709 is x = 0.3127, y = 0.3290: X = 0.9505, Z = 1.0888 at Y = 1.
        let white = from_xyz([0.950_46, 1.0, 1.089_06]);
        assert!(white.iter().all(|x| (x - 1.0).abs() < 1e-3), "{white:?}");
        let header = "FORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1";
        let texel = decode(&file(header, &[0, 128, 0, 129])).expect("valid").1[0];
        assert_eq!(texel, from_xyz([0.0, 1.0, 0.0]));
    }

    #[test]
    fn damage_is_refused() {
        for (header, pixels, why) in [
            ("\n-Y 2 +X 2", &PLAIN[..15], "cut off"),
            ("\n-Y 1 +X 8", &[2, 2, 0, 7, 136, 128], "damaged"),
            ("\n-Y 1 +X 8", &[2, 2, 0, 8, 137, 128], "damaged"),
            ("\n-Y 1 +X 4", &[8, 8, 8, 136, 1, 1, 1, 9], "damaged"),
            ("\n-Y 1000000 +X 1000000", &PLAIN, "texels"),
            ("\n-Y 100000 +X 1000", &PLAIN, "cut off"),
            ("\n-Y 0 +X 4", &PLAIN, "no texels"),
            ("\n-Z 1 +X 4", &PLAIN, "header"),
            ("\n", &[], "header"),
            ("FORMAT=32-bit_rle_zzz\n\n-Y 1 +X 1", &PLAIN, "format"),
        ] {
            let sentence = decode(&file(header, pixels)).expect_err(header);
            assert!(sentence.contains(why), "{header}: {sentence}");
        }
    }
}
