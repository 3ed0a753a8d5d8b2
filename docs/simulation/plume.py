"""Makes a plume of smoke: density and velocity on a grid, as .npz and, with OpenVDB's module, as .vdb.

    python plume.py FILE [HEIGHT]

The smoke rises along y. Its shape is a widening column whose places are moved by curl noise, as an eddying
flow would have carried them.
"""

import sys

import numpy as np

out = sys.argv[1]
ny = int(sys.argv[2]) if len(sys.argv) > 2 else 192
nx = nz = ny // 2
rng = np.random.default_rng(7)
voxel = 2.0 / ny  # the plume is 2 m high


def noise(wavelength):
    """A periodic potential of vectors with waves about this long, in voxels."""
    k = np.meshgrid(*[np.fft.fftfreq(n) for n in (nz, ny, nx)], indexing="ij")
    k2 = sum(c * c for c in k)
    k0 = 1 / wavelength
    weight = np.exp(-((np.sqrt(k2) - k0) ** 2) / (0.5 * k0) ** 2)
    return [np.fft.ifftn(np.fft.fftn(rng.standard_normal((nz, ny, nx))) * weight).real for _ in range(3)]


def curl(p):
    """Curl of a potential (x, y, z), on arrays [z, y, x]."""
    d = lambda f, axis: (np.roll(f, -1, 2 - axis) - np.roll(f, 1, 2 - axis)) / 2
    v = [d(p[2], 1) - d(p[1], 2), d(p[0], 2) - d(p[2], 0), d(p[1], 0) - d(p[0], 1)]
    rms = np.sqrt(np.mean(sum(c * c for c in v)))
    return [c / rms for c in v]


def sample(f, z, y, x):
    """Trilinear lookup; periodic."""
    i = [np.floor(c).astype(int) for c in (z, y, x)]
    t = [c - j for c, j in zip((z, y, x), i)]
    total = 0
    for corner in range(8):
        o = [corner >> a & 1 for a in range(3)]
        w = 1
        for a in range(3):
            w = w * (t[a] if o[a] else 1 - t[a])
        at = [(i[a] + o[a]) % n for a, n in enumerate((nz, ny, nx))]
        total = total + w * f[tuple(at)]
    return total


octaves = [(nx / 2.2, 1.0), (nx / 5, 0.55), (nx / 11, 0.3), (nx / 22, 0.16)]
flows = [[a * c for c in curl(noise(w))] for w, a in octaves]
flow = [sum(f[c] for f in flows) for c in range(3)]

z, y, x = np.meshgrid(np.arange(nz) + 0.5, np.arange(ny) + 0.5, np.arange(nx) + 0.5, indexing="ij")
# Places are followed backwards through the eddies, farther the higher they are.
reach = (y / ny) ** 0.8 * nx * 0.20
at = [x.copy(), y.copy(), z.copy()]
steps = 8
for _ in range(steps):
    v = [sample(f, at[2] - 0.5, at[1] - 0.5, at[0] - 0.5) for f in flow]
    for c in range(3):
        at[c] = at[c] - v[c] * reach / steps
high = np.clip(at[1] / ny, 0, 1)
radius = nx * (0.07 + 0.21 * high)
away = np.hypot(at[0] - nx / 2, at[2] - nz / 2) / radius
density = np.clip(1.25 - away, 0, 1) ** 0.8 * (1 - 0.55 * high)
fade = np.clip((ny - 2 - y) / (0.12 * ny), 0, 1) * np.clip(y / 3, 0, 1)
density = (density * fade).astype(np.float32)
density[density < 0.01] = 0
rise = 1.2 * np.exp(-(away**2)) + 0.2
velocity = np.stack([0.5 * flow[0], rise + 0.5 * flow[1], 0.5 * flow[2]], -1).astype(np.float32)
print(f"{nx}×{ny}×{nz} voxels, {np.mean(density > 0):.1%} with smoke")

if out.endswith(".vdb"):
    import pyopenvdb as openvdb

    # OpenVDB's arrays have x first.
    arrays = [np.ascontiguousarray(a.swapaxes(0, 2)) for a in (density, velocity)]
    smoke, flow = openvdb.FloatGrid(), openvdb.Vec3SGrid()
    smoke.copyFromArray(arrays[0])
    flow.copyFromArray(arrays[1] * (arrays[0] > 0)[..., None])
    for grid, name in ((smoke, "density"), (flow, "velocity")):
        grid.name = name
        grid.transform = openvdb.createLinearTransform(voxelSize=voxel)
    openvdb.write(out, grids=[smoke, flow])
else:
    np.savez(out, density=density, velocity=velocity, origin=np.zeros(3), voxel=voxel)
