//! Addresses of the viewer: `scene=atrium&size=1280x720&a=bitmask&a.bitmask.steps=16`. The viewer reads and writes the
//! whole of them; this module writes the parts that other programs need.

use std::fmt::Write;

use halflight_renderer::parameters::Settings;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

/// Characters that are percent-encoded: all that have a meaning in an address.
const ENCODED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.').remove(b',');

/// A text as a part of an address.
pub fn escape(text: &str) -> String {
    utf8_percent_encode(text, ENCODED).to_string()
}

/// The first parts: a bundled scene by its name, and the size in pixels.
pub fn scene(name: &str, [width, height]: [u32; 2]) -> String {
    format!("scene={}&size={width}x{height}", escape(name))
}

/// The parts of a side, `a` or `b`, each with a `&` before it: the technique, if it is not the viewer's default, and the
/// settings.
pub fn side(name: &str, technique: Option<&str>, settings: &Settings) -> String {
    let mut text = technique.map_or_else(String::new, |technique| format!("&{name}={technique}"));
    for (key, value) in settings {
        // Writing to a String cannot fail.
        let _ = write!(text, "&{name}.{}={}", escape(key), escape(&value.to_string()));
    }
    text
}
