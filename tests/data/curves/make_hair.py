"""Writes the curves of Blender beside this file: bpy 5.3.0 of pip. Run make_curves.py next.

    pip install bpy==5.3.0
    python make_hair.py
"""

import math
import os

import bpy

FOLDER = os.path.dirname(os.path.abspath(__file__))

bpy.ops.wm.read_factory_settings(use_empty=True)

# Hair curves under a head that is moved, turned and scaled.
curves = bpy.data.hair_curves.new("hair")
curves.add_curves([5, 4, 6])
for i, point in enumerate(curves.points):
    strand, k = (0, i) if i < 5 else (1, i - 5) if i < 9 else (2, i - 9)
    point.position = (0.3 * strand + 0.1 * math.sin(k * 1.3), 0.1 * math.cos(k * 0.9), 0.25 * k)
    point.radius = 0.01 * (1 - 0.12 * k)
hair = bpy.data.objects.new("hair", curves)
head = bpy.data.objects.new("head", None)
for made in (hair, head):
    bpy.context.collection.objects.link(made)
head.location, head.rotation_euler, head.scale = (1, 2, 3), (0.1, 0.2, 0.3), (2, 2, 2)
hair.parent, hair.location, hair.rotation_euler = head, (0.5, 0, 0), (0, 0.5, 0)

# Curves of the older kind: Bézier, straight, NURBS.
for name, kind in (("bez", "BEZIER"), ("poly", "POLY"), ("nurbs", "NURBS")):
    old = bpy.data.curves.new(name, "CURVE")
    old.dimensions = "3D"
    spline = old.splines.new(kind)
    if kind == "BEZIER":
        spline.bezier_points.add(2)
        for k, point in enumerate(spline.bezier_points):
            point.co = (k, 0.5 * k * k, 0.2)
            point.handle_left = (k - 0.3, 0.5 * k * k, 0.2 + 0.1 * k)
            point.handle_right = (k + 0.3, 0.5 * k * k, 0.2 - 0.1 * k)
    else:
        spline.points.add(4)
        for k, point in enumerate(spline.points):
            point.co = (k, 0.3 * (k % 2), 0.1 * k, 1)
        if kind == "NURBS":
            spline.order_u, spline.use_endpoint_u = 4, True
    made = bpy.data.objects.new(name, old)
    bpy.context.collection.objects.link(made)
    made.location = (0, 5, 0)

for ending in ("usdc", "usdz"):
    bpy.ops.wm.usd_export(filepath=os.path.join(FOLDER, f"blender.{ending}"))
