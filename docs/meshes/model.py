"""Models a ledge of rock and the water that runs over it, and writes ledge.glb.

python model.py   (with Blender's module: pip install bpy)
"""

import math
import os

import bpy
import numpy
from mathutils import Vector, noise

# 1. An empty scene. Blender's z runs up, and the water falls towards -y.
bpy.ops.wm.read_factory_settings(use_empty=True)


def material(name, colour, picture=None, relief=None):
    made = bpy.data.materials.new(name)
    if not made.node_tree:
        made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 1.0
    if picture:
        new, join = made.node_tree.nodes.new, made.node_tree.links.new
        texture, bent = new("ShaderNodeTexImage"), new("ShaderNodeTexImage")
        normal = new("ShaderNodeNormalMap")
        texture.image, bent.image = picture, relief
        join(texture.outputs["Color"], shader.inputs["Base Color"])
        join(bent.outputs["Color"], normal.inputs["Color"])
        join(normal.outputs["Normal"], shader.inputs["Normal"])
    return made


def add(name, made, rows, uvs, shares=None):
    """Adds a surface of rows of points, each from left to right, with a texture coordinate for each point."""
    row = len(rows[0])
    points, uvs = sum(rows, []), sum(uvs, [])
    faces = [(k, k + row, k + row + 1, k + 1) for k in range(len(points) - row) if (k + 1) % row]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    mesh.materials.append(made)
    layer = mesh.uv_layers.new(name="UVMap")
    for loop in mesh.loops:
        u, v = uvs[loop.vertex_index]
        # Blender's v runs up; taki's v runs down, with the flow.
        layer.data[loop.index].uv = (u, 1 - v)
    if shares:
        # The red of the vertices is the share of the thickness that the water has there.
        colours = mesh.color_attributes.new("Thickness", "FLOAT_COLOR", "POINT")
        for vertex, share in zip(colours.data, sum(shares, [])):
            vertex.color = (share, share, share, 1)
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))


# 2. The rock: an outline (y, z) made rough. It comes up from below, so that the rock is closed behind, and
# goes along the stream bed to the rim, under the overhang, and down to below the pool, which lies at z = 0.
OUTLINE = [(11, 0), (8, 2.9), (4, 3.1), (0.5, 2.95), (0, 2.7), (0.2, 2.35), (0.9, 2.0), (0.8, 1.3),
           (0.4, 0.5), (-0.4, -0.1), (-2, -0.5), (-3, -1.2)]
RIM = 4  # number of the outline's point where the water leaves the rock


def rock(x, s):
    """Returns the point of the rock at x metres across and s points down the outline."""
    k = min(int(s), len(OUTLINE) - 2)
    p = Vector((x, *OUTLINE[k])).lerp(Vector((x, *OUTLINE[k + 1])), s - k)
    p.y -= 0.035 * x * x
    bed = math.exp(-((x / 1.5) ** 6))  # 1 in the bed of the stream, 0 on its banks
    wall = min(max(s - RIM + 0.5, 0), 1)
    rough = noise.fractal(p * 0.5, 1.0, 2.1, 5)
    fine = noise.fractal(p * 2.2, 0.9, 2.2, 5)
    layers = noise.noise(Vector((0.3 * x, 0.3 * p.y, 2.4 * p.z)))
    layers = math.copysign(abs(layers) ** 0.5, layers)
    p.y -= wall * (0.7 * rough + 0.3 * layers + 0.2 * fine) * (1 - 0.7 * bed)
    p.z += (0.45 * rough + 0.15 * fine) * (1 - 0.85 * bed)
    # The banks are higher than the bed.
    p.z += 0.7 * (1 - bed) * min(max(RIM + 1 - s, 0), 1)
    return p


def image(name, channels, data=False):
    """Makes a picture of three channels of 0 to 1. Colours are in sRGB; data are taken as they are."""
    pixels = numpy.stack([*channels, numpy.ones_like(channels[0])], -1).clip(0, 1)
    made = bpy.data.images.new(name, *pixels.shape[:2], is_data=data)
    made.pixels = pixels.ravel()
    made.pack()
    return made


