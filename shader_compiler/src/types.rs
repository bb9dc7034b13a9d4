//! Compiled shaders as Rust types: for each shader file a module with a struct whose fields are everything that one run of
//! it takes. What a caller forgets, misspells or gives with the wrong type does not compile.

use std::{
    collections::BTreeMap,
    fmt::{self, Write},
    fs, io,
    path::Path,
};

use crate::{Binding, BindingKind, Shader};

/// Uniform blocks that the frame graph fills by itself.
const BLOCKS_OF_THE_GRAPH: [&str; 3] = ["view", "previous", "division"];

/// Name of the uniform block that holds a pass's own numbers.
const PARAMS: &str = "params";

/// Writes `types.rs` into `folder`: nested modules by the shaders' paths, for a crate that includes it beside the table of
/// [`crate::write_table`] and the types of `halflight-shared-shaders`. `shaders` are those of the table, in its order: all
/// variants of a file in a row, the one without features first.
///
/// # Errors
/// Where the file cannot be written, or a shader has what no Rust type stands for.
pub fn write_types(folder: &Path, shaders: &[Shader]) -> io::Result<()> {
    let mut root = Module::default();
    let mut first = 0;
    while first < shaders.len() {
        let file = file_of(&shaders[first]);
        let count = shaders[first..].iter().take_while(|shader| file_of(shader) == file).count();
        let text = File::new(file, first, &shaders[first..first + count])
            .and_then(|file| file.to_rust().map_err(|e| e.to_string()))
            .map_err(|message| io::Error::other(format!("{file}: {message}")))?;
        root.insert(file, text);
        first += count;
    }
    fs::write(folder.join("types.rs"), root.to_string())
}

/// Modules within modules, as the folders of the shaders.
#[derive(Default)]
struct Module {
    contents: String,
    inner: BTreeMap<String, Module>,
}

impl Module {
    fn insert(&mut self, path: &str, contents: String) {
        let mut words: Vec<&str> = path.split('/').collect();
        // `sky/sky` is the module `sky`.
        words.dedup();
        let module = words.iter().fold(self, |module, word| module.inner.entry(snake_case(word)).or_default());
        module.contents = contents;
    }
}

impl fmt::Display for Module {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.contents)?;
        for (name, module) in &self.inner {
            if module.contents.is_empty() {
                writeln!(f, "/// Shaders of the folder `{name}`.")?;
            }
            writeln!(f, "pub mod {name} {{\n{module}}}")?;
        }
        Ok(())
    }
}

/// A shader file with all its variants.
struct File<'a> {
    name: &'a str,
    /// Index of its first variant in the table.
    first: usize,
    features: Vec<&'a str>,
    /// Resources by name, with the variants that have them.
    bindings: Vec<(&'a str, Presence)>,
    /// Fields of the uniform block, with their WGSL types.
    params: Vec<(&'a str, &'a str, Presence)>,
    constants: Vec<(&'a str, &'a str, Presence)>,
}

/// Which variants have something: one bit a variant, by the bits of its features.
#[derive(Clone, Copy, PartialEq)]
struct Presence {
    variants: u64,
    of: usize,
}

impl Presence {
    fn always(self) -> bool {
        self.variants.count_ones() as usize == self.of
    }

    /// Whether the variants are those that have this feature.
    fn is_feature(self, feature: usize) -> bool {
        (0..self.of).all(|variant| (variant >> feature & 1 == 1) == (self.variants >> variant & 1 == 1))
    }
}

