//! Words of WGSL, and the names that the linker gives to imported declarations.

/// How names begin that come from an imported module.
const IMPORTED: &str = "package_";

/// Words of a text, with everything between them.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let word = is_word(first);
        let end = rest.find(|c| is_word(c) != word).unwrap_or(rest.len());
        let (head, tail) = rest.split_at(end);
        rest = tail;
        Some(head)
    })
}

/// The path of an imported name: `package_common_view__1view_position` is `common`, `view`, `view_position`. The linker
/// writes a part that has n underscores of its own as `_n` and the part.
pub(super) fn path_of(name: &str) -> Option<Vec<&str>> {
    let mut rest = name.strip_prefix(IMPORTED)?;
    let mut parts = Vec::new();
    loop {
        let mut underscores = 0;
        if let Some(counted) = rest.strip_prefix('_') {
            let digits = counted.find(|c: char| !c.is_ascii_digit()).unwrap_or(counted.len());
            underscores = counted[..digits].parse().ok()?;
            rest = &counted[digits..];
        }
        let end = rest.match_indices('_').nth(underscores).map_or(rest.len(), |(at, _)| at);
        parts.push(&rest[..end]);
        match rest.get(end + 1..) {
            Some(tail) => rest = tail,
            None => return Some(parts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imported_names_have_paths() {
        assert_eq!(path_of("package_common_view_View"), Some(vec!["common", "view", "View"]));
        assert_eq!(path_of("package_common_view__1view_position"), Some(vec!["common", "view", "view_position"]));
        assert_eq!(
            path_of("package_temporal__1previous_view_PreviousView"),
            Some(vec!["temporal", "previous_view", "PreviousView"])
        );
        assert_eq!(path_of("package_common_view__2uv_of_texel"), Some(vec!["common", "view", "uv_of_texel"]));
        assert_eq!(path_of("view_position"), None);
    }
}
