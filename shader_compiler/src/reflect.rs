//! Validation for the WebGPU baseline, and what a module binds.

use std::collections::{BTreeSet, HashSet};

use naga::{
    AddressSpace, Block, Expression, Function, GlobalVariable, Handle, ImageClass, Literal, Module, ScalarKind,
    ShaderStage, Statement, TypeInner, proc::GlobalCtx, valid,
};

use crate::{Binding, BindingKind, EntryPoint, Member, Override, Stage};

/// Limits that every browser grants (WebGPU's defaults), per shader stage.
const MAX_STORAGE_TEXTURES: usize = 4;
const MAX_STORAGE_BUFFERS: usize = 8;
const MAX_SAMPLED_TEXTURES: usize = 16;
/// Invocations of a workgroup that every browser grants.
const MAX_INVOCATIONS: u32 = 256;

/// Storage texture formats that WebGPU guarantees for writing.
const STORAGE_FORMATS: [&str; 9] = [
    "R32Float",
    "R32Uint",
    "Rgba8Unorm",
    "Rgba16Float",
    "Rgba32Float",
    "Rgba32Uint",
    "Rgba16Uint",
    "Rg32Float",
    "Rg32Uint",
];

/// How the linker begins names that come from an imported module.
pub(crate) const IMPORTED: &str = "package_";

/// Parses and validates plain WGSL; returns its entry points and override constants, or what is wrong with it.
pub(crate) fn reflect(source: &str) -> Result<(Vec<EntryPoint>, Vec<Override>), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    // WebGPU's baseline: no capability that only native interfaces have.
    let info = valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32)
        .validate(&module)
        .map_err(|e| e.emit_to_string(source))?;
    let entry_points = (0..module.entry_points.len()).map(|index| entry_point(&module, &info, index));
    let overrides = module.overrides.iter().filter_map(|(_, constant)| override_of(&module, constant));
    Ok((entry_points.collect::<Result<_, _>>()?, overrides.collect()))
}

fn entry_point(module: &Module, info: &valid::ModuleInfo, index: usize) -> Result<EntryPoint, String> {
    let entry = &module.entry_points[index];
    let stage = match entry.stage {
        ShaderStage::Vertex => Stage::Vertex,
        ShaderStage::Fragment => Stage::Fragment,
        ShaderStage::Compute => Stage::Compute,
        other => return Err(format!("{} is an entry point for {other:?}, which WebGPU lacks", entry.name)),
    };
    let workgroup_size = entry.workgroup_size;
    if stage == Stage::Compute && workgroup_size.iter().product::<u32>() > MAX_INVOCATIONS {
        let name = &entry.name;
        return Err(format!("{name} has a workgroup of {workgroup_size:?}; a browser guarantees {MAX_INVOCATIONS}"));
    }
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let (Some(binding), Some(name)) = (&variable.binding, &variable.name) else { continue };
        if info.get_entry_point(index)[handle].is_empty() {
            continue;
        }
        let kind = binding_kind(module, name, variable, &MembersRead::of(module, &entry.function, handle))?;
        // Names of an imported module carry its path; such variables are named by one word.
        let name = if name.starts_with(IMPORTED) { name.rsplit('_').next().unwrap_or(name) } else { name };
        bindings.push(Binding { name: name.to_owned(), group: binding.group, index: binding.binding, kind });
    }
    let count = |of: fn(&BindingKind) -> bool| bindings.iter().filter(|binding| of(&binding.kind)).count();
    for (count, most, what) in [
        (count(|kind| matches!(kind, BindingKind::StorageTexture { .. })), MAX_STORAGE_TEXTURES, "storage textures"),
        (count(|kind| matches!(kind, BindingKind::Storage { .. })), MAX_STORAGE_BUFFERS, "storage buffers"),
        (count(|kind| matches!(kind, BindingKind::Texture { .. })), MAX_SAMPLED_TEXTURES, "sampled textures"),
    ] {
        if count > most {
            return Err(format!("{} uses {count} {what}; a browser guarantees {most}", entry.name));
        }
    }
    Ok(EntryPoint { name: entry.name.clone(), stage, workgroup_size, bindings })
}

