#!/usr/bin/env bash
# Blender's Image.save writes sRGB-coded numbers into an OpenEXR file.
#
# Versions: bpy 5.2.3 of pip (Blender 5.2 LTS), OpenEXR 3.5.3 of pip.
# Expected: a float image in the colour space "Linear Rec.709" is saved as its linear numbers, which is what
#   readers take an EXR file to hold.
# Seen: 0.18 is stored as 0.461, 0.5 as 0.735 and 4 as 1.825, with colorInteropID srgb_rec709_display beside
#   them. save_render of the same image writes the linear numbers, with lin_rec709_scene.
# Why it matters: a light probe or texture that a script bakes and saves this way looks washed out, and its
#   lights lose half of their strength or more, in every renderer that does not read colorInteropID.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
python_of 13
pip_install "$interpreter" bpy==5.2.3 openexr==3.5.3
cat >"$work/save.py" <<'PY'
import sys
import bpy
import OpenEXR

VALUES = [0.18, 0.5, 1.0, 4.0]
bpy.ops.wm.read_factory_settings(use_empty=True)
image = bpy.data.images.new("probe", len(VALUES), 1, float_buffer=True)
image.pixels[:] = [channel for value in VALUES for channel in (value, value, value, 1)]
print("space =", image.colorspace_settings.name)
image.file_format = "OPEN_EXR"
image.filepath_raw = f"{sys.argv[1]}/save.exr"
image.save()
settings = bpy.context.scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
image.save_render(f"{sys.argv[1]}/render.exr")
for name in "save", "render":
    file = OpenEXR.File(f"{sys.argv[1]}/{name}.exr", separate_channels=True)
    red = file.channels()["R"].pixels[0]
    print(f"{name} =", *[f"{value:.3f}" for value in red], file.header().get("colorInteropID"))
PY
observe "$python" "$work/save.py" "$work"
expect "the image's colour space" "$(seen space)" "Linear Rec.709"
expect "save of 0.18 0.5 1 4" "$(seen save)" "0.461 0.735 1.000 1.825 srgb_rec709_display"
expect "save_render of 0.18 0.5 1 4" "$(seen render)" "0.180 0.500 1.000 4.000 lin_rec709_scene"
verdict
