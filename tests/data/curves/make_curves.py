"""Writes curves of every kind with Pixar's library, usd-core 26.11 of pip, and where points of all curves
beside this file lie, as this library and numpy see it.

    pip install usd-core==26.11 numpy==2.4.6 scipy==1.17.1
    python make_curves.py
"""

import json
import os

import numpy as np
from pxr import Gf, Usd, UsdGeom
from scipy.interpolate import BSpline

FOLDER = os.path.dirname(os.path.abspath(__file__))

# Weights of four control points by powers of t.
BASIS = {
    "catmullRom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]]) / 2,
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6,
    "bezier": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]]),
}
WIDTHS = {"bezier": "varying", "catmullRom": "vertex", "bspline": "uniform", "linear": "constant"}


def linear(stage, path, points, widths=(0.5, 0.2)):
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr("linear")
    curves.CreateCurveVertexCountsAttr([len(points)])
    curves.CreatePointsAttr(points)
    curves.CreateWidthsAttr(list(widths))
    return curves


def scattered(count):
    return [((i * 37 % 11) / 4, (i * 53 % 13) / 5, i * 0.3) for i in range(count)]


def write(path):
    if os.path.exists(path):
        os.remove(path)
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Y")
    top = UsdGeom.Xform.Define(stage, "/top")
    top.AddTranslateOp().Set((1, 2, 3))
    top.AddTranslateOp(opSuffix="pivot").Set((0.5, 0, 0))
    top.AddRotateZYXOp().Set((10, 20, 30))
    top.AddScaleOp().Set((2, 3, 1))
    top.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
    for basis, interpolation in WIDTHS.items():
        for wrap in ("nonperiodic", "periodic", "pinned"):
            if (basis, wrap) == ("bezier", "pinned"):
                continue
            curves = UsdGeom.BasisCurves.Define(stage, f"/top/{basis}_{wrap}")
            curves.CreateTypeAttr("linear" if basis == "linear" else "cubic")
            if basis != "linear":
                curves.CreateBasisAttr(basis)
            curves.CreateWrapAttr(wrap)
            counts = [6, 9] if (basis, wrap) == ("bezier", "periodic") else [7, 4]
            curves.CreateCurveVertexCountsAttr(counts)
            curves.CreatePointsAttr(scattered(sum(counts)))
            varying = 3 + 2 if wrap != "periodic" else 2 + 3
            size = {"varying": varying, "vertex": sum(counts), "uniform": 2, "constant": 1}[interpolation]
            curves.CreateWidthsAttr([0.01 + 0.001 * i for i in range(size)])
            curves.SetWidthsInterpolation(interpolation)
    nurbs = UsdGeom.NurbsCurves.Define(stage, "/top/nurbs")
    nurbs.CreateCurveVertexCountsAttr([5, 4])
    nurbs.CreateOrderAttr([4, 3])
    nurbs.CreateKnotsAttr([0, 0, 0, 0, 1, 2, 2, 2, 2, 0, 0, 0, 1, 2, 2, 2])
    nurbs.CreatePointsAttr(scattered(9))
    nurbs.CreateWidthsAttr([0.02] * 9)
    nurbs.SetWidthsInterpolation("vertex")

    # Turns of every kind, and what changes with time.
    turned = UsdGeom.Xform.Define(stage, "/turned")
    turned.AddOrientOp().Set(Gf.Quatf(0.9, 0.1, 0.3, 0.2).GetNormalized())
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 1, 0), 40))
    turned.AddTransformOp().Set(turn * Gf.Matrix4d().SetTranslate((5, 6, 7)))
    turned.GetPrim().GetReferences().AddReference("other.usda")
    moving = linear(stage, "/turned/moving", [(0, 0, 0)] * 3, [0.5])
    moving.SetWidthsInterpolation("constant")
    for time in (3, 5, 8):
        moving.GetPointsAttr().Set([(time, 0, 0), (time, 1, 0), (time, 2, time)], time)
    for name in ("rotateX", "rotateY"):
        under = UsdGeom.Xform.Define(stage, f"/turned/{name}")
        getattr(under, f"Add{name[0].upper()}{name[1:]}Op")().Set(33.0, 4.0)
        linear(stage, f"/turned/{name}/straight", [(1, 2, 3), (2, 2, 2)])
    reset = linear(stage, "/turned/rotateX/reset", [(1, 2, 3), (2, 2, 2)])
    reset.AddTranslateOp().Set((9, 9, 9))
    reset.SetResetXformStack(True)

    # What is not shown.
    for name in ("hidden", "guide", "off"):
        curves = linear(stage, f"/{name}", [(100, 2, 3), (2, 2, 2)])
        if name == "hidden":
            curves.CreateVisibilityAttr("invisible")
        elif name == "guide":
            curves.CreatePurposeAttr("guide")
        else:
            curves.GetPrim().SetActive(False)
    stage.Save()


