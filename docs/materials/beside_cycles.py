"""Renders the strands of a .hair with Blender's Cycles, and compares them with taki's pictures of the same.

Run: TAKI=taki python3 beside_cycles.py [fur|hair|bear]      (Python with bpy 5 and numpy)

For each azimuth of one distant light, both render `truth.toml` with that light alone: taki as cells of a
volume, Cycles as curves with the principled hair BSDF and direct light. Printed are the share of the pixels
that the strands cover, and the mean radiance. `bear` grows the hairs of the preset `bear` on its mesh,
without taki's shells, and prints what each program takes to the same noise.
"""

import json
import math
import os
import re
import struct
import subprocess
import sys
import tempfile
import time

import bpy
import numpy as np
from mathutils import Vector

HERE = os.path.dirname(os.path.abspath(__file__))
TAKI = os.environ.get("TAKI", "taki")
SAMPLES = 256
UP = {"fur": "z", "hair": "y"}  # fur then hangs from the top, and hair runs upwards
AZIMUTHS = [0, 45, 90, 135, 180]  # of the light, from the camera's side, degrees
HEIGHT = 25.0  # of the light above the horizon, degrees
VIEW = (0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 16.0, (256, 256)  # eye, target, field of view, size


def strands(path):
    """Numbers of points, points and diameters of a .hair."""
    with open(path, "rb") as file:
        data = file.read()
    count, points = struct.unpack_from("<2I", data, 4)
    segments = np.frombuffer(data, "<u2", count, 128).astype(int) + 1
    at = 128 + 2 * count
    places = np.frombuffer(data, "<f4", 3 * points, at).reshape(-1, 3)
    return segments, places, np.frombuffer(data, "<f4", points, at + 12 * points)


def upright(p):
    """From taki's axes to Blender's: y points up there, and z here."""
    return np.stack([p[..., 0], -p[..., 2], p[..., 1]], -1)


def light(azimuth):
    a, b = math.radians(azimuth), math.radians(HEIGHT)
    return math.cos(b) * math.sin(a), math.sin(b), math.cos(b) * math.cos(a)


def curves_of(counts, points, widths, fibre):
    """Blender's curves with the principled hair BSDF."""
    curves = bpy.data.hair_curves.new("strands")
    curves.add_curves(counts.tolist())
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radius = curves.attributes.get("radius") or curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", (widths / 2).astype(np.float32))
    material = bpy.data.materials.new("fibre")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    bsdf, out = nodes.new("ShaderNodeBsdfHairPrincipled"), nodes.new("ShaderNodeOutputMaterial")
    bsdf.model, bsdf.parametrization = "CHIANG", "ABSORPTION"
    for name, value in fibre.items():
        bsdf.inputs[name].default_value = value
    material.node_tree.links.new(bsdf.outputs[0], out.inputs["Surface"])
    curves.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("strands", curves))


def stage(fibre_curves, view):
    """Blender's scene of curves, with a sun of the irradiance π and the camera of taki's scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    fibre_curves()
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    camera = bpy.data.cameras.new("eye")
    place, target, fov, size = view
    camera.sensor_fit, camera.angle_y = "VERTICAL", math.radians(fov)
    eye = bpy.data.objects.new("eye", camera)
    eye.location = upright(np.array(place))
    back = Vector(upright(np.array(place) - np.array(target)).tolist())
    eye.rotation_euler = back.to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(eye)
    scene.camera = eye
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = math.pi, 0.0
    scene.collection.objects.link(bpy.data.objects.new("sun", sun))
    scene.render.engine = "CYCLES"
    scene.render.film_transparent = True
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles_curves.shape = "THICK"
    return scene


def turned(scene, direction):
    way = Vector(upright(np.array(direction)).tolist())
    scene.objects["sun"].rotation_euler = way.to_track_quat("Z", "Y").to_euler()


def pixels(path):
    """RGB, not premultiplied by anything but coverage, and alpha."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    data = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(data)
    bpy.data.images.remove(image)
    return data.reshape(-1, 4)


def taki(*args):
    subprocess.run([TAKI, *map(str, args)], check=True, stderr=subprocess.DEVNULL)


def thinned(tile, pieces):
    """The same strands with fewer points: about `pieces` segments each."""
    counts, points, widths = tile
    ends = counts.cumsum()
    kept = [np.linspace(end - count, end - 1, min(pieces + 1, count)).round().astype(int)
            for count, end in zip(counts, ends)]
    every = np.concatenate(kept)
    return np.array([len(own) for own in kept]), points[every], widths[every]


