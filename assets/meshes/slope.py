"""Writes slope.glb, the mesh of the preset `slope`: a piece of a mountainside, and ridges far behind it.

Run: python3 slope.py [FILE]   (Python alone)

Texture coordinates count copies of the volume: u across the slope and v down it. They are bent, so that
copies do not stand in rows.
"""

import math
import random
import sys

import glb

TILE = 2.6  # metres of ground that a copy of the volume covers
NEAR = 0.07, 0.0085  # metres from vertex to vertex near the camera, and growth with the distance
EYE = -7.0, 2.2  # x and z of the camera
LEFT, RIGHT = -7.6, 11.5  # metres
BACK, FRONT = -8.0, 7.0


class Noise:
    """Smooth noise of random numbers on a lattice, −1 to 1."""

    def __init__(self, seed):
        rng = random.Random(seed)
        self.n = 64
        self.values = [rng.uniform(-1.0, 1.0) for _ in range(self.n * self.n)]

    def __call__(self, x, y):
        i, j = math.floor(x), math.floor(y)
        s, t = (f * f * f * (f * (f * 6 - 15) + 10) for f in (x - i, y - j))
        at = lambda a, b: self.values[(j + b) % self.n * self.n + (i + a) % self.n]
        low = at(0, 0) + (at(1, 0) - at(0, 0)) * s
        high = at(0, 1) + (at(1, 1) - at(0, 1)) * s
        return low + (high - low) * t


form, warp = Noise(3), Noise(8)


def fractal(noise, x, y, levels, h=0.9):
    return sum(noise(x * 2**n + 17 * n, y * 2**n) * 2 ** (-n * h) for n in range(levels))


def smooth(a, b, x):
    t = min(1.0, max(0.0, (x - a) / (b - a)))
    return t * t * (3 - 2 * t)


def height(x, z):
    """Height of the ground, metres. The slope falls towards +z."""
    y = 0.62 * (2.0 - z) + 0.05 * x - 0.05 * max(0.0, z - 2.5) ** 2
    # A spur that comes down behind a gully, and a hump in front of it.
    spur = 6.0 + 0.35 * z
    y += 1.9 * math.exp(-(((x - spur) / 2.2) ** 2)) * smooth(8.0, -2.0, z)
    gully = 1.6 + 0.3 * z + 0.5 * math.sin(0.7 * z)
    y -= 0.8 * math.exp(-(((x - gully) / 1.2) ** 2)) * smooth(-9.0, -3.0, z)
    y += 0.7 * fractal(form, 0.19 * x, 0.19 * z, 3)
    # Ledges: steep risers between gentle shelves.
    bed = 0.8 * (y + 0.35 * fractal(form, 0.3 * x + 9, 0.1 * z, 3)) + 0.1 * x
    step = bed - math.floor(bed)
    y += 0.6 * (smooth(0.35, 1.0, step) - step) * (0.55 + 0.45 * form(0.25 * x, 0.25 * z + 5))
    # The edge, behind which the ground falls away.
    edge = -5.2 - 0.08 * x + 0.9 * form(0.3 * x, 3.3)
    return y - 0.9 * max(0.0, edge - z) ** 1.35


def lines(low, high, eye):
    """Places of the rows of vertices, closer near the camera."""
    at, places = eye, [eye]
    while at < high:
        at = min(high, at + NEAR[0] + NEAR[1] * (at - eye) * 0.7)
        places.append(at)
    at = eye
    while at > low:
        at = max(low, at - NEAR[0] - NEAR[1] * (eye - at) * 0.7)
        places.insert(0, at)
    return places


def ground():
    xs, zs = lines(LEFT, RIGHT, EYE[0]), lines(BACK, FRONT, EYE[1])
    points, uvs, triangles = [], [], []
    for x in xs:
        length, before = 0.0, None
        for z in zs:
            y = height(x, z)
            # Copies are as long on risers as on shelves.
            length += 0.0 if before is None else math.hypot(z - before[0], y - before[1])
            before = z, y
            a, b = 0.12 * x, 0.12 * z
            u = x / TILE + 0.2 * length / TILE + 0.5 * fractal(warp, a, b, 2)
            v = length / TILE - 0.1 * x / TILE + 0.5 * fractal(warp, a + 31, b, 2)
            points.append((x, y, z))
            uvs.append((u, v))
    at = lambda i, j: i * len(zs) + j
    for i in range(len(xs) - 1):
        for j in range(len(zs) - 1):
            a, b, c, d = at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)
            triangles += [(a, b, c), (a, c, d)]
    return points, uvs, triangles


def far_height(a, r):
    """Height of the mountains behind, metres: crests are where noise changes its sign. A valley lies before
    them."""
    y, scale, share = 0.0, 1.0, 1.0
    x, z = r * math.cos(a), r * math.sin(a)
    for n in range(6):
        own = form(0.0006 * 2**n * x + 13 * n, 0.0006 * 2**n * z + 5 * n)
        crest = 1.0 - 1.8 * (math.sqrt(own * own + 0.004) - 0.06)
        y += scale * share * crest
        scale, share = 0.45 * scale, min(1.0, max(0.3, crest))
    return (620.0 * y + 160.0) * smooth(600.0, 3600.0, r) - 700.0


def far(wide=170, deep=90):
    """Mountains on the other side of the valley, towards +x and +z."""
    points, triangles = [], []
    for j in range(deep + 1):
        r = 900.0 * 6.5 ** (j / deep)
        for i in range(wide + 1):
            a = -0.3 + 1.15 * i / wide
            points.append((r * math.cos(a), far_height(a, r), r * math.sin(a)))
    at = lambda i, j: j * (wide + 1) + i
    for i in range(wide):
        for j in range(deep):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            triangles += [(a, c, b), (a, d, c)]
    return points, [(0.0, 0.0)] * len(points), triangles


def main(path):
    matt = {"roughnessFactor": 1.0, "metallicFactor": 0.0}
    parts = [
        ("Slope", {"baseColorFactor": [0.08, 0.07, 0.055, 1.0]} | matt, *ground()),
        ("Far", {"baseColorFactor": [0.1, 0.11, 0.09, 1.0]} | matt, *far()),
    ]
    glb.write(path, "slope", parts)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "slope.glb")
