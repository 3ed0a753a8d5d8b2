#!/usr/bin/env bash
# lavapipe: linear filtering of an 8-bit texture returns 8-bit values.
#
# Versions: Mesa 22.3.6 (Debian 12), wgpu-py 0.32.0.
# Expected: the filter's weights have at least 8 bits (subTexelPrecisionBits is 8), so between any two
#   texels of an r8unorm texture some 256 values come out, whatever the texels hold.
# Seen: between texels of 0/255 and 10/255 only 11 values come out, with errors up to half a step, 5 % of
#   the range. The same ramp as r16unorm, and ramps of r16float and r32float, have all of 16,384 values,
#   without error.
# Why it matters: thin densities and dim light volumes kept in 8 bits show terraces, and a comparison with a
#   CPU twin that filters in floating point fails.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
pip_install python3 wgpu==0.32.0 numpy==2.4.6
cat >"$work/filter.py" <<'PY'
import numpy as np
import wgpu

adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan")
print("device:", adapter.info["device"], adapter.info["description"])
device = adapter.request_device_sync(required_features=["float32-filterable", "texture-format16bit-norm"])
shader = device.create_shader_module(code="""
@group(0) @binding(0) var volume: texture_3d<f32>;
@group(0) @binding(1) var linear: sampler;
@group(0) @binding(2) var<storage, read_write> out: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = 0.25 + 0.5 * f32(id.x) / 16383.0;
    out[id.x] = textureSampleLevel(volume, linear, vec3(x, 0.5, 0.5), 0.0).r;
}
""")
usage = wgpu.BufferUsage
sampler = device.create_sampler(min_filter="linear", mag_filter="linear")
pipeline = device.create_compute_pipeline(layout="auto", compute={"module": shader, "entry_point": "main"})


def ramp(name, texels, whole):
    texels = np.array(texels)
    texture = device.create_texture(
        size=(2, 1, 1), dimension="3d", format=name,
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST)
    device.queue.write_texture({"texture": texture}, texels, {"bytes_per_row": texels.nbytes}, (2, 1, 1))
    out = device.create_buffer(size=4 * 16384, usage=usage.STORAGE | usage.COPY_SRC)
    entries = [
        {"binding": 0, "resource": texture.create_view()},
        {"binding": 1, "resource": sampler},
        {"binding": 2, "resource": {"buffer": out}},
    ]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    compute = encoder.begin_compute_pass()
    compute.set_pipeline(pipeline)
    compute.set_bind_group(0, group)
    compute.dispatch_workgroups(256)
    compute.end()
    device.queue.submit([encoder.finish()])
    values = np.frombuffer(device.queue.read_buffer(out), np.float32) * whole / float(texels[1])
    error = np.abs(values - np.linspace(0, 1, 16384)).max()
    print(f"{name} {texels[1]} = {len(np.unique(values))} values, largest error {error:.3f}")


ramp("r8unorm", np.array([0, 255], np.uint8), 255)
ramp("r8unorm", np.array([0, 10], np.uint8), 255)
ramp("r16unorm", np.array([0, 2570], np.uint16), 65535)
ramp("r16float", np.array([0, 1], np.float16), 1)
ramp("r32float", np.array([0, 1], np.float32), 1)
PY
observe "$python" "$work/filter.py"
expect "r8unorm from 0 to 255" "$(seen "r8unorm 255")" "256 values, largest error 0.004"
expect "r8unorm from 0 to 10" "$(seen "r8unorm 10")" "11 values, largest error 0.052"
expect "r16unorm from 0 to 2570" "$(seen "r16unorm 2570")" "16384 values, largest error 0.000"
expect "r16float from 0 to 1" "$(seen "r16float 1.0")" "16384 values, largest error 0.000"
expect "r32float from 0 to 1" "$(seen "r32float 1.0")" "16384 values, largest error 0.000"
verdict
