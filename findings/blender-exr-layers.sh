#!/usr/bin/env bash
# Blender's Python finds no pixels in an OpenEXR file with layers, and no error says so.
#
# Versions: bpy 5.2.3 of pip (Blender 5.2 LTS), OpenEXR 3.5.3 of pip.
# Expected: a file whose main picture stands in R, G, B and A is read as that picture, whatever channels of
#   layers stand beside it, as other readers of OpenEXR do.
# Seen: with one more channel called depth.Z, images.load gives an image of 0 × 0 pixels without channels, and
#   its list of pixels is empty. Nothing is raised or printed. A further channel called Z does no harm.
# Why it matters: a script that averages, compares or bakes renders works with preview files and silently gets
#   nothing, or NaN, as soon as the renderer adds a depth or albedo layer.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3 openexr==3.5.3
cat >"$work/load.py" <<'PY'
import sys
import bpy
import numpy
import OpenEXR

ramp = numpy.linspace(0, 1, 12, dtype=numpy.float32).reshape(3, 4)
picture = {"R": ramp, "G": ramp, "B": ramp, "A": numpy.ones_like(ramp)}
for name, more in ("plain", []), ("depth", ["depth.Z"]), ("z", ["Z"]):
    path = f"{sys.argv[1]}/{name}.exr"
    OpenEXR.File({"type": OpenEXR.scanlineimage}, picture | {own: ramp for own in more}).write(path)
    kept = OpenEXR.File(path).channels()
    print(f"{name}_openexr =", kept["RGBA"].pixels.shape[:2])
    image = bpy.data.images.load(path)
    print(f"{name} =", *image.size, image.channels, len(image.pixels))
PY
observe "$python" "$work/load.py" "$work"
expect "OpenEXR's own reader, with a layer" "$(seen depth_openexr)" "(3, 4)"
expect "width, height, channels and numbers of a plain file" "$(seen plain)" "4 3 4 48"
expect "the same with a channel Z" "$(seen z)" "4 3 4 48"
expect "the same with a channel depth.Z" "$(seen depth)" "0 0 0 0"
verdict
