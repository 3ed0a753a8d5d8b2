#!/usr/bin/env bash
# naga refuses functions that take pointers to uniform, storage or workgroup variables; Tint takes them.
#
# Versions: naga 30.0.1, webgpu 0.6.2 of npm (Tint).
# Expected: a shader that a browser compiles also compiles in wgpu. This is a WGSL language extension,
#   unrestricted_pointer_parameters, which Tint offers without a `requires`.
# Seen: naga refuses the function itself, even if it is not called, and also the line `requires
#   unrestricted_pointer_parameters;`. A pointer to one element of a function's own array, which belongs to
#   the same extension, it takes.
# Why it matters: a helper that reads one of several buffers has to be written once for each buffer, or has
#   to copy what it reads.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/wgsl.bash"
wgsl_compilers
judge "pointer to a storage variable" refuses takes <<'WGSL'
@group(0) @binding(0) var<storage, read> cells: array<f32, 4>;
@group(0) @binding(1) var<storage, read_write> out: array<f32>;
fn cell(p: ptr<storage, array<f32, 4>, read>, i: u32) -> f32 {
    return (*p)[i];
}
@compute @workgroup_size(1)
fn main() {
    out[0] = cell(&cells, 1u);
}
WGSL
judge "pointer to a uniform variable" refuses takes <<'WGSL'
struct Frame { eye: vec4f, sun: vec4f }
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read_write> out: array<f32>;
fn height(p: ptr<uniform, Frame>) -> f32 {
    return (*p).sun.y;
}
@compute @workgroup_size(1)
fn main() {
    out[0] = height(&frame);
}
WGSL
judge "pointer to a workgroup variable, not called" refuses takes <<'WGSL'
fn first(p: ptr<workgroup, array<f32, 4>>) -> f32 {
    return (*p)[0];
}
@compute @workgroup_size(1)
fn main() {}
WGSL
judge "pointer to an element of a variable of the function" takes takes <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn put(p: ptr<function, f32>) {
    *p = 2.0;
}
@compute @workgroup_size(1)
fn main() {
    var lanes: array<f32, 4>;
    put(&lanes[1]);
    out[0] = lanes[1];
}
WGSL
judge "the extension is required by name" refuses takes <<'WGSL'
requires unrestricted_pointer_parameters;
@compute @workgroup_size(1)
fn main() {}
WGSL
verdict
