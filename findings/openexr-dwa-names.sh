#!/usr/bin/env bash
# OpenEXR's DWAA and DWAB: the name of a float channel decides whether its values survive.
#
# Versions: OpenEXR 3.5.3 of pip.
# Expected: DWA loses a little of every channel, or of none that holds 32-bit floats.
# Seen: channels whose last name is R, G, B or Y, in capitals, are stored lossily and as half floats: values above
#   65,504 shrink to about that. Equal values under other names (density, Z, A, r, red, N.X) come back exactly.
#   That holds in any layer: emission.R loses, emission.density does not.
# Why it matters: positions, identifiers or optical depths kept as R, G, B of a layer are damaged, though the file
#   says FLOAT and single-letter depth beside them is exact. Bright suns over 65,504 dim.
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
            told = f"{'off by more than 0.01' if off > 0.01 else off}, 1e6 came as {'65 thousand' if 64e3 < came[0, 0] < 66e3 else came[0, 0]}"
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
