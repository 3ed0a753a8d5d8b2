"""Writes hand.glb, the mesh of the preset `skin`: an open hand, its palm towards +z, fingers up.

Run: python3 hand.py [FILE]   (needs NumPy)

The hand is a smooth union of round cones, drawn into a mesh by naive surface nets (Gibson 1998). Lengths are
millimetres until the end.
"""

import sys

import glb
import numpy as np

CELL = 1.4  # edge of the grid's cells
LOW, HIGH = np.array([-95.0, -115.0, -34.0]), np.array([60.0, 208.0, 52.0])


def cone(p, a, b, ra, rb, squeeze=1.0):
    """Distance to a cone between two spheres; the thickness along z is squeezed by a factor."""
    a, b = np.array(a, float), np.array(b, float)
    scale = np.array([1.0, 1.0, 1.0 / squeeze])
    q, axis = (p - a) * scale, (b - a) * scale
    t = np.clip(q @ axis / (axis @ axis), 0.0, 1.0)
    return (np.linalg.norm(q - t[..., None] * axis, axis=-1) - (ra + (rb - ra) * t)) * min(1.0, squeeze)


def ball(p, centre, radii):
    q = (p - np.array(centre)) / np.array(radii)
    far = np.linalg.norm(q, axis=-1)
    return (far - 1.0) * min(radii)


def union(a, b, k):
    """Smooth union: the two bodies flow together over a width k."""
    h = np.clip(0.5 + 0.5 * (b - a) / k, 0.0, 1.0)
    return b + (a - b) * h - k * h * (1.0 - h)


def finger(p, root, spread, lengths, radii, curl):
    """Distance to a finger, with its creases. Angles in degrees; curl bends towards the palm."""
    at, bend, d, crease = np.array(root, float), 0.0, None, 0.0
    side = np.radians(spread)
    for i, (length, bent) in enumerate(zip(lengths, curl)):
        bend += np.radians(bent)
        along = np.array([np.sin(side) * np.cos(bend), np.cos(side) * np.cos(bend), np.sin(bend)])
        end = at + along * length
        part = cone(p, at, end, radii[i], radii[i + 1])
        # Flesh between the joints, towards the palm.
        r = 0.5 * (radii[i] + radii[i + 1])
        flesh = at + along * (length * (0.55 if i + 1 < len(lengths) else 0.62)) + (0.0, 0.0, 0.24 * r)
        part = union(part, ball(p, flesh, (0.93 * r, 0.46 * length, 0.92 * r)), 2.0)
        d = part if d is None else union(d, part, 3.0)
        # Creases lie on the inner side of the joints, the middle one twice.
        for shift in ((0.0,), (-1.4, 1.6), (0.0,))[i] if i > 0 else ((12.0,)):
            q = p - (at + along * shift)
            inner = 1.0 / (1.0 + np.exp(-(q[..., 2] - 1.0) / 1.5))
            near = np.exp(-(np.linalg.norm(q, axis=-1) / (2.0 * radii[i])) ** 4)
            crease = crease + 0.8 * np.exp(-(((q @ along) / 1.3) ** 2)) * inner * near
        at = end
    return d + crease


def curve(p, a, b, c):
    """Distance in x and y from a bent line."""
    t = np.linspace(0.0, 1.0, 40)[:, None]
    line = (1 - t) ** 2 * np.array(a) + 2 * t * (1 - t) * np.array(b) + t**2 * np.array(c)
    best = np.full(p.shape[:-1], np.inf)
    for x, y in line:
        best = np.minimum(best, np.hypot(p[..., 0] - x, p[..., 1] - y))
    return best


