"""Makes the water and the rock of the preset `pour`: pour.vdb and ../meshes/pour.glb.

    blender -b -P pour.py             # bakes the water into the folder `cache`, in Blender 3.4.1
    python pour.py                    # writes both files, with bpy 5.3.0

Two programs are needed: the module bpy bakes no fluids, and Blender 3.4 has no Python module for OpenVDB.
The axes are Blender's: x to the right, y away from the camera, z up, metres.
"""

import sys
from pathlib import Path

import bpy
from mathutils import Vector, noise

HERE = Path(__file__).resolve().parent
CACHE = HERE / "cache"
# Voxels along the longest side of the domain, its lower corner and its sides.
RESOLUTION = 128
LOW = Vector((-0.55, -0.32, 0.0))
SIDES = Vector((1.1, 0.64, 1.28))
FRAMES = 40


def body(name, low, high, edge=0.02, rough=0.0):
    """Returns a block between two corners. Its faces are cut to `edge` and moved by up to `rough`."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0))
    block = bpy.context.object
    block.name = name
    low, high = Vector(low), Vector(high)
    middle, sides = (low + high) / 2, high - low
    mesh = block.data
    for vertex in mesh.vertices:
        vertex.co = Vector(a * b for a, b in zip(vertex.co, sides)) + middle
    if rough == 0.0:
        return block
    cuts = block.modifiers.new("remesh", "REMESH")
    cuts.mode, cuts.voxel_size = "VOXEL", edge
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.modifier_apply(modifier="remesh")
    for vertex in mesh.vertices:
        at = vertex.co.copy()
        far = noise.turbulence_vector(at * 3.5 + Vector((7, 1, 4)), 5, False, noise_basis="PERLIN_ORIGINAL")
        # Beds of the rock lie in layers: every layer stands out by another length.
        layer = noise.noise(Vector((at.x * 0.8, at.y * 0.8, at.z * 22.0)))
        out = Vector((at.x - middle.x, at.y - middle.y, 0.0))
        out = out / max(out.length, 1e-6)
        vertex.co = at + far * rough + out * layer * rough * 0.8
    return block


def rock():
    """Returns the rock: a pillar, the ledge that leaves it to the right, and the spout above."""
    # Without a seed, Blender's noise of vectors is another in each run.
    noise.seed_set(1)
    pillar = body("pillar", (-0.75, -0.42, -0.25), (-0.33, 0.42, 0.94), rough=0.04)
    ledge = body("ledge", (-0.5, -0.25, 0.50), (-0.02, 0.27, 0.62), edge=0.014, rough=0.028)
    floor = body("spout", (-0.5, -0.12, 0.985), (-0.2, 0.12, 1.015), edge=0.008, rough=0.006)
    left = body("spout_front", (-0.5, -0.14, 0.985), (-0.21, -0.105, 1.09), edge=0.008, rough=0.006)
    right = body("spout_back", (-0.5, 0.105, 0.985), (-0.21, 0.14, 1.09), edge=0.008, rough=0.006)
    return [pillar, ledge, floor, left, right]


def fluid(block, kind):
    """Makes a block a part of the simulation, and returns that part's settings."""
    modifier = block.modifiers.new("fluid", "FLUID")
    modifier.fluid_type = kind
    return getattr(modifier, f"{'effector' if kind == 'EFFECTOR' else kind.lower()}_settings")


def bake():
    domain_block = body("domain", LOW, LOW + SIDES)
    domain = fluid(domain_block, "DOMAIN")
    domain.domain_type = "LIQUID"
    domain.resolution_max = RESOLUTION
    for side in ["front", "back", "left", "right", "top", "bottom"]:
        setattr(domain, f"use_collision_border_{side}", False)
    source = fluid(body("source", (-0.42, -0.085, 1.03), (-0.36, 0.085, 1.085)), "FLOW")
    source.flow_type, source.flow_behavior = "LIQUID", "INFLOW"
    source.use_initial_velocity, source.velocity_coord = True, (0.75, 0.0, 0.0)
    for block in rock():
        fluid(block, "EFFECTOR").effector_type = "COLLISION"
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    domain.cache_frame_start, domain.cache_frame_end = 1, FRAMES
    domain.cache_directory, domain.cache_type = str(CACHE), "ALL"
    # Without the data to resume from, the cache of a liquid holds no level set.
    domain.cache_resumable = True
    domain.cache_data_format, domain.openvdb_data_depth = "OPENVDB", "16"
    domain.openvdb_cache_compress_type = "BLOSC"
    bpy.context.view_layer.objects.active = domain_block
    bpy.ops.wm.save_as_mainfile(filepath=str(CACHE) + ".blend")
    bpy.ops.fluid.bake_all()


