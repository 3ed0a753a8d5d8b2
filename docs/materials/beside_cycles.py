"""Renders the strands of a .hair with Blender's Cycles, and compares them with taki's pictures of the same.

Run: TAKI=taki python3 beside_cycles.py [fur|hair]      (Python with bpy 5 and numpy)

For each azimuth of one distant light, both render `truth.toml` with that light alone: taki as cells of a volume,
Cycles as curves with the principled hair BSDF and direct light. Printed are the share of the pixels that the
strands cover, and the mean radiance.
"""

import math
import os
import re
import struct
import subprocess
import sys
import tempfile

import bpy
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
TAKI = os.environ.get("TAKI", "taki")
SAMPLES = 256
UP = {"fur": "z", "hair": "y"}  # fur then hangs from the top, and hair runs upwards
AZIMUTHS = [0, 45, 90, 135, 180]  # of the light, from the camera's side, degrees
HEIGHT = 25.0  # of the light above the horizon, degrees
SIZE = 256
TARGET, DISTANCE, VIEW = (0.0, 0.0, 0.0), 4.0, 16.0  # metres, metres, degrees


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


def stage(path, up, fibre):
    """Blender's scene of the strands, with a sun of the irradiance π."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    counts, points, widths = strands(path)
    curves = bpy.data.hair_curves.new("strands")
    curves.add_curves(counts.tolist())
    curves.attributes["position"].data.foreach_set("vector", (points if up == "z" else upright(points)).astype(np.float32).ravel())
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
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("strands", curves))
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    camera = bpy.data.cameras.new("eye")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(VIEW)
    eye = bpy.data.objects.new("eye", camera)
    eye.location = upright(np.array([0.0, 0.0, DISTANCE]) + np.array(TARGET))
    eye.rotation_euler = (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(eye)
    scene.camera = eye
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = math.pi, 0.0
    scene.collection.objects.link(bpy.data.objects.new("sun", sun))
    scene.render.engine = "CYCLES"
    scene.render.film_transparent = True
    scene.render.resolution_x = scene.render.resolution_y = SIZE
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


def turned(scene, azimuth):
    from mathutils import Vector

    way = Vector(upright(np.array(light(azimuth))).tolist())
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


def compare(kind, folder):
    scene = os.path.join(HERE, "truth.toml")
    hair = os.path.join(folder, f"{kind}.hair")
    taki("volume", "build", os.path.join(HERE, "strands.toml"), "--volume", kind, "-o", hair, "--overwrite")
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
    blend = stage(hair, UP[kind], fibre)
    _, points, widths = strands(hair)
    # A cell with ρ = 1 is hidden once over by the strands in it.
    sigma = (number("longest") - 2) / (np.ptp(points, 0).max() + widths.max())
    print(f"| {kind}, light at | covered, taki | Cycles | radiance, taki | Cycles | ratio |")
    print("|---|--:|--:|--:|--:|--:|")
    for azimuth in AZIMUTHS:
        own, other = (os.path.join(folder, f"{kind}_{azimuth}_{who}.exr") for who in ("taki", "cycles"))
        direction = ",".join(f"{x:.7f}" for x in light(azimuth))
        taki("render", scene, "-o", own, "--overwrite", "--layers", "rgb", "--set", f"volumes.strands.source={hair}",
             "--set", f"volumes.strands.up={UP[kind]}", "--set", f"trace.sigma={sigma}", "--set", f"lights.sun.direction=[{direction}]")
        turned(blend, azimuth)
        blend.render.filepath = other
        bpy.ops.render.render(write_still=True)
        a, b = pixels(own), pixels(other)
        cover = [100 * p[:, 3].mean() for p in (a, b)]
        mean = [p[:, :3].mean(0) for p in (a, b)]
        green = [m @ [0.2126, 0.7152, 0.0722] for m in mean]
        print(f"| {azimuth}° | {cover[0]:.2f} % | {cover[1]:.2f} % | {green[0]:.5f} | {green[1]:.5f} | "
              f"{green[0] / green[1]:.3f} |", flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as own:
        folder = os.environ.get("KEEP", own)
        for name in sys.argv[1:] or ["fur", "hair"]:
            compare(name, folder)
