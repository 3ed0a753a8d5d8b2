#!/usr/bin/env bash
# ffmpeg squares every value of a 32-bit EXR file with DWAA or DWAB compression, without a warning.
#
# Versions: ffmpeg 5.1.9 (Debian 12), OpenEXR 3.5.3 of pip.
# Expected: the linear values that OpenEXR's own reader gives, as with other compression.
# Seen: float channels come squared (0.5 as 0.25, 4 as 16), with exit code 0 and nothing on stderr. The same
#   picture in half floats is decoded correctly, and so are ZIP and PIZ in either.
# Why it matters: a movie made from a renderer's 32-bit DWA frames has crushed shadows and blown highlights.
#   It looks like a wrong view transform, and half-float frames beside it are right.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
needs ffmpeg
debian ffmpeg 5.1.9
pip_install python3 openexr==3.5.3 numpy==2.4.6
cat >"$work/decode.py" <<'PY'
import subprocess
import sys
import numpy as np
import OpenEXR

path, n = sys.argv[1], 64
y, x = np.mgrid[0:n, 0:n].astype(np.float32) / (n - 1) * 4
picture = {"R": x, "G": y, "B": (x + y) / 2}
for kind in "DWAA DWAB ZIP PIZ".split():
    for dtype in np.float32, np.float16:
        header = {"compression": getattr(OpenEXR, f"{kind}_COMPRESSION"), "type": OpenEXR.scanlineimage}
        channels = {name: np.ascontiguousarray(v.astype(dtype)) for name, v in picture.items()}
        OpenEXR.File(header, channels).write(path)
        read = OpenEXR.File(path, separate_channels=True).channels()
        command = f"ffmpeg -v warning -nostdin -i {path} -f rawvideo -pix_fmt gbrpf32le -"
        ran = subprocess.run(command.split(), capture_output=True)
        planes = np.frombuffer(ran.stdout, np.float32).reshape(3, n, n)
        read = [read[name].pixels.astype(np.float32) for name in "GBR"]
        # DWA itself is off by a few thousandths.
        near = lambda truth: np.allclose(planes, truth, rtol=0.01, atol=0.01)
        told = "linear" if near(read) else "squared" if near(np.square(read)) else "neither"
        said = "something" if ran.stderr else "nothing"
        print(f"{kind} {dtype.__name__} = {told}, exit code {ran.returncode}, {said} on stderr")
PY
observe "$python" "$work/decode.py" "$work/a.exr"
for kind in DWAA DWAB ZIP PIZ; do
    curve=linear
    [[ $kind == DWA? ]] && curve=squared
    expect "$kind float" "$(seen "$kind float32")" "$curve, exit code 0, nothing on stderr"
    expect "$kind half" "$(seen "$kind float16")" "linear, exit code 0, nothing on stderr"
done
verdict
