#!/usr/bin/env bash
# Slurm: a job whose folder is missing on the node runs in /tmp and is COMPLETED.
#
# Versions: Slurm 22.05.8 (Debian 12); one node on the loopback interface.
# Expected: a job that cannot enter its working folder fails before its first command.
# Seen: it starts in /tmp, also where the folder was named with --chdir. What it writes under relative names
#   lies there, on the node. The job ends as COMPLETED with exit code 0:0; only the job's own log tells.
# Why it matters: on a node that has not mounted the disk of the frames, a batch renders for hours into /tmp
#   and reports success. Begin the job script with cd "$SLURM_SUBMIT_DIR" || exit 1.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
source "$(dirname -- "$0")/lib/slurm.bash"
slurm_start
mkdir "$work/frames"
cd "$work/frames"
here=$(sbatch --parsable --hold --output="$work/here.log" --wrap='pwd')
chdir=$(sbatch --parsable --hold --chdir="$work/frames" --output="$work/chdir.log" --wrap='pwd')
cd "$work"
rmdir frames
for job in "$here" "$chdir"; do
    scontrol release "$job"
    await 60 "job $job has ended" job_ended "$job"
    expect "state of job $job" "$(job_field "$job" JobState)" COMPLETED
    expect "exit code of job $job" "$(job_field "$job" ExitCode)" 0:0
done
sed 's/^/log: /' here.log chdir.log
expect "folder of the job submitted in it" "$(tail -n 1 here.log)" /tmp
expect "folder of the job sent there with --chdir" "$(tail -n 1 chdir.log)" /tmp
verdict
