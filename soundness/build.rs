//! Compiles the shaders of the tests, which import those that ship.
#![allow(clippy::disallowed_macros, reason = "a build script talks to cargo on standard output")]

use std::{env, error::Error, path::PathBuf};

use halflight_shader_compiler::{Sources, write_table};

fn main() -> Result<(), Box<dyn Error>> {
    let own = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let sources = Sources::new(own.join("wgsl")).or_from(own.join("../shared_shaders/wgsl"));
    let shader = sources.compile("pairs+visibility")?;
    for path in sources.watched()? {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    write_table(&PathBuf::from(env::var("OUT_DIR")?), &[shader])?;
    Ok(())
}
