#!/usr/bin/env bash
# naga refuses a function that ends with a loop left only by `return`, or with code after a `return`.
#
# Versions: naga 30.0.1, webgpu 0.6.2 of npm (Tint).
# Expected: WGSL only asks for a `return` where control can reach the end of a function. A `loop` without a
#   `break`, and a `return` followed by more statements, are valid.
# Seen: naga refuses both: "The `return` expression None does not match the declared return type". It takes
#   an `if` or a `switch` in which every branch returns. Tint takes all of them.
# Why it matters: a walk along a ray is such a loop. A `return` put in front of the rest of a function, to
#   look at one value, stops the shader from compiling.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/wgsl.bash"
wgsl_compilers
judge "loop left by return alone" refuses takes <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn walk(length: f32) -> f32 {
    var t = 0.0;
    loop {
        t += 0.25;
        if t >= length { return t; }
    }
}
@compute @workgroup_size(1)
fn main() {
    out[0] = walk(out[1]);
}
WGSL
judge "statement behind a return" refuses takes <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn shade(depth: f32) -> f32 {
    return depth;
    out[1] = exp(-depth);
}
@compute @workgroup_size(1)
fn main() {
    out[0] = shade(out[1]);
}
WGSL
judge "if and else that both return" takes takes <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn sign(x: f32) -> f32 {
    if x < 0.0 { return -1.0; } else { return 1.0; }
}
@compute @workgroup_size(1)
fn main() {
    out[0] = sign(out[1]);
}
WGSL
judge "switch of which all cases return" takes takes <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn weight(kind: i32) -> f32 {
    switch kind {
        case 1: { return 0.5; }
        default: { return 1.0; }
    }
}
@compute @workgroup_size(1)
fn main() {
    out[0] = weight(i32(out[1]));
}
WGSL
verdict
