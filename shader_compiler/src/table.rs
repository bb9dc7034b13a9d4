//! Compiled shaders as Rust source: a table of the types of `halflight-shared-shaders`.

use std::{
    fmt::{self, Write},
    fs, io,
    path::Path,
};

use crate::{BindingKind, Member, Shader};

/// Writes each shader's WGSL into `folder`, and `shaders.rs` with `pub static SHADERS: &[Shader]`, for a build script
/// whose crate includes it beside the types of `halflight-shared-shaders`.
///
/// # Errors
/// Where a file cannot be written.
pub fn write_table(folder: &Path, shaders: &[Shader]) -> io::Result<()> {
    let mut table = String::from("/// Every shader, sorted by file.\npub static SHADERS: &[Shader] = &[\n");
    for shader in shaders {
        let path = folder.join(format!("{}.wgsl", shader.name.replace('/', "__")));
        fs::write(&path, &shader.source)?;
        write_shader(&mut table, shader, &path.display().to_string()).map_err(io::Error::other)?;
    }
    table.push_str("];\n");
    fs::write(folder.join("shaders.rs"), table)
}

fn write_shader(table: &mut String, shader: &Shader, path: &str) -> fmt::Result {
    writeln!(table, "Shader {{ name: {:?}, source: include_str!({path:?}), entry_points: &[", shader.name)?;
    for entry in &shader.entry_points {
        let (name, stage, size) = (&entry.name, entry.stage, entry.workgroup_size);
        writeln!(
            table,
            "EntryPoint {{ name: {name:?}, stage: Stage::{stage:?}, workgroup_size: {size:?}, bindings: &["
        )?;
        for binding in &entry.bindings {
            write!(
                table,
                "Binding {{ name: {:?}, group: {}, index: {}, kind: BindingKind::",
                binding.name, binding.group, binding.index
            )?;
            match &binding.kind {
                BindingKind::Uniform { size, members } => {
                    write!(table, "Uniform {{ size: {size}, members: &[")?;
                    for member in members {
                        let Member { name, offset, size, read, .. } = member;
                        write!(table, "Member {{ name: {name:?}, offset: {offset}, size: {size}, read: {read} }},")?;
                    }
                    write!(table, "] }}")?;
                }
                // These print as Rust source.
                other => write!(table, "{other:?}")?,
            }
            writeln!(table, " }},")?;
        }
        writeln!(table, "] }},")?;
    }
    let overrides: Vec<&str> = shader.overrides.iter().map(|constant| constant.name.as_str()).collect();
    writeln!(table, "], overrides: &{overrides:?} }},")
}
