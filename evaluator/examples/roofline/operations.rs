//! Operations of one turn of a shader's loop, counted in its WGSL.

use halflight_shared_shaders::Shader;
use naga::{
    Block, Expression, Function, Handle, MathFunction, Module, Statement, TypeInner,
    valid::{Capabilities, FunctionInfo, ModuleInfo, ValidationFlags, Validator},
};

/// What one turn does.
#[derive(Clone, Copy, Default)]
pub struct Operations {
    /// Operations on single numbers: arithmetic, comparisons, choices, conversions. A product of two vectors of three counts
    /// as five. A function of the language, such as a square root, counts as one a component.
    pub scalar: u32,
    /// Texels that are loaded.
    pub fetches: u32,
}

/// Counts the first loop of a shader's first entry point, with the functions that it calls; `None` without a loop, or if the
/// shader is not valid.
pub fn of_loop(shader: &Shader) -> Option<Operations> {
    let module = naga::front::wgsl::parse_str(shader.source).ok()?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module).ok()?;
    let entry = module.entry_points.first()?;
    let counter = Counter { module: &module, info: &info };
    let (body, continuing) = first_loop(&entry.function.body)?;
    let function = (&entry.function, info.get_entry_point(0));
    let mut operations = Operations::default();
    for block in [body, continuing] {
        counter.add(block, function, &mut operations);
    }
    Some(operations)
}

fn first_loop(block: &Block) -> Option<(&Block, &Block)> {
    block.iter().find_map(|statement| match statement {
        Statement::Loop { body, continuing, .. } => Some((body, continuing)),
        Statement::Block(inner) => first_loop(inner),
        Statement::If { accept, reject, .. } => first_loop(accept).or_else(|| first_loop(reject)),
        _ => None,
    })
}

struct Counter<'a> {
    module: &'a Module,
    info: &'a ModuleInfo,
}

impl Counter<'_> {
    fn add(&self, block: &Block, function: (&Function, &FunctionInfo), sum: &mut Operations) {
        for statement in block {
            match statement {
                Statement::Emit(range) => {
                    range.clone().for_each(|expression| self.add_expression(expression, function, sum))
                }
                Statement::Block(inner) => self.add(inner, function, sum),
                Statement::If { accept, reject, .. } => {
                    self.add(accept, function, sum);
                    self.add(reject, function, sum);
                }
                Statement::Call { function: callee, .. } => {
                    let callee_function = &self.module.functions[*callee];
                    self.add(&callee_function.body, (callee_function, &self.info[*callee]), sum);
                }
                _ => {}
            }
        }
    }

    fn add_expression(
        &self,
        expression: Handle<Expression>,
        function: (&Function, &FunctionInfo),
        sum: &mut Operations,
    ) {
        let components = |of: Handle<Expression>| match function.1[of].ty.inner_with(&self.module.types) {
            TypeInner::Vector { size, .. } => *size as u32,
            _ => 1,
        };
        match &function.0.expressions[expression] {
            Expression::ImageLoad { .. } => sum.fetches += 1,
            Expression::Math { fun: MathFunction::Dot, arg, .. } => sum.scalar += 2 * components(*arg) - 1,
            Expression::Unary { .. }
            | Expression::Binary { .. }
            | Expression::Select { .. }
            | Expression::Relational { .. }
            | Expression::Math { .. }
            | Expression::As { .. } => sum.scalar += components(expression),
            _ => {}
        }
    }
}
