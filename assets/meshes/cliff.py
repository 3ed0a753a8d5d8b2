"""Writes cliff.glb, the mesh of the preset `cliff`: a cliff, and the water that runs over its rim.

Run: python cliff.py [FILE]   (with Blender's module: pip install bpy==5.3.0)

The scene is modelled as in Blender: metres, Z up, the water falls towards −Y. The fall's texture has u across
the water from left to right, and v = time of fall, so that the pattern stretches as the water gets faster.
"""

import math
import sys

import bpy
import numpy
from mathutils import Vector, noise

WIDTH, DEPTH, HEIGHT = 22.0, 16.0, 8.0  # metres
ACROSS, ALONG = 126, 162  # squares of the rock
LIP_WIDTH = 3.6  # metres


def smooth(low, high, x):
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3 - 2 * t)


def channel(x):
    """Depth of the bed that the water has cut, 0 to 1."""
    return math.exp(-(((x - 0.6 * math.sin(0.35 * x)) / 2.0) ** 4))


def profile(s):
    """Outline of the cliff from the plateau behind to the ground in front: (y, z) for s from 0 to 1."""
    points = [(8.0, 8.4), (2.2, 8.1), (0.7, 7.9), (0.0, 7.2), (-0.25, 5.2), (0.1, 3.4), (-0.5, 1.2)]
    points += [(-0.9, -0.4), (-2.5, -1.0), (-9.0, -1.6)]
    at = s * (len(points) - 1)
    i = min(int(at), len(points) - 2)
    f = at - i
    (y0, z0), (y1, z1) = points[i], points[i + 1]
    return y0 + (y1 - y0) * f, z0 + (z1 - z0) * f


def rock():
    vertices, faces = [], []
    for j in range(ALONG + 1):
        for i in range(ACROSS + 1):
            x = (i / ACROSS - 0.5) * WIDTH
            y, z = profile(j / ALONG)
            wall = smooth(0.2, 0.35, j / ALONG) * (1 - smooth(0.72, 0.9, j / ALONG))
            # The cliff curves round the plunge pool.
            y -= 0.045 * x * x * (0.35 + 0.65 * wall) - 0.4
            at = Vector((x, y, z))
            big = noise.fractal(at * 0.28 + Vector((3.1, 0, 0)), 1.0, 2.1, 6)
            # Beds of rock step out and back with the height, broken into blocks.
            bed = noise.noise(Vector((0.3 * x, 0.3 * y, 1.9 * z + 0.7 * math.sin(0.4 * x))))
            bed = math.copysign(abs(bed) ** 0.35, bed)
            block = noise.cell(Vector((1.1 * x + 0.6 * z, 0.0, 1.6 * z)))
            fine = noise.fractal(at * 1.5, 0.75, 2.2, 6)
            cut = channel(x)
            y -= wall * (1.2 * big + 0.5 * bed + 0.22 * block + 0.42 * fine) * (1 - 0.85 * cut)
            z += (1 - wall) * (0.7 * big + 0.3 * fine) * (1 - 0.95 * cut)
            if j / ALONG < 0.34:
                z += 1.3 * (1 - cut) - 1.15 * cut
            vertices.append((x, y, z))
    for j in range(ALONG):
        for i in range(ACROSS):
            a = j * (ACROSS + 1) + i
            faces.append((a, a + ACROSS + 1, a + ACROSS + 2, a + 1))
    return vertices, faces, [(x / 4, -(y + z) / 4) for x, y, z in vertices], None


