#!/usr/bin/env bash
# OpenJD evens out chunks of frames, writes them in several ways, and does not chunk a range with a step.
#
# Versions: openjd-cli 0.8.0, openjd-model 0.13.0 (the specification 2023-09, extension TASK_CHUNKING).
# Expected: a CHUNK[INT] of 1-10 by 3 runs as 1-3, 4-6, 7-9 and 10; every second frame is chunked three by
#   three as well.
# Seen: 1-10 by 3 runs as 1-3, 4-5, 6-8, 9-10: the fewest chunks, evened out. CONTIGUOUS writes one frame as
#   "4-4", and cuts 1-10:2 or 4-1:-1 into chunks of one frame. NONCONTIGUOUS writes three frames in a row as
#   "1-3", but two as "4,5".
# Why it matters: a command that reads its frames from such a parameter has to understand all of these
#   forms. A template that renders every second frame starts the renderer once a frame, which chunks were to
#   avoid.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
pip_install python3 openjd-cli==0.8.0 openjd-model==0.13.0
# RANGE CONSTRAINT: the chunks by 3 in the order they run.
chunks() {
    cat >"$work/template.json" <<JSON
{
    "specificationVersion": "jobtemplate-2023-09",
    "extensions": ["TASK_CHUNKING"],
    "name": "chunks",
    "steps": [{
        "name": "Render",
        "parameterSpace": {"taskParameterDefinitions": [{
            "name": "Frames", "type": "CHUNK[INT]", "range": "$1",
            "chunks": {"defaultTaskCount": 3, "rangeConstraint": "$2"}
        }]},
        "script": {"actions": {"onRun": {"command": "echo", "args": ["frames <{{Task.Param.Frames}}>"]}}}
    }]
}
JSON
    "${python%/*}/openjd" run "$work/template.json" --extensions TASK_CHUNKING >"$work/log"
    sed -n 's/.*\tframes <\(.*\)>$/\1/p' "$work/log" | paste -sd ' '
}
expect "1-10, contiguous" "$(chunks 1-10 CONTIGUOUS)" "1-3 4-5 6-8 9-10"
expect "1-4,8-9, contiguous" "$(chunks 1-4,8-9 CONTIGUOUS)" "1-2 3-4 8-9"
expect "4, contiguous" "$(chunks 4 CONTIGUOUS)" "4-4"
expect "1-10:2, contiguous" "$(chunks 1-10:2 CONTIGUOUS)" "1-1 3-3 5-5 7-7 9-9"
expect "4-1:-1, contiguous" "$(chunks 4-1:-1 CONTIGUOUS)" "4-4 3-3 2-2 1-1"
expect "1-10, not contiguous" "$(chunks 1-10 NONCONTIGUOUS)" "1-3 4,5 6-8 9,10"
expect "5,8,9, not contiguous" "$(chunks 5,8,9 NONCONTIGUOUS)" "5,8,9"
verdict
