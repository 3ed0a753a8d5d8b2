#!/usr/bin/env bash
# naga takes derivatives and barriers in non-uniform branches, and aliased pointers; Tint refuses all three.
#
# Versions: naga 30.0.1, webgpu 0.6.2 of npm (Tint).
# Expected: WGSL makes all three an error when the shader is created, so naga with all of its validation flags
#   finds them as Tint does.
# Seen: naga takes textureSample and dpdx in a branch that depends on an interpolated input, workgroupBarrier in
#   a branch that depends on the invocation's index, and a function called with the same pointer twice that
#   writes through one and reads through the other. Tint refuses each.
# Why it matters: shaders that pass every test of a wgpu program fail on a page in Chromium. Two compilers must
#   see a shader that is to run in both.
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
