//! Text of models and material libraries: encodings and lines.

use std::borrow::Cow;

/// The text of a file: UTF-16 where it has a byte order mark or every other byte is 0, UTF-8 where it is valid, else
/// Latin-1. Line ends of every kind become `\n`.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => Cow::Owned(utf16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Cow::Owned(utf16(rest, u16::from_be_bytes)),
        _ => match zeros(bytes) {
            (0, 2..) => Cow::Owned(utf16(bytes, u16::from_le_bytes)),
            (2.., 0) => Cow::Owned(utf16(bytes, u16::from_be_bytes)),
            _ => {
                let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
                let latin_1 = |_| Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect());
                std::str::from_utf8(bytes).map_or_else(latin_1, Cow::Borrowed)
            }
        },
    };
    if text.contains('\r') { Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n")) } else { text }
}

/// Number of zeros among the first bytes: at even and at odd positions.
fn zeros(bytes: &[u8]) -> (usize, usize) {
    let head = &bytes[..bytes.len().min(64)];
    let count = |odd| head.iter().skip(odd).step_by(2).filter(|&&byte| byte == 0).count();
    (count(0), count(1))
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Lines with their numbers, starting at 1. A line that ends in `\` continues on the next one, unless it is a comment:
/// a path of a Windows computer may end a comment.
pub(super) fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().zip(1..);
    let continues = |line: &str| line.trim_end().ends_with('\\') && !line.trim_start().starts_with('#');
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        if !continues(line) {
            return Some((number, Cow::Borrowed(line)));
        }
        let mut joined = line.trim_end().trim_end_matches('\\').to_owned();
        for (line, _) in lines.by_ref() {
            joined.push(' ');
            if !continues(line) {
                joined.push_str(line);
                break;
            }
            joined.push_str(line.trim_end().trim_end_matches('\\'));
        }
        Some((number, Cow::Owned(joined)))
    })
}

/// The keyword in lower case, and the rest of the line.
pub(super) fn split_keyword(line: &str) -> (Cow<'_, str>, &str) {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let upper = keyword.contains(|c: char| c.is_uppercase());
    (if upper { Cow::Owned(keyword.to_lowercase()) } else { Cow::Borrowed(keyword) }, rest.trim())
}

/// The readings of a name, the likeliest first: as it stands, without quotes, and without a comment. A `#` may be part
/// of a name, and it begins a comment after a blank.
pub(super) fn names(rest: &str) -> impl Iterator<Item = &str> {
    let comment = rest.match_indices('#').map(|(at, _)| at).find(|&at| rest[..at].ends_with(char::is_whitespace));
    let short = comment.map(|at| rest[..at].trim());
    [Some(rest), short]
        .into_iter()
        .flatten()
        .map(str::trim)
        .map(|name| name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(name))
}

/// Numbers of occurrences by keyword, in the order of first appearance.
#[derive(Debug, Default)]
pub(super) struct Counts(Vec<(String, usize)>);

/// Number of keywords that are counted by name, and the name of the rest.
const MOST: usize = 12;
const OTHERS: &str = "others";

impl Counts {
    pub fn add(&mut self, keyword: &str) {
        // Only short, printable words: damaged or binary files have others.
        let shown: String = keyword.chars().filter(|c| !c.is_control()).take(24).collect();
        match self.0.iter().position(|(known, _)| *known == shown) {
            Some(index) => self.0[index].1 += 1,
            None if self.0.len() < MOST => self.0.push((shown, 1)),
            None if self.0.len() == MOST => self.0.push((OTHERS.into(), 1)),
            None => self.0[MOST].1 += 1,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, (keyword, count)) in self.0.iter().enumerate() {
            let comma = if index > 0 { ", " } else { "" };
            let times = if *count > 1 { format!(" ({count} times)") } else { String::new() };
            write!(f, "{comma}`{keyword}`{times}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_and_line_end_is_read() {
        let text = "v 1\n# é\nv 2\n";
        let utf16 = |unit: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(unit).collect::<Vec<u8>>();
        let (little, big) = (utf16(u16::to_le_bytes), utf16(u16::to_be_bytes));
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            [b"\xff\xfe", &little[..]].concat(),
            [b"\xfe\xff", &big[..]].concat(),
            little,
            big,
            b"v 1\n# \xe9\nv 2\n".to_vec(),
            "v 1\r\n# é\r\nv 2\r\n".into(),
            "v 1\r# é\rv 2\r".into(),
            "v 1\r\n# é\rv 2\n".into(),
        ] {
            assert_eq!(decode(&bytes), text, "{bytes:?}");
        }
        assert_eq!(decode(b""), "");
    }

    #[test]
    fn lines_continue_after_a_backslash_and_comments_do_not() {
        let lines = |text| logical_lines(text).map(|(n, line)| (n, line.into_owned())).collect::<Vec<_>>();
        assert_eq!(lines("a \\\nb\\ \nc\nd"), [(1, "a  b c".into()), (4, "d".into())]);
        assert_eq!(lines("# C:\\x\\\nb"), [(1, "# C:\\x\\".into()), (2, "b".into())]);
        assert_eq!(lines("a\\"), [(1, "a".into())]);
    }

    #[test]
    fn a_name_may_hold_a_number_sign_or_be_followed_by_a_comment() {
        assert_eq!(names("red").collect::<Vec<_>>(), ["red"]);
        assert_eq!(names("a#1").collect::<Vec<_>>(), ["a#1"]);
        assert_eq!(names("red # street # 2").collect::<Vec<_>>(), ["red # street # 2", "red"]);
        assert_eq!(names("\"my wall\"\t# x").collect::<Vec<_>>(), ["\"my wall\"\t# x", "my wall"]);
    }
}
