//! The lines of a material library that name an image: options, a file name that may have blanks, and a comment.

use super::text;

/// The options `-s` and `-o` of a texture: its coordinates are scaled, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mapping {
    pub scale: [f32; 2],
    pub offset: [f32; 2],
}

impl Default for Mapping {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2] }
    }
}

/// What stands behind the keyword of a texture.
#[derive(Debug)]
pub(super) struct Image {
    /// The readings of the file name, as it stands first.
    pub names: Vec<String>,
    pub mapping: Mapping,
    /// An option that is not drawn changes how the image is used.
    pub changed: bool,
}

/// Options with their least and largest number of arguments, and whether they change what is drawn.
const OPTIONS: [(&str, usize, usize, bool); 14] = [
    ("-s", 1, 3, false),
    ("-o", 1, 3, false),
    ("-t", 1, 3, true),
    ("-mm", 1, 2, true),
    ("-blendu", 1, 1, false),
    ("-blendv", 1, 1, false),
    ("-cc", 1, 1, false),
    ("-clamp", 1, 1, true),
    ("-texres", 1, 1, false),
    ("-bm", 1, 1, false),
    ("-boost", 1, 1, false),
    ("-imfchan", 1, 1, true),
    ("-type", 1, 1, true),
    ("-colorspace", 1, 1, false),
];

impl Image {
    /// Reads the line behind the keyword.
    pub fn parse(rest: &str) -> Self {
        let mut names = Vec::new();
        let mut options = Options::default();
        let mut add = |name: &str| {
            let name = name.trim();
            let plain = name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(name).trim();
            if !plain.is_empty() && !names.iter().any(|known| known == plain) {
                names.push(plain.to_owned());
            }
        };
        let mut shortest = rest;
        for reading in text::names(rest) {
            add(reading);
            shortest = reading;
        }
        // A number may be an argument or begin the name.
        let starts = leading(shortest, &mut options);
        for &start in &starts {
            add(&shortest[start..]);
        }
        let name = &shortest[starts.last().copied().unwrap_or_default()..];
        if let Some(end) = trailing(name, &mut options) {
            add(&name[..end]);
        }
        // A line of options without a name.
        if shortest.starts_with('-') && name.is_empty() {
            names.clear();
        }
        Self { names, mapping: options.mapping, changed: options.changed }
    }
}

/// What the options of a texture say.
#[derive(Default)]
struct Options {
    mapping: Mapping,
    changed: bool,
}

impl Options {
    /// Takes an option with its arguments and what follows them.
    fn take(&mut self, option: &str, changes: bool, arguments: &str) {
        let numbers: Vec<f32> = arguments.split_whitespace().take(3).map_while(|word| word.parse().ok()).collect();
        let finite = |index: usize, other: f32| numbers.get(index).copied().filter(|x| x.is_finite()).unwrap_or(other);
        match option.to_lowercase().as_str() {
            "-s" => self.mapping.scale = [finite(0, 1.0), finite(1, 1.0)],
            "-o" => self.mapping.offset = [finite(0, 0.0), finite(1, 0.0)],
            "-t" => self.changed |= numbers.iter().any(|&x| x != 0.0),
            "-mm" => self.changed |= numbers.get(..2) != Some(&[0.0, 1.0]),
            "-clamp" => {
                let first = arguments.split_whitespace().next();
                self.changed |= first.is_some_and(|word| word.eq_ignore_ascii_case("on"));
            }
            _ => self.changed |= changes,
        }
    }
}

/// Where the name may begin behind the options at the start, in ascending order.
fn leading(text: &str, options: &mut Options) -> Vec<usize> {
    let mut starts = vec![0];
    let mut at = 0;
    while let Some((option, end)) = word(text, at)
        && let Some(&(_, least, most, changes)) = known(option)
    {
        options.take(option, changes, &text[end..]);
        at = end;
        starts.clear();
        for argument in 0..most {
            let Some((value, end)) = word(text, at) else { break };
            if argument >= least && value.parse::<f64>().is_err() {
                break;
            }
            at = end;
            if argument + 1 >= least {
                starts.push(at);
            }
        }
        if starts.is_empty() {
            starts.push(text.len());
        }
    }
    starts
}

