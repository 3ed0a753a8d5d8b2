#!/usr/bin/env bash
# Slurm: a cancelled job that requeues itself on SIGTERM comes back.
#
# Versions: Slurm 22.05.8 (Debian 12); one node on the loopback interface.
# Expected: scancel ends a job for good, whatever the job asks for while it ends.
# Seen: scancel sends SIGTERM. A script that answers with `scontrol requeue` is obeyed, although squeue
#   calls its job COMPLETING by then: the job is queued again, runs anew and ends as COMPLETED.
# Why it matters: requeueing on SIGTERM is the usual answer to a time limit or a preempted node. The same
#   lines make renders that their owner cannot stop with one scancel. Requeue only while squeue says
#   RUNNING.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/slurm.bash"
slurm_start
cd "$work"
cat >job.sbatch <<'JOB'
#!/bin/bash
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=job.log
echo "run ${SLURM_RESTART_COUNT:-0}" >>runs
[ "${SLURM_RESTART_COUNT:-0}" = 0 ] || exit 0
stop() {
    squeue --noheader --jobs="$SLURM_JOB_ID" --format=%T >told
    if [ "$(cat when)" = always ] || [ "$(cat told)" = RUNNING ]; then scontrol requeue "$SLURM_JOB_ID"; fi
    exit 143
}
trap stop TERM
sleep 300 &
wait
JOB
# WHEN: cancels a job that requeues itself always, or only while it is RUNNING.
cancel() {
    echo "$1" >when
    rm -f runs told
    job=$(sbatch --parsable job.sbatch)
    await 60 "job $job runs" test -s runs
    # Its trap is set.
    sleep 1
    scancel --full "$job"
    await 60 "job $job has ended" job_ended "$job"
}
cancel running
expect "squeue's state in the trap" "$(cat told)" COMPLETING
expect "runs, requeued only if RUNNING" "$(wc -l <runs)" 1
expect "its state" "$(job_field "$job" JobState)" CANCELLED
cancel always
expect "runs, requeued always" "$(wc -l <runs)" 2
expect "its state" "$(job_field "$job" JobState)" COMPLETED
verdict
