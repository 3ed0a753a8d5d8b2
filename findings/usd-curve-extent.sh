#!/usr/bin/env bash
# USD computes the extent of Catmull-Rom hair from its control points, and the curve leaves that box.
#
# Versions: usd-core 26.11.
# Expected: the extent that ComputeExtentFromPlugins gives for BasisCurves, and that BBoxCache uses, holds
#   the curve.
# Seen: it is the box of the control points, whatever the basis. Bézier and B-spline curves stay inside. A
#   Catmull-Rom curve through four corners of a unit square swings out by 0.125.
# Why it matters: Blender writes hair as Catmull-Rom. A renderer that culls or builds its tree by this
#   extent cuts off the outermost bends.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
pip_install python3 usd-core==26.11 numpy==2.4.6
cat >"$work/extent.py" <<'PY'
import numpy as np
from pxr import Usd, UsdGeom

# Weights of four control points by powers of t, for the segment between the second and the third.
BASIS = {
    "catmullRom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]]) / 2,
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6,
    "bezier": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]]),
}
points = np.array([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], float)
t = np.linspace(0, 1, 1001)
for basis, weights in BASIS.items():
    stage = Usd.Stage.CreateInMemory()
    hair = UsdGeom.BasisCurves.Define(stage, "/hair")
    hair.CreateTypeAttr("cubic")
    hair.CreateBasisAttr(basis)
    hair.CreateWrapAttr("nonperiodic")
    hair.CreateCurveVertexCountsAttr([4])
    hair.CreatePointsAttr([tuple(map(float, p)) for p in points])
    hair.CreateWidthsAttr([0.0] * 4)
    low, high = UsdGeom.Boundable.ComputeExtentFromPlugins(hair, Usd.TimeCode.Default())
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    bound = cache.ComputeWorldBound(stage.GetPrimAtPath("/hair")).GetRange()
    curve = np.stack([t**3, t**2, t, t**0], 1) @ weights @ points
    reach = curve[:, 1].max()
    print(f"{basis} = extent to {high[1]:g}, bound to {bound.GetMax()[1]:g}, curve to {reach:.3f}")
PY
observe "$python" "$work/extent.py"
expect "catmullRom, y" "$(seen catmullRom)" "extent to 1, bound to 1, curve to 1.125"
expect "bspline, y" "$(seen bspline)" "extent to 1, bound to 1, curve to 0.958"
expect "bezier, y" "$(seen bezier)" "extent to 1, bound to 1, curve to 0.750"
verdict
