"""Renders the smoke of smoke.toml, or the water of the preset `pour`, in Cycles, with a number of bounces.

    python beside.py smoke 0          # writes smoke-cycles-0.png
    python beside.py pour 12          # writes pour-cycles-12.png

Run it beside smoke.toml. For the water, pour.vdb and pour.glb must lie there too, copied from assets/volumes
and assets/meshes.
"""

import math
import os
import sys

import bpy
from mathutils import Vector

WHAT, BOUNCES = sys.argv[1], int(sys.argv[2])

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def blender(x, y, z):
    """Returns a place or direction of taki with Blender's z up."""
    return Vector((x, -z, y))


def matter(file, sigma, albedo):
    """Adds the density of a file as a volume with this extinction at density 1."""
    bpy.ops.object.volume_import(filepath=os.path.abspath(file))
    made = bpy.context.object
    paint = bpy.data.materials.new("matter")
    paint.use_nodes = True
    nodes, links = paint.node_tree.nodes, paint.node_tree.links
    nodes.clear()
    volume, end = nodes.new("ShaderNodeVolumePrincipled"), nodes.new("ShaderNodeOutputMaterial")
    volume.inputs["Density"].default_value = sigma
    volume.inputs["Color"].default_value = (albedo, albedo, albedo, 1)
    links.new(volume.outputs["Volume"], end.inputs["Volume"])
    made.data.materials.append(paint)
    return made


def sun(direction, colour, strength):
    made = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    made.rotation_euler = blender(*direction).to_track_quat("Z", "Y").to_euler()
    made.data.energy, made.data.angle, made.data.color = strength, 0.0, colour
    scene.collection.objects.link(made)


def camera(eye, target, fov):
    made = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    made.location = blender(*eye)
    made.rotation_euler = (made.location - blender(*target)).to_track_quat("Z", "Y").to_euler()
    made.data.sensor_fit, made.data.angle = "VERTICAL", math.radians(fov)
    scene.collection.objects.link(made)
    scene.camera = made


def patch(corners, colour, roughness):
    """Adds a patch between corners of taki."""
    mesh = bpy.data.meshes.new("patch")
    mesh.from_pydata([blender(*corner) for corner in corners], [], [(0, 1, 2, 3)])
    paint = bpy.data.materials.new("patch")
    paint.use_nodes = True
    shader = paint.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    mesh.materials.append(paint)
    scene.collection.objects.link(bpy.data.objects.new("patch", mesh))


world = bpy.data.worlds.new("sky")
world.use_nodes = True
sky = world.node_tree.nodes["Background"].inputs["Color"]
scene.world = world

if WHAT == "smoke":
    smoke = matter("gas/data/fluid_data_0030.vdb", 12.0, 0.9)
    # Cells are half a voxel higher than the file says, and the domain stands where it stood.
    smoke.location = (-0.6 + 1 / 64, -0.6 + 1 / 64, 1 / 64)
    # Scattered evenly, light is spread over 4π.
    sun((1.0, 0.35, 0.25), (1.0, 0.93, 0.82), 0.7 * 4 * math.pi)
    camera((0.0, 1.1, 4.0), (0.0, 0.95, 0.0), 34)
    sky.default_value = (0.03, 0.04, 0.06, 1)
else:
    # The file has taki's axes.
    matter("pour.vdb", 65.0, 0.97).rotation_euler = (math.pi / 2, 0, 0)
    bpy.ops.import_scene.gltf(filepath=os.path.abspath("pour.glb"))
    wall = [(-4.6, -0.4, -1.2), (3.6, -0.4, -1.7), (3.6, 2.4, -2.0), (-4.6, 2.4, -1.5)]
    patch(wall, (0.05, 0.052, 0.042), 1.0)
    patch([(-4, 0.05, 3), (4, 0.05, 3), (4, 0.05, -3), (-4, 0.05, -3)], (0.012, 0.02, 0.018), 0.05)
    # Surfaces scatter over π.
    sun((0.5, 1.1, -0.75), (1.0, 0.92, 0.78), 2.8 * math.pi)
    sun((0.9, 0.6, 0.7), (0.6, 0.78, 1.0), 0.9 * math.pi)
    camera((0.66, 0.92, 1.66), (-0.03, 0.535, 0.0), 37)
    sky.default_value = (0.12, 0.15, 0.18, 1)

bpy.ops.preferences.addon_enable(module="cycles")
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.volume_bounces = 16, BOUNCES
scene.cycles.max_bounces = max(scene.cycles.max_bounces, BOUNCES)
scene.cycles.use_denoising = False
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = 1280, 720
scene.render.filepath = os.path.abspath(f"{WHAT}-cycles-{BOUNCES}.png")
scene.render.image_settings.file_format = "PNG"
bpy.ops.render.render(write_still=True)
