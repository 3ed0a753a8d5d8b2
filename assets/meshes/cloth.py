"""Writes cloth.glb, the mesh of the preset `cloth`: two square pieces of cloth, draped over balls on a table.

Run: python3 cloth.py [FILE]   (needs NumPy 1.20 or later)

Position-based dynamics, which takes minutes: the cloth falls, its edges keep their lengths, and it stays
outside of balls and table.
Texture coordinates are metres, u along the weft and v along the warp.
"""

import sys

import numpy as np

import glb

SIDE, NODES = 1.0, 73  # metres and points along an edge of a piece
BALL = 0.27  # metres
STEPS, ROUNDS, TIME = 700, 20, 1 / 240
GAP = 0.012  # distance of the cloth's middle from what it lies on, metres


def links():
    """Pairs of points that keep their distance, in sets without a point in common: edges, diagonals and,
    softly, every second point."""
    grid = np.arange(NODES * NODES).reshape(NODES, NODES)
    sets = []
    for dj, di, soft in [(0, 1, 1.0), (1, 0, 1.0), (1, 1, 0.35), (1, -1, 0.35), (0, 2, 0.25), (2, 0, 0.25)]:
        a = grid[: NODES - dj, max(0, -di) : NODES - max(0, di)]
        b = grid[dj:, max(0, di) : NODES - max(0, -di)]
        j, i = np.indices(a.shape)
        period = 2 * max(dj, abs(di), 1)
        for k in range(period):
            own = ((j if dj else i) % period) == k
            sets.append((a[own], b[own], soft))
    return sets


def drape(centre, turn):
    """Points of a piece over a ball at `centre`, turned about the upright axis."""
    s = np.linspace(-0.5, 0.5, NODES) * SIDE
    u, v = np.meshgrid(s, s)
    cos, sin = np.cos(turn), np.sin(turn)
    x = np.stack([u * cos - v * sin, np.full_like(u, BALL + 0.05), u * sin + v * cos], -1).reshape(-1, 3)
    x += np.random.default_rng(3).normal(0, 1e-4, x.shape)
    top = np.array([0.0, BALL, 0.0])
    old, sets = x.copy(), links()
    lengths = [np.linalg.norm(x[b] - x[a], axis=1) for a, b, _ in sets]
    for _ in range(STEPS):
        step = (x - old) * 0.985 + np.array([0.0, -9.81, 0.0]) * TIME**2
        old = x.copy()
        x = x + step
        for _ in range(ROUNDS):
            for (a, b, soft), length in zip(sets, lengths):
                d = x[b] - x[a]
                now = np.linalg.norm(d, axis=1)
                move = d * (0.5 * soft * (now - length) / np.maximum(now, 1e-9))[:, None]
                x[a] += move
                x[b] -= move
        away = x - top
        far = np.linalg.norm(away, axis=1)
        inside = far < BALL + GAP
        x[inside] = top + away[inside] * ((BALL + GAP) / far[inside])[:, None]
        old[inside] += (x[inside] - old[inside]) * 0.9  # friction
        low = x[:, 1] < GAP
        x[low, 1] = GAP
        old[low] += (x[low] - old[low]) * 0.9
    return smooth(x) + np.asarray(centre)


def smooth(x):
    """Points without the creases that are as fine as the grid."""
    x = x.reshape(NODES, NODES, 3)
    for _ in range(4):
        for axis in (0, 1):
            low, high = np.roll(x, 1, axis), np.roll(x, -1, axis)
            mean = 0.5 * x + 0.25 * (low + high)
            inner = [slice(None)] * 2
            inner[axis] = slice(1, -1)
            x = x.copy()
            x[tuple(inner)] = mean[tuple(inner)]
    return x.reshape(-1, 3)


def piece(centre, turn):
    points = drape(centre, turn)
    s = np.linspace(0.0, SIDE, NODES)
    uv = np.stack(np.meshgrid(s, s), -1).reshape(-1, 2)
    grid = np.arange(NODES * NODES).reshape(NODES, NODES)
    a, b, c, d = (g.ravel() for g in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    # Seen from above, the outer side is that of the upright normal.
    triangles = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    return points, uv, triangles


def table():
    r = 30.0
    points = np.array([(-r, 0, -r), (-r, 0, r), (r, 0, r), (r, 0, -r)], float)
    return points, np.zeros((4, 2)), np.array([(0, 1, 2), (0, 2, 3)])


def main(path):
    pieces = [
        ("Twill", [0.02, 0.025, 0.04], piece((-0.42, 0, 0), -0.35)),
        ("Satin", [0.05, 0.01, 0.01], piece((0.42, 0, 0.1), -0.5)),
        ("Table", [0.16, 0.12, 0.09], table()),
    ]
    look = lambda color: {"baseColorFactor": color + [1.0], "metallicFactor": 0.0, "roughnessFactor": 0.55}
    glb.write(path, "cloth", [(name, look(color), *part) for name, color, part in pieces])


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "cloth.glb")