/// What stands in a field of the main struct.
enum Field<'a> {
    /// A resource of every variant.
    Always(&'a str),
    /// A resource of some variants, which none of the features alone decides.
    Sometimes(&'a str),
    /// A feature that brings one resource.
    Resource { feature: &'a str, binding: &'a str },
    /// A feature that brings several resources.
    Group { feature: &'a str, bindings: Vec<&'a str> },
    /// A feature that brings none by itself.
    Flag(&'a str),
}

impl<'a> File<'a> {
    fn new(name: &'a str, first: usize, variants: &'a [Shader]) -> Result<Self, String> {
        if !variants.len().is_power_of_two() || variants.len() > 64 {
            return Err(format!("{} variants are not all combinations of at most six features", variants.len()));
        }
        let features = variants.last().into_iter().flat_map(|all| all.name.split('+').skip(1)).collect();
        let mut file = Self { name, first, features, bindings: Vec::new(), params: Vec::new(), constants: Vec::new() };
        let of = variants.len();
        for (variant, shader) in variants.iter().enumerate() {
            let seen = Presence { variants: 1 << variant, of };
            for binding in shader.entry_points.iter().flat_map(|entry| &entry.bindings) {
                file.add(binding, seen)?;
            }
            for constant in &shader.overrides {
                add(&mut file.constants, &constant.name, &constant.wgsl_type, seen)?;
            }
        }
        Ok(file)
    }

    fn add(&mut self, binding: &'a Binding, seen: Presence) -> Result<(), String> {
        match &binding.kind {
            BindingKind::Sampler { .. } => {}
            BindingKind::Uniform { .. } if BLOCKS_OF_THE_GRAPH.contains(&binding.name.as_str()) => {}
            BindingKind::Uniform { members, .. } if binding.name == PARAMS => {
                // Padding has no name that people give.
                for member in members.iter().filter(|member| !member.name.starts_with("unused")) {
                    add(&mut self.params, &member.name, &member.wgsl_type, seen)?;
                }
            }
            _ => match self.bindings.iter_mut().find(|(name, _)| *name == binding.name) {
                Some((_, presence)) => presence.variants |= seen.variants,
                None => self.bindings.push((&binding.name, seen)),
            },
        }
        Ok(())
    }

    /// The fields of the main struct: what every variant binds, then the features, then the rest.
    fn fields(&self) -> Vec<Field<'a>> {
        let of_feature = |feature| {
            let own =
                self.bindings.iter().filter(move |(_, presence)| !presence.always() && presence.is_feature(feature));
            own.map(|&(name, _)| name).collect::<Vec<_>>()
        };
        let always =
            self.bindings.iter().filter(|(_, presence)| presence.always()).map(|&(name, _)| Field::Always(name));
        let features = self.features.iter().enumerate().map(|(index, &feature)| match of_feature(index).as_slice() {
            [] => Field::Flag(feature),
            &[binding] => Field::Resource { feature, binding },
            bindings => Field::Group { feature, bindings: bindings.to_vec() },
        });
        let decided = |presence: Presence| (0..self.features.len()).any(|feature| presence.is_feature(feature));
        let sometimes = self.bindings.iter().filter(|(_, presence)| !presence.always() && !decided(*presence));
        always.chain(features).chain(sometimes.map(|&(name, _)| Field::Sometimes(name))).collect()
    }

    /// The field of a resource that no feature alone decides: by another name where a feature has its own.
    fn sometimes(&self, binding: &str) -> String {
        let name = snake_case(binding);
        if self.features.contains(&binding) { format!("{name}_resource") } else { name }
    }

    fn to_rust(&self) -> Result<String, fmt::Error> {
        let mut text = String::new();
        let out = &mut text;
        let name = self.name;
        let fields = self.fields();
        writeln!(out, "//! `{name}.wgsl`.")?;
        writeln!(out, "#[allow(unused_imports)]\nuse crate::{{Call, Constant, Shader, UniformValue, variant}};")?;
        writeln!(out, "/// Name of the shader without features.\npub const FILE: &str = {name:?};")?;
        self.write_features(out)?;
        for field in &fields {
            if let Field::Group { feature, bindings } = field {
                writeln!(out, "/// What the feature `{feature}` of `{name}` reads and writes.")?;
                writeln!(out, "#[derive(Clone, Copy, Debug, PartialEq)]\npub struct {}<R> {{", camel_case(feature))?;
                for binding in bindings {
                    writeln!(out, "/// Binding `{binding}`.\npub {}: R,", snake_case(binding))?;
                }
                writeln!(out, "}}")?;
            }
        }
        write_numbers(out, "Params", "Fields of the uniform block `params`", &self.params)?;
        write_numbers(out, "Constants", "Pipeline-overridable constants", &self.constants)?;
        self.write_struct(out, &fields)?;
        Ok(text)
    }

    fn write_features(&self, out: &mut String) -> fmt::Result {
        writeln!(out, "/// Which features of `{}` are on.", self.name)?;
        writeln!(out, "#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]\npub struct Features {{")?;
        for feature in &self.features {
            writeln!(out, "/// Feature `{feature}`.\npub {}: bool,", snake_case(feature))?;
        }
        writeln!(out, "}}\nimpl Features {{\n/// The variant that has them.")?;
        let on: Vec<_> = self.features.iter().map(|feature| format!("self.{}", snake_case(feature))).collect();
        writeln!(out, "pub fn shader(self) -> &'static Shader {{ variant({}, &[{}]) }}\n}}", self.first, on.join(", "))
    }

    fn write_struct(&self, out: &mut String, fields: &[Field]) -> fmt::Result {
        let name = camel_case(self.name.rsplit('/').next().unwrap_or(self.name));
        let generic = if self.bindings.is_empty() { "" } else { "<R>" };
        writeln!(out, "/// One run of `{}.wgsl`; `R` names resources.", self.name)?;
        writeln!(out, "#[derive(Clone, Debug, PartialEq)]\npub struct {name}{generic} {{")?;
        for field in fields {
            match field {
                Field::Always(binding) => {
                    writeln!(out, "/// Binding `{binding}`.\npub {}: R,", snake_case(binding))
                }
                Field::Sometimes(binding) => writeln!(
                    out,
                    "/// Binding `{binding}`, where the features ask for it.\npub {}: Option<R>,",
                    self.sometimes(binding)
                ),
                Field::Resource { feature, binding } => writeln!(
                    out,
                    "/// Feature `{feature}` is on where its binding `{binding}` is given.\npub {}: Option<R>,",
                    snake_case(feature)
                ),
                Field::Group { feature, .. } => writeln!(
                    out,
                    "/// Feature `{feature}` is on where its bindings are given.\npub {}: Option<{}<R>>,",
                    snake_case(feature),
                    camel_case(feature)
                ),
                Field::Flag(feature) => {
                    writeln!(out, "/// Feature `{feature}`.\npub {}: bool,", snake_case(feature))
                }
            }?;
        }
        if !self.params.is_empty() {
            writeln!(out, "/// The uniform block `params`.\npub params: Params,")?;
        }
        if !self.constants.is_empty() {
            writeln!(out, "/// Pipeline-overridable constants.\npub constants: Constants,")?;
        }
        writeln!(out, "}}\nimpl{generic} {name}{generic} {{\n/// The features that are on.")?;
        writeln!(out, "pub fn features(&self) -> Features {{ Features {{")?;
        for field in fields {
            match field {
                Field::Flag(feature) => writeln!(out, "{0}: self.{0},", snake_case(feature))?,
                Field::Resource { feature, .. } | Field::Group { feature, .. } => {
                    writeln!(out, "{0}: self.{0}.is_some(),", snake_case(feature))?;
                }
                Field::Always(_) | Field::Sometimes(_) => {}
            }
        }
        writeln!(out, "}} }}\n}}")?;
        writeln!(out, "impl<R> From<{name}{generic}> for Call<R> {{\nfn from(run: {name}{generic}) -> Self {{")?;
        writeln!(out, "#[allow(unused_mut)]\nlet mut call = Call::new(run.features().shader());")?;
        for field in fields {
            match field {
                Field::Always(binding) => writeln!(out, "call.bind({binding:?}, Some(run.{}));", snake_case(binding))?,
                Field::Sometimes(binding) => writeln!(out, "call.bind({binding:?}, run.{});", self.sometimes(binding))?,
                Field::Resource { feature, binding } => {
                    writeln!(out, "call.bind({binding:?}, run.{});", snake_case(feature))?;
                }
                Field::Group { feature, bindings } => {
                    writeln!(out, "if let Some(group) = run.{} {{", snake_case(feature))?;
                    for binding in bindings {
                        writeln!(out, "call.bind({binding:?}, Some(group.{}));", snake_case(binding))?;
                    }
                    writeln!(out, "}}")?;
                }
                Field::Flag(_) => {}
            }
        }
        if !self.params.is_empty() {
            writeln!(out, "call.params = run.params.values();")?;
        }
        if !self.constants.is_empty() {
            writeln!(out, "call.constants(run.constants.values());")?;
        }
        writeln!(out, "call.checked()\n}}\n}}")
    }
}

fn add<'a>(
    all: &mut Vec<(&'a str, &'a str, Presence)>,
    name: &'a str,
    wgsl_type: &'a str,
    seen: Presence,
) -> Result<(), String> {
    rust_type(wgsl_type)
        .ok_or_else(|| format!("{name} has the type \"{wgsl_type}\"; use a number, a vector or a 4x4 matrix"))?;
    match all.iter_mut().find(|(known, ..)| *known == name) {
        Some((_, known, presence)) if *known == wgsl_type => presence.variants |= seen.variants,
        Some((_, known, _)) => return Err(format!("{name} is {known} in one variant and {wgsl_type} in another")),
        None => all.push((name, wgsl_type, seen)),
    }
    Ok(())
}

