"""Writes bear.glb, the mesh of the preset `bear`: a sitting bear of ellipsoids, after Kajiya and Kay's.

Run: python3 bear.py [FILE]   (Python alone)

Texture coordinates count copies of the volume: u around an ellipsoid and v along it, in the direction in
which the fur is combed. Poles are where v begins and ends; most of them lie inside another ellipsoid.
"""

import math
import sys

import glb

TILE = 0.22  # metres of skin that a copy of the volume covers
ROUND, LONG = 56, 28  # quads around an ellipsoid and along it


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def ellipsoid(centre, along, radii, front=(0.0, 0.0, 1.0)):
    """Points, coordinates and triangles. `along` leads from the pole v = 0 to the other; `radii` are those
    across, along, and to the front."""
    y = unit(along)
    x = unit(cross(y, front)) if abs(sum(a * b for a, b in zip(y, unit(front)))) < 0.99 else (1.0, 0.0, 0.0)
    z = cross(x, y)
    across, length, deep = radii
    girth = 2 * math.pi * math.sqrt((across * across + deep * deep) / 2)
    copies = max(1, round(girth / TILE)), math.pi / 2 * (length + math.sqrt(across * deep)) / TILE
    points, uvs, triangles = [], [], []
    for j in range(LONG + 1):
        b = math.pi * j / LONG
        for i in range(ROUND + 1):
            a = 2 * math.pi * (i % ROUND) / ROUND
            own = across * math.sin(b) * math.sin(a), -length * math.cos(b), deep * math.sin(b) * math.cos(a)
            if j in (0, LONG):
                own = 0.0, own[1], 0.0
            points.append(tuple(centre[k] + x[k] * own[0] + y[k] * own[1] + z[k] * own[2] for k in range(3)))
            uvs.append((copies[0] * i / ROUND, copies[1] * j / LONG))
    for j in range(LONG):
        for i in range(ROUND):
            a, b = j * (ROUND + 1) + i, (j + 1) * (ROUND + 1) + i
            if j > 0:
                triangles.append((a, a + 1, b))
            if j < LONG - 1:
                triangles.append((a + 1, b + 1, b))
    return points, uvs, triangles


def both(part):
    """An ellipsoid on the left and its mirror image on the right."""
    centre, along, radii = part
    flip = lambda v: (-v[0], v[1], v[2])
    return [part, (flip(centre), flip(along), radii)]


def limb(start, end, thick):
    middle = tuple((a + b) / 2 for a, b in zip(start, end))
    along = tuple(b - a for a, b in zip(start, end))
    return middle, along, (thick, math.sqrt(sum(x * x for x in along)) / 2 + thick * 0.55, thick)


DOWN = (0.0, -1.0, 0.0)
# The fur of head and muzzle is combed away from muzzle and nose.
HEAD, SNOUT = (0.0, 0.31, -1.0), (0.0, -0.38, -1.0)
COAT = [
    ((0.0, 0.60, 0.0), DOWN, (0.44, 0.58, 0.41)),
    ((0.0, 1.34, 0.07), HEAD, (0.37, 0.34, 0.34)),
    *both(((0.27, 1.65, 0.02), (0.35, 1.0, 0.0), (0.12, 0.13, 0.075))),
    *both(limb((0.36, 0.98, 0.12), (0.45, 0.56, 0.40), 0.145)),
    *both(limb((0.26, 0.22, 0.15), (0.40, 0.20, 0.66), 0.18)),
]
MUZZLE = [
    ((0.0, 1.25, 0.36), SNOUT, (0.165, 0.17, 0.125)),
    *both(((0.405, 0.2, 0.715), (-0.14, 0.0, -0.51), (0.125, 0.135, 0.125))),
]
DARK = [
    ((0.0, 1.325, 0.555), SNOUT, (0.058, 0.042, 0.04)),
    *both(((0.148, 1.45, 0.428), DOWN, (0.042, 0.042, 0.042))),
]


def joined(parts):
    points, uvs, triangles = [], [], []
    for part in parts:
        p, uv, t = ellipsoid(*part)
        triangles += [tuple(len(points) + k for k in triangle) for triangle in t]
        points += p
        uvs += uv
    return points, uvs, triangles


def ground():
    r = 60.0
    points = [(-r, 0.0, -r), (-r, 0.0, r), (r, 0.0, r), (r, 0.0, -r)]
    return points, [(0.0, 0.0)] * 4, [(0, 1, 2), (0, 2, 3)]


def main(path):
    matt = {"roughnessFactor": 0.9, "metallicFactor": 0.0}
    looks = [
        ("Coat", {"baseColorFactor": [0.05, 0.03, 0.02, 1.0]}, joined(COAT)),
        ("Muzzle", {"baseColorFactor": [0.2, 0.14, 0.09, 1.0]}, joined(MUZZLE)),
        ("Dark", {"baseColorFactor": [0.012, 0.01, 0.01, 1.0]} | matt | {"roughnessFactor": 0.25}, joined(DARK)),
        ("Ground", {"baseColorFactor": [0.2, 0.185, 0.165, 1.0]} | matt, ground()),
    ]
    glb.write(path, "bear", [(name, look, *part) for name, look, part in looks])


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "bear.glb")
