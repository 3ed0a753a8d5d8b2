#!/usr/bin/env bash
# egui's WGSL shader is several times slower on software Vulkan because of a filter that is off.
#
# Versions: egui-wgpu 0.37.0, Mesa 22.3.6 (Debian 12), wgpu-py 0.32.0.
# Expected: `predictable_texture_filtering` is a uniform and 0, so every pixel takes the branch with one
#   textureSample. The filter in the other branch, four textureLoad with wrap modes, costs nothing.
# Seen: drawing takes more than three times as long as with that branch cut out of the shader, for an equal
#   picture, and as long as with the filter on. llvmpipe runs both sides of a branch and then selects.
# Why it matters: an egui window without a GPU is faster through OpenGL, whose shader has no such branch. A
#   renderer's own shaders pay in the same way for what a uniform switches off; specialised pipelines do
#   not.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
cargo_source egui-wgpu 0.37.0
pip_install python3 wgpu==0.32.0 numpy==2.4.6
cat >"$work/draw.py" <<'PY'
import re
import sys
import time
import numpy as np
import wgpu

whole = open(sys.argv[1], encoding="utf-8").read()
# sample_texture keeps the statement of its first branch alone.
body = re.compile(r"(fn sample_texture\(in: VertexOutput\) -> vec4<f32> \{)(.*?)\n\}\n", re.S)
first = re.search(r"return textureSample\([^;]*;", body.search(whole)[2])[0]
short = body.sub(lambda m: m[1] + "\n    " + first + "\n}\n", whole, count=1)
assert "textureLoad" in whole and "textureLoad" not in short

adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan")
print("device:", adapter.info["device"], adapter.info["description"])
device = adapter.request_device_sync()
usage, width, height, layers = wgpu.BufferUsage, 1280, 720, 8
corners = np.array([[0, 0], [1, 0], [0, 1], [1, 0], [1, 1], [0, 1]], np.float32)
vertices = np.zeros(6, [("at", "f4", 2), ("uv", "f4", 2), ("color", "u4")])
vertices["at"] = corners * [width, height]
vertices["uv"] = corners
vertices["color"] = 0xFF8040C0
vertices = device.create_buffer_with_data(data=vertices.tobytes(), usage=usage.VERTEX)
flags = device.create_buffer_with_data(data=np.zeros(4, np.uint32), usage=usage.UNIFORM)
noise = np.random.default_rng(1).integers(0, 256, (512, 512, 4), dtype=np.uint8)
texture = device.create_texture(
    size=(512, 512, 1), format="rgba8unorm",
    usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST)
device.queue.write_texture({"texture": texture}, noise, {"bytes_per_row": 2048}, (512, 512, 1))
sampler = device.create_sampler(min_filter="linear", mag_filter="linear")
target = device.create_texture(
    size=(width, height, 1), format="rgba8unorm",
    usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC)


def draw(code, predictable):
    """The fastest of some frames, in ms a layer, and the picture."""
    module = device.create_shader_module(code=code)
    formats = [("float32x2", 0), ("float32x2", 8), ("uint32", 16)]
    attributes = [{"format": f, "offset": o, "shader_location": i} for i, (f, o) in enumerate(formats)]
    over = {"src_factor": "one", "dst_factor": "one-minus-src-alpha"}
    pipeline = device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": "vs_main",
                "buffers": [{"array_stride": 20, "attributes": attributes}]},
        fragment={"module": module, "entry_point": "fs_main_gamma_framebuffer",
                  "targets": [{"format": "rgba8unorm", "blend": {"color": over, "alpha": over}}]},
        primitive={"topology": "triangle-list"})
    values = np.array([width, height], np.float32).tobytes() + np.array([0, predictable], np.uint32).tobytes()
    values = device.create_buffer_with_data(data=values, usage=usage.UNIFORM)
    entries = [{"binding": 0, "resource": texture.create_view()}, {"binding": 1, "resource": sampler}]
    if "textureLoad" in code:
        entries.append({"binding": 2, "resource": {"buffer": flags}})
    groups = [
        device.create_bind_group(
            layout=pipeline.get_bind_group_layout(0),
            entries=[{"binding": 0, "resource": {"buffer": values}}]),
        device.create_bind_group(layout=pipeline.get_bind_group_layout(1), entries=entries),
    ]
    fastest = float("inf")
    for _ in range(8):
        encoder = device.create_command_encoder()
        attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store",
                      "clear_value": (0, 0, 0, 0)}
        render = encoder.begin_render_pass(color_attachments=[attachment])
        render.set_pipeline(pipeline)
        render.set_vertex_buffer(0, vertices)
        for index, group in enumerate(groups):
            render.set_bind_group(index, group)
        for _ in range(layers):
            render.draw(6)
        render.end()
        start = time.perf_counter()
        device.queue.submit([encoder.finish()])
        rows = {"bytes_per_row": 4 * width}
        picture = device.queue.read_texture({"texture": target}, rows, (width, height, 1))
        fastest = min(fastest, time.perf_counter() - start)
    return fastest * 1e3 / layers, bytes(picture)


cut, cut_picture = draw(short, 0)
off, off_picture = draw(whole, 0)
on, on_picture = draw(whole, 1)
print(f"ms a layer of 1280x720: branch cut out {cut:.1f}, filter off {off:.1f}, filter on {on:.1f}")
print("pictures =", "equal" if cut_picture == off_picture else "different")
print("factor =", "more than 3" if off > 3 * cut else f"{off / cut:.1f}")
print("on =", "as long as off" if 0.7 < on / off < 1.4 else f"{on / off:.1f} times as long")
PY
observe "$python" "$work/draw.py" "$crate/src/egui.wgsl"
expect "pictures with the branch cut out and with the filter off" "$(seen pictures)" equal
expect "time with the filter off, in times of the branch cut out" "$(seen factor)" "more than 3"
expect "time with the filter on" "$(seen on)" "as long as off"
verdict