def parts(path):
    """Points, texture coordinates and triangles of the parts of a .glb of `glb.py`, by material."""
    with open(path, "rb") as file:
        data = file.read()
    (length,) = struct.unpack_from("<I", data, 12)
    document, blob = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(number, kind, columns):
        own = document["accessors"][number]
        start = document["bufferViews"][own["bufferView"]].get("byteOffset", 0)
        rows = own["count"] // (3 if own["type"] == "SCALAR" else 1)
        return np.frombuffer(blob, kind, rows * columns, start).reshape(-1, columns)

    for part in document["meshes"][0]["primitives"]:
        places = part["attributes"]
        yield document["materials"][part["material"]]["name"], (
            array(places["POSITION"], "<f4", 3).astype(float),
            array(places["TEXCOORD_0"], "<f4", 2).astype(float),
            array(part["indices"], "<u2", 3).astype(int),
        )


def grown(part, tile, size, thickness):
    """Strands of copies of a tile on a mesh: each stands on the triangle that holds its root."""
    points, uvs, triangles = part
    # Copies of a point on seams share its normal, which is weighted by the angles of the triangles.
    _, same = np.unique(points.round(6), axis=0, return_inverse=True)
    normals = np.zeros((same.max() + 1, 3))
    p = points[triangles]
    flat = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    for k in range(3):
        a, b = p[:, (k + 1) % 3] - p[:, k], p[:, (k + 2) % 3] - p[:, k]
        cosine = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        np.add.at(normals, same[triangles[:, k]], flat * np.arccos(cosine.clip(-1, 1))[:, None])
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True))[same]
    counts, places, widths = tile
    size = np.array(size, float)
    cells = places / (size / size.max()) + 0.5  # 0 to 1 in the tile
    first = np.concatenate([[0], counts.cumsum()[:-1]])
    roots = cells[first, :2]
    out_counts, out_points, out_widths = [], [], []
    for triangle in triangles:
        corners, uv, up = points[triangle], uvs[triangle], normals[triangle]
        edges = np.array([uv[1] - uv[0], uv[2] - uv[0]]).T
        if abs(np.linalg.det(edges)) < 1e-12:
            continue
        inverse = np.linalg.inv(edges)
        scale = np.sqrt(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
                        / abs(np.linalg.det(edges))) / size[0]
        low, high = np.floor(uv.min(0) - 1).astype(int), np.ceil(uv.max(0)).astype(int)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                b = (roots + [i, j] - uv[0]) @ inverse.T
                for strand in np.flatnonzero((b >= 0).all(1) & (b.sum(1) < 1)):
                    own = slice(first[strand], first[strand] + counts[strand])
                    b_own = (cells[own, :2] + [i, j] - uv[0]) @ inverse.T
                    weights = np.column_stack([1 - b_own.sum(1), b_own])
                    out = thickness * (1 - cells[own, 2:3])
                    out_points.append(weights @ corners + out * (weights @ up))
                    out_widths.append(widths[own] * size.max() * scale)
                    out_counts.append(counts[strand])
    return np.array(out_counts), np.concatenate(out_points), np.concatenate(out_widths)


def compare(kind, folder):
    scene = os.path.join(HERE, "truth.toml")
    hair = os.path.join(folder, f"{kind}.hair")
    source = os.path.join(HERE, "strands.toml")
    taki("volume", "build", source, "--volume", kind, "-o", hair, "--overwrite")
    with open(scene) as file:
        text = file.read()
    number = lambda key: float(re.search(rf"^{key} = (.*)$", text, re.M).group(1))
    melanin, redness = number("melanin"), number("redness")
    eu, pheo = np.array([0.419, 0.697, 1.37]), np.array([0.187, 0.4, 1.05])
    fibre = {
        "Absorption Coefficient": (melanin * ((1 - redness) * eu + redness * pheo)).tolist(),
        "IOR": number("eta"),
        "Offset": math.radians(number("tilt")),
        "Roughness": number("beta_m"),
        "Radial Roughness": number("beta_n"),
        "Random Roughness": 0.0,
    }
    counts, points, widths = strands(hair)
    places = points if UP[kind] == "z" else upright(points)
    blend = stage(lambda: curves_of(counts, places, widths, fibre), VIEW)
    # A cell with ρ = 1 is hidden once over by the strands in it.
    sigma = (number("longest") - 2) / (np.ptp(points, 0).max() + widths.max())
    print(f"| {kind}, light at | covered, taki | Cycles | radiance, taki | Cycles | ratio |")
    print("|---|--:|--:|--:|--:|--:|")
    for azimuth in AZIMUTHS:
        own, other = (os.path.join(folder, f"{kind}_{azimuth}_{who}.exr") for who in ("taki", "cycles"))
        sets = {
            "volumes.strands.source": hair,
            "volumes.strands.up": UP[kind],
            "trace.sigma": sigma,
            "lights.sun.direction": ",".join(f"{x:.7f}" for x in light(azimuth)),
        }
        given = [f"--set={key}={value}" for key, value in sets.items()]
        taki("render", scene, "-o", own, "--overwrite", "--layers", "rgb", *given)
        turned(blend, light(azimuth))
        blend.render.filepath = other
        bpy.ops.render.render(write_still=True)
        a, b = pixels(own), pixels(other)
        cover = [100 * p[:, 3].mean() for p in (a, b)]
        mean = [p[:, :3].mean(0) for p in (a, b)]
        green = [m @ [0.2126, 0.7152, 0.0722] for m in mean]
        ratio = green[0] / green[1]
        row = [f"{azimuth}°", *(f"{c:.2f} %" for c in cover), *(f"{g:.5f}" for g in green), f"{ratio:.3f}"]
        print("|", " | ".join(row), "|", flush=True)


