//! Links every shader, validates it for the WebGPU baseline and writes it down together with what
//! it binds, so that a mistake in WGSL fails the build and no binding is ever typed twice.
//!
//! Every `.wgsl` file under `wgsl/` with an entry point is a shader; the others are modules to
//! import. A first line `// variants: a, b` asks for one shader for each combination of the
//! WESL features `a` and `b`, named `file`, `file+a`, `file+b` and `file+a+b`.
#![allow(clippy::disallowed_macros, reason = "a build script talks to cargo on standard output")]

use std::{
    env,
    error::Error,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use naga::{AddressSpace, ImageClass, ShaderStage, TypeInner, proc::GlobalCtx, valid};

/// Limits that every browser grants (WebGPU's defaults), per shader stage.
const MAX_STORAGE_TEXTURES: usize = 4;
const MAX_STORAGE_BUFFERS: usize = 8;
const MAX_SAMPLED_TEXTURES: usize = 16;
const MAX_INVOCATIONS: u32 = 256;

/// Storage texture formats that WebGPU guarantees for writing.
const STORAGE_FORMATS: [&str; 8] =
    ["R32Float", "R32Uint", "Rgba8Unorm", "Rgba16Float", "Rgba32Float", "Rgba32Uint", "Rgba16Uint", "Rg32Float"];

fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("wgsl");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rerun-if-changed={}", root.display());
    let mut files = Vec::new();
    collect(&root, &mut files)?;
    files.sort();
    let mut list = String::from("/// Every shader, by name.\npub static SHADERS: &[Shader] = &[\n");
    for file in &files {
        println!("cargo::rerun-if-changed={}", file.display());
        let text = fs::read_to_string(file)?;
        if !["@compute", "@vertex", "@fragment"].iter().any(|stage| text.contains(stage)) {
            continue;
        }
        let name = file.strip_prefix(&root)?.with_extension("").to_string_lossy().replace('\\', "/");
        for variant in variants(&text) {
            let name = variant.iter().fold(name.clone(), |name, feature| format!("{name}+{feature}"));
            let source = link(&root, &name, &variant)?;
            let path = out.join(format!("{}.wgsl", name.replace('/', "__")));
            fs::write(&path, &source)?;
            write_shader(&mut list, &name, &path, &source).map_err(|e| format!("{name}: {e}"))?;
        }
    }
    list.push_str("];\n");
    fs::write(out.join("shaders.rs"), list)?;
    Ok(())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            println!("cargo::rerun-if-changed={}", path.display());
            collect(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            files.push(path);
        }
    }
    Ok(())
}

/// All subsets of the features that the first line names.
fn variants(text: &str) -> Vec<Vec<String>> {
    let names: Vec<String> = text
        .lines()
        .next()
        .and_then(|line| line.strip_prefix("// variants:"))
        .map(|list| list.split(',').map(|name| name.trim().to_owned()).collect())
        .unwrap_or_default();
    (0..1usize << names.len())
        .map(|bits| names.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, n)| n.clone()).collect())
        .collect()
}

fn link(root: &Path, name: &str, features: &[String]) -> Result<String, Box<dyn Error>> {
    let file = name.split('+').next().unwrap_or(name);
    let module = format!("package::{}", file.replace('/', "::")).parse()?;
    let mut compiler = wesl::Wesl::new(root);
    compiler.set_missing_feature_behavior(false);
    for feature in features {
        compiler.set_feature(feature, true);
    }
    Ok(compiler.compile(&module).map_err(|e| format!("{name}: {e}"))?.to_string())
}

