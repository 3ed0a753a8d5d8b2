#!/usr/bin/env bash
# Blender "exports" hair curves to OBJ, PLY and glTF with success, and no hair is in them.
#
# Versions: bpy 5.2.3 of pip (Blender 5.2 LTS).
# Expected: an exporter that cannot write hair raises an error or answers CANCELLED.
# Seen: all answer FINISHED. OBJ says "File exported successfully" and writes no file, PLY has no vertices,
#   and glTF has a node without a mesh. USD and Alembic hold the curves: USD as pinned cubic Catmull-Rom
#   whose widths are diameters.
# Why it matters: a pipeline that checks the operator's answer, or only that a file is there, hands a bald
#   scene to the renderer.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3
cat >"$work/export.py" <<'PY'
import json
import os
import struct
import sys
import bpy


def hair():
    """A scene of two curves."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves([4, 4])
    for i, point in enumerate(curves.points):
        point.position = (i // 4, 0, i % 4)
        point.radius = 0.01
    bpy.context.collection.objects.link(bpy.data.objects.new("hair", curves))


def export(operator, name):
    path = f"{sys.argv[1]}/{name}"
    answer = operator(filepath=path)
    assert answer == {"FINISHED"}, answer
    return path


hair()
path = export(bpy.ops.wm.obj_export, "hair.obj")
print("obj =", "FINISHED,", "a file" if os.path.exists(path) else "no file")
path = export(bpy.ops.wm.ply_export, "hair.ply")
head = open(path, "rb").read().split(b"end_header")[0].decode()
print("ply = FINISHED,", *[line for line in head.splitlines() if line.startswith("element")])
path = export(bpy.ops.export_scene.gltf, "hair.glb")
with open(path, "rb") as file:
    length, = struct.unpack("<I", file.read(20)[12:16])
    gltf = json.loads(file.read(length))
print("gltf = FINISHED, nodes", gltf["nodes"], "meshes", gltf.get("meshes"))
for name, write, read in [
    ("usd", bpy.ops.wm.usd_export, bpy.ops.wm.usd_import),
    ("alembic", bpy.ops.wm.alembic_export, bpy.ops.wm.alembic_import),
]:
    hair()
    path = export(write, f"hair.{'usda' if name == 'usd' else 'abc'}")
    if name == "usd":
        lines = [line.strip() for line in open(path, encoding="utf-8")]
        words = [line.split("=")[1].strip().strip('"') for line in lines if line.startswith("uniform token")]
        widths = next(line for line in lines if "widths" in line).split("[")[2].split(",")[0]
        print("kind =", *sorted(word for word in words if word in ("cubic", "catmullRom", "pinned")), widths)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    read(filepath=path)
    back = [thing.data for thing in bpy.data.objects if thing.type == "CURVES"]
    print(f"{name} = FINISHED,", *[f"{len(c.curves)} curves, {len(c.points)} points" for c in back])
PY
observe "$python" "$work/export.py" "$work" >"$work/all" 2>&1 || { cat "$work/all"; exit 1; }
grep -E ' = |successfully' "$work/all"
expect "OBJ" "$(seen obj)" "FINISHED, no file"
expect "PLY" "$(seen ply)" "FINISHED, element vertex 0"
expect "glTF" "$(seen gltf)" "FINISHED, nodes [{'name': 'hair'}] meshes None"
expect "USD" "$(seen usd)" "FINISHED, 2 curves, 8 points"
expect "USD's curves, and the width of radius 0.01" "$(seen kind)" "catmullRom cubic pinned 0.02"
expect "Alembic" "$(seen alembic)" "FINISHED, 2 curves, 8 points"
verdict
