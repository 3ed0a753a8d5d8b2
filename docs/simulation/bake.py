"""Bakes a small simulation in Blender: blender -b -P bake.py -- gas, or -- liquid.

The cache comes into the folder `gas` or `liquid` beside this script.
"""

import sys
from pathlib import Path

import bpy

KIND = sys.argv[sys.argv.index("--") + 1]
FOLDER = Path(__file__).resolve().parent / KIND
FRAMES = 36
RESOLUTION = 64  # voxels along the longest side of the domain

bpy.ops.wm.read_factory_settings(use_empty=True)


def block(name, middle, sides, role):
    """Adds a block with a role in the simulation, and returns the block and the role's settings."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=middle)
    made = bpy.context.object
    made.name, made.scale = name, sides
    # The domain must have no scale of its own.
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    fluid = made.modifiers.new("fluid", "FLUID")
    fluid.fluid_type = role
    settings = {"DOMAIN": "domain_settings", "FLOW": "flow_settings", "EFFECTOR": "effector_settings"}
    return made, getattr(fluid, settings[role])


# A room of 1.2 × 1.2 × 2 m that stands on the ground around the origin.
room, domain = block("domain", (0, 0, 1), (1.2, 1.2, 2), "DOMAIN")
if KIND == "gas":
    domain.domain_type = "GAS"
    domain.vorticity = 0.3
    _, flow = block("source", (0, 0, 0.2), (0.3, 0.3, 0.12), "FLOW")
    flow.flow_type, flow.flow_behavior = "SMOKE", "INFLOW"
else:
    domain.domain_type = "LIQUID"
    for side in ["front", "back", "left", "right", "top", "bottom"]:
        setattr(domain, f"use_collision_border_{side}", False)
    _, flow = block("source", (-0.35, 0, 1.75), (0.12, 0.4, 0.12), "FLOW")
    flow.flow_type, flow.flow_behavior = "LIQUID", "INFLOW"
    flow.use_initial_velocity, flow.velocity_coord = True, (0.9, 0, 0)
    _, ledge = block("ledge", (-0.1, 0, 0.85), (0.6, 0.7, 0.12), "EFFECTOR")
    ledge.effector_type = "COLLISION"

bpy.context.scene.frame_end = domain.cache_frame_end = FRAMES
domain.resolution_max = RESOLUTION
domain.cache_directory, domain.cache_type = str(FOLDER), "ALL"
domain.cache_data_format = "OPENVDB"
domain.openvdb_cache_compress_type, domain.openvdb_data_depth = "BLOSC", "16"
# Only a resumable cache of a liquid holds its level set.
domain.cache_resumable = KIND == "liquid"
bpy.context.view_layer.objects.active = room
# Mantaflow bakes into a scene that has a file.
bpy.ops.wm.save_as_mainfile(filepath=f"{FOLDER}.blend")
bpy.ops.fluid.bake_all()
