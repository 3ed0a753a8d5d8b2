"""Makes the water and the rock of the preset `pour`: pour.vdb and ../meshes/pour.glb.

    blender -b -P pour.py             # bakes the water into the folder `cache`, in Blender 3.4.1
    python pour.py                    # writes both files, with bpy 5.3.0

Two programs are needed: the module bpy bakes no fluids, and Blender 3.4 has no Python module for OpenVDB.
The axes are Blender's: x to the right, y away from the camera, z up, metres.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector, kdtree, noise

HERE = Path(__file__).resolve().parent
CACHE = HERE / "cache"
# Voxels along the longest side of the domain, its lower corner and its sides.
RESOLUTION = 128
LOW = Vector((-0.55, -0.32, 0.0))
SIDES = Vector((1.1, 0.64, 1.28))
FRAMES = 40
# Metres of rock that one copy of its texture covers.
TILE = 0.55


def block_of(name, low, high, edge=0.0):
    """Returns a block between two corners, its faces cut to `edge` if that is above 0."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0))
    block = bpy.context.object
    block.name = name
    low, high = Vector(low), Vector(high)
    for vertex in block.data.vertices:
        vertex.co = Vector(a * b for a, b in zip(vertex.co, high - low)) + (low + high) / 2
    if edge > 0.0:
        change(block, "REMESH", mode="VOXEL", voxel_size=edge)
    return block


def change(block, kind, **settings):
    """Applies a modifier."""
    modifier = block.modifiers.new("change", kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.modifier_apply(modifier="change")


def smooth(low, high, x):
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3 - 2 * t)


def broken(at):
    """Returns how far the rock stands out at a place, in parts of its roughness.

    Beds of rock lie on each other, a little inclined, and each is broken into stones with joints between.
    """
    bent = at + 0.05 * Vector((noise.noise(at * 5), noise.noise(at * 5 + Vector((9, 2, 4))), 0.0))
    height = bent.z + 0.1 * bent.x - 0.06 * bent.y
    bed = noise.noise(Vector((0.9 * bent.x, 0.9 * bent.y, 11.0 * height)))
    bed = math.copysign(abs(bed) ** 0.3, bed)
    far, stones = noise.voronoi(Vector((3.6 * bent.x, 3.6 * bent.y, 13.0 * height)))
    stone = noise.cell(stones[0] * 7.3)
    joint = 1.0 - smooth(0.0, 0.12, far[1] - far[0])
    large = noise.fractal(at * 2.6 + Vector((3, 1, 7)), 1.0, 2.1, 4)
    fine = noise.fractal(at * 15.0, 0.8, 2.2, 4)
    return 0.7 * large + 0.8 * bed + 0.5 * stone - 0.3 * joint + 0.2 * fine


def stone(name, low, high, edge, rough):
    """Returns a block of rock. Its faces are cut to `edge` and move by about `rough`."""
    block = block_of(name, low, high, edge)
    mesh = block.data
    mesh.update()
    normals = [vertex.normal.copy() for vertex in mesh.vertices]
    for vertex, normal in zip(mesh.vertices, normals):
        # Water has worn the upper sides.
        worn = 0.3 if normal.z > 0.7 else 1.0
        vertex.co = vertex.co + normal * (rough * worn * broken(vertex.co))
    # Where stones meet at an edge, faces now pass through each other.
    change(block, "REMESH", mode="VOXEL", voxel_size=edge)
    return block


def rock():
    """Returns the rock: a pillar, the ledge that leaves it to the right, and the spout above."""
    pillar = stone("pillar", (-0.75, -0.42, -0.08), (-0.36, 0.36, 0.93), 0.0125, 0.04)
    ledge = stone("ledge", (-0.5, -0.25, 0.50), (-0.03, 0.27, 0.62), 0.0095, 0.02)
    floor = stone("spout", (-0.5, -0.12, 0.97), (-0.2, 0.12, 1.015), 0.008, 0.005)
    left = stone("spout_front", (-0.52, -0.15, 0.96), (-0.215, -0.105, 1.085), 0.008, 0.01)
    right = stone("spout_back", (-0.52, 0.105, 0.96), (-0.215, 0.15, 1.085), 0.008, 0.01)
    return [pillar, ledge, floor, left, right]


def fluid(block, kind):
    """Makes a block a part of the simulation, and returns that part's settings."""
    modifier = block.modifiers.new("fluid", "FLUID")
    modifier.fluid_type = kind
    return getattr(modifier, f"{'effector' if kind == 'EFFECTOR' else kind.lower()}_settings")


def bake():
    domain_block = block_of("domain", LOW, LOW + SIDES)
    domain = fluid(domain_block, "DOMAIN")
    domain.domain_type = "LIQUID"
    domain.resolution_max = RESOLUTION
    for side in ["front", "back", "left", "right", "top", "bottom"]:
        setattr(domain, f"use_collision_border_{side}", False)
    source = fluid(block_of("source", (-0.42, -0.085, 1.03), (-0.36, 0.085, 1.085)), "FLOW")
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
    """Writes the water of a frame, and returns the middles of the cells with water."""
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
    corner = Vector(low) + Vector([float(a) for a in first])
    middle = corner + Vector((0.5, 0.5, 0.5))
    for grid, edge in [(density, 1), (velocity, 2)]:
        at = LOW + voxel * (corner + Vector((0.5, 0.5, 0.5)) * edge)
        e = voxel * edge
        rows = [[e, 0, 0, 0], [0, 0, -e, 0], [0, e, 0, 0], [at.x, at.z, -at.y, 1]]
        grid.transform = openvdb.createLinearTransform(rows)
        grid.saveFloatAsHalf = True
    openvdb.write(str(HERE / "pour.vdb"), grids=[density, velocity])
    speed = np.linalg.norm(flow, axis=-1)[np.any(flow != 0, -1)]
    print(share.shape, "cells;", (share > 0).sum(), "with water; speed", np.percentile(speed, [5, 50, 95]))
    return [tuple(LOW + voxel * (Vector(at) + middle)) for at in np.argwhere(share > 0.3).tolist()]


