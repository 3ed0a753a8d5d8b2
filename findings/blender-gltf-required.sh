#!/usr/bin/env bash
# Blender's glTF requires lamps and texture transforms of a reader, but not instancing.
#
# Versions: bpy 5.2.3 of pip (Blender 5.2 LTS).
# Expected: extensionsRequired lists what a reader cannot do without. A mesh can be shown without
#   KHR_lights_punctual; twenty instances cannot be shown without EXT_mesh_gpu_instancing.
# Seen: KHR_lights_punctual and KHR_texture_transform are required as soon as they are used. Twenty objects
#   that share a mesh become one node with EXT_mesh_gpu_instancing, which is in extensionsUsed alone.
# Why it matters: a strict reader refuses an ordinary scene for its lamp, and shows a field of twenty plants
#   as a single one without a word.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3
cat >"$work/export.py" <<'PY'
import json
import struct
import sys
import bpy


def glb(name, **options):
    path = f"{sys.argv[1]}/{name}.glb"
    bpy.ops.export_scene.gltf(filepath=path, **options)
    with open(path, "rb") as file:
        length, = struct.unpack("<I", file.read(20)[12:16])
        gltf = json.loads(file.read(length))
    print(f"{name} = used {gltf.get('extensionsUsed')}, required {gltf.get('extensionsRequired')}")
    return gltf


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def link(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(thing)
    return thing


empty()
link("lamp", bpy.data.lights.new("lamp", "POINT"))
glb("lamp", export_lights=True)

empty()
bpy.ops.mesh.primitive_plane_add()
material = bpy.data.materials.new("rock")
material.use_nodes = True
bpy.context.object.data.materials.append(material)
nodes, links = material.node_tree.nodes, material.node_tree.links
image = nodes.new("ShaderNodeTexImage")
image.image = bpy.data.images.new("rock", 4, 4)
image.image.pack()
mapping = nodes.new("ShaderNodeMapping")
mapping.inputs["Scale"].default_value = (2, 2, 1)
links.new(nodes.new("ShaderNodeTexCoord").outputs["UV"], mapping.inputs["Vector"])
links.new(mapping.outputs["Vector"], image.inputs["Vector"])
shader = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
links.new(image.outputs["Color"], shader.inputs["Base Color"])
glb("texture")

empty()
parent = link("field", None)
bpy.ops.mesh.primitive_cube_add()
plant = bpy.context.object.data
bpy.data.objects.remove(bpy.context.object)
for i in range(20):
    instance = link(f"plant {i}", plant)
    instance.location = (3 * i, 0, 0)
    instance.parent = parent
gltf = glb("field", export_gpu_instances=True)
print("nodes =", len(gltf["nodes"]))
PY
# It logs that two optional libraries are missing, and what it exports.
observe "$python" -W ignore "$work/export.py" "$work" >"$work/all" 2>&1 || { cat "$work/all"; exit 1; }
grep ' = ' "$work/all"
expect "with a lamp" "$(seen lamp)" "used ['KHR_lights_punctual'], required ['KHR_lights_punctual']"
expect "with a scaled texture" "$(seen texture)" \
    "used ['KHR_texture_transform'], required ['KHR_texture_transform']"
expect "with twenty instances" "$(seen field)" "used ['EXT_mesh_gpu_instancing'], required None"
expect "nodes of the twenty" "$(seen nodes)" 1
verdict
