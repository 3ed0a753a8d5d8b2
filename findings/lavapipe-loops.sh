#!/usr/bin/env bash
# lavapipe: after 65,535 turns all loops of an invocation end, without a word.
#
# Versions: Mesa 22.3.6 (Debian 12), wgpu-py 0.32.0.
# Expected: a counted loop runs to its end, or the device is lost.
# Seen: the turns of all loops of an invocation are counted together. A loop of 68,000 turns ends after
#   65,535. Two loops of 40,000 make 65,534 turns together. 1000 times 1000 turns come to 65,405. The
#   invocation then goes on behind the loop, and nothing reports an error.
# Why it matters: long walks through a volume, nested loops over lights and path tracers that loop over
#   samples give plausible, wrong pictures on the driver that most tests run on.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
pip_install python3 wgpu==0.32.0 numpy==2.4.6
cat >"$work/loops.py" <<'PY'
import numpy as np
import wgpu

adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan")
print("device:", adapter.info["device"], adapter.info["description"])
device = adapter.request_device_sync()
usage = wgpu.BufferUsage


def run(body, turns):
    """What the shader counted; the number of turns is not known to the compiler."""
    shader = device.create_shader_module(code="""
        @group(0) @binding(0) var<storage, read> turns: array<u32>;
        @group(0) @binding(1) var<storage, read_write> out: array<u32>;
        @compute @workgroup_size(1)
        fn main() {
            let n = turns[0];
            var count = 0u;
            BODY
            out[0] = count;
        }
    """.replace("BODY", body))
    stage = {"module": shader, "entry_point": "main"}
    pipeline = device.create_compute_pipeline(layout="auto", compute=stage)
    n = device.create_buffer_with_data(data=np.array([turns], np.uint32), usage=usage.STORAGE)
    out = device.create_buffer(size=4, usage=usage.STORAGE | usage.COPY_SRC)
    entries = [{"binding": 0, "resource": {"buffer": n}}, {"binding": 1, "resource": {"buffer": out}}]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    compute = encoder.begin_compute_pass()
    compute.set_pipeline(pipeline)
    compute.set_bind_group(0, group)
    compute.dispatch_workgroups(1)
    compute.end()
    device.queue.submit([encoder.finish()])
    return int(np.frombuffer(device.queue.read_buffer(out), np.uint32)[0])


loop = "for (var i = 0u; i < n; i++) { count++; }"
print("short =", run(loop, 60000))
print("long =", run(loop, 68000))
print("two =", run(loop + loop, 40000))
print("nested =", run("for (var i = 0u; i < n; i++) { for (var j = 0u; j < n; j++) { count++; } }", 1000))
PY
observe "$python" "$work/loops.py"
expect "turns of a loop of 60000" "$(seen short)" 60000
expect "turns of a loop of 68000" "$(seen long)" 65535
expect "turns of two loops of 40000" "$(seen two)" 65534
expect "turns of 1000 times 1000" "$(seen nested)" 65405
verdict
