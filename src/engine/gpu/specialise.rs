//! Shaders specialised before they reach a driver: what their `override` constants rule out is left out.
//!
//! A driver would find it too, after it has read, inlined and optimised all of it: for the integrate pass
//! that takes software Vulkan several times as long as for what is left, and nothing keeps it from one
//! process to the next.

use wgpu::naga;

use naga::back::PipelineConstants;
use naga::back::pipeline_constants::process_overrides;
use naga::compact::{KeepUnused, compact};
use naga::front::wgsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Block, Expression, Function, Handle, Literal, Module, ShaderStage, Statement};

/// A stage's shader, read and checked.
pub struct Source {
    module: Module,
    info: ModuleInfo,
}

impl Source {
    /// Reads WGSL. The shaders are the program's own: tests see to it that they are whole.
    pub fn read(name: &str, text: &str) -> Self {
        let module = wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        let info = Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        Source { module, info }
    }

    /// One compute entry point, and what is left of it with these constants.
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
            // Names keep what they name alive.
            function.named_expressions.clear();
        }
        (module.functions, module.entry_points) = (functions, entry_points);
        compact(&mut module, KeepUnused::No);
        module
    }
}

/// Puts in place of each `if` whose condition is known the branch that is taken.
fn prune(module: &Module, function: &Function, block: &mut Block) {
    let mut kept = Block::with_capacity(block.len());
    for (mut statement, span) in std::mem::take(block).span_into_iter() {
        match &mut statement {
            Statement::If { condition, accept, reject } => {
                if let Some(known) = known(module, function, *condition) {
                    let mut taken = std::mem::take(if known { accept } else { reject });
                    prune(module, function, &mut taken);
                    // What follows it is never reached.
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

/// The value of a condition that no longer depends on anything.
fn known(module: &Module, function: &Function, condition: Handle<Expression>) -> Option<bool> {
    let value = match function.expressions[condition] {
        Expression::Constant(constant) => &module.global_expressions[module.constants[constant].init],
        ref other => other,
    };
    match value {
        Expression::Literal(Literal::Bool(value)) => Some(*value),
        _ => None,
    }
}