def water(openvdb, np, frame):
    """Returns the share of water and the velocity, m/s, of a frame's cells, and the cell at their corner."""
    file = str(CACHE / "data" / f"fluid_data_{frame:04}.vdb")
    phi, velocity = openvdb.read(file, "phi"), openvdb.read(file, "velocity")
    low, high = phi.evalActiveVoxelBoundingBox()
    sides = [b - a + 1 for a, b in zip(low, high)]
    far, flow = np.zeros(sides, np.float32), np.zeros([n + 1 for n in sides] + [3], np.float32)
    phi.copyToArray(far, low)
    velocity.copyToArray(flow, low)
    # The level set is in cells, so it falls by 1 across the cell that the surface cuts.
    share = np.clip(0.5 - far, 0.0, 1.0)
    # Component a lies on the lower face across axis a, in cells per 0.4 s.
    middle = [0.5 * (flow[..., a] + np.roll(flow[..., a], -1, a))[:-1, :-1, :-1] for a in range(3)]
    return share, np.stack(middle, -1) * (phi.transform.voxelSize()[0] / 0.4), low


def coarse(np, share, flow):
    """Returns the mean velocity of the water in every eight cells."""
    eight = lambda a: a.reshape(a.shape[0] // 2, 2, a.shape[1] // 2, 2, a.shape[2] // 2, 2).sum((1, 3, 5))
    mass = np.maximum(eight(share), 1e-6)
    return np.stack([eight(share * flow[..., a]) / mass for a in range(3)], -1)


def write_water(frame):
    import numpy as np

    bpy.utils.expose_bundled_modules()
    import openvdb

    share, flow, low = water(openvdb, np, frame)
    full = np.argwhere(share > 0.0)
    # The box begins at an even cell and ends behind an odd one, because the velocity has half the cells.
    first, last = full.min(0) // 2 * 2, full.max(0) // 2 * 2 + 2
    pad = [(0, max(0, b - n)) for b, n in zip(last, share.shape)]
    share, flow = np.pad(share, pad), np.pad(flow, pad + [(0, 0)])
    crop = tuple(slice(a, b) for a, b in zip(first, last))
    share, flow = share[crop], flow[crop]
    flow = coarse(np, share, flow)
    voxel = max(SIDES) / RESOLUTION
    density, velocity = openvdb.FloatGrid(0.0), openvdb.Vec3SGrid((0.0, 0.0, 0.0))
    density.name, velocity.name = "density", "velocity"
    density.gridClass = openvdb.GridClass.FOG_VOLUME
    # The module takes arrays as if they lay in one piece.
    density.copyFromArray(np.ascontiguousarray(share), tolerance=0.0)
    # y points up in scenes of taki: (x, y, z) becomes (x, z, -y). That turns places and vectors alike.
    turned = np.ascontiguousarray(np.stack([flow[..., 0], flow[..., 2], -flow[..., 1]], -1))
    velocity.copyFromArray(turned, tolerance=(0.0, 0.0, 0.0))
    for grid, edge in [(density, 1), (velocity, 2)]:
        at = LOW + voxel * (Vector(low) + Vector([float(a) for a in first]) + Vector((0.5, 0.5, 0.5)) * edge)
        e = voxel * edge
        rows = [[e, 0, 0, 0], [0, 0, -e, 0], [0, e, 0, 0], [at.x, at.z, -at.y, 1]]
        grid.transform = openvdb.createLinearTransform(rows)
        grid.saveFloatAsHalf = True
    openvdb.write(str(HERE / "pour.vdb"), grids=[density, velocity])
    speed = np.linalg.norm(flow, axis=-1)[np.any(flow != 0, -1)]
    print(share.shape, "cells;", (share > 0).sum(), "with water; speed", np.percentile(speed, [5, 50, 95]))


def write_rock():
    blocks = rock()
    paint = bpy.data.materials.new("Rock")
    for block in blocks:
        block.data.materials.append(paint)
        for face in block.data.polygons:
            face.use_smooth = True
        block.select_set(True)
    file = str(HERE.parent / "meshes" / "pour.glb")
    bpy.ops.export_scene.gltf(filepath=file, export_format="GLB", use_selection=True, export_yup=True)


bpy.ops.wm.read_factory_settings(use_empty=True)
if bpy.app.version < (5, 0):
    bake()
else:
    write_rock()
    write_water(int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES)