def paint(size=512):
    """Paints stains, grain and cracks, and their relief. Sums of waves repeat without a seam."""
    chance = numpy.random.default_rng(3)
    run = numpy.fft.fftfreq(size, 1 / size)
    frequency = numpy.maximum(numpy.hypot(run, run[:, None]), 1)

    def cloud(smoothness):
        made = numpy.fft.ifft2(numpy.fft.fft2(chance.normal(size=(size, size))) / frequency**smoothness).real
        return (made - made.mean()) / made.std()

    crack, grain = numpy.exp(-((cloud(1.4) / 0.06) ** 2)), cloud(1.1)
    grey = 0.37 + 0.05 * cloud(1.6) + 0.06 * grain - 0.17 * crack
    height = 4 * cloud(1.8) - crack  # in pixels
    x, y = (numpy.roll(height, 1, axis) - height for axis in (1, 0))
    normal = numpy.stack([x, y, numpy.ones_like(x)]) / numpy.sqrt(x * x + y * y + 1)
    return (image("Rock", [grey * 1.04, grey, grey * (0.88 + 0.03 * cloud(1.6))]),
            image("Relief", 0.5 + 0.5 * normal, data=True))


xs = [16 * i / 192 - 8 for i in range(193)]
rows = []
for k, ((y0, z0), (y1, z1)) in enumerate(zip(OUTLINE, OUTLINE[1:])):
    count = math.ceil(math.hypot(y1 - y0, z1 - z0) / 0.1)
    rows += [[rock(x, k + j / count) for x in xs] for j in range(count)]
# The texture is 4 m wide. y + z falls both along the bed and down the wall.
uvs = [[(p.x / 4, -(p.y + p.z) / 4) for p in row] for row in rows]
add("Rock", material("Rock", (1, 1, 1), *paint()), rows, uvs)

# 3. The water: along the bed to the rim, then the parabola of free fall. Each row knows its time t.
SPEED, DEPTH, WIDTH, COLUMNS = 1.6, 0.15, 3.2, 24
across = [i / COLUMNS for i in range(COLUMNS + 1)]
rows, times = [], []
for j in range(41):
    # The water is level: each row lies above the middle of the bed, and its ends lie in the banks.
    s = 2 + (RIM - 2) * j / 40
    middle = rock(0, s)
    rows.append([Vector((p.x, p.y, middle.z + DEPTH)) for p in (rock((u - 0.5) * WIDTH, s) for u in across)])
    times.append((rock(0, 2).y - middle.y) / SPEED)
rim, start = rows[-1], times[-1]
for j in range(1, 25):
    t = 0.035 * j
    # The last rows lie below the pool.
    rows.append([p + Vector((0, -SPEED * t, -4.905 * t * t)) for p in rim])
    times.append(start + t)
# u across the water, and v = the time of its fall in seconds.
uvs = [[(u, t) for u in across] for t in times]


def share(u, t):
    """Returns 0 at the edges and 1 in the middle, with a ragged border."""
    return min(max(5 * min(u, 1 - u) + noise.noise(Vector((6 * u, 3 * t, 0))), 0), 1) if 0 < u < 1 else 0.0


add("Fall", material("Fall", (0.8, 0.9, 1.0)), rows, uvs, [[share(u, t) for u in across] for t in times])

# 4. A camera.
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location = (2.6, -12.5, 3.0)
camera.rotation_euler = (math.radians(84), 0, math.radians(12))
bpy.context.collection.objects.link(camera)

# 5. The file, with the colours of the vertices. Blender turns its z into glTF's y.
bpy.ops.export_scene.gltf(filepath=os.path.abspath("ledge.glb"), export_format="GLB", export_cameras=True,
                          export_vertex_color="ACTIVE")
