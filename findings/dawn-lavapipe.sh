#!/usr/bin/env bash
# Dawn finds no adapter on Debian 12's lavapipe, where wgpu does.
#
# Versions: Mesa 22.3.6 (Debian 12), webgpu 0.6.2 of npm (Dawn), wgpu-py 0.32.0, vulkan 1.3.275.1.
# Expected: lavapipe 22.3.6 is a driver of Vulkan 1.3, so WebGPU runs on it through Dawn as well as through
#   wgpu.
# Seen: Dawn warns "Vulkan shaderUniform*ArrayDynamicIndexing required" and requestAdapter answers null.
#   lavapipe has dynamic indexing for uniform and storage buffers, but not for sampled images, where Vulkan
#   leaves it optional.
# Why it matters: a CI that draws on this driver through wgpu cannot try the same code with Dawn, and says
#   nothing about Chromium.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
lavapipe
npm_install webgpu@0.6.2
pip_install python3 wgpu==0.32.0 vulkan==1.3.275.1
cat >"$work/node/adapter.mjs" <<'JS'
import { create, globals } from "webgpu";

Object.assign(globalThis, globals);
const adapter = await create(["backend=vulkan"]).requestAdapter();
console.log("dawn =", adapter === null ? "no adapter" : `adapter ${adapter.info.description}`);
process.exit(0);
JS
cat >"$work/features.py" <<'PY'
import vulkan as vk
import wgpu

application = vk.VkApplicationInfo(apiVersion=vk.VK_MAKE_VERSION(1, 3, 0))
instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(pApplicationInfo=application), None)
for device in vk.vkEnumeratePhysicalDevices(instance):
    properties = vk.vkGetPhysicalDeviceProperties(device)
    features = vk.vkGetPhysicalDeviceFeatures(device)
    print("device:", properties.deviceName)
    print(f"version = {properties.apiVersion >> 22}.{properties.apiVersion >> 12 & 0x3FF}")
    for kind in ["UniformBuffer", "StorageBuffer", "SampledImage"]:
        print(f"{kind} =", "yes" if getattr(features, f"shader{kind}ArrayDynamicIndexing") else "no")
found = [a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan"]
print("wgpu =", "adapter" if found and found[0].request_device_sync() else "no adapter")
PY
node "$work/node/adapter.mjs" 2>&1 | sed '/^ *at /d' | tee "$work/seen"
observe "$python" "$work/features.py"
expect "Vulkan of the driver" "$(seen version)" 1.3
expect "dynamic indices into uniform buffers" "$(seen UniformBuffer)" yes
expect "dynamic indices into storage buffers" "$(seen StorageBuffer)" yes
expect "dynamic indices into sampled images" "$(seen SampledImage)" no
expect "wgpu" "$(seen wgpu)" adapter
expect "Dawn" "$(seen dawn)" "no adapter"
verdict
