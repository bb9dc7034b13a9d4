//! Edits of bytes, words and lines at random.

use crate::oracle::Random;

/// A random whole number below `most`.
pub(super) fn below(random: &mut Random, most: usize) -> usize {
    ((random.unit() * most as f64) as usize).min(most.saturating_sub(1))
}

/// One of these at random.
pub(super) fn any<'a, T>(random: &mut Random, list: &'a [T]) -> &'a T {
    &list[below(random, list.len())]
}

/// Whether the one of `times` cases is met that damages something rarely.
pub(super) fn one_in(random: &mut Random, times: usize) -> bool {
    below(random, times) == 0
}

/// Replaces the four bytes at this place, which are often a number, by a number at a limit of its range.
pub(super) fn digits(bytes: &mut [u8], at: usize, random: &mut Random) {
    const WHOLE: &[i32] = &[
        0,
        1,
        -1,
        2,
        3,
        4,
        7,
        16,
        127,
        255,
        256,
        4096,
        16384,
        65535,
        65536,
        1 << 20,
        1 << 27,
        1 << 30,
        i32::MAX,
        i32::MIN,
    ];
    const FLOATS: &[f32] = &[
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        1e-45,
        1e-20,
        1e6,
        1e10,
        1e30,
        3e38,
        -3e38,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ];
    let number = if one_in(random, 2) { any(random, WHOLE).to_le_bytes() } else { any(random, FLOATS).to_le_bytes() };
    if let Some(place) = bytes.get_mut(at..at + 4) {
        place.copy_from_slice(&number);
    }
}

/// Duplicates, deletes or swaps lines.
pub(super) fn edit_lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    let (a, b) = (below(random, lines.len()), below(random, lines.len()));
    match below(random, 3) {
        0 => drop(lines.remove(a)),
        1 => lines.swap(a, b),
        _ => {
            let line = lines[a].clone();
            // Sometimes many copies of one line, which reveals quadratic run time.
            let times = if below(random, 50) == 0 { 500 } else { 1 };
            (0..times).for_each(|_| lines.insert(b, line.clone()));
        }
    }
    *bytes = lines.join(&b'\n');
}

/// Replaces one word by another: a number, a key or punctuation.
pub(super) fn replace_word(bytes: &mut Vec<u8>, random: &mut Random, words: &[&str]) {
    let part = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'_' | b'/');
    let at = below(random, bytes.len().max(1));
    let Some(begin) = (at..bytes.len()).find(|&i| part(bytes[i])) else { return };
    let begin = (0..=begin).rev().take_while(|&i| part(bytes[i])).last().unwrap_or(begin);
    let end = (begin..bytes.len()).find(|&i| !part(bytes[i])).unwrap_or(bytes.len());
    drop(bytes.splice(begin..end, any(random, words).bytes()));
}