def bear(folder):
    """Time to the same noise, with one light on the bear's coat and no light but it."""
    assets = os.path.join(HERE, "..", "..", "assets")
    mesh = dict(parts(os.path.join(assets, "meshes", "bear.glb")))
    tile = os.path.join(folder, "coat.hair")
    taki("volume", "build", "bear", "--volume", "coat", "-o", tile, "--overwrite")
    counts, points, widths = grown(mesh["Coat"], thinned(strands(tile), 10), (96, 96, 44), 0.095)
    print(f"{len(counts)} hairs, {len(points)} points")
    fibre = {"Absorption Coefficient": [0.4, 0.7, 1.2], "IOR": 1.55, "Offset": math.radians(3.0),
             "Roughness": 0.3, "Radial Roughness": 0.3}
    view = (1.1, 1.25, 4.3), (0.0, 0.86, 0.1), 30.0, (640, 360)
    direction = (0.7, 1.0, 0.75)

    def curves():
        curves_of(counts, upright(points), widths, fibre)
        body, uv, triangles = mesh["Coat"]
        skin = bpy.data.meshes.new("skin")
        skin.from_pydata(upright(body).tolist(), [], triangles.tolist())
        black = bpy.data.materials.new("black")
        black.diffuse_color = 0, 0, 0, 1
        black.use_nodes = True
        black.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = 0, 0, 0, 1
        black.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0
        skin.materials.append(black)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("skin", skin))

    blend = stage(curves, view)
    turned(blend, direction)
    one = ["--set", "meshes.bear.materials.Ground=none", "--set", "meshes.bear.materials.Muzzle=none",
           "--set", "meshes.bear.materials.Dark=none", "--remove", "volumes.coat.color_3",
           "--remove", "volumes.coat.color_2", "--remove", "volumes.coat.color", "--remove", "lights.rim",
           "--set", "light.ambient=[0,0,0]", "--set", "light.reflection=hair", "--set", "hair.melanin=1.2",
           "--set", "lights.key.intensity=1", "--set", "lights.key.color=[1,1,1]", "--set", "image.width=640",
           "--set", "image.height=360", "--set", "haze.density=0", "--layers", "rgb", "--alpha"]
    pictures, times = {}, {}
    for samples in (4, 64):
        path = os.path.join(folder, f"bear_taki_{samples}.exr")
        start = time.time()
        taki("render", "bear", *one, "--set", f"image.samples={samples}", "-o", path, "--overwrite")
        times["taki", samples], pictures["taki", samples] = time.time() - start, pixels(path)
    for samples in (1, 4, 16, 256):
        path = os.path.join(folder, f"bear_cycles_{samples}.exr")
        blend.cycles.samples, blend.render.filepath = samples, path
        start = time.time()
        bpy.ops.render.render(write_still=True)
        times["cycles", samples], pictures["cycles", samples] = time.time() - start, pixels(path)
    best = {"taki": pictures["taki", 64], "cycles": pictures["cycles", 256]}
    print("| program | samples | s | covered | mean radiance | noise ÷ mean |")
    print("|---|--:|--:|--:|--:|--:|")
    noises = {}
    for (who, samples), picture in pictures.items():
        green = lambda p: p[:, :3] @ [0.2126, 0.7152, 0.0722]
        noise = np.sqrt(((green(picture) - green(best[who])) ** 2).mean()) / green(best[who]).mean()
        noises[who, samples] = noise
        print(f"| {who} | {samples} | {times[who, samples]:.1f} | {100 * picture[:, 3].mean():.2f} % | "
              f"{green(picture).mean():.5f} | {noise:.3f} |", flush=True)
    # Noise falls with the root of the samples, and time grows by as much for each of them.
    wanted = 16 * (noises["cycles", 16] / noises["taki", 4]) ** 2
    each = (times["cycles", 256] - times["cycles", 16]) / (256 - 16)
    seconds = times["cycles", 16] + (wanted - 16) * each
    print(f"Cycles needs about {wanted:.0f} samples and {seconds:.0f} s for the noise of taki's 4 samples, "
          f"which take {times['taki', 4]:.1f} s: 1/{seconds / times['taki', 4]:.0f} of the time")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as own:
        folder = os.environ.get("KEEP", own)
        for name in sys.argv[1:] or ["fur", "hair", "bear"]:
            bear(folder) if name == "bear" else compare(name, folder)