/// A struct of numbers, and its values by name. Those that only some variants have are optional among params; a constant
/// that a variant lacks is left out when it is used.
fn write_numbers(out: &mut String, name: &str, doc: &str, fields: &[(&str, &str, Presence)]) -> fmt::Result {
    if fields.is_empty() {
        return Ok(());
    }
    let constants = name == "Constants";
    writeln!(out, "/// {doc}.\n#[derive(Clone, Copy, Debug, PartialEq)]\npub struct {name} {{")?;
    for &(field, wgsl_type, presence) in fields {
        let rust = rust_type(wgsl_type).unwrap_or_default();
        let some = presence.always() || constants;
        let rust = if some { rust.to_owned() } else { format!("Option<{rust}>") };
        let when = if some { "" } else { ", where the features ask for it" };
        writeln!(out, "/// `{field}: {wgsl_type}`{when}.\npub {}: {rust},", snake_case(field))?;
    }
    let (item, each) = if constants { ("f64", "Constant::to_f64") } else { ("UniformValue", "UniformValue::from") };
    writeln!(out, "}}\nimpl {name} {{\n/// Values by their WGSL names.")?;
    writeln!(out, "pub fn values(&self) -> Vec<(&'static str, {item})> {{\n[")?;
    for &(field, _, presence) in fields {
        let own = format!("self.{}", snake_case(field));
        let value =
            if presence.always() || constants { format!("Some({each}({own}))") } else { format!("{own}.map({each})") };
        writeln!(out, "({field:?}, {value}),")?;
    }
    writeln!(out, "]\n.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()\n}}\n}}")
}

fn rust_type(wgsl_type: &str) -> Option<&'static str> {
    Some(match wgsl_type {
        "bool" => "bool",
        "f32" => "f32",
        "u32" => "u32",
        "i32" => "i32",
        "vec2<f32>" => "[f32; 2]",
        "vec3<f32>" => "[f32; 3]",
        "vec4<f32>" => "[f32; 4]",
        "vec2<u32>" => "[u32; 2]",
        "vec3<u32>" => "[u32; 3]",
        "vec4<u32>" => "[u32; 4]",
        "mat4x4<f32>" => "[[f32; 4]; 4]",
        _ => return None,
    })
}

/// The file of a shader: its name without features.
fn file_of(shader: &Shader) -> &str {
    shader.name.split('+').next().unwrap_or(&shader.name)
}

/// `NEAR_SAMPLES` and `ray-march` as names of fields and modules.
fn snake_case(name: &str) -> String {
    name.to_lowercase().replace('-', "_")
}

/// `direct_light` as the name of a type.
fn camel_case(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
    };
    name.split(['_', '-']).map(word).collect()
}
