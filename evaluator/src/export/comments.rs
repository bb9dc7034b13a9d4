//! Brings the comments of the source files back into a linked shader. The linker keeps none.
//!
//! A comment stands before a line of code. It returns before the line of the linked shader that begins with the same code.
//! Comments on code of other variants find no such line and stay away.

use std::collections::BTreeMap;

use super::names::{path_of, words};

/// A line of a source file with the comment before it.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    comment: Vec<String>,
    code: String,
}

/// The declarations of a source file, and the comment at its beginning.
#[derive(Debug, Default)]
pub(super) struct SourceFile {
    /// Lines of the comment at the beginning.
    pub(super) head: Vec<String>,
    /// By name. Variants of a declaration have the same name.
    declarations: BTreeMap<String, Vec<Vec<Line>>>,
}

/// Code that two texts have in common where they mean the same: without spaces, conditions of variants and what ends a line.
fn bare(line: &str) -> String {
    let mut line = line.trim();
    while let Some(rest) = line.strip_prefix("@if(") {
        let mut depth = 1;
        let end = rest.find(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth == 0
        });
        line = end.map_or("", |end| rest[end + 1..].trim_start());
    }
    let named = words(line).map(|word| path_of(word).and_then(|path| path.last().copied()).unwrap_or(word));
    let text: String = named.collect::<String>().split_whitespace().collect();
    text.trim_end_matches([',', ';', '{']).to_owned()
}

/// The name that a line declares at the top level of a module.
fn declared(line: &str) -> Option<&str> {
    let is_word = |word: &&str| word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let mut before = "";
    for word in words(line).filter(is_word) {
        if ["fn", "struct", "const", "override", "alias"].contains(&before) {
            return Some(word);
        }
        // `var<storage, read_write> name`: the words in between belong to it.
        let is_space = ["uniform", "storage", "read", "read_write", "workgroup", "private"].contains(&word);
        match (before, is_space) {
            ("var", true) => {}
            ("var", false) => return Some(word),
            _ => before = word,
        }
    }
    None
}

/// Lines of a text with the depth of braces before each.
fn with_depth(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut depth = 0usize;
    text.lines().map(move |line| {
        let before = depth;
        let code = line.split("//").next().unwrap_or_default();
        depth = (depth + code.matches('{').count()).saturating_sub(code.matches('}').count());
        (before, line)
    })
}

impl SourceFile {
    /// Reads a WGSL file of the project.
    pub(super) fn read(text: &str) -> Self {
        let mut file = Self::default();
        let lines = text.lines().skip_while(|line| line.starts_with("// variants:"));
        file.head =
            lines.take_while(|line| line.starts_with("//") && !line.starts_with("///")).map(str::to_owned).collect();
        let mut comment: Vec<String> = Vec::new();
        let mut current: Option<String> = None;
        let begins = file.head.len();
        for (depth, line) in with_depth(text).skip(begins) {
            let trimmed = line.trim();
            if trimmed.starts_with("//") {
                comment.push(trimmed.to_owned());
                continue;
            }
            if trimmed.is_empty() {
                comment.clear();
                continue;
            }
            let code = bare(line);
            if code.is_empty() || depth == 0 && trimmed.starts_with('@') && declared(line).is_none() {
                // A condition or an attribute of the next line.
                continue;
            }
            if depth == 0
                && let Some(name) = declared(line)
            {
                current = Some(name.to_owned());
                file.declarations.entry(name.to_owned()).or_default().push(Vec::new());
            }
            let lines =
                current.as_ref().and_then(|name| file.declarations.get_mut(name)).and_then(|all| all.last_mut());
            if let Some(lines) = lines {
                lines.push(Line { comment: std::mem::take(&mut comment), code });
            }
        }
        file
    }

    /// Lines of the declaration of this name that fits this linked text best.
    fn declaration(&self, name: &str, linked: &[String]) -> Option<&[Line]> {
        let fitting = |lines: &&Vec<Line>| lines.iter().filter(|line| find(linked, 0, &line.code).is_some()).count();
        self.declarations.get(name)?.iter().max_by_key(fitting).map(Vec::as_slice)
    }
}

/// The first line from `from` that begins with this code.
fn find(linked: &[String], from: usize, code: &str) -> Option<usize> {
    // Braces and the like are everywhere.
    let is_telling = code.chars().filter(char::is_ascii_alphanumeric).count() >= 3;
    (from..linked.len()).find(|&index| is_telling && linked[index].starts_with(code))
}

