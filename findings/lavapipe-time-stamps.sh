#!/usr/bin/env bash
# lavapipe: once a device has rendered, time stamps leave out the first dispatch of a compute pass.
#
# Versions: Mesa 22.3.6 (Debian 12), wgpu-py 0.32.0.
# Expected: the difference of a pass's two stamps is the time that it took, within a few per cent of the
#   host's clock.
# Seen: that holds until the device's first render pass, even one without a draw. From then on the first
#   stamp is written when the pass's first dispatch is over: a pass of one dispatch shows less than a
#   thousandth of its time, a pass of two equal ones shows half.
# Why it matters: a renderer that sizes its tiles or reports its speed by time stamps takes software Vulkan
#   to be a thousand times as fast as it is. A test that never renders does not see it.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
pip_install python3 wgpu==0.32.0 numpy==2.4.6
cat >"$work/stamps.py" <<'PY'
import time
import numpy as np
import wgpu

adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan")
print("device:", adapter.info["device"], adapter.info["description"])
device = adapter.request_device_sync(required_features=["timestamp-query"])
count = 64 * 1000
shader = device.create_shader_module(code="""
@group(0) @binding(0) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    var state = id.x;
    for (var i = 0u; i < 20000u; i++) {
        state = state * 747796405u + 2891336453u;
    }
    out[id.x] = state;
}
""")
pipeline = device.create_compute_pipeline(layout="auto", compute={"module": shader, "entry_point": "main"})
usage = wgpu.BufferUsage
out = device.create_buffer(size=4 * count, usage=usage.STORAGE | usage.COPY_DST)
group = device.create_bind_group(
    layout=pipeline.get_bind_group_layout(0), entries=[{"binding": 0, "resource": {"buffer": out}}]
)
queries = device.create_query_set(type="timestamp", count=2)
stamps = device.create_buffer(size=256, usage=usage.QUERY_RESOLVE | usage.COPY_SRC)


def run(dispatches):
    """Share of the host's time that the stamps tell."""
    encoder = device.create_command_encoder()
    writes = {"query_set": queries, "beginning_of_pass_write_index": 0, "end_of_pass_write_index": 1}
    compute = encoder.begin_compute_pass(timestamp_writes=writes)
    compute.set_pipeline(pipeline)
    compute.set_bind_group(0, group)
    for _ in range(dispatches):
        compute.dispatch_workgroups(count // 64)
    compute.end()
    encoder.resolve_query_set(queries, 0, 2, stamps, 0)
    start = time.perf_counter()
    device.queue.submit([encoder.finish()])
    begin, end = np.frombuffer(device.queue.read_buffer(stamps), np.uint64)[:2].astype(float)
    host = time.perf_counter() - start
    told = (end - begin) * 1e-9
    print(f"dispatches: {dispatches}; the stamps tell {told * 1e3:.2f} ms, the host {host * 1e3:.1f} ms")
    return told / host


def word(share):
    if share < 0.02:
        return "next to nothing"
    return "half" if 0.4 < share < 0.6 else "all" if share > 0.75 else share


def render():
    size = {"size": (16, 16, 1), "format": "rgba8unorm", "usage": wgpu.TextureUsage.RENDER_ATTACHMENT}
    view = device.create_texture(**size).create_view()
    target = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
    encoder = device.create_command_encoder()
    encoder.begin_render_pass(color_attachments=[target]).end()
    device.queue.submit([encoder.finish()])


run(1)
print("before =", word(run(1)))
render()
print("one =", word(run(1)))
print("two =", word(run(2)))
PY
observe "$python" "$work/stamps.py"
expect "told of one dispatch before anything was rendered" "$(seen before)" all
expect "told of one dispatch afterwards" "$(seen one)" "next to nothing"
expect "told of two dispatches afterwards" "$(seen two)" half
verdict
