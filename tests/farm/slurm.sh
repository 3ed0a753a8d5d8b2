#!/usr/bin/env bash
# Runs job files of `taki farm slurm` on a temporary Slurm: munged, slurmctld and slurmd on the loopback
# interface, in a temporary folder, as any user, without systemd and cgroups.
#
#     tests/farm/slurm.sh TAKI
#
# Exit codes: 0 ok, 1 a promise is broken, 77 the tools are missing (the reason on stderr).
set -euo pipefail
taki=$(realpath "$1")
PATH=$PATH:/usr/sbin:/sbin
for tool in munged slurmctld slurmd sbatch scontrol squeue scancel shellcheck python3 setpriv; do
    command -v "$tool" >/dev/null && continue
    echo "$tool is not installed (Debian: slurm-wlm munge shellcheck)" >&2
    exit 77
done

# The name is short, because the path of a socket has at most 107 bytes.
work=$(mktemp -d /tmp/taki-slurm.XXXXXX)
chmod 755 "$work"
daemons=()
cleanup() {
    code=$?
    trap - EXIT
    if [ "$code" != 0 ]; then
        squeue --array 2>&1 || true
        tail -n 25 "$work"/*.log "$work"/*/*.log 2>/dev/null || true
    fi >&2
    if [ -S "$work/munge/socket" ]; then
        scancel --user="$(id -un)" 2>/dev/null || true
        for _ in $(seq 50); do
            [ -n "$(squeue --noheader 2>/dev/null)" ] || break
            sleep 0.2
        done
    fi
    # A task that does not end would hold its slurmstepd for ever. Its script lies in this folder.
    pgrep -f "$work/spool/job" | xargs -r kill -KILL || true
    # Stops the daemon that started last first: slurmd signs off from slurmctld, and both need munged.
    for ((i = ${#daemons[@]} - 1; i >= 0; i--)); do
        kill "${daemons[i]}" 2>/dev/null || true
        wait "${daemons[i]}" 2>/dev/null || true
    done
    rm -rf "$work"
    exit "$code"
}
trap cleanup EXIT
trap 'exit 143' TERM INT HUP

fail() { echo "slurm.sh: $*" >&2; exit 1; }
# Waits at most SECONDS until COMMAND succeeds.
await() {
    local seconds=$1 what=$2
    shift 2
    for ((i = 0; i < seconds * 5; i++)); do
        if "$@" >/dev/null 2>&1; then return; fi
        sleep 0.2
    done
    fail "after $seconds s still not so: $what"
}
# The daemons end with this script, even if it is killed.
daemon() {
    local log=$1
    shift
    setpriv --pdeathsig TERM "$@" >>"$work/$log" 2>&1 &
    daemons+=($!)
}

mkdir "$work/munge" "$work/state" "$work/spool"
head -c 1024 /dev/urandom >"$work/munge/key"
chmod 400 "$work/munge/key"
daemon munged.log munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" \
    --log-file="$work/munged.log" --pid-file="$work/munge/pid" --seed-file="$work/munge/seed"
await 10 "munged listens" test -S "$work/munge/socket"

host=$(uname -n)
host=${host%%.*}
read -r port_1 port_2 < <(python3 -c '
import socket
sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
print(*(s.getsockname()[1] for s in sockets))')
# cred_expire is also how long a requeued task has to wait.
cat >"$work/slurm.conf" <<CONF
ClusterName=taki
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
SlurmctldPort=$port_1
SlurmdPort=$port_2
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
MailProg=/bin/true
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,batch_sched_delay=1
SlurmdParameters=config_overrides
KillWait=5
NodeName=$host NodeAddr=127.0.0.1 CPUs=8 RealMemory=8000
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
daemon slurmctld.log slurmctld -D
await 20 "slurmctld answers" scontrol ping
idle() { [ "$(sinfo --noheader --format=%T)" = idle ]; }
dead() { ! kill -0 "${daemons[-1]}"; }
daemon slurmd.log slurmd -D
await 30 "slurmd is ready or has given up" eval 'idle || dead'
if dead 2>/dev/null; then
    # Newer versions must be told to do without cgroups. Older versions do not know the option.
    echo "CgroupPlugin=disabled" >"$work/cgroup.conf"
    daemon slurmd.log slurmd -D
    await 30 "slurmd is ready" idle
fi

# The program on the nodes counts its runs and fails as the folder's file `fault` says (SHARD CODE TIMES).
# With the code 143 it waits for SIGTERM.
cat >"$work/taki" <<PROGRAM
#!/bin/bash
set -u
[ "\$1 \$2" = "batch --shard" ] || exit 2
shard=\${3%/*}
echo run >>"runs.\$shard"
read -r faulty code times <fault
if [ "\$shard" = "\$faulty" ] && [ "\$(wc -l <"runs.\$shard")" -le "\$times" ]; then
    if [ "\$code" = 143 ]; then
        sleep 600 &
        trap 'kill \$!; exit 143' TERM
        wait
    fi
    exit "\$code"
fi
exec "$taki" "\$@"
PROGRAM
chmod +x "$work/taki"

# shellcheck disable=SC2016 # A second expansion by the shell would change this path.
arguments=(front --size 24x16 --engine cpu -o 'out dir/it'\''s $HOME.####.png')
# Submits the batch in a folder of its own: CASE FAULT SHARDS FRAMES OPTION…; the job's number is in `job`.
submit() {
    local case=$1 fault=$2 shards=$3 frames=$4
    shift 4
    mkdir -p "$work/$case/out dir"
    cd "$work/$case"
    echo "$fault" >fault
    "$taki" farm slurm --shards "$shards" --name "$case" --taki "$work/taki" --cpus 1 --memory 500 \
        --output job.sbatch "$@" -- "${arguments[@]}" --frames "$frames"
    shellcheck --exclude=SC2016 job.sbatch || fail "shellcheck: $case"
    sbatch --parsable job.sbatch >job
}
# One field of a task, as scontrol shows it: CASE SHARD FIELD.
field() { scontrol show job --oneliner "$(cat "$work/$1/job")_$2" | grep -o "\b$3=[^ ]*" | cut -d= -f2; }
ended() {
    local states
    states=$(scontrol show job --oneliner "$(cat "$work/$1/job")" | grep -o '\bJobState=[A-Z_]*') || return 1
    ! grep -vqE '=(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL|OUT_OF_MEMORY)$' <<<"$states"
}
runs() { grep -c run "$work/$1/runs.$2" 2>/dev/null || true; }
expect() { [ "$2" = "$3" ] || fail "$1: $2, expected $3"; }

submit limit "0 143 1" 1 0-0 --time 1
submit cancelled "0 143 9" 1 0-0
submit lost "7 75 1" 8 0-23 --time 60
submit bad "1 65 9" 2 0-1
submit always "1 75 9" 2 0-1 --retries 1

mkdir -p "$work/alone/out dir"
cd "$work/alone"
"$taki" batch "${arguments[@]}" --frames 0-23 || fail "the batch alone: exit code $?"
expect "frames of the batch alone" "$(find "$work/alone/out dir" -name '*.png' | wc -l)" 24

# A task that is cancelled while it waits for SIGTERM ends with 143 and does not come back.
started() { [ -n "$(runs "$1" 0)" ]; }
await 60 "the task to be cancelled runs" started cancelled
scancel "$(cat "$work/cancelled/job")"

await 100 "the bad shard has ended" ended bad
expect "the bad shard's state" "$(field bad 1 JobState)" FAILED
expect "the bad shard's exit code" "$(field bad 1 ExitCode)" 65:0
expect "the bad shard's runs" "$(runs bad 1)" 1
expect "the bad shard's neighbour" "$(field bad 0 JobState)" COMPLETED

await 100 "the shard of the lost device has ended" ended lost
for shard in 0 1 2 3 4 5 6 7; do
    expect "shard $shard" "$(field lost "$shard" JobState)" COMPLETED
    # The number of the last task is that of the array, but only one task may have been requeued.
    expect "runs of shard $shard" "$(runs lost "$shard")" $((shard == 7 ? 2 : 1))
done
expect "requeues of shard 7" "$(field lost 7 Restarts)" 1
for frame in "$work/alone/out dir"/*.png; do
    cmp "$frame" "$work/lost/out dir/${frame##*/}" || fail "the farm's frame differs from the batch's"
done
expect "the farm's frames" "$(find "$work/lost/out dir" -name '*.png' | wc -l)" 24

await 100 "the shard that always fails has ended" ended always
expect "its exit code" "$(field always 1 ExitCode)" 75:0
expect "its runs" "$(runs always 1)" 2
expect "its neighbour's runs" "$(runs always 0)" 1

# The limit of a minute sends SIGTERM 30 s before it, or somewhat more.
await 110 "the time limit has come and the next run is done" ended limit
expect "the state after the time limit" "$(field limit 0 JobState)" COMPLETED
expect "runs around the time limit" "$(runs limit 0)" 2
expect "frames after the time limit" "$(find "$work/limit/out dir" -name '*.png' | wc -l)" 1

expect "the cancelled task's state" "$(field cancelled 0 JobState)" CANCELLED
expect "the cancelled task's runs" "$(runs cancelled 0)" 1
cd /
echo "slurm.sh: ok"
