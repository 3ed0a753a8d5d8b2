"""Writes hair.glb, the mesh of the preset `hair`: a head from behind with hair down to the shoulder blades.

Run: python3 hair.py [FILE]   (Python alone)

The hair is a surface of paths that begin at the parting, follow the skull and fall down the back. Texture
coordinates: u counts copies of the volume around the head, and v runs from 0 at the roots to 1 at the tips.
"""

import math
import sys

import glb

LENGTH = 0.54  # metres from root to tip
COPIES = 3  # of the volume around the head
AROUND, LONG = 84, 48  # quads around the head and along the hair
BLADES = 1.24  # height of the shoulder blades, metres
OPEN = math.radians(148)  # where the hair ends at the face, from the back of the head

SKULL = (0.0, 1.62, 0.0), (0.084, 0.122, 0.104)
# Rings of the bust from the chin down: height, half width, half depth, and middle of the depth.
NECK = [(1.52, 0.052, 0.055, 0.0), (1.47, 0.053, 0.056, -0.005), (1.43, 0.06, 0.06, -0.012)]
BODY = [
    (1.415, 0.068, 0.064, -0.015),
    (1.395, 0.098, 0.07, -0.018),
    (1.37, 0.145, 0.078, -0.02),
    (1.34, 0.182, 0.087, -0.02),
    (1.30, 0.203, 0.096, -0.018),
    (1.24, 0.212, 0.104, -0.015),
    (1.15, 0.208, 0.108, -0.01),
    (1.0, 0.19, 0.1, 0.0),
    (0.85, 0.185, 0.1, 0.0),
]
HEAD = [
    ((0.0, 1.617, 0.0), (0.079, 0.116, 0.098)),
    ((0.0, 1.577, 0.033), (0.058, 0.105, 0.072)),
]