fn binding_kind(
    module: &Module,
    name: &str,
    variable: &naga::GlobalVariable,
    read: &MembersRead,
) -> Result<BindingKind, String> {
    match (variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, TypeInner::Struct { members, span }) => Ok(BindingKind::Uniform {
            size: *span,
            members: members
                .iter()
                .zip(0..)
                .map(|(field, index)| member(module, field, read.contains(index)))
                .collect(),
        }),
        (AddressSpace::Storage { access }, _) => {
            Ok(BindingKind::Storage { writable: access.contains(naga::StorageAccess::STORE) })
        }
        (AddressSpace::Handle, TypeInner::Image { class: ImageClass::Storage { format, access }, .. }) => {
            let format = format!("{format:?}");
            if !STORAGE_FORMATS.contains(&format.as_str()) {
                return Err(format!("{name} has format {format}, which no browser guarantees"));
            }
            Ok(BindingKind::StorageTexture { format, writable: access.contains(naga::StorageAccess::STORE) })
        }
        (AddressSpace::Handle, TypeInner::Image { arrayed, .. }) => Ok(BindingKind::Texture { arrayed: *arrayed }),
        (AddressSpace::Handle, TypeInner::Sampler { comparison }) => {
            Ok(BindingKind::Sampler { comparison: *comparison })
        }
        _ => Err(format!("{name}: bind a struct as uniform, a buffer, a texture or a sampler")),
    }
}

fn member(module: &Module, field: &naga::StructMember, read: bool) -> Member {
    let inner = &module.types[field.ty].inner;
    let context = GlobalCtx {
        types: &module.types,
        constants: &module.constants,
        overrides: &module.overrides,
        global_expressions: &module.global_expressions,
    };
    Member {
        name: field.name.clone().unwrap_or_default(),
        offset: field.offset,
        size: inner.size(context),
        wgsl_type: wgsl_type(inner),
        read,
    }
}

/// The members of a uniform struct that a function and everything it calls may read.
enum MembersRead {
    All,
    These(BTreeSet<u32>),
}

impl MembersRead {
    fn of(module: &Module, function: &Function, variable: Handle<GlobalVariable>) -> Self {
        let mut functions = vec![function];
        let mut known = HashSet::new();
        let mut members = BTreeSet::new();
        while let Some(function) = functions.pop() {
            let is_variable =
                |base| matches!(function.expressions[base], Expression::GlobalVariable(own) if own == variable);
            for (_, expression) in function.expressions.iter() {
                match *expression {
                    Expression::AccessIndex { base, index } if is_variable(base) => {
                        members.insert(index);
                    }
                    // A copy of the whole struct. A pointer to it cannot be passed to a function.
                    Expression::Load { pointer } if is_variable(pointer) => return Self::All,
                    _ => {}
                }
            }
            visit_statements(&function.body, &mut |statement| {
                if let Statement::Call { function: called, .. } = statement
                    && known.insert(*called)
                {
                    functions.push(&module.functions[*called]);
                }
            });
        }
        Self::These(members)
    }

    fn contains(&self, index: u32) -> bool {
        match self {
            Self::All => true,
            Self::These(members) => members.contains(&index),
        }
    }
}

fn visit_statements(block: &Block, visit: &mut impl FnMut(&Statement)) {
    for statement in block {
        visit(statement);
        match statement {
            Statement::Block(inner) => visit_statements(inner, visit),
            Statement::If { accept, reject, .. } => {
                visit_statements(accept, visit);
                visit_statements(reject, visit);
            }
            Statement::Switch { cases, .. } => cases.iter().for_each(|case| visit_statements(&case.body, visit)),
            Statement::Loop { body, continuing, .. } => {
                visit_statements(body, visit);
                visit_statements(continuing, visit);
            }
            _ => {}
        }
    }
}

fn override_of(module: &Module, constant: &naga::Override) -> Option<Override> {
    let default = constant.init.and_then(|value| match module.global_expressions[value] {
        Expression::Literal(Literal::Bool(value)) => Some(f64::from(u8::from(value))),
        Expression::Literal(Literal::I32(value)) => Some(value.into()),
        Expression::Literal(Literal::U32(value)) => Some(value.into()),
        Expression::Literal(Literal::F32(value)) => Some(value.into()),
        _ => None,
    });
    let wgsl_type = wgsl_type(&module.types[constant.ty].inner);
    Some(Override { name: constant.name.clone()?, wgsl_type, default })
}

/// A scalar, vector or matrix type as WGSL writes it.
fn wgsl_type(inner: &TypeInner) -> String {
    let scalar = |scalar: naga::Scalar| {
        let bits = 8 * scalar.width;
        match scalar.kind {
            ScalarKind::Bool => "bool".to_owned(),
            ScalarKind::Sint => format!("i{bits}"),
            ScalarKind::Uint => format!("u{bits}"),
            _ => format!("f{bits}"),
        }
    };
    match inner {
        TypeInner::Scalar(s) => scalar(*s),
        TypeInner::Vector { size, scalar: s } => format!("vec{}<{}>", *size as u32, scalar(*s)),
        TypeInner::Matrix { columns, rows, scalar: s } => {
            format!("mat{}x{}<{}>", *columns as u32, *rows as u32, scalar(*s))
        }
        _ => String::new(),
    }
}
