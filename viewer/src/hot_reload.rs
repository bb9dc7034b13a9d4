//! Hot reload of shaders: compiles the shaders that a changed WGSL file reaches while the viewer runs.
//!
//! Enabled by the feature `hot-reload`, which is meant for work on shaders. The files are those that the program was
//! built from. A shader must keep its entry points, bindings and constants: the program was built for them.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, SystemTime},
};

use eframe::egui::Context;
use halflight_shader_compiler::{Error, Shader, Sources};

/// The folder of the shaders that the program was built from.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared_shaders/wgsl");

/// Time between two looks at the files.
const INTERVAL: Duration = Duration::from_millis(300);

/// Names of shaders with their new source, or the reason why the old one stays in use.
pub type Changes = Vec<(String, Result<String, String>)>;

/// Watches the shader files in a thread. The receiver gets the changes; each one also requests a pass of the interface.
pub fn watch(ctx: Context) -> Receiver<Result<Changes, String>> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut files = match ShaderFiles::new(Path::new(FOLDER)) {
            Ok(files) => files,
            Err(error) => return drop(sender.send(Err(error.to_string()))),
        };
        loop {
            let changes = files.poll();
            if !changes.is_empty() {
                // The receiver is gone after the viewer was closed.
                if sender.send(Ok(changes)).is_err() {
                    return;
                }
                ctx.request_repaint();
            }
            thread::sleep(INTERVAL);
        }
    });
    receiver
}

/// Time of the last change and size of a file; `None` while it does not exist.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Shader files and what was compiled from them.
struct ShaderFiles {
    sources: Sources,
    shaders: Vec<Known>,
    stamps: HashMap<PathBuf, Stamp>,
}

/// A shader, with the files that it was last compiled from.
struct Known {
    name: String,
    files: Vec<PathBuf>,
    /// The first compilation. Its interface is the one that the program was built for.
    built: Shader,
}

impl ShaderFiles {
    /// Compiles all shaders of a folder.
    ///
    /// # Errors
    /// A file that cannot be read, or a shader that cannot be compiled.
    fn new(folder: &Path) -> Result<Self, Error> {
        let read = |error| Error::Read { path: folder.to_owned(), error };
        let sources = Sources::new(folder.canonicalize().map_err(read)?);
        let stamps = sources.watched()?.into_iter().map(|path| (path.clone(), stamp(&path))).collect();
        let known = |name: String| {
            let built = sources.compile(&name)?;
            Ok(Known { name, files: built.files.clone(), built })
        };
        let shaders = sources.shader_names()?.into_iter().map(known).collect::<Result<_, Error>>()?;
        Ok(Self { sources, shaders, stamps })
    }

    /// Compiles the shaders that were changed since the last call.
    fn poll(&mut self) -> Changes {
        let mut changed = Vec::new();
        for (path, known) in &mut self.stamps {
            let now = stamp(path);
            // Some editors remove a file before they write it again.
            if now.is_some() && now != *known && path.is_file() {
                *known = now;
                changed.push(path.clone());
            }
        }
        let reached = self.shaders.iter_mut().filter(|shader| shader.files.iter().any(|file| changed.contains(file)));
        let mut changes = Vec::new();
        for shader in reached {
            let source = match self.sources.compile(&shader.name) {
                Ok(new) if new.entry_points == shader.built.entry_points && new.overrides == shader.built.overrides => {
                    for file in &new.files {
                        self.stamps.entry(file.clone()).or_insert_with(|| stamp(file));
                    }
                    shader.files = new.files;
                    Ok(new.source)
                }
                Ok(_) => Err(format!(
                    "{}: the entry points, bindings or constants have changed; build the program again",
                    shader.name
                )),
                Err(error) => Err(error.to_string()),
            };
            changes.push((shader.name.clone(), source));
        }
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULE: &str = "fn value() -> f32 { return 1.0; }\n";
    const SHADER: &str = "import package::module::value;\n@group(0) @binding(0) var<storage, read_write> out: array<f32>;\n\
                          @compute @workgroup_size(1) fn main() { out[0] = value(); }\n";

    #[test]
    fn a_changed_file_recompiles_the_shaders_that_it_reaches() {
        let folder = std::env::temp_dir().join(format!("halflight-hot-reload-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a temporary folder");
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a temporary file");
        write("module.wgsl", MODULE);
        write("uses.wgsl", SHADER);
        write("other.wgsl", "@compute @workgroup_size(1) fn main() {}\n");
        let mut files = ShaderFiles::new(&folder).expect("valid shaders");
        assert!(files.poll().is_empty());

        // A change of an imported module reaches the shader that imports it, and no other.
        write("module.wgsl", "fn value() -> f32 { return 22.0; }\n");
        let changes = files.poll();
        let [(name, Ok(source))] = changes.as_slice() else { panic!("{changes:?}") };
        assert!(name == "uses" && source.contains("22.0"), "{source}");
        assert!(files.poll().is_empty());

        // A mistake is reported once, with the name of the shader; the next version is compiled again.
        write("module.wgsl", "fn value() -> f32 { return true; }\n");
        let changes = files.poll();
        let [(name, Err(error))] = changes.as_slice() else { panic!("{changes:?}") };
        assert!(name == "uses" && error.contains("uses"), "{error}");
        assert!(files.poll().is_empty());
        write("module.wgsl", "fn value() -> f32 { return 333.0; }\n");
        assert!(files.poll()[0].1.as_ref().is_ok_and(|source| source.contains("333.0")));

        // Other bindings need a new build.
        write("uses.wgsl", &SHADER.replace("binding(0)", "binding(17)"));
        assert!(files.poll()[0].1.as_ref().is_err_and(|error| error.contains("build the program again")));
        fs::remove_dir_all(&folder).expect("the temporary folder is removed");
    }
}