/// Where the name ends before options at the end.
fn trailing(text: &str, options: &mut Options) -> Option<usize> {
    let mut at = 0;
    while let Some((option, end)) = word(text, at) {
        if at > 0 && known(option).is_some() {
            leading(&text[end - option.len()..], options);
            return Some(end - option.len());
        }
        at = end;
    }
    None
}

/// The first word from this position, and its end.
fn word(text: &str, from: usize) -> Option<(&str, usize)> {
    let rest = &text[from..];
    let start = rest.find(|c: char| !c.is_whitespace())?;
    let length = rest[start..].find(char::is_whitespace).unwrap_or(rest.len() - start);
    Some((&rest[start..start + length], from + start + length))
}

fn known(option: &str) -> Option<&'static (&'static str, usize, usize, bool)> {
    OPTIONS.iter().find(|(name, ..)| name.eq_ignore_ascii_case(option))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_found_before_and_behind_options() {
        let last = |rest: &str| Image::parse(rest).names.pop();
        for (rest, name) in [
            ("a.png", "a.png"),
            ("my image.png", "my image.png"),
            ("\"my image.png\"", "my image.png"),
            ("-o 0.0 -7.0 0.0 -s 1.0 10.0 1.0 -clamp on my dir/a.png", "my dir/a.png"),
            ("-bm 0.3 -blendu on -blendv off -mm 0 1 -texres 512 -cc on -type sphere -imfchan m a.png", "a.png"),
            ("-s 2 a.png", "a.png"),
            ("-S 2 2 a.png", "a.png"),
            ("a b.png -s 2 2 1", "a b.png"),
            ("\"a b.png\" -s 2 2 1 # wall", "a b.png"),
            ("a.png # the front", "a.png"),
            ("a-s.png", "a-s.png"),
            ("dir\\a.png", "dir\\a.png"),
        ] {
            assert_eq!(last(rest).as_deref(), Some(name), "{rest}");
        }
        // As it stands comes first; a number may belong to the name.
        assert_eq!(Image::parse("a #1.png").names, ["a #1.png", "a"]);
        assert_eq!(
            Image::parse("-s 1 1 2 walls.png").names,
            ["-s 1 1 2 walls.png", "1 2 walls.png", "2 walls.png", "walls.png"]
        );
        for empty in ["", "-s 1 1 1", "-clamp", "\"\""] {
            assert_eq!(Image::parse(empty).names, [""; 0], "{empty}");
        }
    }

    #[test]
    fn options_that_are_not_drawn_are_noticed() {
        let changed = |rest: &str| Image::parse(rest).changed;
        for rest in
            ["a.png", "-s 1 1 1 -o 0 0 0 -mm 0 1 a.png", "-blendu on -texres 512 -clamp off a.png", "a.png -s 1 1"]
        {
            assert!(!changed(rest), "{rest}");
        }
        for rest in ["-mm 0.1 1 a.png", "-type sphere a.png", "-imfchan r a.png", "a.png -t 1 1 1", "-clamp on a.png"] {
            assert!(changed(rest), "{rest}");
        }
    }

    #[test]
    fn scale_and_offset_are_read_wherever_they_stand() {
        let mapping = |rest: &str| {
            let Mapping { scale, offset } = Image::parse(rest).mapping;
            (scale, offset)
        };
        assert_eq!(mapping("a.png"), ([1.0; 2], [0.0; 2]));
        assert_eq!(mapping("-o 0.5 -7.0 0.0 -s 2 10.0 1.0 a.png"), ([2.0, 10.0], [0.5, -7.0]));
        assert_eq!(mapping("-s 2 a.png"), ([2.0, 1.0], [0.0; 2]));
        assert_eq!(mapping("a b.png -s 2 3 1 -o 0.25"), ([2.0, 3.0], [0.25, 0.0]));
    }
}
