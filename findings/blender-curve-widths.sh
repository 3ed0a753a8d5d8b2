#!/usr/bin/env bash
# Blender's USD export makes every curve without a bevel 2 m wide, though it renders nothing of it.
#
# Versions: bpy 5.2.3 of pip (Blender 5.2 LTS).
# Expected: a Bézier, NURBS or poly curve with a bevel depth of 0, which Blender renders as nothing, is
#   written without widths or with widths of 0; with a bevel depth of 0.01 its widths are 0.02.
# Seen: the widths are twice the radius of the points, which only scales the bevel and is 1 by default: 2 m,
#   with and without a bevel. Widths of hair curves are true diameters.
# Why it matters: a renderer that takes widths as diameters, as USD defines them, shows a guide curve of a few
#   centimetres as a rope that is 2 m thick and fills the scene.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3
cat >"$work/widths.py" <<'PY'
import re
import sys
import bpy


def widths(made, name):
    """Exports one object, and returns the widths in the file."""
    bpy.context.collection.objects.link(made)
    path = f"{sys.argv[1]}/{name}.usda"
    bpy.ops.wm.usd_export(filepath=path)
    with open(path) as file:
        found = re.search(r"float\[\] widths = \[([^]]*)\]", file.read())
    return sorted({round(float(width), 4) for width in found[1].split(",")}) if found else "none"


def curve(kind, bevel):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = bpy.data.curves.new("curve", "CURVE")
    made.dimensions, made.bevel_depth = "3D", bevel
    spline = made.splines.new(kind)
    points = spline.bezier_points if kind == "BEZIER" else spline.points
    points.add(3)
    for i, point in enumerate(points):
        point.co = (i, 0, 0) if kind == "BEZIER" else (i, 0, 0, 1)
    return bpy.data.objects.new("curve", made)


for kind in ("BEZIER", "POLY", "NURBS"):
    for bevel in (0.0, 0.01):
        name = f"{kind.lower()}-{bevel:g}"
        print(f"{name} = {widths(curve(kind, bevel), name)}")
bpy.ops.wm.read_factory_settings(use_empty=True)
hair = bpy.data.hair_curves.new("hair")
hair.add_curves([4])
for i, point in enumerate(hair.points):
    point.position, point.radius = (i, 0, 0), 0.01
print(f"hair = {widths(bpy.data.objects.new('hair', hair), 'hair')}")
PY
observe "$python" "$work/widths.py" "$work"
expect "hair of radius 0.01 (control)" "$(seen hair)" "[0.02]"
for kind in bezier poly nurbs; do
    expect "$kind, no bevel" "$(seen "$kind-0")" "[2.0]"
    expect "$kind, bevel 0.01" "$(seen "$kind-0.01")" "[2.0]"
done
verdict
