#!/usr/bin/env bash
# A NanoVDB file saved by Warp lists its grid with no voxels and an empty box.
#
# Versions: warp-lang 1.19.0 (on the CPU), NanoVDB tools 10.0.1 (Debian 12).
# Expected: the record in front of a grid in a .nvdb file repeats the grid's voxel count and its box in
#   index space, so that a reader can choose grids and allocate before it reads them.
# Seen: of 4096 voxels from (0, 0, 0) to (15, 15, 15) the record tells 0 voxels and a box from 0 to 0; so
#   does nanovdb_print. The grid behind it is whole: after two conversions by nanovdb_convert the record is
#   right.
# Why it matters: a loader that skips empty grids, or takes the bounds for its camera or acceleration
#   structure from the record, shows nothing.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
needs nanovdb_convert nanovdb_print
debian libnanovdb-tools 10.0.1
pip_install python3 warp-lang==1.19.0 numpy==2.4.6
export WARP_CACHE_PATH=$work/kernels
cat >"$work/save.py" <<'PY'
import sys
import numpy as np
import warp as wp

wp.config.log_level = wp.LOG_WARNING
values = np.random.default_rng(1).uniform(0.5, 1, (16, 16, 16)).astype(np.float32)
volume = wp.Volume.load_from_numpy(values, voxel_size=1.0, bg_value=0.0, device="cpu")
volume.save_to_nvdb(sys.argv[1])
print("grid =", volume.get_voxel_count())
PY
cat >"$work/list.py" <<'PY'
import struct
import sys

# Head of 16 bytes; in the record: sizes (2), name's hash and voxel count at 24, type and class, the
# world's box (6 doubles), then the box in index space.
data = open(sys.argv[2], "rb").read(16 + 176)
assert data[:8] == b"NanoVDB0", data[:8]
voxels, = struct.unpack_from("<Q", data, 16 + 24)
box = struct.unpack_from("<6i", data, 16 + 40 + 48)
print(f"{sys.argv[1]} = {voxels} voxels,", *box)
PY
observe "$python" "$work/save.py" "$work/warp.nvdb" 2>/dev/null
observe "$python" "$work/list.py" record "$work/warp.nvdb"
nanovdb_print -v "$work/warp.nvdb" | sed -n '/^# *Name/,/^$/p'
nanovdb_convert --force "$work/warp.nvdb" "$work/warp.vdb"
nanovdb_convert --force "$work/warp.vdb" "$work/again.nvdb"
observe "$python" "$work/list.py" again "$work/again.nvdb"
printed=$(nanovdb_print -v "$work/warp.nvdb" |
    sed -nE 's/^.* float .*\) +([0-9]+) +([0-9]+ x [0-9]+ x [0-9]+) *$/\1 voxels, \2/p')
expect "voxels of the grid" "$(seen grid)" 4096
expect "voxels and box of the record" "$(seen record)" "0 voxels, 0 0 0 0 0 0"
expect "voxels and resolution by nanovdb_print" "$printed" "0 voxels, 1 x 1 x 1"
expect "voxels and box after two conversions" "$(seen again)" "4096 voxels, 0 0 0 15 15 15"
verdict
