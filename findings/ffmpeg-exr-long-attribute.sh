#!/usr/bin/env bash
# ffmpeg loses rows, or the whole picture, of an EXR file with an attribute longer than 255 bytes.
#
# Versions: ffmpeg 5.1.9 (Debian 12), OpenEXR 3.5.3 of pip.
# Expected: an attribute that ffmpeg does not know is skipped, whatever its length.
# Seen: up to 255 bytes it is. From 256 bytes on, an attribute whose name sorts before the required ones
#   makes the file unreadable ("Missing compression attribute"). With one that sorts after them half of the
#   rows come out wrong, with exit code 0 and nothing on stderr.
# Why it matters: renderers keep the scene, the command line or a Cryptomatte manifest in such attributes.
#   The frames are intact; the movie made of them is not.
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

path, n = sys.argv[1], 32
y, x = np.mgrid[0:n, 0:n].astype(np.float32) / (n - 1)
picture = {"R": 0.25 + x, "G": 0.25 + y, "B": 0.25 + x + y}
for name in "about", "zscene":
    for length in 255, 256, 300:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, name: "x" * length}
        OpenEXR.File(header, dict(picture)).write(path)
        read = OpenEXR.File(path, separate_channels=True).channels()
        assert all(np.array_equal(read[c].pixels, picture[c]) for c in picture)
        command = f"ffmpeg -v warning -nostdin -i {path} -f rawvideo -pix_fmt gbrpf32le -"
        ran = subprocess.run(command.split(), capture_output=True)
        said = "something" if ran.stderr else "nothing"
        if ran.stdout:
            planes = np.frombuffer(ran.stdout, np.float32).reshape(3, n, n)
            wrong = (planes != np.stack([picture[c] for c in "GBR"])).any(axis=(0, 2)).sum()
            told = f"{wrong} of {n} rows wrong"
        else:
            told = "no picture"
        print(f"{name} {length} = {told}, exit code {ran.returncode}, {said} on stderr")
PY
observe "$python" "$work/decode.py" "$work/a.exr"
expect "255 bytes, sorted first" "$(seen "about 255")" "0 of 32 rows wrong, exit code 0, nothing on stderr"
expect "256 bytes, sorted first" "$(seen "about 256")" "no picture, exit code 1, something on stderr"
expect "300 bytes, sorted first" "$(seen "about 300")" "no picture, exit code 1, something on stderr"
expect "255 bytes, sorted last" "$(seen "zscene 255")" "0 of 32 rows wrong, exit code 0, nothing on stderr"
expect "256 bytes, sorted last" "$(seen "zscene 256")" "16 of 32 rows wrong, exit code 0, nothing on stderr"
expect "300 bytes, sorted last" "$(seen "zscene 300")" "16 of 32 rows wrong, exit code 0, nothing on stderr"
verdict
