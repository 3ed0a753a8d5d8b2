#!/usr/bin/env bash
# Slurm: when the last task of an array requeues $SLURM_JOB_ID, the whole array runs again.
#
# Versions: Slurm 22.05.8 (Debian 12); one node on the loopback interface.
# Expected: SLURM_JOB_ID names the task that it is set in: it differs from task to task.
# Seen: the last task's SLURM_JOB_ID is the array's number. In any other task `scontrol requeue
#   $SLURM_JOB_ID` concerns that task alone. In the last one it runs every task again, those that are
#   COMPLETED too.
# Why it matters: a task that requeues itself after losing its device throws away the finished frames of the
#   others, in one task of each array. Requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID".
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/slurm.bash"
slurm_start
cd "$work"
cat >array.sbatch <<'JOB'
#!/bin/bash
#SBATCH --array=0-3
#SBATCH --requeue
#SBATCH --output=/dev/null
restarts=${SLURM_RESTART_COUNT:-0}
same=other
[ "$SLURM_JOB_ID" = "$SLURM_ARRAY_JOB_ID" ] && same=array
echo "$same" >>"task.$SLURM_ARRAY_TASK_ID"
if [ "$SLURM_ARRAY_TASK_ID" = "$(cat faulty)" ] && [ "$restarts" = 0 ]; then
    # Until the others have ended.
    while [ "$(squeue --noheader --array --jobs="$SLURM_ARRAY_JOB_ID" | wc -l)" -gt 1 ]; do sleep 0.5; done
    name=$SLURM_JOB_ID
    [ "$(cat naming)" = task ] && name=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
    scontrol requeue "$name"
    sleep 60
fi
JOB
# FAULTY NAMING: runs of the tasks 0 to 3, in `runs`.
array() {
    local job
    rm -f task.*
    echo "$1" >faulty
    echo "$2" >naming
    job=$(sbatch --parsable array.sbatch)
    await 120 "the array of job $job has ended" job_ended "$job"
    runs=$(for task in 0 1 2 3; do wc -l <"task.$task"; done | paste -sd ' ')
    number=$(head -n 1 task.3)
}
array 1 job
expect "SLURM_JOB_ID of task 3 is the number of" "$number" array
expect "runs of tasks 0 to 3, task 1 requeues SLURM_JOB_ID" "$runs" "1 2 1 1"
array 3 job
expect "runs of tasks 0 to 3, task 3 requeues SLURM_JOB_ID" "$runs" "2 2 2 2"
array 3 task
expect "runs of tasks 0 to 3, task 3 requeues itself by array and task" "$runs" "1 1 1 2"
verdict
