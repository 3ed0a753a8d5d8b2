#!/usr/bin/env bash
# SwiftShader, the software GPU of Chromium, snaps corners to a sixteenth of a pixel.
#
# Versions: SwiftShader of @sparticuz/chromium 148.0.0 of npm, Mesa 22.3.6 (Debian 12), wgpu-py 0.32.0,
#   vulkan 1.3.275.1.
# Expected: corners are snapped to 1/256 pixel as by lavapipe and by GPUs of desktops, so a rectangle whose
#   left border lies 0.02 pixels to the right of a pixel's centre does not cover the pixel.
# Seen: it covers the pixel. subPixelPrecisionBits is 4, the least that Vulkan allows; wgpu and WebGPU do not
#   tell it.
# Why it matters: edges of one scene lie up to 1/32 pixel elsewhere than on other drivers, and what is
#   interpolated over small triangles differs by several per cent. Tolerances that hold for lavapipe fail in
#   headless Chromium.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
npm_install @sparticuz/chromium@148.0.0
pip_install python3 wgpu==0.32.0 vulkan==1.3.275.1
# shellcheck disable=SC2016
unpack='const fs = require("fs"), [from, to] = process.argv.slice(1);
    fs.writeFileSync(to, require("zlib").brotliDecompressSync(fs.readFileSync(from)));'
node -e "$unpack" "$work/node/node_modules/@sparticuz/chromium/bin/swiftshader.tar.br" "$work/swiftshader.tar"
mkdir "$work/swiftshader"
tar --extract --file "$work/swiftshader.tar" --directory "$work/swiftshader"
cat >"$work/border.py" <<'PY'
import sys

import vulkan as vk
import wgpu

driver = sys.argv[1]
instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(), None)
(device,) = vk.vkEnumeratePhysicalDevices(instance)
print(f"{driver} bits =", vk.vkGetPhysicalDeviceProperties(device).limits.subPixelPrecisionBits)

SIDE = 8
SHADER = """
const border = BORDER;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    let left = border / 4.0 - 1.0;
    return vec4<f32>(select(left, 1.0, (i & 1u) == 1u), select(-1.0, 1.0, i > 1u), 0.0, 1.0);
}

@fragment
fn white() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}
"""


def covered(device, border):
    """Number of pixels of the first row that a rectangle from `border` pixels to the right end covers."""
    module = device.create_shader_module(code=SHADER.replace("BORDER", str(border)))
    pipeline = device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": "corner"},
        primitive={"topology": "triangle-strip"},
        fragment={"module": module, "entry_point": "white", "targets": [{"format": "rgba8unorm"}]},
    )
    texture = device.create_texture(
        size=(SIDE, SIDE, 1),
        format="rgba8unorm",
        usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC,
    )
    encoder = device.create_command_encoder()
    target = {"view": texture.create_view(), "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
    work = encoder.begin_render_pass(color_attachments=[target])
    work.set_pipeline(pipeline)
    work.draw(4)
    work.end()
    device.queue.submit([encoder.finish()])
    layout = {"bytes_per_row": 4 * SIDE, "rows_per_image": SIDE}
    row = device.queue.read_texture({"texture": texture}, layout, (SIDE, 1, 1))
    return sum(value == 255 for value in bytes(row)[::4])


(adapter,) = [a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan"]
print("device:", adapter.info["device"], adapter.info["description"])
told = [name for name in adapter.limits if "sub" in name.lower() and "pixel" in name.lower()]
print(f"{driver} limits of wgpu =", ", ".join(told) or "none")
device = adapter.request_device_sync()
for border in [0.48, 0.52, 0.55]:
    print(f"{driver} from {border} =", covered(device, border))
PY
observe "$python" "$work/border.py" lavapipe
driver=$work/swiftshader/vk_swiftshader_icd.json
export VK_DRIVER_FILES=$driver VK_ICD_FILENAMES=$driver
observe "$python" "$work/border.py" swiftshader
expect "sub-pixel bits of lavapipe" "$(seen 'lavapipe bits')" 8
expect "sub-pixel bits of SwiftShader" "$(seen 'swiftshader bits')" 4
expect "limits of wgpu about them" "$(seen 'swiftshader limits of wgpu')" none
expect "pixels of 8 from 0.48, lavapipe" "$(seen 'lavapipe from 0.48')" 8
expect "pixels of 8 from 0.52, lavapipe" "$(seen 'lavapipe from 0.52')" 7
expect "pixels of 8 from 0.48, SwiftShader" "$(seen 'swiftshader from 0.48')" 8
expect "pixels of 8 from 0.52, SwiftShader" "$(seen 'swiftshader from 0.52')" 8
expect "pixels of 8 from 0.55, SwiftShader" "$(seen 'swiftshader from 0.55')" 7
verdict
