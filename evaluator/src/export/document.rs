//! What plan.json says: the types that are written, field by field. docs/export.md describes the format for readers, and
//! js/plan.schema.json holds it.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::rules::{Side, Squares};

/// Version of the format. A player refuses others.
pub const VERSION: u32 = 1;

/// A plan for other engines.
#[derive(Clone, Debug, Serialize)]
pub struct Document {
    /// [`VERSION`].
    pub version: u32,
    /// Program and commit that wrote it.
    pub program: String,
    /// The command that writes it again.
    pub command: String,
    /// Name of the technique.
    pub technique: &'static str,
    /// The technique in one sentence.
    pub summary: &'static str,
    /// Sizes of the display for which it is valid.
    pub display: Display,
    /// What a user of the plan must know, one sentence each.
    pub notes: Vec<String>,
    /// Every setting of the technique.
    pub settings: Vec<Setting>,
    /// Textures that the caller provides.
    pub inputs: Vec<Input>,
    /// Results.
    pub outputs: Vec<Output>,
    /// Textures that the player makes.
    pub textures: Vec<Texture>,
    /// Pairs of textures that swap roles after every frame.
    pub histories: Vec<HistoryPair>,
    /// Uniform blocks.
    pub uniforms: Vec<Block>,
    /// Passes in order.
    pub passes: Vec<Pass>,
}

/// Sizes of the display for which a plan is valid.
#[derive(Clone, Debug, Serialize)]
pub struct Display {
    /// Width and height that it was exported for, pixels.
    pub exported: [u32; 2],
    /// `any`, or `exported` if it is valid for this size alone.
    pub valid: &'static str,
    /// Why it is valid for one size alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// A setting of the technique.
#[derive(Clone, Debug, Serialize)]
pub struct Setting {
    /// Name.
    pub name: &'static str,
    /// Value.
    pub value: Value,
    /// Its meaning.
    pub doc: &'static str,
    /// Unit; `1` for a pure number, empty for choices.
    pub unit: &'static str,
    /// What a change of it takes.
    pub change: Change,
    /// Allowed values of a live setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
}

/// What a change of a setting takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// Other numbers in uniform blocks: the player may change it at once.
    Live,
    /// Other passes, textures or shaders: it needs another export.
    Export,
    /// Nothing: no pass of this plan depends on it.
    None,
}

/// Allowed values of a setting.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Range {
    /// Smallest value.
    pub at_least: f64,
    /// Largest value.
    pub at_most: f64,
    /// Whether the smallest value itself is not allowed, because the plan has other passes there.
    pub above: bool,
    /// Whether only whole numbers are allowed.
    pub whole: bool,
}

/// A texture of the caller.
#[derive(Clone, Debug, Serialize)]
pub struct Input {
    /// Name, as bindings use it.
    pub name: String,
    /// What its texels are, with units.
    pub doc: &'static str,
    /// Formats that hold it without loss of what matters. Any format with these channels can be bound.
    pub formats: &'static [&'static str],
}

/// A result.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// Name.
    pub name: &'static str,
    /// The texture that holds it after a frame.
    pub texture: String,
    /// What its texels are, with units.
    pub doc: &'static str,
}

/// A texture of the player.
#[derive(Clone, Debug, Serialize)]
pub struct Texture {
    /// Name.
    pub name: String,
    /// Format, as WebGPU names it.
    pub format: String,
    /// Width and height, texels.
    pub size: [Side; 2],
    /// Array layers.
    pub layers: u32,
    /// Mip levels.
    pub mips: u32,
    /// Usages that passes need, as WebGPU names them.
    pub usage: Vec<&'static str>,
    /// Why the plan has it.
    pub reason: String,
}

/// Two textures that swap roles after every frame.
#[derive(Clone, Debug, Serialize)]
pub struct HistoryPair {
    /// The texture that this frame writes, completely.
    pub now: String,
    /// What the previous frame wrote.
    pub before: String,
}

/// A uniform block.
#[derive(Clone, Debug, Serialize)]
pub struct Block {
    /// Name.
    pub name: String,
    /// Bytes.
    pub size: u32,
    /// Fields.
    pub fields: Vec<Field>,
}

/// A field of a uniform block.
#[derive(Clone, Debug, Serialize)]
pub struct Field {
    /// Name in the shader.
    pub name: &'static str,
    /// Offset, bytes.
    pub offset: u32,
    /// WGSL type.
    #[serde(rename = "type")]
    pub wgsl_type: &'static str,
    /// Where its value comes from.
    #[serde(flatten)]
    pub source: Source,
}

/// Where the value of a field comes from.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Source {
    /// The player knows it in every frame.
    Frame {
        /// Which value: `camera.world_to_view`, `frame.number` and so on.
        from: &'static str,
    },
    /// A number of the plan.
    Plan {
        /// At the exported size, with the exported settings.
        value: Value,
        /// At other sizes.
        #[serde(skip_serializing_if = "Option::is_none")]
        by_size: Option<Squares>,
        /// At other values of a setting.
        #[serde(skip_serializing_if = "Option::is_none")]
        by_setting: Option<BySetting>,
    },
}

/// How a number follows a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BySetting {
    /// Name of the setting.
    pub setting: &'static str,
    /// The function of its value.
    #[serde(flatten)]
    pub function: Function,
    /// The number at a value of 0, if the function does not give it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_zero: Option<AtZero>,
}

/// A function of a setting's value v.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Function {
    /// `times * v^power`.
    Power {
        /// Factor.
        times: f64,
        /// Exponent: 1 or 2.
        power: i32,
    },
    /// Number of frames after which this share remains: the least whole number n with `v^n <= share`.
    FramesUntil(f64),
}

/// A number at a setting of 0, which stands for a default.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AtZero {
    /// The same at all sizes.
    Number(f64),
    /// A function of the display's size.
    BySize(Squares),
}

/// A pass.
#[derive(Clone, Debug, Serialize)]
pub struct Pass {
    /// Unique name.
    pub name: String,
    /// Why the plan has it.
    pub reason: String,
    /// File of its shader, relative to plan.json.
    pub shader: String,
    /// Entry point.
    pub entry: &'static str,
    /// Values of pipeline-overridable constants.
    pub constants: BTreeMap<&'static str, f64>,
    /// Invocations of a workgroup along x, y and z.
    pub workgroup_size: [u32; 3],
    /// Number of workgroups along x and y.
    pub workgroups: [Side; 2],
    /// Work of one invocation, in fetches of a texel. A player may divide a dispatch that would take too long.
    pub work: u64,
    /// What its shader binds.
    pub bindings: Vec<Binding>,
}

/// A resource variable of a shader.
#[derive(Clone, Debug, Serialize)]
pub struct Binding {
    /// Name of the variable.
    pub name: &'static str,
    /// Bind group.
    pub group: u32,
    /// Index within the group.
    pub index: u32,
    /// What is bound.
    #[serde(flatten)]
    pub resource: Bound,
}

/// What is bound to a variable.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Bound {
    /// A texture that the shader reads.
    Texture {
        /// Name of a texture or an input.
        texture: String,
        /// `2d` or `2d-array`.
        dimension: &'static str,
    },
    /// A texture that the shader writes.
    StorageTexture {
        /// Name of a texture.
        texture: String,
        /// `write-only`.
        access: &'static str,
    },
    /// A uniform block.
    Uniform {
        /// Name of a block.
        block: String,
    },
    /// A sampler.
    Sampler {
        /// Filter of magnification and minification.
        filter: &'static str,
    },
}
