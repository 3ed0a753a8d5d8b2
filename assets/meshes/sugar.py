"""Writes sugar.glb, the mesh of the preset `sugar`: three lumps and a heap, ten times as large as life.

Run: python3 sugar.py [FILE]   (Python alone)

Texture coordinates count copies of the volume.
"""

import math
import sys

import glb

TILE = 0.128  # metres that a copy of the volume covers
SIDE, EDGE, FIELDS = 0.16, 0.012, 16  # of a lump: length of a side, radius of its edges, quads along a side
RADIUS, RISE = 0.31, 0.15  # of the heap
RINGS, SPOKES = 44, 120


def lump(centre, turn, tilt=0.0):
    """A cube with round edges: every point of a cube's faces, drawn in to the round."""
    points, uvs, triangles = [], [], []
    inner = SIDE / 2 - EDGE
    for axis in range(3):
        for sign in (-1.0, 1.0):
            first = len(points)
            for j in range(FIELDS + 1):
                for i in range(FIELDS + 1):
                    # Denser towards the edges, which are round.
                    a, b = (math.sin((2 * k / FIELDS - 1) * math.pi / 2) * SIDE / 2 for k in (i, j))
                    p = [0.0] * 3
                    p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = sign * SIDE / 2, a, b
                    core = [max(-inner, min(inner, x)) for x in p]
                    out = [x - c for x, c in zip(p, core)]
                    far = math.sqrt(sum(x * x for x in out))
                    p = [c + x / far * EDGE for c, x in zip(core, out)]
                    points.append(placed(p, centre, turn, tilt))
                    uvs.append((a / TILE + 0.37 * axis, b / TILE + 0.21 * sign))
            for j in range(FIELDS):
                for i in range(FIELDS):
                    a = first + j * (FIELDS + 1) + i
                    b, c, d = a + 1, a + FIELDS + 2, a + FIELDS + 1
                    triangles += [(a, b, c), (a, c, d)] if sign > 0 else [(a, c, b), (a, d, c)]
    return points, uvs, triangles


def placed(p, centre, turn, tilt):
    """Turned about the x and then the y axis, and moved. Degrees."""
    c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    x, y, z = p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    x, z = c * x + s * z, c * z - s * x
    return x + centre[0], y + centre[1], z + centre[2]


def around(inner, outer, height, rings, middle):
    """A disc or ring on the table; `height` is that at a radius and an angle."""
    points, uvs, triangles = [], [], []
    for j in range(rings + 1):
        r = inner + (outer - inner) * j / rings
        for i in range(SPOKES):
            a = 2 * math.pi * i / SPOKES
            wave = 1.0 + 0.06 * math.sin(3 * a + 1.0) + 0.04 * math.sin(5 * a)
            x, z = r * wave * math.cos(a), r * wave * math.sin(a)
            points.append((middle[0] + x, height(r, a), middle[1] + z))
            # Bent, so that copies do not stand in rows.
            uvs.append(((x + 0.025 * math.sin(7 * z)) / TILE, (z + 0.025 * math.sin(8 * x + 1)) / TILE))
    at = lambda j, i: j * SPOKES + i % SPOKES
    for j in range(rings):
        for i in range(SPOKES):
            a, b, c, d = at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)
            if j > 0 or inner > 0.0:
                triangles.append((a, b, d))
            triangles.append((b, c, d))
    return points, uvs, triangles


def heap(r, a):
    """Height of the heap, metres. Its foot dives below the table, so the last grains stand alone."""
    x, z = r * math.cos(a), r * math.sin(a)
    slope = RISE * (1.0 - r / RADIUS) * (1.0 + 0.1 * math.sin(2 * a + 0.7) * min(1.0, r / 0.1))
    # The tip is blunt.
    top = RISE * 0.85 - 0.02 * math.log(1.0 + math.exp((RISE * 0.85 - slope) / 0.02))
    bump = math.sin(31 * x + 4 * math.sin(23 * z)) * math.sin(27 * z + 3 * math.sin(19 * x))
    return top + 0.006 * bump


def joined(parts):
    points, uvs, triangles = [], [], []
    for p, uv, t in parts:
        triangles += [tuple(len(points) + k for k in triangle) for triangle in t]
        points += p
        uvs += uv
    return points, uvs, triangles


def main(path):
    middle = (0.24, 0.1)
    h = SIDE / 2 + 0.004
    lumps = [
        lump((-0.22, h, 0.0), 24.0),
        lump((-0.05, h, -0.2), -15.0),
        lump((-0.165, 3 * h + 0.008, -0.09), 48.0),
    ]
    table = [(-6.0, 0.0, -6.0), (-6.0, 0.0, 6.0), (6.0, 0.0, 6.0), (6.0, 0.0, -6.0)]
    strewn = around(0.28, 0.5, lambda r, a: 0.001, 22, middle)
    few = around(0.42, 0.8, lambda r, a: 0.001, 34, middle)
    white = {"baseColorFactor": [0.75, 0.75, 0.74, 1.0], "roughnessFactor": 1.0, "metallicFactor": 0.0}
    dark = {"baseColorFactor": [0.018, 0.014, 0.012, 1.0], "roughnessFactor": 0.35, "metallicFactor": 0.0}
    parts = [
        ("Lump", white, *joined(lumps)),
        ("Heap", white, *around(0.0, 1.3 * RADIUS, heap, RINGS, middle)),
        ("Strewn", white, *strewn),
        ("Few", white, *few),
        ("Table", dark, table, [(0.0, 0.0)] * 4, [(0, 1, 2), (0, 2, 3)]),
    ]
    glb.write(path, "sugar", parts)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "sugar.glb")
