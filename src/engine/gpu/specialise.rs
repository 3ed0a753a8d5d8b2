//! Specialises shaders before they reach a driver: code that their `override` constants rule out is removed.
//!
//! A driver would remove that code too, but only after it has read, inlined and optimised it. For the
//! integrate pass this takes software Vulkan several times as long as compiling the remaining code, and no
//! cache keeps the result from one process to the next.

use wgpu::naga;

use naga::back::PipelineConstants;
use naga::back::pipeline_constants::process_overrides;
use naga::compact::{KeepUnused, compact};
use naga::front::wgsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Block, Expression, Function, Handle, Literal, Module, ShaderStage, Statement};

/// The parsed and validated shader of a stage.
pub struct Source {
    module: Module,
    info: ModuleInfo,
}

impl Source {
    /// Parses and validates WGSL; `name` is for messages.
    ///
    /// # Panics
    /// If the text is not valid. The shaders are part of the program, and tests validate each of them.
    pub fn read(name: &str, text: &str) -> Self {
        let module = wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        Source { module, info }
    }

    /// Returns a module with one compute entry point and only the code that these constants leave.
    ///
    /// # Panics
    /// If the shader has no such entry point or constant.
    pub fn compute(&self, entry_point: &str, constants: &[(&str, f64)]) -> Module {
        let mut values = PipelineConstants::default();
        values.extend(constants.iter().map(|&(name, value)| (name.to_owned(), value)));
        let entry = Some((ShaderStage::Compute, entry_point));
        let (module, _) = process_overrides(&self.module, &self.info, entry, &values)
            .unwrap_or_else(|e| panic!("{entry_point}: {e}"));
        let mut module = module.into_owned();
        let mut functions = std::mem::take(&mut module.functions);
        let mut entry_points = std::mem::take(&mut module.entry_points);
        let own = functions.iter_mut().map(|(_, function)| function);
        for function in own.chain(entry_points.iter_mut().map(|entry| &mut entry.function)) {
            let mut body = std::mem::take(&mut function.body);
            prune(&module, function, &mut body);
            function.body = body;
            // Named expressions would keep unused code alive.
            function.named_expressions.clear();
        }
        (module.functions, module.entry_points) = (functions, entry_points);
        compact(&mut module, KeepUnused::No);
        module
    }
}

/// Replaces each `if` whose condition is constant by the branch that is taken.
fn prune(module: &Module, function: &Function, block: &mut Block) {
    let mut kept = Block::with_capacity(block.len());
    for (mut statement, span) in std::mem::take(block).span_into_iter() {
        match &mut statement {
            Statement::If { condition, accept, reject } => {
                if let Some(value) = constant_condition(module, function, *condition) {
                    let mut taken = std::mem::take(if value { accept } else { reject });
                    prune(module, function, &mut taken);
                    // Statements after a terminator are unreachable.
                    let ends = taken.last().is_some_and(Statement::is_terminator);
                    kept.append(&mut taken);
                    if ends {
                        break;
                    }
                    continue;
                }
                prune(module, function, accept);
                prune(module, function, reject);
            }
            Statement::Block(inner) => prune(module, function, inner),
            Statement::Loop { body, continuing, .. } => {
                prune(module, function, body);
                prune(module, function, continuing);
            }
            Statement::Switch { cases, .. } => {
                for case in cases {
                    prune(module, function, &mut case.body);
                }
            }
            _ => {}
        }
        kept.push(statement, span);
    }
    *block = kept;
}

/// Returns the value of a constant condition; `None` if it is not constant.
fn constant_condition(module: &Module, function: &Function, condition: Handle<Expression>) -> Option<bool> {
    let value = match function.expressions[condition] {
        Expression::Constant(constant) => &module.global_expressions[module.constants[constant].init],
        ref other => other,
    };
    match value {
        Expression::Literal(Literal::Bool(value)) => Some(*value),
        _ => None,
    }
}