def on_curve(shape, points, widths, number):
    """Points and widths at the ends and in the middle of the segments of a curve."""
    kind, basis, wrap, interpolation = shape
    if kind == "linear":
        ends = list(range(len(points))) + ([0] if wrap == "periodic" else [])
        own = {"constant": [widths[0]] * len(points), "vertex": widths}[interpolation]
        return [[*points[i], own[i]] for i in ends]
    step = 3 if basis == "bezier" else 1
    own = widths if interpolation == "vertex" else np.zeros(len(points))
    four = np.c_[points, own]
    if wrap == "pinned":
        four = np.r_[[2 * four[0] - four[1]], four, [2 * four[-1] - four[-2]]]
    segments = len(points) // step if wrap == "periodic" else (len(four) - 4) // step + 1
    rows = []
    for segment in range(segments):
        own = four[[(segment * step + i) % len(four) for i in range(4)]]
        for t in (0, 0.5, 1):
            row = np.array([t**3, t**2, t, 1]) @ BASIS[basis] @ own
            if interpolation == "uniform":
                row[3] = widths[number]
            elif interpolation == "varying":
                row[3] = (1 - t) * widths[segment] + t * widths[(segment + 1) % len(widths)]
            rows.append(row.tolist())
    return rows


def truth(path, time):
    stage = Usd.Stage.Open(path)
    time = Usd.TimeCode(time)
    strands = []
    for prim in sorted(stage.Traverse(), key=lambda prim: str(prim.GetPath())):
        shown = UsdGeom.Imageable(prim)
        if not prim.IsA(UsdGeom.Curves) or shown.ComputePurpose() == "guide":
            continue
        if shown.ComputeVisibility(time) == "invisible":
            continue
        curves = UsdGeom.Curves(prim)
        to_stage = np.array(curves.ComputeLocalToWorldTransform(time))
        points = np.array(curves.GetPointsAttr().Get(time))
        points = (np.c_[points, np.ones(len(points))] @ to_stage)[:, :3]
        interpolation = curves.GetWidthsInterpolation()
        scale = abs(np.linalg.det(to_stage[:3, :3])) ** (1 / 3)
        widths = np.array(curves.GetWidthsAttr().Get(time)) * scale
        first = first_knot = first_varying = 0
        for number, count in enumerate(curves.GetCurveVertexCountsAttr().Get(time)):
            own = points[first : first + count]
            if prim.IsA(UsdGeom.NurbsCurves):
                nurbs = UsdGeom.NurbsCurves(prim)
                order = nurbs.GetOrderAttr().Get()[number]
                knots = np.array(nurbs.GetKnotsAttr().Get())[first_knot : first_knot + count + order]
                first_knot += count + order
                times = np.linspace(knots[order - 1], knots[count], 5)
                rows = [[*row, widths[first]] for row in BSpline(knots, own, order - 1)(times)]
            else:
                basis = UsdGeom.BasisCurves(prim)
                shape = (basis.GetTypeAttr().Get(), basis.GetBasisAttr().Get(), basis.GetWrapAttr().Get())
                all_widths = widths
                if interpolation == "vertex":
                    all_widths = widths[first : first + count]
                elif interpolation == "varying":
                    ends = count // 3 if shape[2] == "periodic" else (count - 1) // 3 + 1
                    all_widths = widths[first_varying : first_varying + ends]
                    first_varying += ends
                rows = on_curve((*shape, interpolation), own, all_widths, number)
            first += count
            strands.append([[round(float(x), 6) for x in row] for row in rows])
    return strands


for ending in ("usda", "usdc"):
    write(os.path.join(FOLDER, f"pixar.{ending}"))
known = {
    f"{name} {time}": truth(os.path.join(FOLDER, name), time)
    for name, time in (("blender.usdc", 0), ("pixar.usdc", 0), ("pixar.usdc", 8))
}
with open(os.path.join(FOLDER, "points.json"), "w") as file:
    json.dump(known, file, separators=(",", ":"))
    file.write("\n")
