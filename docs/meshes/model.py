"""Models a ledge of rock and the water that runs over it, and writes ledge.glb.

python model.py   (with Blender's module: pip install bpy)
"""

import math
import os

import bpy
from mathutils import Vector, noise

# 1. An empty scene. Blender's z runs up, and the water falls towards -y.
bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, colour):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 1.0
    return made


def add(name, vertices, faces, made, uvs=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.materials.append(made)
    if uvs:
        layer = mesh.uv_layers.new(name="UVMap")
        for loop in mesh.loops:
            u, v = uvs[loop.vertex_index]
            # Blender's v runs up; taki's v runs down, with the flow.
            layer.data[loop.index].uv = (u, 1 - v)
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


def grid(across, along):
    row = across + 1
    return [(j * row + i, (j + 1) * row + i, (j + 1) * row + i + 1, j * row + i + 1)
            for j in range(along) for i in range(across)]


# 2. The rock: a profile from the stream bed behind to the ground in front, made rough.
PROFILE = [(6, 3.0), (1, 2.9), (0.2, 2.6), (0.0, 1.4), (-0.3, 0.2), (-2, -0.1), (-7, -0.2)]
ACROSS, ALONG = 48, 60
vertices = []
for j in range(ALONG + 1):
    at = j / ALONG * (len(PROFILE) - 1)
    k = min(int(at), len(PROFILE) - 2)
    (y0, z0), (y1, z1) = PROFILE[k], PROFILE[k + 1]
    for i in range(ACROSS + 1):
        p = Vector(((i / ACROSS - 0.5) * 12, y0 + (y1 - y0) * (at - k), z0 + (z1 - z0) * (at - k)))
        rough = noise.fractal(p * 0.6, 1.0, 2.1, 6)
        vertices.append(p + Vector((0, -0.45 * rough, 0.3 * rough)))
add("Rock", vertices, grid(ACROSS, ALONG), material("Rock", (0.09, 0.08, 0.065)))

# 3. The water: along the bed to the rim, then the parabola of free fall. Each row knows its time.
SPEED = 1.5
path = [(3.0 - 0.3 * k, 3.15, 0.3 * k / SPEED) for k in range(10)]
start = path[-1][2] + 0.3 / SPEED
for k in range(21):
    t = 0.04 * k
    path.append((-SPEED * t, 3.15 - 4.905 * t * t, start + t))
COLUMNS = 8
vertices, uvs = [], []
for y, z, t in path:
    for i in range(COLUMNS + 1):
        u = i / COLUMNS
        vertices.append(((u - 0.5) * 2.4, y, z))
        # u across the water, and v = the time of its fall in seconds.
        uvs.append((u, t))
add("Fall", vertices, grid(COLUMNS, len(path) - 1), material("Fall", (0.8, 0.9, 1.0)), uvs)

# 4. A camera.
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location = (2.4, -9.5, 1.9)
camera.rotation_euler = (math.radians(87), 0, math.radians(14))
bpy.context.collection.objects.link(camera)

# 5. The file. Blender turns its z into glTF's y.
bpy.ops.export_scene.gltf(filepath=os.path.abspath("ledge.glb"), export_format="GLB", export_cameras=True)
