#!/usr/bin/env bash
# A rotation in a glTF file of Blender turns texture coordinates clockwise.
#
# Version: bpy 5.2.3 of pip (Blender 5.2 LTS).
# Expected: the matrix of the GLSL in the draft of KHR_texture_transform, after scale and before offset:
#   u' = cos r * u - sin r * v and v' = sin r * u + cos r * v.
# Seen: a Mapping node with 30 degrees is written as +30 degrees, but only the matrix with the other sign of r
#   gives the coordinates that Blender samples; the GLSL's is off by up to 0.4 of the texture. The reason is
#   that v runs down in glTF: what is counter-clockwise in the picture is clockwise in (u, v).
# Why it matters: a reader that follows the GLSL shows every turned texture turned the wrong way, and mirrored
#   cases still look plausible.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3
cat >"$work/turn.py" <<'PY'
import json, math, struct, sys
import bpy

TURN, SCALE, PLACE = math.radians(30), (2.0, 3.0), (0.1, 0.2)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add()
plane = bpy.context.object
image = bpy.data.images.new("chart", 4, 4)
image.filepath_raw = f"{sys.argv[1]}/chart.png"
image.file_format = "PNG"
image.save()
material = bpy.data.materials.new("chart")
material.use_nodes = True
nodes, links = material.node_tree.nodes, material.node_tree.links
texture = nodes.new("ShaderNodeTexImage")
texture.image = image
mapping = nodes.new("ShaderNodeMapping")
mapping.inputs["Rotation"].default_value = (0, 0, TURN)
mapping.inputs["Scale"].default_value = (*SCALE, 1)
mapping.inputs["Location"].default_value = (*PLACE, 0)
uv_map = nodes.new("ShaderNodeUVMap")
uv_map.uv_map = plane.data.uv_layers[0].name
links.new(uv_map.outputs["UV"], mapping.inputs["Vector"])
links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
plane.data.materials.append(material)
bpy.ops.export_scene.gltf(filepath=f"{sys.argv[1]}/turn.gltf", export_format="GLTF_SEPARATE")
document = json.load(open(f"{sys.argv[1]}/turn.gltf"))
info = document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
t = info["extensions"]["KHR_texture_transform"]
offset, scale, turn = t.get("offset", [0, 0]), t.get("scale", [1, 1]), t.get("rotation", 0)
print("rotation =", f"{math.degrees(turn):.1f}")
cos, sin = math.cos(turn), math.sin(turn)
worst = {"counter-clockwise": 0.0, "clockwise": 0.0}
for u, v in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.8)]:
    # Blender: scaled, turned, moved, with v up.
    x, y = u * SCALE[0], v * SCALE[1]
    bu = x * math.cos(TURN) - y * math.sin(TURN) + PLACE[0]
    bv = x * math.sin(TURN) + y * math.cos(TURN) + PLACE[1]
    x, y = u * scale[0], (1 - v) * scale[1]
    for name, s in ("counter-clockwise", sin), ("clockwise", -sin):
        gu, gv = x * cos - y * s + offset[0], x * s + y * cos + offset[1]
        # The rows of an image repeat.
        away = lambda d: abs(d - round(d))
        worst[name] = max(worst[name], away(gu - bu), away(gv - (1 - bv)))
for name, error in worst.items():
    print(f"{name} = {error:.3f}")
PY
observe "$python" "$work/turn.py" "$work"
expect "the rotation in the file" "$(seen rotation)" "30.0"
expect "largest error of the counter-clockwise matrix" "$(seen counter-clockwise)" "0.400"
expect "largest error of the clockwise matrix" "$(seen clockwise)" "0.000"
verdict
