#!/usr/bin/env bash
# Blender's glTF export puts an invented white set of colours before the painted one.
#
# Version: bpy 5.2.3 of pip (Blender 5.2 LTS).
# Expected: a mesh with one set of colours of vertices has one in the file, in COLOR_0.
# Seen: if no material uses the colours, the exporter's defaults write COLOR_0 with 1 everywhere and the
#   painted colours as COLOR_1; the log says that the active colours will not be exported. With
#   export_vertex_color="ACTIVE" the painted ones are COLOR_0, and there is no other.
# Why it matters: a renderer that reads masks, thickness or growth from COLOR_0 gets a mask of 1, and nothing
#   looks broken.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3
cat >"$work/colors.py" <<'PY'
import json, struct, sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add()
plane = bpy.context.object
plane.data.materials.append(bpy.data.materials.new("plain"))
colors = plane.data.color_attributes.new("mask", "FLOAT_COLOR", "POINT")
for value in colors.data:
    value.color = (0.25, 0.25, 0.25, 1.0)
for name, options in [("defaults", {}), ("active", {"export_vertex_color": "ACTIVE"})]:
    bpy.ops.export_scene.gltf(filepath=f"{sys.argv[1]}/{name}.gltf", export_format="GLTF_SEPARATE", **options)
    document = json.load(open(f"{sys.argv[1]}/{name}.gltf"))
    data = open(f"{sys.argv[1]}/{name}.bin", "rb").read()
    for key, number in sorted(document["meshes"][0]["primitives"][0]["attributes"].items()):
        if not key.startswith("COLOR"):
            continue
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        code, most = {5126: ("f", 1.0), 5123: ("H", 65535.0), 5121: ("B", 255.0)}[accessor["componentType"]]
        red = struct.unpack_from("<" + code, data, first)[0] / most
        print(f"{name} {key} = {red:.2f}")
PY
observe "$python" "$work/colors.py" "$work"
expect "red in the first set, by default" "$(seen 'defaults COLOR_0')" "1.00"
expect "red in the second set, by default" "$(seen 'defaults COLOR_1')" "0.25"
expect "red in the first set, of the active colours" "$(seen 'active COLOR_0')" "0.25"
expect "red in the second set, of the active colours" "$(seen 'active COLOR_1')" ""
verdict
