//! Command lines of the project as data: one type prints and parses every command line that a report, a message, an image
//! file or the viewer shows.
//!
//! ```
//! use halflight_renderer::parameters::{Settings, Value};
//! use halflight_techniques::invocation::Invocation;
//!
//! let settings = Settings::from([("hierarchical.samples".to_owned(), Value::Int(16))]);
//! let shown = Invocation::render("my scenes/room.toml", "hierarchical", &settings, [1280, 720]).option("out", "a.exr");
//! assert_eq!(
//!     shown.to_string(),
//!     "evaluator render --scene 'my scenes/room.toml' --technique hierarchical --set hierarchical.samples=16 \
//!      --size 1280x720 --out a.exr"
//! );
//! assert_eq!(shown.to_string().parse(), Ok(shown));
//! ```

use std::{borrow::Cow, fmt, str::FromStr};

use halflight_renderer::parameters::{Settings, Value};

/// A command line: a program with its subcommand, arguments and options.
///
/// It prints quoted for POSIX shells, and parses what it prints.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Invocation {
    /// Words that name the command: `evaluator render`, `cargo xtask stability`.
    program: Vec<String>,
    /// Positional arguments.
    arguments: Vec<String>,
    /// Options by name without dashes, in order. A flag has no value.
    options: Vec<(String, Option<String>)>,
}

impl Invocation {
    /// `evaluator SUBCOMMAND`.
    pub fn evaluator(subcommand: &str) -> Self {
        Self { program: vec!["evaluator".into(), subcommand.into()], ..Self::default() }
    }

    /// `cargo xtask COMMAND`.
    pub fn xtask(command: &str) -> Self {
        Self { program: vec!["cargo".into(), "xtask".into(), command.into()], ..Self::default() }
    }

    /// `evaluator render` of a technique with these settings. Missing settings have their defaults.
    pub fn render(scene: impl fmt::Display, technique: &str, settings: &Settings, size: [u32; 2]) -> Self {
        Self::evaluator("render").option("scene", scene).technique(technique, settings).size(size)
    }

    /// Adds a positional argument.
    pub fn argument(mut self, value: impl fmt::Display) -> Self {
        self.arguments.push(value.to_string());
        self
    }

    /// Adds the option `--NAME VALUE`.
    pub fn option(mut self, name: &str, value: impl fmt::Display) -> Self {
        self.options.push((name.into(), Some(value.to_string())));
        self
    }

    /// Adds an option if there is a value.
    pub fn option_if(self, name: &str, value: Option<impl fmt::Display>) -> Self {
        match value {
            Some(value) => self.option(name, value),
            None => self,
        }
    }

    /// Adds an option unless its value is the default.
    pub fn option_unless<T: fmt::Display + PartialEq>(self, name: &str, value: T, default: T) -> Self {
        if value == default { self } else { self.option(name, value) }
    }

    /// Adds the flag `--NAME` if it is on.
    pub fn flag(mut self, name: &str, on: bool) -> Self {
        if on {
            self.options.push((name.into(), None));
        }
        self
    }

    /// Adds `--technique NAME` and one `--set KEY=VALUE` for each setting.
    pub fn technique(self, technique: &str, settings: &Settings) -> Self {
        let with_technique = self.option("technique", technique);
        settings.iter().fold(with_technique, |all, (key, value)| all.option("set", format_args!("{key}={value}")))
    }

    /// Adds `--size WIDTHxHEIGHT`, pixels.
    pub fn size(self, [width, height]: [u32; 2]) -> Self {
        self.option("size", format_args!("{width}x{height}"))
    }

    /// Words that name the command.
    pub fn program(&self) -> &[String] {
        &self.program
    }

    /// Positional arguments.
    pub fn arguments(&self) -> &[String] {
        &self.arguments
    }

    /// The value of an option that is given once.
    pub fn value(&self, name: &str) -> Option<&str> {
        self.values(name).next()
    }

    /// The values of an option that may be given many times.
    pub fn values(&self, name: &str) -> impl Iterator<Item = &str> {
        self.options.iter().filter(move |(option, _)| option == name).filter_map(|(_, value)| value.as_deref())
    }

    /// Whether a flag is on.
    pub fn has(&self, name: &str) -> bool {
        self.options.iter().any(|(option, _)| option == name)
    }

    /// The settings of its `--set` options, not checked against their declarations.
    ///
    /// # Errors
    /// If one has no value.
    pub fn settings(&self) -> Result<Settings, InvocationError> {
        let setting = |text: &str| {
            let (key, value) = text
                .split_once('=')
                .ok_or_else(|| InvocationError(format!("--set {text} has no value: write --set {text}=VALUE")))?;
            Ok((key.to_owned(), Value::parse(value)))
        };
        self.values("set").map(setting).collect()
    }

