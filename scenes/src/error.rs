//! The error type of this crate.

/// Why a scene could not be read or written: one sentence that names the file, the line or key, and the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", one_line(.0))]
pub struct SceneError(pub String);

/// The text on one line. Text quoted from a file or a user may hold line breaks and other control characters; they are
/// escaped as in Rust source (`\n`).
pub fn one_line(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn control_characters_are_escaped() {
        let error = super::SceneError("s.toml:3: unknown key `a\n\tb`; use `é`".into());
        assert_eq!(error.to_string(), "s.toml:3: unknown key `a\\n\\tb`; use `é`");
    }
}
