"""Makes the grids that tests/suite/grid/samples.rs reads, with the programs that people use.

    python3 make.py old FOLDER     Debian 12: python3-openvdb and vdb_tool of libopenvdb-tools, OpenVDB 10.0.1
    python  make.py new FOLDER     bpy 5.3.0 (pip install bpy), OpenVDB 13.0.0
    python3 make.py cc FOLDER      compresses what make.cc, a program with OpenVDB 10.0.1, wrote to the folder
    python  make.py warp FOLDER    warp-lang 1.19.0 (pip install warp-lang blosc), NanoVDB 32.3.3

The formulas of the values stand once more in the tests. The files are compressed by gzip, because the tree of
a .vdb begins with ten thousand bytes of zeros.
"""

import gzip
import pathlib
import subprocess
import sys

import numpy as np


def code(x, y, z):
    return (x * 7 + y * 13 + z * 29) % 64


def cells(origin, size):
    for x in range(origin[0], origin[0] + size[0]):
        for y in range(origin[1], origin[1] + size[1]):
            for z in range(origin[2], origin[2] + size[2]):
                yield x, y, z


def fill(grid, origin, size, of=lambda h: h / 64, off=None):
    """Active where the code is no multiple of 3. off: value of the others, if not the background."""
    accessor = grid.getAccessor()
    for x, y, z in cells(origin, size):
        h = code(x, y, z)
        if h % 3:
            accessor.setValueOn((x, y, z), of(h))
        elif off is not None:
            accessor.setValueOff((x, y, z), off(h))
    return grid


def vector(h):
    return h / 64, -h / 32, h / 16 - 1


def grids(vdb):
    """Names of files and the grids in them."""

    def density(off=None, background=0.0):
        grid = fill(vdb.FloatGrid(background), (1, 2, 3), (9, 8, 7), off=off)
        grid.name, grid.gridClass = "density", vdb.GridClass.FOG_VOLUME
        grid.transform = vdb.createLinearTransform(voxelSize=0.25)
        return grid

    yield "float", [density()]
    # What is not active has the background's negative, one value, both, two values, many.
    for name, off in [
        ("minus", lambda h: -0.5),
        ("one", lambda h: 3.0),
        ("plus_minus", lambda h: -0.5 if h % 2 else 0.5),
        ("one_and_plus", lambda h: 3.0 if h % 2 else 0.5),
        ("two", lambda h: 3.0 if h % 2 else 4.0),
        ("many", lambda h: float(h)),
    ]:
        yield f"off_{name}", [density(off, 0.5)]
    half = density(lambda h: 3.0 if h % 2 else 4.0, 0.5)
    half.saveFloatAsHalf = True
    velocity = fill(vdb.Vec3SGrid((0.0, 0.0, 0.0)), (-9, -8, -7), (9, 8, 7), vector)
    velocity.name, velocity.gridClass = "velocity", vdb.GridClass.STAGGERED
    half_velocity = velocity.deepCopy()
    half_velocity.name, half_velocity.saveFloatAsHalf = "half_velocity", True
    yield "half", [half]
    yield "vector", [velocity, half_velocity]

    one = vdb.FloatGrid(0.0)
    one.name = "one"
    one.getAccessor().setValueOn((-1, -2, -3), 0.75)
    one.transform = vdb.createLinearTransform(
        [[0.0, 2.0, 0.0, 0.0], [-2.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0], [10.0, 20.0, 30.0, 1.0]]
    )
    empty = vdb.FloatGrid(-1.0)
    empty.name = "empty"
    again = one.deepCopy()
    again.getAccessor().setValueOn((-1, -2, -3), 0.5)
    flags = vdb.BoolGrid(False)
    flags.name = "flags"
    flags.getAccessor().setValueOn((1, 2, 3), True)
    yield "several", [flags, one, empty, again]

    tiles = vdb.FloatGrid(0.0)
    tiles.name = "tiles"
    tiles.fill((0, 0, 0), (4095, 4095, 4095), 1.0, True)
    tiles.fill((4096, 0, 0), (4096 + 127, 127, 127), 2.0, True)
    tiles.fill((4096 + 128, 0, 0), (4096 + 135, 7, 7), 3.0, True)
    tiles.fill((4096 + 256, 0, 0), (4096 + 256, 1, 2), 4.0, True)
    yield "tiles", [tiles]

    sphere = vdb.createLevelSetSphere(radius=4.0, center=(10.0, 10.0, 10.0), voxelSize=1.0)
    sphere.name = "surface"
    sphere.transform = vdb.createLinearTransform(
        [[0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 0.5, 0.0], [1.5, 0.0, -2.0, 1.0]]
    )
    yield "sphere", [sphere]

    for name, kind in [("double", "DoubleGrid"), ("int32", "Int32Grid"), ("int64", "Int64Grid")]:
        if hasattr(vdb, kind):
            grid = fill(getattr(vdb, kind)(), (1, 2, 3), (9, 8, 7), of=lambda h: h)
            grid.name = name
            yield name, [grid]
    if hasattr(vdb, "Vec3DGrid"):
        grid = fill(vdb.Vec3DGrid((0.0, 0.0, 0.0)), (1, 2, 3), (9, 8, 7), vector)
        grid.name = "vector"
        yield "vec3d", [grid]


def values(vdb, file, name):
    """Active values as rows of index and value: what the program itself reads from a file."""
    grid = vdb.read(str(file), name)
    rows = []
    for item in grid.citerOnValues():
        value = item.value if isinstance(item.value, (tuple, list)) else [item.value]
        rows.append([*item.min, *item.max, *value])
    return np.array(sorted(rows), dtype=np.float64)


def tool(*words):
    subprocess.run(["vdb_tool", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def main():
    kind, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(exist_ok=True)
    if kind == "cc":
        pass
    elif kind == "warp":
        import warp as wp

        dense = np.zeros((9, 8, 7), np.float32)
        for x, y, z in cells((0, 0, 0), dense.shape):
            dense[x, y, z] = code(x, y, z) / 64
        volume = wp.Volume.load_from_numpy(dense, min_world=(1, 2, 3), voxel_size=0.5, bg_value=0.25, device="cpu")
        for codec in ["none", "zip", "blosc"]:
            volume.save_to_nvdb(str(folder / f"warp_{codec}.nvdb"), codec)
    else:
        if kind == "new":
            import bpy

            bpy.utils.expose_bundled_modules()
            import openvdb as vdb
        else:
            import pyopenvdb as vdb
        for name, list_of_grids in grids(vdb):
            vdb.write(str(folder / f"{kind}_{name}.vdb"), list_of_grids)
        if kind == "old":
            for codec in ["none", "zip", "active", "blosc"]:
                for bits in [32, 16]:
                    out = folder / f"tool_{codec}_{bits}.vdb"
                    tool("-read", folder / "old_off_two.vdb", "-write", f"codec={codec}", f"bits={bits}", out)
            for codec in ["zip", "blosc"]:
                tool("-read", folder / "old_off_two.vdb", "-write", f"codec={codec}", folder / f"tool_{codec}.nvdb")
            for name in ["off_two", "vector", "tiles", "sphere"]:
                file = folder / f"old_{name}.vdb"
                for bits in [32, 16, 8, 4, "N"] if name == "sphere" else [32]:
                    tool("-read", file, "-write", f"bits={bits}", folder / f"tool_{name}_{bits}.nvdb")
    for file in folder.glob("*vdb" if kind != "cc" else "cc_*.vdb"):
        (folder / f"{file.name}.gz").write_bytes(gzip.compress(file.read_bytes(), 9, mtime=0))


main()
