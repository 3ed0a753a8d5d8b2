"""Renders the smoke of smoke.toml in Cycles, with a number of bounces.

    python beside.py 12               # writes cycles-12.png
"""

import math
import os
import sys

import bpy
from mathutils import Vector

SIGMA, ALBEDO = 12.0, 0.9

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def blender(x, y, z):
    """Returns a place or direction of taki with Blender's z up."""
    return Vector((x, -z, y))


# The volume. Cells are half a voxel higher than the file says, and the domain stands where it stood.
bpy.ops.object.volume_import(filepath=os.path.abspath("gas/data/fluid_data_0030.vdb"))
smoke = bpy.context.object
smoke.location = (-0.6 + 1 / 64, -0.6 + 1 / 64, 1 / 64)
paint = bpy.data.materials.new("smoke")
paint.use_nodes = True
nodes, links = paint.node_tree.nodes, paint.node_tree.links
nodes.clear()
volume, end = nodes.new("ShaderNodeVolumePrincipled"), nodes.new("ShaderNodeOutputMaterial")
volume.inputs["Density"].default_value = SIGMA
volume.inputs["Color"].default_value = (ALBEDO, ALBEDO, ALBEDO, 1)
links.new(volume.outputs["Volume"], end.inputs["Volume"])
smoke.data.materials.append(paint)

sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.rotation_euler = blender(1.0, 0.35, 0.25).to_track_quat("Z", "Y").to_euler()
# Scattered evenly, light is spread over 4π.
sun.data.energy, sun.data.angle = 0.7 * 4 * math.pi, 0.0
sun.data.color = (1.0, 0.93, 0.82)
scene.collection.objects.link(sun)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
eye, target = blender(0.0, 1.1, 4.0), blender(0.0, 0.95, 0.0)
camera.location = eye
camera.rotation_euler = (eye - target).to_track_quat("Z", "Y").to_euler()
camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(34)
scene.collection.objects.link(camera)
scene.camera = camera

world = bpy.data.worlds.new("dark")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.03, 0.04, 0.06, 1)
scene.world = world

bpy.ops.preferences.addon_enable(module="cycles")
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.volume_bounces = 64, int(sys.argv[1])
scene.cycles.use_denoising = False
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = 300, 400
scene.render.filepath = os.path.abspath(f"cycles-{sys.argv[1]}.png")
scene.render.image_settings.file_format = "PNG"
bpy.ops.render.render(write_still=True)
