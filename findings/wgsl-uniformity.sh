#!/usr/bin/env bash
# naga takes derivatives and barriers in non-uniform branches, and aliased pointers; Tint refuses them.
#
# Versions: naga 30.0.1, webgpu 0.6.2 of npm (Tint).
# Expected: WGSL makes all of them errors at shader creation, so naga finds them when all of its validation
#   flags are set.
# Seen: naga takes textureSample and dpdx in a branch that depends on an interpolated input,
#   workgroupBarrier in a branch that depends on the invocation's index, and a call that passes one pointer
#   twice, to be written and to be read. Tint refuses each.
# Why it matters: a shader that passes every test of a wgpu program fails on a page in Chromium. A shader
#   for both has to be compiled by both.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/wgsl.bash"
wgsl_compilers
judge "textureSample in a non-uniform branch" takes refuses <<'WGSL'
@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var linear: sampler;
@fragment
fn main(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x > 0.5 {
        return textureSample(image, linear, uv);
    }
    return vec4f();
}
WGSL
judge "dpdx in a non-uniform branch" takes refuses <<'WGSL'
@fragment
fn main(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x > 0.5 {
        return vec4f(dpdx(uv.y));
    }
    return vec4f();
}
WGSL
judge "workgroupBarrier in a non-uniform branch" takes refuses <<'WGSL'
var<workgroup> shared_depth: array<f32, 64>;
@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) lane: u32) {
    shared_depth[lane] = 1.0;
    if lane < 32u {
        workgroupBarrier();
    }
}
WGSL
judge "the same pointer twice, one written" takes refuses <<'WGSL'
@group(0) @binding(0) var<storage, read_write> out: array<f32>;
fn advance(t: ptr<function, f32>, step: ptr<function, f32>) {
    *t += *step;
}
@compute @workgroup_size(1)
fn main() {
    var t = 1.0;
    advance(&t, &t);
    out[0] = t;
}
WGSL
judge "derivatives with their check switched off" takes takes <<'WGSL'
diagnostic(off, derivative_uniformity);
@fragment
fn main(@location(0) uv: vec2f) -> @location(0) vec4f {
    if uv.x > 0.5 {
        return vec4f(dpdx(uv.y));
    }
    return vec4f();
}
WGSL
verdict
