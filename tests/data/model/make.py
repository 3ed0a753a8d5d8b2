"""Writes the models beside this file: Blender 5.2.3 LTS (bpy 5.2.3 of pip) and trimesh 5.2.0.

    pip install bpy==5.2.3 trimesh==5.2.0
    python make.py
"""

import math
import os

import bpy
import trimesh

FOLDER = os.path.dirname(os.path.abspath(__file__))


def path(name):
    return os.path.join(FOLDER, name)


def material(name, color, roughness):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*color, 1)
    inputs["Roughness"].default_value = roughness
    return made


bpy.ops.wm.read_factory_settings(use_empty=True)

# A cliff of 16 quads, the middle of which is water.
bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, size=4)
cliff = bpy.context.object
cliff.name = "Cliff"
for vertex in cliff.data.vertices:
    vertex.co.z = 0.2 * math.sin(3 * vertex.co.x)
cliff.data.materials.append(material("Wet stone", (0.5, 0.25, 0.125), 0.5))
cliff.data.materials.append(material("Fall", (0.1, 0.2, 0.9), 0.1))
for polygon in cliff.data.polygons:
    polygon.material_index = 1 if abs(polygon.center.x) < 1 else 0
cliff.rotation_euler = (math.pi / 2, 0, 0)
cliff.location = (0, 2, 2)

# Three plants that share a mesh, under an empty.
plants = bpy.data.objects.new("Plants", None)
bpy.context.collection.objects.link(plants)
bpy.ops.mesh.primitive_cube_add(size=0.2)
first = bpy.context.object
first.data.materials.append(material("Leaf", (0, 1, 0), 0.5))
first.parent = plants
for i in (1, 2):
    copy = bpy.data.objects.new(f"Plant {i}", first.data)
    bpy.context.collection.objects.link(copy)
    copy.parent = plants
    copy.location = (i, 0, 0)

for kind in ("SUN", "POINT", "SPOT"):
    bpy.ops.object.light_add(type=kind, location=(0, 0, 5))

bpy.ops.object.camera_add(location=(0, -8, 2), rotation=(math.pi / 2, 0, 0))
camera = bpy.context.object
bpy.context.scene.camera = camera
camera.keyframe_insert("location", frame=0)
camera.location = (4, -8, 2)
camera.keyframe_insert("location", frame=4)
bpy.context.scene.frame_end = 4

for name, kind in (("blender.glb", "GLB"), ("blender.gltf", "GLTF_SEPARATE")):
    bpy.ops.export_scene.gltf(
        filepath=path(name),
        export_format=kind,
        export_cameras=True,
        export_lights=True,
        export_gpu_instances=True,
    )
bpy.ops.wm.obj_export(filepath=path("blender.obj"))

scene = trimesh.Scene([trimesh.creation.box(), trimesh.creation.icosphere(subdivisions=1)])
scene.export(path("trimesh.glb"))