def image(np, name, channels, data=False):
    """Makes a picture of three channels of 0 to 1. Colours are in sRGB; data are taken as they are."""
    pixels = np.stack([*channels, np.ones_like(channels[0])], -1).clip(0, 1)
    made = bpy.data.images.new(name, *pixels.shape[:2], is_data=data)
    made.pixels = pixels.ravel()
    made.pack()
    return made


def paint(np, size=256):
    """Paints stains, grain and cracks, and their relief. Sums of waves repeat without a seam."""
    chance = np.random.default_rng(8)
    run = np.fft.fftfreq(size, 1 / size)

    def cloud(smoothness, stretch=1.0):
        frequency = np.maximum(np.hypot(run, run[:, None] / stretch), 1)
        made = np.fft.ifft2(np.fft.fft2(chance.normal(size=(size, size))) / frequency**smoothness).real
        return (made - made.mean()) / made.std()

    # Beds are longer than they are high.
    crack, grain, beds = np.exp(-((cloud(1.5, 3.0) / 0.05) ** 2)), cloud(1.0), cloud(1.7, 4.0)
    grey = 0.43 + 0.05 * beds + 0.06 * grain - 0.16 * crack
    warm = 0.04 * cloud(1.9)
    height = 1.5 * cloud(1.6) + 0.5 * beds - 0.6 * crack  # in pixels
    x, y = (np.roll(height, 1, axis) - height for axis in (1, 0))
    normal = np.stack([x, y, np.ones_like(x)]) / np.sqrt(x * x + y * y + 1)
    return (image(np, "Rock", [grey * (1.03 + warm), grey, grey * (0.9 - warm)]),
            image(np, "Relief", 0.5 + 0.5 * normal, data=True))


def material(name, roughness, pictures):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    new, join = made.node_tree.nodes.new, made.node_tree.links.new
    texture, bent, normal = (new(f"ShaderNode{kind}") for kind in ["TexImage", "TexImage", "NormalMap"])
    texture.image, bent.image = pictures
    join(texture.outputs["Color"], shader.inputs["Base Color"])
    join(bent.outputs["Color"], normal.inputs["Color"])
    join(normal.outputs["Normal"], shader.inputs["Normal"])
    return made


def write_rock(wet_places):
    """Writes the rock. It is wet near these places, and where water has run down from them."""
    import numpy as np

    near, above = kdtree.KDTree(len(wet_places)), kdtree.KDTree(len(wet_places))
    for i, place in enumerate(wet_places):
        near.insert(place, i)
        above.insert((place[0], place[1], 0.0), i)
    near.balance()
    above.balance()

    def wet(at):
        here = 1.0 - smooth(0.012, 0.06, near.find(at)[2] + 0.02 * noise.noise(at * 18))
        _, i, aside = above.find((at.x, at.y, 0.0))
        fallen = wet_places[i][2] - at.z
        below = (1.0 - smooth(0.0, 0.03, aside)) * (1.0 - smooth(0.1, 0.5, fallen)) if fallen > 0 else 0.0
        pool = 1.0 - smooth(0.06, 0.13, at.z + 0.03 * noise.noise(at * 9))
        return max(here, 0.8 * below, pool)

    blocks = rock()
    pictures = paint(np)
    paints = [material("Rock", 0.95, pictures), material("Wet", 0.45, pictures)]
    for block, share in zip(blocks, [0.3, 0.25, 0.12, 0.25, 0.25]):
        change(block, "DECIMATE", ratio=share)
        mesh = block.data
        for own in paints:
            mesh.materials.append(own)
        film = [wet(vertex.co) for vertex in mesh.vertices]
        colours = mesh.color_attributes.new("Film", "BYTE_COLOR", "POINT")
        for colour, share in zip(colours.data, film):
            # Water fills the pores, and the rock gets darker.
            dark = 1.0 - 0.7 * share
            colour.color = (dark, dark, dark, 1.0)
        uvs = mesh.uv_layers.new(name="UVMap")
        for face in mesh.polygons:
            face.use_smooth = True
            # Every face has the texture as seen along the axis that it faces most.
            out = [abs(x) for x in face.normal]
            u, v = [(1, 2), (0, 2), (0, 1)][out.index(max(out))]
            for i in face.loop_indices:
                at = mesh.vertices[mesh.loops[i].vertex_index].co
                uvs.data[i].uv = (at[u] / TILE, at[v] / TILE)
            face.material_index = int(sum(film[i] for i in face.vertices) > 0.5 * len(face.vertices))
        block.select_set(True)
    file = str(HERE.parent / "meshes" / "pour.glb")
    bpy.ops.export_scene.gltf(
        filepath=file,
        export_format="GLB",
        use_selection=True,
        export_yup=True,
        export_image_format="JPEG",
        export_vertex_color="ACTIVE",
        export_all_vertex_colors=True,
    )


bpy.ops.wm.read_factory_settings(use_empty=True)
if bpy.app.version < (5, 0):
    bake()
else:
    write_rock(write_water(int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES))
