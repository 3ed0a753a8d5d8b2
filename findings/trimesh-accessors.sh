#!/usr/bin/env bash
# trimesh reads normalised glTF positions 32,767 times too large, and sparse ones as zeros.
#
# Versions: trimesh 5.2.0.
# Expected: values of an accessor with `normalized` are divided by their type's largest number. A sparse
#   accessor without a bufferView is zeros, overwritten by its own values. A file that cannot be read is
#   refused.
# Seen: a triangle of normalised 16-bit integers under a node of scale 2 has sides of 65,534, not 2. Of a
#   sparse accessor without a bufferView every vertex is 0. Neither raises an error or warns.
# Why it matters: quantised meshes and sparse morph targets are of these kinds. trimesh is no reference when
#   a loader is tested.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
pip_install python3 trimesh==5.2.0 numpy==2.4.6
cat >"$work/load.py" <<'PY'
import io
import json
import struct
import numpy as np
import trimesh

INDICES = {"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"}


def load(accessor, views, node=None, **extensions):
    """Corner by corner what trimesh makes of a triangle."""
    views = [np.array([0, 1, 2, 0], np.uint16).tobytes()] + views
    gltf = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], **extensions,
        "nodes": [{"mesh": 0, **(node or {})}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0}]}],
        "accessors": [INDICES, {"count": 3, "type": "VEC3", **accessor}],
        "buffers": [{"byteLength": sum(map(len, views))}],
        "bufferViews": [],
    }
    offset = 0
    for i, view in enumerate(views):
        gltf["bufferViews"].append({"buffer": 0, "byteOffset": offset, "byteLength": len(view)})
        offset += len(view)
    if "normalized" in accessor:
        gltf["bufferViews"][1]["byteStride"] = 8
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(views)
    glb = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    glb += struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    scene = trimesh.load_scene(io.BytesIO(glb), file_type="glb", process=False)
    return " ".join(f"({x:g} {y:g} {z:g})" for x, y, z in scene.to_mesh().vertices)


plain = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
print("float =", load({"componentType": 5126, "bufferView": 1, "min": [0, 0, 0], "max": [1, 1, 0]},
                      [plain.tobytes()], {"scale": [2, 2, 2]}))
wide = np.array([[0, 0, 0, 0], [32767, 0, 0, 0], [0, 32767, 0, 0]], np.int16)
print("normalised =", load(
    {"componentType": 5122, "normalized": True, "bufferView": 1, "min": [0, 0, 0], "max": [32767, 32767, 0]},
    [wide.tobytes()], {"scale": [2, 2, 2]},
    extensionsUsed=["KHR_mesh_quantization"], extensionsRequired=["KHR_mesh_quantization"]))
where = np.array([1, 2], np.uint16)
values = np.array([[1, 0, 0], [0, 1, 0]], np.float32)
print("sparse =", load(
    {"componentType": 5126, "min": [0, 0, 0], "max": [1, 1, 0],
     "sparse": {
         "count": 2, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 2}}},
    [where.tobytes(), values.tobytes()]))
PY
observe "$python" "$work/load.py"
expect "floats at scale 2" "$(seen float)" "(0 0 0) (2 0 0) (0 2 0)"
expect "normalised integers at scale 2" "$(seen normalised)" "(0 0 0) (65534 0 0) (0 65534 0)"
expect "sparse" "$(seen sparse)" "(0 0 0) (0 0 0) (0 0 0)"
verdict