def hand(p):
    knuckles = [(-29.0, 90.0, 1.0), (-9.0, 95.0, 0.0), (11.0, 91.0, 0.0), (29.0, 81.0, 2.0)]
    fingers = [
        (-9.0, (46, 26, 19), (11.2, 10.0, 9.0, 7.6), (5, 7, 6)),
        (-1.0, (50, 30, 20), (11.4, 10.2, 9.2, 7.7), (6, 8, 6)),
        (7.0, (46, 28, 20), (10.9, 9.7, 8.8, 7.5), (8, 9, 7)),
        (18.0, (36, 21, 17), (9.6, 8.5, 7.8, 6.7), (10, 10, 8)),
    ]
    all_fingers = None
    for root, (spread, lengths, radii, curl) in zip(knuckles, fingers):
        one = finger(p, root, spread, lengths, radii, curl)
        all_fingers = one if all_fingers is None else union(all_fingers, one, 2.2)
    palm = None
    for (x, y, z), r in zip(knuckles, (12.0, 12.5, 12.0, 11.0)):
        bone = cone(p, (x * 0.55, 4.0, 0.0), (x * 0.97, y - 8.0, z), 14.5, r, 0.95)
        palm = bone if palm is None else union(palm, bone, 9.0)
    palm = union(palm, ball(p, (23.0, 34.0, 6.0), (15.0, 34.0, 13.5)), 9.0)
    for x, y in ((-21.0, 79.0), (1.0, 84.0), (21.0, 77.0)):
        palm = union(palm, ball(p, (x, y, 7.0), (11.0, 11.0, 8.0)), 7.0)
    thumb = finger(p, (-47.0, 44.0, 12.0), -24.0, (33, 26), (12.0, 10.6, 8.2), (14, 6))
    root = cone(p, (-24, 16, 4), (-47, 44, 12), 14, 12)
    mound = union(ball(p, (-28.0, 34.0, 8.5), (17.0, 31.0, 15.0)), root, 8.0)
    web = cone(p, (-28.0, 66.0, 2.0), (-46.0, 52.0, 9.0), 7.0, 7.5)
    palm = union(union(palm, mound, 8.0), web, 8.0)
    palm = union(palm, thumb, 6.0)
    lines = [
        ((32.0, 66.0), (4.0, 66.0), (-16.0, 87.0)),
        ((-37.0, 63.0), (-10.0, 62.0), (22.0, 40.0)),
        ((-37.0, 61.0), (-3.0, 50.0), (-8.0, 6.0)),
    ]
    front = 1.0 / (1.0 + np.exp(-(p[..., 2] - 4.0) / 1.5))
    for line in lines:
        palm = palm + 1.1 * np.exp(-((curve(p, *line) / 1.5) ** 2)) * front
    arm = cone(p, (0.0, 12.0, 0.0), (3.0, -130.0, 0.0), 25.0, 29.0, 0.74)
    wrist = sum(np.exp(-(((p[..., 1] - y - 0.004 * p[..., 0] ** 2) / 1.3) ** 2)) for y in (-4.0, -10.0))
    arm = arm + 0.7 * wrist * front
    return union(union(palm, all_fingers, 6.0), arm, 12.0)


def surface_net(values):
    """Points, in cells, and quads of the surface where values change their sign."""
    inside = values < 0.0
    low = [slice(None, -1)] * 3
    total = np.zeros([n - 1 for n in values.shape] + [3])
    count = np.zeros([n - 1 for n in values.shape])
    for axis in range(3):
        for corner in range(4):
            start = [0, 0, 0]
            start[(axis + 1) % 3], start[(axis + 2) % 3] = corner & 1, corner >> 1
            end = list(start)
            end[axis] = 1
            pick = lambda s: tuple(slice(o, o + n - 1) for o, n in zip(s, values.shape))
            a, b = values[pick(start)], values[pick(end)]
            crosses = (a < 0.0) != (b < 0.0)
            t = np.where(crosses, a / np.where(crosses, a - b, 1.0), 0.0)
            place = np.zeros(total.shape)
            for k in range(3):
                place[..., k] = start[k] + (t if k == axis else 0.0)
            total += np.where(crosses[..., None], place, 0.0)
            count += crosses
    used = count > 0
    number = np.full(count.shape, -1)
    number[used] = np.arange(used.sum())
    points = np.argwhere(used) + total[used] / count[used][:, None]
    quads = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        ahead = np.roll(inside, -1, axis)
        for where in np.argwhere(inside != ahead):
            if where[axis] == inside.shape[axis] - 1 or where[b] == 0 or where[c] == 0:
                continue
            if where[b] >= count.shape[b] or where[c] >= count.shape[c]:
                continue
            corners = []
            for db, dc in ((1, 1), (0, 1), (0, 0), (1, 0)):
                cell = where.copy()
                cell[b] -= db
                cell[c] -= dc
                corners.append(number[tuple(cell)])
            quads.append(corners if inside[tuple(where)] else corners[::-1])
    return points, np.array(quads)


def smoothed(points, quads, rounds=2):
    """Moves points towards the middles of their neighbours, and back out (Taubin 1995)."""
    ends = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    ends = np.concatenate([ends, ends[:, ::-1]])
    degree = np.bincount(ends[:, 0], minlength=len(points))[:, None]
    for step in (0.5, -0.53) * rounds:
        mean = np.zeros(points.shape)
        for k in range(3):
            mean[:, k] = np.bincount(ends[:, 0], points[ends[:, 1], k], len(points))
        points = points + step * (mean / degree - points)
    return points


def main(path):
    axes = [np.arange(low, high, CELL) for low, high in zip(LOW, HIGH)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = hand(grid)
    # Closes the arm below the picture.
    values = np.maximum(values, LOW[1] + 3.0 * CELL - grid[..., 1])
    points, quads = surface_net(values)
    points = smoothed(points, quads)
    points = LOW + points * CELL
    triangles = [t for a, b, c, d in quads.tolist() for t in ((a, b, c), (a, c, d))]
    look = {"baseColorFactor": [0.6, 0.4, 0.32, 1.0], "roughnessFactor": 0.5, "metallicFactor": 0.0}
    rows = [tuple(row) for row in (points / 1000.0).tolist()]
    glb.write(path, "hand", [("Skin", look, rows, [(x * 1.0, y * 1.0) for x, y, _ in rows], triangles)])
    print(len(rows), "points,", len(triangles), "triangles")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "hand.glb")
