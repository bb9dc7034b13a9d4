//! The one error type of this crate.

/// Why a scene could not be read: one sentence that names the file, the line or key, and the mend.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", one_line(.0))]
pub struct SceneError(pub String);

/// The text as one line: what a file or a user gave may hold line breaks and other control characters, which are written
/// as Rust writes them (`\n`).
pub fn one_line(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_sentence_is_one_line_whatever_it_quotes() {
        let error = super::SceneError("s.toml:3: unknown key `a\n\tb`; use `é`".into());
        assert_eq!(error.to_string(), "s.toml:3: unknown key `a\\n\\tb`; use `é`");
    }
}