fn write_shader(list: &mut String, name: &str, path: &Path, source: &str) -> Result<(), Box<dyn Error>> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    // What a browser guarantees: no native-only capability.
    let info = valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32)
        .validate(&module)
        .map_err(|e| e.emit_to_string(source))?;
    writeln!(
        list,
        "Shader {{ name: {name:?}, source: include_str!({:?}), entry_points: &[",
        path.display().to_string()
    )?;
    for (index, entry) in module.entry_points.iter().enumerate() {
        let size = entry.workgroup_size;
        if entry.stage == ShaderStage::Compute && size.iter().product::<u32>() > MAX_INVOCATIONS {
            return Err(
                format!("{} has a workgroup of {size:?}; a browser guarantees {MAX_INVOCATIONS}", entry.name).into()
            );
        }
        writeln!(
            list,
            "EntryPoint {{ name: {:?}, stage: Stage::{:?}, workgroup_size: {size:?}, bindings: &[",
            entry.name, entry.stage
        )?;
        let (mut storage_textures, mut storage_buffers, mut sampled) = (0, 0, 0);
        for (handle, variable) in module.global_variables.iter() {
            let (Some(binding), Some(name)) = (&variable.binding, &variable.name) else { continue };
            if info.get_entry_point(index)[handle].is_empty() {
                continue;
            }
            let inner = &module.types[variable.ty].inner;
            let kind = match (variable.space, inner) {
                (AddressSpace::Uniform, TypeInner::Struct { members, span }) => {
                    let mut text = format!("BindingKind::Uniform {{ size: {span}, members: &[");
                    for member in members {
                        let inner = &module.types[member.ty].inner;
                        write!(
                            text,
                            "Member {{ name: {:?}, offset: {}, size: {} }},",
                            member.name.as_deref().unwrap_or_default(),
                            member.offset,
                            inner.size(GlobalCtx {
                                types: &module.types,
                                constants: &module.constants,
                                overrides: &module.overrides,
                                global_expressions: &module.global_expressions
                            })
                        )?;
                    }
                    text + "] }"
                }
                (AddressSpace::Storage { access }, _) => {
                    storage_buffers += 1;
                    format!("BindingKind::Storage {{ writable: {} }}", access.contains(naga::StorageAccess::STORE))
                }
                (AddressSpace::Handle, TypeInner::Image { class: ImageClass::Storage { format, .. }, .. }) => {
                    storage_textures += 1;
                    let format = format!("{format:?}");
                    if !STORAGE_FORMATS.contains(&format.as_str()) {
                        return Err(format!("{name} has format {format}, which no browser guarantees").into());
                    }
                    format!("BindingKind::StorageTexture {{ format: {format:?} }}")
                }
                (AddressSpace::Handle, TypeInner::Image { arrayed, .. }) => {
                    sampled += 1;
                    format!("BindingKind::Texture {{ arrayed: {arrayed} }}")
                }
                (AddressSpace::Handle, TypeInner::Sampler { comparison }) => {
                    format!("BindingKind::Sampler {{ comparison: {comparison} }}")
                }
                _ => return Err(format!("{name}: bind a struct as uniform, a buffer, a texture or a sampler").into()),
            };
            // Names of an imported module carry its path; such variables are named by one word.
            let name = if name.starts_with("package_") { name.rsplit('_').next().unwrap_or(name) } else { name };
            writeln!(
                list,
                "Binding {{ name: {name:?}, group: {}, index: {}, kind: {kind} }},",
                binding.group, binding.binding
            )?;
        }
        for (count, most, what) in [
            (storage_textures, MAX_STORAGE_TEXTURES, "storage textures"),
            (storage_buffers, MAX_STORAGE_BUFFERS, "storage buffers"),
            (sampled, MAX_SAMPLED_TEXTURES, "sampled textures"),
        ] {
            if count > most {
                return Err(format!("{} uses {count} {what}; a browser guarantees {most}", entry.name).into());
            }
        }
        writeln!(list, "] }},")?;
    }
    let overrides: Vec<_> = module.overrides.iter().filter_map(|(_, o)| o.name.clone()).collect();
    writeln!(list, "], overrides: &{overrides:?} }},")?;
    Ok(())
}
