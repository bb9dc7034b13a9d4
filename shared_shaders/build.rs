//! Compiles every shader under `wgsl/` and writes its bindings as a table and as Rust types, so that a mistake in WGSL
//! or in its use fails the build and no binding is declared twice.
#![allow(clippy::disallowed_macros, reason = "a build script talks to cargo on standard output")]

use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use halflight_shader_compiler::{Sources, write_table, write_types};

fn main() -> Result<(), Box<dyn Error>> {
    let sources = Sources::new(PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("wgsl"));
    for path in sources.watched()? {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    let names = sources.shader_names()?;
    let shaders = names.iter().map(|name| sources.compile(name)).collect::<Result<Vec<_>, _>>()?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    write_table(&out, &shaders)?;
    write_types(&out, &shaders)?;
    write_sources(&out, &sources)
}

/// Writes a table of the files as they are. Linked shaders have no comments.
fn write_sources(out: &Path, sources: &Sources) -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("wgsl");
    let mut table = String::from("&[\n");
    for path in sources.watched()?.iter().filter(|path| path.extension().is_some_and(|ending| ending == "wgsl")) {
        let name = path.strip_prefix(&folder)?.with_extension("").to_string_lossy().replace('\\', "/");
        table += &format!("({name:?}, include_str!({:?})),\n", path.to_string_lossy());
    }
    Ok(fs::write(out.join("sources.rs"), table + "]")?)
}