/// A linked shader with the comments of its files. `own` is the file of the shader itself, and `files` has all by name.
pub(super) fn commented(linked: &str, own: &str, files: &BTreeMap<&str, SourceFile>) -> String {
    let lines: Vec<(usize, &str)> = with_depth(linked).collect();
    let mut text = String::new();
    let mut begin = 0;
    while begin < lines.len() {
        // A declaration ends where the next one begins: the linker writes an empty line before it.
        let is_end = |&index: &usize| lines[index].0 == 0 && lines[index].1.trim().is_empty();
        let end = (begin..lines.len()).find(is_end).map_or(lines.len(), |index| index + 1);
        let block: Vec<&str> = lines[begin..end].iter().map(|(_, line)| *line).collect();
        begin = end;
        let code: Vec<String> = block.iter().map(|line| bare(line)).collect();
        let name = block.iter().find_map(|line| declared(line));
        let path = name.and_then(path_of);
        let found = name.and_then(|name| match path.as_deref() {
            Some([folders @ .., last]) => files.get(folders.join("/").as_str())?.declaration(last, &code),
            _ => files.get(own)?.declaration(name, &code),
        });
        let mut comments: BTreeMap<usize, Vec<String>> = BTreeMap::new();
        let mut from = 0;
        for (index, line) in found.unwrap_or_default().iter().enumerate() {
            // The first line is the declaration, however the linker writes it.
            let at = if index == 0 { Some(0) } else { find(&code, from, &line.code) };
            if let Some(at) = at {
                from = at;
                comments.entry(at).or_default().extend(line.comment.iter().cloned());
            }
        }
        for (index, line) in block.iter().enumerate() {
            let indent: String = line.chars().take_while(|c| *c == ' ').collect();
            for comment in comments.get(&index).into_iter().flatten() {
                text += &format!("{indent}{comment}\n");
            }
            text += line;
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "// variants: a\n// The head\n// of the file.\nimport package::common::x::{one};\n\n\
        // Not this: an empty line follows.\n\n/// Adds.\n/// Twice.\n@if(a)\nfn add(p: f32,\n    q: f32) -> f32 {\n    // First.\n    \
        let sum = one(p) +\n        q;\n    @if(!a) {\n        // Another variant.\n        return 1.0;\n    }\n    // Last.\n    \
        return sum;\n}\n\nstruct S {\n    // Metres.\n    length: f32,\n    // Seconds.\n    @if(a) time: f32,\n}\n\
        // A block.\n@group(0) @binding(0) var<uniform> block: S;\n";

    #[test]
    fn comments_return_to_their_lines() {
        let linked = "fn add(p: f32, q: f32) -> f32 {\n    let sum = package_common_x_one(p) + q;\n    return sum;\n}\n\n\
            struct S {\n    length: f32,\n    time: f32\n}\n\n@group(0) @binding(0)\nvar<uniform> block: S;\n\n\
            fn package_common_x_one(p: f32) -> f32 {\n    return p;\n}\n";
        let imported = SourceFile::read("/// One.\nfn one(p: f32) -> f32 {\n    // Itself.\n    return p;\n}\n");
        let own = SourceFile::read(SOURCE);
        assert_eq!(own.head, ["// The head", "// of the file."]);
        let files = BTreeMap::from([("own", own), ("common/x", imported)]);
        let text = commented(linked, "own", &files);
        let wanted = "/// Adds.\n/// Twice.\nfn add(p: f32, q: f32) -> f32 {\n    // First.\n    \
            let sum = package_common_x_one(p) + q;\n    // Last.\n    return sum;\n}\n\n\
            struct S {\n    // Metres.\n    length: f32,\n    // Seconds.\n    time: f32\n}\n\n// A block.\n\
            @group(0) @binding(0)\nvar<uniform> block: S;\n\n\
            /// One.\nfn package_common_x_one(p: f32) -> f32 {\n    // Itself.\n    return p;\n}\n";
        assert_eq!(text, wanted);
    }

    #[test]
    fn names_are_found() {
        for (line, name) in [
            ("fn f(a: f32) {", Some("f")),
            ("@compute @workgroup_size(8, 8) fn f() {", Some("f")),
            ("@group(0) @binding(4) var<storage, read_write> grid: array<u32>;", Some("grid")),
            ("@group(0) @binding(4) var depth: texture_2d<f32>;", Some("depth")),
            ("override SLICES: u32;", Some("SLICES")),
            ("const A: f32 = 1.0;", Some("A")),
            ("@must_use", None),
            ("import package::common::view::View;", None),
        ] {
            assert_eq!(declared(line), name, "{line}");
        }
    }
}
