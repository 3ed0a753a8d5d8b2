"""Turns the level set of a liquid's cache into the share of each cell that is filled, and velocities in m/s.

    python fill.py liquid/data/fluid_data_0036.vdb water.vdb

The module openvdb comes with bpy, Blender's Python module.
"""

import sys

import bpy
import numpy as np

bpy.utils.expose_bundled_modules()
import openvdb  # noqa: E402

phi, velocity = (openvdb.read(sys.argv[1], name) for name in ["phi", "velocity"])
low, high = phi.evalActiveVoxelBoundingBox()
sides = [b - a + 1 for a, b in zip(low, high)]
far, flow = np.zeros(sides, np.float32), np.zeros([n + 1 for n in sides] + [3], np.float32)
phi.copyToArray(far, low)
velocity.copyToArray(flow, low)

# phi is in cells: it changes by about 1 across the cell that the surface cuts.
share = np.clip(0.5 - far, 0, 1)
# The velocity is in cells per 0.4 s, and component a is that of the cell's lower face across axis a.
flow *= phi.transform.voxelSize()[0] / 0.4
middle = [0.5 * (flow[..., a] + np.roll(flow[..., a], -1, a))[:-1, :-1, :-1] for a in range(3)]
flow = np.stack(middle, -1)
flow[share == 0] = 0

density, velocity = openvdb.FloatGrid(0.0), openvdb.Vec3SGrid((0.0, 0.0, 0.0))
density.name, velocity.name = "density", "velocity"
density.copyFromArray(share, low, tolerance=0)
velocity.copyFromArray(flow, low, tolerance=(0, 0, 0))
for grid in [density, velocity]:
    grid.transform, grid.saveFloatAsHalf = phi.transform, True
openvdb.write(sys.argv[2], grids=[density, velocity])