def fall():
    """The water: along its bed to the rim, then the parabola of free fall. v is the time in seconds."""
    path, t = [], 0.0
    speed = 1.9
    for k in range(10):
        y = 5.2 - 0.5 * k
        path.append((y, 7.16 + 0.03 * (y - 0.7), t))
        t += 0.5 / speed
    rim_y, rim_z, start = 0.7, 7.16, path[-1][2]
    for k in range(1, 31):
        time = k * 0.042
        path.append((rim_y - speed * time, rim_z - 4.905 * time * time, start + time))
    columns = 14
    vertices, faces, uvs, share = [], [], [], []
    for y, z, time in path:
        fallen = max(rim_z - z, 0.0)
        width = LIP_WIDTH * (1 + 0.035 * fallen)
        for i in range(columns + 1):
            u = i / columns
            x = (u - 0.5) * width
            # The edges lag behind: the rim is lower in the middle.
            lag = 0.3 * (2 * u - 1) ** 2
            wave = 0.1 * math.sin(2.1 * x + 0.7) + 0.06 * math.sin(5.3 * x)
            z_bed = 0.28 * (2 * u - 1) ** 2 * math.exp(-fallen)
            vertices.append((x, y + lag + wave * min(fallen, 1.0) - 0.4, z + z_bed))
            uvs.append((u, time))
            # The water thins out towards ragged edges, and where it begins.
            edge = min(u, 1 - u) * width + 0.35 * noise.noise(Vector((9 * u, 2.6 * time, 0.0)))
            share.append(smooth(0.0, 0.9, edge) * smooth(0.0, 1.2, time) if 0 < i < columns else 0.0)
    for j in range(len(path) - 1):
        for i in range(columns):
            a = j * (columns + 1) + i
            faces.append((a, a + columns + 1, a + columns + 2, a + 1))
    return vertices, faces, uvs, share


def image(name, channels, data=False):
    """Makes a picture of three channels of 0 to 1. Colours are in sRGB; data are taken as they are."""
    pixels = numpy.stack([*channels, numpy.ones_like(channels[0])], -1).clip(0, 1)
    made = bpy.data.images.new(name, *pixels.shape[:2], is_data=data)
    made.pixels = pixels.ravel()
    made.pack()
    return made


def paint(size=256):
    """Paints stains, grain and cracks, and their relief. Sums of waves repeat without a seam."""
    chance = numpy.random.default_rng(3)
    run = numpy.fft.fftfreq(size, 1 / size)
    frequency = numpy.maximum(numpy.hypot(run, run[:, None]), 1)

    def cloud(smoothness):
        made = numpy.fft.ifft2(numpy.fft.fft2(chance.normal(size=(size, size))) / frequency**smoothness).real
        return (made - made.mean()) / made.std()

    crack, grain = numpy.exp(-((cloud(1.4) / 0.06) ** 2)), cloud(1.1)
    grey = 0.33 + 0.05 * cloud(1.6) + 0.06 * grain - 0.17 * crack
    height = 2 * cloud(1.8) - 0.5 * crack  # in pixels
    x, y = (numpy.roll(height, 1, axis) - height for axis in (1, 0))
    normal = numpy.stack([x, y, numpy.ones_like(x)]) / numpy.sqrt(x * x + y * y + 1)
    return (image("Rock", [grey * 1.04, grey, grey * (0.88 + 0.03 * cloud(1.6))]),
            image("Relief", 0.5 + 0.5 * normal, data=True))


def add(name, material, colour, parts):
    vertices, faces, uvs, share = parts
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    if uvs:
        layer = mesh.uv_layers.new(name="UVMap")
        for loop in mesh.loops:
            u, v = uvs[loop.vertex_index]
            # Blender's v runs up, glTF's down.
            layer.data[loop.index].uv = (u, 1 - v)
    if share:
        # The red of the vertices is the share of the thickness that the water has there.
        colours = mesh.color_attributes.new("Thickness", "FLOAT_COLOR", "POINT")
        for i, red in enumerate(share):
            colours.data[i].color = (red, red, red, 1)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    made = bpy.data.materials.new(material)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 1.0
    if name == "Rock":
        picture, relief = paint()
        new, join = made.node_tree.nodes.new, made.node_tree.links.new
        texture, bent = new("ShaderNodeTexImage"), new("ShaderNodeTexImage")
        normal = new("ShaderNodeNormalMap")
        texture.image, bent.image = picture, relief
        join(texture.outputs["Color"], shader.inputs["Base Color"])
        join(bent.outputs["Color"], normal.inputs["Color"])
        join(normal.outputs["Normal"], shader.inputs["Normal"])
    mesh.materials.append(made)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)


bpy.ops.wm.read_factory_settings(use_empty=True)
add("Rock", "Rock", (1, 1, 1), rock())
add("Fall", "Fall", (0.8, 0.9, 1.0), fall())
bpy.ops.export_scene.gltf(
    filepath=sys.argv[1] if len(sys.argv) > 1 else "cliff.glb",
    export_format="GLB",
    export_vertex_color="ACTIVE",
    export_all_vertex_colors=True,
)
