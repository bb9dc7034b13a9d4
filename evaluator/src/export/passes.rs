//! Passes, uniform blocks and usages of textures, as plan.json says them.

use halflight_frame_graph::{FramePlan, Pass as PlannedPass, ResourceId, ResourceKind};
use halflight_renderer::gi::Technique;
use halflight_shared_shaders::{Binding as Variable, BindingKind, Member, UniformValue};
use serde_json::Value;

use super::{
    document::{Binding, Block, Bound, Field, Pass, Source},
    numbers::{Probes, workgroup_size, workgroups},
    rules::Axis,
    settings::LiveSettings,
    shader,
};

/// Usages that the passes need of a texture. Outputs may be copied, too.
pub(super) fn usage(plan: &FramePlan, id: ResourceId) -> Vec<&'static str> {
    // The two textures of a history swap roles.
    let pair = |id: ResourceId| match plan.resources[id.0].kind {
        ResourceKind::Previous { of, .. } => Some(of),
        _ => plan
            .resources
            .iter()
            .position(|other| matches!(other.kind, ResourceKind::Previous { of, .. } if of == id))
            .map(ResourceId),
    };
    let both = [Some(id), pair(id)];
    let bound = |wanted: fn(&BindingKind) -> bool| {
        plan.passes.iter().any(|pass| {
            let variables = pass.shader.bindings().filter(|variable| wanted(&variable.kind));
            variables.into_iter().any(|variable| {
                pass.bindings.iter().any(|&(name, bound)| name == variable.name && both.contains(&Some(bound)))
            })
        })
    };
    let mut usage = Vec::new();
    let is_output = plan.outputs.values().any(|&output| output == id);
    if is_output || bound(|kind| matches!(kind, BindingKind::Texture { .. })) {
        usage.push("texture-binding");
    }
    if bound(|kind| matches!(kind, BindingKind::StorageTexture { .. })) {
        usage.push("storage-binding");
    }
    if is_output {
        usage.push("copy-src");
    }
    usage
}

/// The passes, and name and text of their shader files.
pub(super) fn passes(technique: &Technique, plan: &FramePlan, probes: &Probes) -> (Vec<Pass>, Vec<(String, String)>) {
    let mut shaders = Vec::new();
    let mut all = Vec::new();
    for (index, pass) in plan.passes.iter().enumerate() {
        let file = format!("{index:02}_{}.wgsl", pass.name);
        let per = workgroup_size(pass);
        let count =
            |axis: usize, natural| probes.side(natural, per[axis], |plan| workgroups(&plan.passes[index])[axis]);
        all.push(Pass {
            name: pass.name.clone(),
            reason: pass.reason.clone(),
            shader: file.clone(),
            entry: pass.shader.entry_points[0].name,
            constants: pass.constants.iter().copied().collect(),
            workgroup_size: per,
            workgroups: [count(0, Axis::Width), count(1, Axis::Height)],
            work: pass.cost,
            bindings: pass.shader.entry_points[0]
                .bindings
                .iter()
                .map(|variable| binding(plan, pass, variable))
                .collect(),
        });
        shaders.push((file, shader::text(technique, plan, pass)));
    }
    (all, shaders)
}

/// Name of the uniform block that a variable of a pass binds. Passes share those that the player fills.
fn block_name(pass: &PlannedPass, variable: &str) -> String {
    match variable {
        "view" | "previous" | "division" => variable.to_owned(),
        _ => format!("{}.{variable}", pass.name),
    }
}

fn binding(plan: &FramePlan, pass: &PlannedPass, variable: &Variable) -> Binding {
    let texture = || {
        let bound = pass.bindings.iter().find(|(name, _)| *name == variable.name);
        bound.map(|(_, id)| plan.resources[id.0].name.clone()).unwrap_or_default()
    };
    let resource = match variable.kind {
        BindingKind::Uniform { .. } => Bound::Uniform { block: block_name(pass, variable.name) },
        BindingKind::Texture { arrayed } => {
            Bound::Texture { texture: texture(), dimension: if arrayed { "2d-array" } else { "2d" } }
        }
        // `refusal::check` leaves no plan with storage buffers.
        BindingKind::StorageTexture { .. } | BindingKind::Storage { .. } => {
            Bound::StorageTexture { texture: texture(), access: "write-only" }
        }
        BindingKind::Sampler { .. } => Bound::Sampler { filter: "linear" },
    };
    Binding { name: variable.name, group: variable.group, index: variable.index, resource }
}