    /// The words as a program receives them, without quotes. The first one is the program.
    pub fn words(&self) -> Vec<String> {
        let mut words = [self.program.as_slice(), &self.arguments].concat();
        for (name, value) in &self.options {
            match value {
                None => words.push(format!("--{name}")),
                // A value that looks like an option must not be parsed as one.
                Some(value) if value.starts_with('-') => words.push(format!("--{name}={value}")),
                Some(value) => words.extend([format!("--{name}"), value.clone()]),
            }
        }
        words
    }
}

impl fmt::Display for Invocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, word) in self.words().iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            write!(f, "{space}{}", quoted(word))?;
        }
        Ok(())
    }
}

/// A word, quoted for POSIX shells if needed.
fn quoted(word: &str) -> Cow<'_, str> {
    fn quote(word: &str) -> Cow<'_, str> {
        // Only a zero byte cannot be quoted, and no operating system passes one to a program.
        shlex::try_quote(word).unwrap_or_default()
    }
    // `shlex` quotes every `=`. Shells interpret it only in the first word and at the start of a word.
    let is_plain = |part: &str| part.is_empty() || matches!(quote(part), Cow::Borrowed(_));
    if !word.starts_with('=') && word.contains('=') && word.split('=').all(is_plain) {
        return Cow::Borrowed(word);
    }
    quote(word)
}

/// Why a text is not a command line of the project: one sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct InvocationError(pub String);

impl FromStr for Invocation {
    type Err = InvocationError;

    fn from_str(text: &str) -> Result<Self, InvocationError> {
        let words = shlex::split(text).ok_or_else(|| InvocationError(format!("a quote is not closed in {text}")))?;
        let named = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["evaluator", _, ..] => 2,
            ["cargo", "xtask", _, ..] => 3,
            _ => {
                return Err(InvocationError(format!(
                    "{text} is not a command of Halflight: begin with evaluator COMMAND or cargo xtask COMMAND"
                )));
            }
        };
        let mut invocation = Self { program: words[..named].to_vec(), ..Self::default() };
        let mut rest = words[named..].iter().peekable();
        while let Some(word) = rest.next() {
            let Some(option) = word.strip_prefix("--") else {
                if invocation.options.is_empty() {
                    invocation.arguments.push(word.clone());
                    continue;
                }
                return Err(InvocationError(format!("{word} belongs to no option: put it before the options")));
            };
            let (name, value) = match option.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (option, rest.next_if(|next| !next.starts_with("--")).cloned()),
            };
            invocation.options.push((name.into(), value));
        }
        Ok(invocation)
    }
}

/// A size written `WIDTHxHEIGHT`, each from 1 to 16384 pixels.
///
/// # Errors
/// A sentence that says how to write it.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some([w @ 1..=16384, h @ 1..=16384]) => Ok([w, h]),
        _ => Err("write WIDTHxHEIGHT, each from 1 to 16384, for example 1280x720".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_parses_back() {
        let settings = Settings::from([
            ("hierarchical.radius".to_owned(), Value::Float(20.5)),
            ("direct.shadow_map_size".to_owned(), Value::Int(512)),
            ("hierarchical.visibility".to_owned(), Value::Text("auto".into())),
        ]);
        for invocation in [
            Invocation::render("scenes/cornell.toml", "hierarchical", &settings, [64, 36]).flag("check", true),
            Invocation::evaluator("compare").argument("a b.exr").argument("c'd.exr").flag("json", true),
            Invocation::evaluator("run").option("grid", "$HOME/*.toml").option("out", "").option("direct", "truth"),
            Invocation::evaluator("render").option("out", "--odd name.exr").option("exposure", -1.5),
            Invocation::xtask("stability").option_if("technique", Some("none")).option_if("row", None::<&str>),
        ] {
            let text = invocation.to_string();
            assert_eq!(text.parse().as_ref(), Ok(&invocation), "{text}");
        }
    }

    #[test]
    fn settings_are_read_back() {
        let settings = Settings::from([
            ("a.number".to_owned(), Value::Float(0.25)),
            ("a.count".to_owned(), Value::Int(-3)),
            ("a.word".to_owned(), Value::Text("x=y".into())),
        ]);
        let invocation = Invocation::render("s.toml", "a", &settings, [1, 2]);
        assert_eq!(invocation.settings(), Ok(settings));
        assert_eq!(invocation.value("size").map(parse_size), Some(Ok([1, 2])));
        assert!(Invocation::evaluator("render").option("set", "samples").settings().is_err());
    }

    #[test]
    fn other_texts_are_refused_with_a_sentence() {
        for text in ["", "evaluator", "rm -rf .", "evaluator render --out 'a", "evaluator plan --json x y"] {
            let refused = text.parse::<Invocation>();
            // A word after an option is its value, like `x` here. The next word has no option.
            assert!(refused.is_err(), "{text}: {refused:?}");
        }
    }

    #[test]
    fn sizes_are_whole_pixels_in_range() {
        assert_eq!(parse_size("1280x720"), Ok([1280, 720]));
        for text in ["", "1280", "0x1", "1x16385", "-1x1", "1.5x2"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
