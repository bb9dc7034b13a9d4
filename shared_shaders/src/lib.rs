//! All WGSL shaders of the project, linked and validated when the crate is built, as a table of bindings and as one
//! Rust type per shader. The crate uses no graphics API.
//!
//! The modules of this crate follow the folders of `wgsl/`. The struct in each of them has a field for every input of a
//! run of the shader: resources, features, the uniform block `params` and pipeline-overridable constants.
//!
//! A run of a shader with all its inputs:
//!
//! ```
//! use halflight_shared_shaders::{Call, ssdo::gather::{Constants, Gather, Params}};
//!
//! let params = Params { scale: 4.0, radius: 1.5, intensity: 1.0 };
//! let constants = Constants { samples: 64, radiometric: true };
//! // Resources may have any type: here they are numbers.
//! let call = Call::from(Gather { surfels: 0, gathered: 1, params, constants });
//! assert_eq!(call.shader.name, "ssdo/gather");
//! ```
//!
//! Five mistakes that do not compile. A missing binding:
//!
//! ```compile_fail,E0063
//! use halflight_shared_shaders::ssdo::gather::{Constants, Gather, Params};
//! let params = Params { scale: 4.0, radius: 1.5, intensity: 1.0 };
//! let constants = Constants { samples: 64, radiometric: true };
//! let run = Gather { surfels: 0, params, constants };
//! ```
//!
//! A misspelled parameter:
//!
//! ```compile_fail,E0560
//! use halflight_shared_shaders::ssdo::gather::Params;
//! let params = Params { scale: 4.0, radios: 1.5, intensity: 1.0 };
//! ```
//!
//! A variant that does not exist:
//!
//! ```compile_fail,E0560
//! use halflight_shared_shaders::composite::Features;
//! let shader = Features { float64: true, ..Features::default() }.shader();
//! ```
//!
//! A field of the wrong type:
//!
//! ```compile_fail,E0308
//! use halflight_shared_shaders::ssdo::gather::Params;
//! let params = Params { scale: 4.0, radius: 1u32, intensity: 1.0 };
//! ```
//!
//! A constant that the shader lacks:
//!
//! ```compile_fail,E0560
//! use halflight_shared_shaders::ssdo::gather::Constants;
//! let constants = Constants { samples: 64, radiometric: true, levels: 4 };
//! ```

mod call;

pub use call::{Call, Constant, UniformValue};

/// A linked WGSL module.
#[derive(Debug, PartialEq)]
pub struct Shader {
    /// Path under `wgsl/` without the extension, then `+feature` for each enabled feature.
    pub name: &'static str,
    /// Plain WGSL.
    pub source: &'static str,
    /// Entry points in source order.
    pub entry_points: &'static [EntryPoint],
    /// Names of the pipeline-overridable constants.
    pub overrides: &'static [&'static str],
}

/// One entry point and the resources that it uses.
#[derive(Debug, PartialEq)]
pub struct EntryPoint {
    /// Function name.
    pub name: &'static str,
    /// Pipeline stage.
    pub stage: Stage,
    /// Invocations of a workgroup along x, y and z; zero outside compute.
    pub workgroup_size: [u32; 3],
    /// Resources that the entry point reaches.
    pub bindings: &'static [Binding],
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
#[derive(Debug, PartialEq)]
pub struct Binding {
    /// Name of the WGSL variable. Resources are bound by this name.
    pub name: &'static str,
    /// Bind group.
    pub group: u32,
    /// Index within the group.
    pub index: u32,
    /// What kind of resource it is.
    pub kind: BindingKind,
}

/// Kind of a resource variable.
#[derive(Debug, PartialEq)]
pub enum BindingKind {
    /// Uniform buffer holding a struct.
    Uniform {
        /// Bytes.
        size: u32,
        /// Fields of the struct.
        members: &'static [Member],
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
    /// Storage texture. The format is naga's name.
    StorageTexture {
        /// Texel format, for example `Rgba16Float`.
        format: &'static str,
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
#[derive(Debug, PartialEq)]
pub struct Member {
    /// Field name.
    pub name: &'static str,
    /// Offset, bytes.
    pub offset: u32,
    /// Size, bytes.
    pub size: u32,
    /// Whether the entry point may read it.
    pub read: bool,
}

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
include!(concat!(env!("OUT_DIR"), "/types.rs"));

/// The files under `wgsl/` as they are written, with their comments, by their path without the ending. The sources of
/// [`SHADERS`] are linked from them.
pub const SOURCES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/sources.rs"));

/// The variant of a shader with these features, in their order; `first` is the index of the one without any.
fn variant(first: usize, features: &[bool]) -> &'static Shader {
    &SHADERS[first + features.iter().rev().fold(0, |bits, &on| 2 * bits + usize::from(on))]
}

/// The shader of this name, for example `hierarchical/gather` or `gbuffer/gbuffer+emitters`.
pub fn shader(name: &str) -> Option<&'static Shader> {
    SHADERS.iter().find(|shader| shader.name == name)
}

impl Shader {
    /// The entry point of this name.
    pub fn entry_point(&self, name: &str) -> Option<&'static EntryPoint> {
        self.entry_points.iter().find(|entry| entry.name == name)
    }

    /// The name without features: the name of the file.
    pub fn file(&self) -> &'static str {
        self.name.split('+').next().unwrap_or(self.name)
    }

    /// Distinct resources of all entry points.
    pub fn bindings(&self) -> impl Iterator<Item = &'static Binding> {
        let entries = self.entry_points;
        entries.iter().enumerate().flat_map(move |(index, entry)| {
            let before = &entries[..index];
            let known = move |name| before.iter().flat_map(|entry| entry.bindings).any(|other| other.name == name);
            entry.bindings.iter().filter(move |binding| !known(binding.name))
        })
    }
}