/// The uniform blocks of all passes.
pub(super) fn uniforms(plan: &FramePlan, probes: &Probes, live: &LiveSettings) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for (index, pass) in plan.passes.iter().enumerate() {
        for variable in pass.shader.entry_points[0].bindings {
            let BindingKind::Uniform { size, members } = variable.kind else { continue };
            let name = block_name(pass, variable.name);
            if blocks.iter().any(|block| block.name == name) {
                continue;
            }
            let named = members.iter().filter(|member| !member.name.starts_with("unused"));
            let fields = named.map(|member| field(variable.name, (index, pass), member, probes, live)).collect();
            blocks.push(Block { name, size, fields });
        }
    }
    blocks
}

fn field(
    block: &str,
    (index, pass): (usize, &PlannedPass),
    member: &Member,
    probes: &Probes,
    live: &LiveSettings,
) -> Field {
    let known = match (block, member.name) {
        ("view", "world_to_view") => Some(("mat4x4f", "camera.world_to_view")),
        ("view", "view_to_world") => Some(("mat4x4f", "camera.view_to_world")),
        ("view", "tan_half_fov") => Some(("vec2f", "camera.tan_half_fov")),
        ("view", "display_size") => Some(("vec2f", "display.size")),
        ("view", "near") => Some(("f32", "camera.near")),
        ("view", "frame") => Some(("u32", "frame.number")),
        ("view", "seed") => Some(("u32", "frame.seed")),
        ("previous", "view_to_previous") => Some(("mat4x4f", "previous.view_to_previous")),
        ("previous", "tan_half_fov") => Some(("vec2f", "previous.tan_half_fov")),
        ("previous", "valid") => Some(("u32", "previous.valid")),
        ("previous", "static_frames") => Some(("u32", "frame.unchanged")),
        ("division", "workgroup") => Some(("vec2u", "dispatch.workgroup")),
        ("division", "invocation") => Some(("vec2u", "dispatch.invocation")),
        _ => None,
    };
    if let Some((wgsl_type, from)) = known {
        return Field { name: member.name, offset: member.offset, wgsl_type, source: Source::Frame { from } };
    }
    let position = pass.params.iter().position(|(name, _)| *name == member.name);
    let value = position.map(|field| &pass.params[field].1);
    Field {
        name: member.name,
        offset: member.offset,
        wgsl_type: value.map_or("f32", type_name),
        source: Source::Plan {
            value: value.map_or(Value::Null, json),
            by_size: position.and_then(|field| probes.by_size(index, field)),
            by_setting: position.and_then(|field| live.of(index, field)).cloned(),
        },
    }
}

fn type_name(value: &UniformValue) -> &'static str {
    match value {
        UniformValue::U32(_) => "u32",
        UniformValue::I32(_) => "i32",
        UniformValue::F32(_) => "f32",
        UniformValue::Vec2(_) => "vec2f",
        UniformValue::Vec3(_) => "vec3f",
        UniformValue::Vec4(_) => "vec4f",
        UniformValue::UVec2(_) => "vec2u",
        UniformValue::UVec3(_) => "vec3u",
        UniformValue::UVec4(_) => "vec4u",
        UniformValue::Mat4(_) => "mat4x4f",
    }
}

/// A value as numbers. A float32 is written as the double of the same value, so that it reads back exactly.
fn json(value: &UniformValue) -> Value {
    match value {
        UniformValue::U32(v) => (*v).into(),
        UniformValue::I32(v) => (*v).into(),
        UniformValue::F32(v) => f64::from(*v).into(),
        UniformValue::Vec2(v) => v.map(f64::from).to_vec().into(),
        UniformValue::Vec3(v) => v.map(f64::from).to_vec().into(),
        UniformValue::Vec4(v) => v.map(f64::from).to_vec().into(),
        UniformValue::UVec2(v) => v.to_vec().into(),
        UniformValue::UVec3(v) => v.to_vec().into(),
        UniformValue::UVec4(v) => v.to_vec().into(),
        UniformValue::Mat4(v) => v.iter().flatten().map(|&v| f64::from(v)).collect::<Vec<_>>().into(),
    }
}
