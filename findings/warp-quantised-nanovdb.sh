#!/usr/bin/env bash
# Warp loads quantised NanoVDB volumes without an error and samples them as 0.
#
# Versions: warp-lang 1.19.0 (on the CPU), NanoVDB tools 10.0.1 (Debian 12).
# Expected: a grid of type Fp4, Fp8, Fp16 or FpN is decoded by the sampling functions for floats, or refused
#   when it is loaded.
# Seen: load_from_nvdb takes the file, counts its voxels and names its type ("Float8"). volume_sample_f and
#   volume_lookup_f return 0 everywhere. The float grid that it was made from is sampled correctly.
# Why it matters: a cache that was quantised to fit the GPU's memory renders as empty space, and nothing
#   says so.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
needs nanovdb_convert
debian libnanovdb-tools 10.0.1
pip_install python3 warp-lang==1.19.0 numpy==2.4.6
export WARP_CACHE_PATH=$work/kernels
cat >"$work/volume.py" <<'PY'
import sys
import numpy as np
import warp as wp

wp.config.log_level = wp.LOG_WARNING
SIZE = 16


@wp.kernel
def sample(volume: wp.uint64, out: wp.array(dtype=float)):
    i = wp.tid()
    out[i] = wp.volume_sample_f(volume, wp.vec3(float(i), 5.0, 6.0), wp.Volume.LINEAR)


@wp.kernel
def lookup(volume: wp.uint64, out: wp.array(dtype=float)):
    i = wp.tid()
    out[i] = wp.volume_lookup_f(volume, i, 5, 6)


values = np.random.default_rng(1).uniform(0.5, 1, (SIZE, SIZE, SIZE)).astype(np.float32)
if sys.argv[1] == "write":
    volume = wp.Volume.load_from_numpy(values, voxel_size=1.0, bg_value=0.0, device="cpu")
    volume.save_to_nvdb(sys.argv[2])
else:
    with open(sys.argv[2], "rb") as file:
        volume = wp.Volume.load_from_nvdb(file, device="cpu")
    told = []
    for kernel in sample, lookup:
        out = wp.zeros(SIZE, dtype=float, device="cpu")
        wp.launch(kernel, SIZE, [volume.id, out], device="cpu")
        out, truth = out.numpy(), values[:, 5, 6]
        told.append("right" if np.abs(out - truth).max() < 1e-6 else "zeros" if not out.any() else str(out))
    name = sys.argv[3]
    print(f"{name} = {volume.get_grid_info().type_str}, {volume.get_voxel_count()} voxels:", *told)
PY
"$python" "$work/volume.py" write "$work/float.nvdb" 2>/dev/null
observe "$python" "$work/volume.py" read "$work/float.nvdb" float 2>/dev/null
nanovdb_convert --force "$work/float.nvdb" "$work/float.vdb"
for kind in fp4 fp8 fp16 fpN; do
    nanovdb_convert --force "--$kind" "$work/float.vdb" "$work/$kind.nvdb"
    observe "$python" "$work/volume.py" read "$work/$kind.nvdb" "$kind" 2>/dev/null
done
expect "float" "$(seen float)" "float, 4096 voxels: right right"
expect "Fp4" "$(seen fp4)" "Float4, 4096 voxels: zeros zeros"
expect "Fp8" "$(seen fp8)" "Float8, 4096 voxels: zeros zeros"
expect "Fp16" "$(seen fp16)" "Float16, 4096 voxels: zeros zeros"
expect "FpN" "$(seen fpN)" "FloatN, 4096 voxels: zeros zeros"
verdict
