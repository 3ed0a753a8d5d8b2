//! Specialisation of shaders before the driver compiles them.

use taki::engine::gpu::{Source, integrate_source, visibility_source};
use wgpu::naga;

use naga::{Block, Module, Statement};

const SMALL: &str = "
override DEEP: bool = false;
override MANY: u32 = 1u;
override BOTH: bool = DEEP & (MANY > 1u);

@group(0) @binding(0) var<storage, read_write> out: array<u32>;

fn deep(n: u32) -> u32 {
    if MANY == 1u {
        return n;
    }
    return many(n);
}

fn many(n: u32) -> u32 {
    var sum = 0u;
    for (var i = 0u; i < n; i++) {
        if BOTH {
            sum += both(i);
        }
        sum += i;
    }
    return sum;
}

fn both(n: u32) -> u32 {
    let named = n * 7u;
    return named;
}

@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if DEEP {
        out[id.x] = deep(id.y);
    } else {
        out[id.x] = id.x;
    }
    if id.x > 3u {
        out[0] = 1u;
    }
}

@compute @workgroup_size(1)
fn other() {
    out[0] = many(3u);
}
";

fn functions(module: &Module) -> Vec<&str> {
    let mut names: Vec<_> = module.functions.iter().filter_map(|(_, f)| f.name.as_deref()).collect();
    names.sort_unstable();
    names
}

/// Number of `if`s in a block, nested ones included.
fn conditions(block: &Block) -> usize {
    block
        .iter()
        .map(|statement| match statement {
            Statement::If { accept, reject, .. } => 1 + conditions(accept) + conditions(reject),
            Statement::Block(inner) => conditions(inner),
            Statement::Loop { body, continuing, .. } => conditions(body) + conditions(continuing),
            _ => 0,
        })
        .sum()
}

fn assert_valid(module: &Module) {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(module).expect("a valid module");
}

#[test]
fn what_constants_rule_out_is_left_out() {
    let source = Source::read("small", SMALL);
    let left = |constants: &[(&str, f64)]| {
        let module = source.compute("main", constants);
        assert_valid(&module);
        assert_eq!(module.entry_points.len(), 1);
        assert!(module.overrides.is_empty());
        let own = &module.entry_points[0].function.body;
        let all: usize = module.functions.iter().map(|(_, f)| conditions(&f.body)).sum();
        (functions(&module).join(" "), conditions(own) + all)
    };
    // The condition on id.x always stays. With `many`, the condition that ends its loop stays too.
    assert_eq!(left(&[]), (String::new(), 1));
    assert_eq!(left(&[("DEEP", 1.0)]), ("deep".into(), 1));
    assert_eq!(left(&[("DEEP", 1.0), ("MANY", 2.0)]), ("both deep many".into(), 2));
    assert_eq!(left(&[("DEEP", 0.0), ("MANY", 2.0)]), (String::new(), 1));
}

#[test]
fn an_entry_point_has_what_it_needs_and_no_other_has() {
    let source = Source::read("small", SMALL);
    let module = source.compute("other", &[("MANY", 2.0)]);
    assert_valid(&module);
    assert_eq!(module.entry_points[0].name, "other");
    assert_eq!(functions(&module), ["many"]);
}

#[test]
#[should_panic(expected = "NONE")]
fn a_constant_that_no_shader_has_is_an_error_of_the_program() {
    Source::read("small", SMALL).compute("main", &[("NONE", 1.0)]);
}

#[test]
fn the_walk_without_light_has_no_model_of_light() {
    let source = Source::read("integrate", &integrate_source(true));
    let plain = source.compute("integrate", &[("LIGHTS", 0.0)]);
    assert_valid(&plain);
    for gone in
        ["strand_psi", "scatter_multiple", "optical_depth", "sample_trilinear", "spread_psi", "walk_leap"]
    {
        assert!(!functions(&plain).contains(&gone), "{gone} is still there");
    }
    let whole = source.compute(
        "integrate",
        &[
            ("LIGHTS", 2.0),
            ("STRAND", 1.0),
            ("HAIR", 1.0),
            ("TILTED", 1.0),
            ("MULTIPLE", 1.0),
            ("MARCH", 1.0),
            ("TRILINEAR", 1.0),
            ("PYRAMID", 1.0),
            ("LEAPS", 1.0),
        ],
    );
    assert_valid(&whole);
    for needed in ["strand_psi", "scatter_multiple", "optical_depth", "sample_trilinear", "walk_leap"] {
        assert!(functions(&whole).contains(&needed), "{needed} is missing");
    }
}

#[test]
fn every_set_of_switches_leaves_a_valid_shader() {
    let switches = [
        "PER_CELL", "MARCH", "CACHED", "CODES", "CORNERED", "STRAND", "HAIR", "TILTED", "MULTIPLE", "ERODED",
        "BILLOWS", "PYRAMID", "LEAPS",
    ];
    for many in [false, true] {
        let source = Source::read("integrate", &integrate_source(many));
        for (i, on) in switches.iter().enumerate() {
            for other in &switches[i..] {
                for lights in [1.0, 2.0] {
                    assert_valid(
                        &source.compute("integrate", &[("LIGHTS", lights), (on, 1.0), (other, 1.0)]),
                    );
                }
            }
        }
    }
    let source = Source::read("visibility", &visibility_source());
    for on in ["PER_CELL", "CODES", "PYRAMID", "LEAPS", "EVERYWHERE"] {
        assert_valid(&source.compute("visibility", &[(on, 1.0)]));
    }
}
