//! Links WGSL modules, validates the result for the WebGPU baseline and describes what it found.
//!
//! Build scripts use it to compile every shader of the project; a program may use it to compile a changed shader while
//! it runs. A shader that a browser would refuse is an error here, with the reason.
//!
//! Every `.wgsl` file with an entry point is a shader; the others are modules to import. A first line
//! `// variants: a, b` declares the WESL features `a` and `b`: the file is then one shader for each combination of them,
//! named `file`, `file+a`, `file+b` and `file+a+b`.
//!
//! ```no_run
//! use halflight_shader_compiler::Sources;
//!
//! let sources = Sources::new("shared_shaders/wgsl");
//! match sources.compile("direct/direct_light+emitters") {
//!     Ok(shader) => println!("{} overrides\n{}", shader.overrides.len(), shader.source),
//!     Err(error) => eprintln!("{error}"),
//! }
//! ```

use std::path::PathBuf;

mod reflect;
mod sources;
mod table;
mod types;

pub use sources::Sources;
pub use table::write_table;
pub use types::write_types;

/// A linked and validated WGSL module with its reflection.
#[derive(Clone, Debug, PartialEq)]
pub struct Shader {
    /// Path under the source folder without the ending, then `+feature` for each feature that is on.
    pub name: String,
    /// Plain WGSL.
    pub source: String,
    /// Files that the source was linked from: the shader's own and those that it imports, sorted.
    pub files: Vec<PathBuf>,
    /// Entry points in source order.
    pub entry_points: Vec<EntryPoint>,
    /// Pipeline-overridable constants.
    pub overrides: Vec<Override>,
}

/// One entry point and the resources that it uses.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryPoint {
    /// Function name.
    pub name: String,
    /// Pipeline stage.
    pub stage: Stage,
    /// Invocations of a workgroup along x, y and z; zero outside compute.
    pub workgroup_size: [u32; 3],
    /// Resources that the entry point reaches.
    pub bindings: Vec<Binding>,
}

/// Pipeline stage of an entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Vertex shader.
    Vertex,
    /// Fragment shader.
    Fragment,
    /// Compute shader.
    Compute,
}

/// One resource variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// Name of the WGSL variable. Of a variable that comes from an imported module, the last word of its name.
    pub name: String,
    /// Bind group.
    pub group: u32,
    /// Index within the group.
    pub index: u32,
    /// Kind of resource.
    pub kind: BindingKind,
}

/// Kind of a resource variable.
#[derive(Clone, Debug, PartialEq)]
pub enum BindingKind {
    /// Uniform buffer that holds a struct.
    Uniform {
        /// Bytes.
        size: u32,
        /// Fields of the struct.
        members: Vec<Member>,
    },
    /// Storage buffer.
    Storage {
        /// Whether the shader may write to it.
        writable: bool,
    },
    /// Sampled or loaded texture.
    Texture {
        /// Whether it is an array of textures.
        arrayed: bool,
    },
    /// Storage texture.
    StorageTexture {
        /// Texel format by naga's name, for example `Rgba16Float`.
        format: String,
        /// Whether the shader may write to it.
        writable: bool,
    },
    /// Sampler.
    Sampler {
        /// Whether it compares depths.
        comparison: bool,
    },
}

/// A field of a uniform struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Field name.
    pub name: String,
    /// Offset, bytes.
    pub offset: u32,
    /// Size, bytes.
    pub size: u32,
    /// WGSL type, for example `f32`, `vec2<f32>` or `mat4x4<f32>`; empty for arrays and structs.
    pub wgsl_type: String,
    /// Whether the entry point may read it.
    pub read: bool,
}

/// A pipeline-overridable constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Name of the constant.
    pub name: String,
    /// WGSL type: `bool`, `i32`, `u32` or `f32`.
    pub wgsl_type: String,
    /// Value that it has unless a pipeline sets another one (a boolean is 0 or 1); `None` where it must be set or is
    /// computed.
    pub default: Option<f64>,
}

/// Why a shader was not compiled.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A folder or file that cannot be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The folder or file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A name that no shader can have.
    #[error(
        "{0} is not a shader name: write the path under the source folder without its ending, then +feature for each feature"
    )]
    Name(String),
    /// Imports or conditions that cannot be resolved.
    #[error("{shader}: {message}")]
    Link {
        /// Name of the shader.
        shader: String,
        /// What the linker reported, with file and line.
        message: String,
    },
    /// WGSL with a mistake, or one that needs what WebGPU does not guarantee.
    #[error("{shader}: {message}")]
    Invalid {
        /// Name of the shader.
        shader: String,
        /// What the validator reported, with the line of the linked source.
        message: String,
    },
}
