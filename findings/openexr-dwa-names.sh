#!/usr/bin/env bash
# OpenEXR's DWAA and DWAB: the name of a float channel decides whether its values survive.
#
# Versions: OpenEXR 3.5.3 of pip.
# Expected: DWA loses a little of every channel, or nothing of channels that hold 32-bit floats.
# Seen: channels named R, G, B or Y (capitals, in any layer: emission.R) lose, and pass through half floats:
#   1e6 comes back as some 65 thousand. The same values under other names (density, Z, A, r, red, N.X,
#   emission.density) come back exactly.
# Why it matters: positions, identifiers or optical depths kept in R, G, B are damaged although the file
#   says FLOAT, and bright suns are cut.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
pip_install python3 openexr==3.5.3 numpy==2.4.6
cat >"$work/names.py" <<'PY'
import sys
import numpy as np
import OpenEXR

truth = np.random.default_rng(2).uniform(0, 3, (64, 64)).astype(np.float32)
truth[0, 0] = 1e6
NAMES = "R Y B r red A Z density N.X emission.R emission.density".split()
for kind in "DWAA", "DWAB":
    for name in NAMES:
        header = {"compression": getattr(OpenEXR, f"{kind}_COMPRESSION"), "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {name: truth.copy()}).write(sys.argv[1])
        came = OpenEXR.File(sys.argv[1], separate_channels=True).channels()[name].pixels
        assert came.dtype == np.float32
        off = np.abs(came - truth).ravel()[1:].max()
        if np.array_equal(came, truth):
            told = "exact"
        else:
            large = "65 thousand" if 64e3 < came[0, 0] < 66e3 else came[0, 0]
            told = f"off by {'more than 0.01' if off > 0.01 else off}, 1e6 came as {large}"
        print(f"{kind} {name} = {told}")
PY
observe "$python" "$work/names.py" "$work/a.exr"
for kind in DWAA DWAB; do
    for name in R Y B emission.R; do
        expect "$kind of $name" "$(seen "$kind $name")" "off by more than 0.01, 1e6 came as 65 thousand"
    done
    for name in r red A Z density N.X emission.density; do
        expect "$kind of $name" "$(seen "$kind $name")" exact
    done
done
verdict