def smooth(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def around(a, shrink=0.0):
    """The point of hair of azimuth `a` from the back, `shrink` metres below the skull's equator."""
    (cx, cy, cz), (rx, _, rz) = SKULL
    # Hair beside the face is drawn behind the shoulders on its way down.
    own = a * (1 - 0.42 * smooth(shrink / 0.3))
    wide = 1 + 0.4 * smooth(shrink / 0.35) + 0.012 * math.sin(7 * a + 9 * shrink) * smooth(shrink / 0.1)
    x, y, z = cx + rx * wide * math.sin(own), cy - shrink, cz - rz * wide * math.cos(own)
    # On its way down it moves behind the shoulders, and lies on the back.
    width, depth, middle = ring(min(y, BLADES))
    back = middle - depth * math.sqrt(max(0.0, 1 - (x / width) ** 2)) - 0.008
    behind = 0.5 * (back + z - math.hypot(back - z, 0.012))
    z += (behind - z) * smooth(shrink / (cy - BLADES))
    return x, y, z


def ring(y):
    """Half width, half depth and middle of the bust at a height."""
    rings = NECK + BODY
    for above, below in zip(rings, rings[1:]):
        if below[0] <= y <= above[0]:
            s = (above[0] - y) / (above[0] - below[0])
            return [p + (q - p) * s for p, q in zip(above[1:], below[1:])]
    return rings[0][1:] if y > rings[0][0] else rings[-1][1:]


def path(a):
    """Points of the hair of azimuth `a`, at equal distances along it."""
    (cx, cy, cz), (rx, ry, rz) = SKULL
    # The parting leads from the crown to the forehead, in the disc that the skull is from above.
    front = smooth((abs(a) - math.radians(50)) / (OPEN - math.radians(50)))
    root = -0.25 + 1.05 * front
    side = math.copysign(0.02, a)
    points = []
    for i in range(61):
        s = i / 60
        p, q = side + (math.sin(a) - side) * s, root + (-math.cos(a) - root) * s
        points.append((cx + rx * p, cy + ry * math.sqrt(max(0.0, 1 - p * p - q * q)), cz + rz * q))
    points += [around(a, 0.005 * i) for i in range(1, 130)]
    lengths = [0.0]
    for p, q in zip(points, points[1:]):
        lengths.append(lengths[-1] + math.dist(p, q))
    result, i = [], 0
    for j in range(LONG + 1):
        want = LENGTH * j / LONG
        while lengths[i + 1] < want:
            i += 1
        s = (want - lengths[i]) / max(lengths[i + 1] - lengths[i], 1e-9)
        result.append(tuple(p + (q - p) * s for p, q in zip(points[i], points[i + 1])))
    return result


def quads(columns, rows, points, uvs):
    triangles = []
    for i in range(columns):
        for j in range(rows):
            a, b = i * (rows + 1) + j, (i + 1) * (rows + 1) + j
            for triangle in ((a, b, a + 1), (b, b + 1, a + 1)):
                sides = [math.dist(points[triangle[k]], points[triangle[k - 1]]) for k in range(3)]
                if min(sides) > 1e-5:
                    triangles.append(triangle)
    return points, uvs, triangles


def hair(rows, inwards):
    """The first `rows` rows of the hair, `inwards` metres below its roots. The colour is the thickness."""
    points, uvs, thick = [], [], []
    for i in range(AROUND + 1):
        a = OPEN * (2 * i / AROUND - 1)
        for j, (x, y, z) in enumerate(path(a)[: rows + 1]):
            out = math.hypot(x, z)
            step = inwards * min(1.0, out / 0.03) / max(out, 1e-6)
            points.append((x - x * step, y - inwards * (1 - min(1.0, out / 0.1)), z - z * step))
            uvs.append((COPIES * i / AROUND, j / LONG))
            thick.append([0.1 + 0.9 * smooth(j / (0.2 * LONG)) ** 0.5] * 3)
    return *quads(AROUND, rows, points, uvs), {"COLOR_0": thick}


def smoothed(rings):
    """Points, triangles and smooth normals of closed rings with the same number of points, from top to
    bottom."""
    points = [p for ring in rings for p in ring]
    count, normals, triangles = len(rings[0]), [[0.0] * 3 for _ in points], []
    for j in range(len(rings) - 1):
        for i in range(count):
            a, b = j * count + i, j * count + (i + 1) % count
            triangles += [(a, a + count, b), (b, a + count, b + count)]
    for triangle in triangles:
        p, q, r = (points[k] for k in triangle)
        u, v = [b - a for a, b in zip(p, q)], [b - a for a, b in zip(p, r)]
        n = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        for k in triangle:
            normals[k] = [x + y for x, y in zip(normals[k], n)]
    unit = lambda n: [x / max(math.hypot(*n), 1e-30) for x in n]
    return points, [(0.0, 0.0)] * len(points), triangles, {"NORMAL": [unit(n) for n in normals]}


def ellipsoid(centre, radii, columns=40, rows=24):
    def point(a, b):
        unit = -math.sin(b) * math.sin(a), math.cos(b), -math.sin(b) * math.cos(a)
        return tuple(c + r * n for c, r, n in zip(centre, radii, unit))

    turn = lambda i, n: 2 * math.pi * i / n
    heights = [math.pi * (j + 0.02) / (rows + 0.04) for j in range(rows + 1)]
    return smoothed([[point(turn(i, columns), b) for i in range(columns)] for b in heights])


def bust(rings, columns=64):
    """A smooth surface through rings. Between them it follows Catmull and Rom's curves."""
    fine = []
    for k in range(len(rings) - 1):
        p0, p1, p2, p3 = (rings[min(max(k + d, 0), len(rings) - 1)] for d in (-1, 0, 1, 2))
        for i in range(4):
            s = i / 4
            t = 1 - s
            weights = -s * t * t, 2 - 5 * s * s + 3 * s**3, s * (1 + 4 * s - 3 * s * s), -s * s * t
            fine.append([sum(w * x for w, x in zip(weights, xs)) / 2 for xs in zip(p0, p1, p2, p3)])
    fine.append(rings[-1])
    turns = [2 * math.pi * i / columns for i in range(columns)]
    return smoothed([[(-w * math.sin(a), y, m - d * math.cos(a)) for a in turns] for y, w, d, m in fine])


def joined(parts):
    points, uvs, triangles, normals = [], [], [], []
    for p, uv, t, more in parts:
        triangles += [tuple(len(points) + k for k in triangle) for triangle in t]
        points, uvs, normals = points + p, uvs + uv, normals + more["NORMAL"]
    return points, uvs, triangles, {"NORMAL": normals}


def main(path):
    body = joined([ellipsoid(*e) for e in HEAD] + [bust(NECK + BODY[:1])])
    looks = [
        ("Hair", {"baseColorFactor": [0.03, 0.018, 0.01, 1.0]}, hair(LONG, 0.0)),
        ("Under", {"baseColorFactor": [0.02, 0.012, 0.007, 1.0]}, hair(LONG * 2 // 3, 0.004)),
        ("Skin", {"baseColorFactor": [0.62, 0.36, 0.25, 1.0]}, body),
        ("Clothes", {"baseColorFactor": [0.055, 0.075, 0.10, 1.0]}, bust(BODY)),
    ]
    matt = {"roughnessFactor": 0.8, "metallicFactor": 0.0}
    glb.write(path, "hair", [(name, look | matt, *part) for name, look, part in looks])


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "hair.glb")
