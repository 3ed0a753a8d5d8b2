# A Slurm of one node of its own on the loopback interface, as any user: munged, slurmctld and slurmd in the
# temporary folder, without systemd and cgroups. Read after common.bash; start it with slurm_start.
# shellcheck shell=bash disable=SC2154
PATH=$PATH:/usr/sbin:/sbin

daemons=()
# They go down with the script, even if it is killed.
daemon() {
    local log=$1
    shift
    setpriv --pdeathsig TERM "$@" >>"$work/$log" 2>&1 &
    daemons+=($!)
}
# SECONDS WHAT COMMAND…: until the command succeeds.
await() {
    local seconds=$1 what=$2 i
    shift 2
    for ((i = 0; i < seconds * 5; i++)); do
        if "$@" >/dev/null 2>&1; then return; fi
        sleep 0.2
    done
    say "after $seconds s still not so: $what" >&2
    tail -n 5 "$work"/*.log >&2 || true
    exit 1
}
slurm_stop() {
    local i
    scancel --user="$(id -un)" 2>/dev/null || true
    for ((i = 0; i < 50; i++)); do
        [ -n "$(squeue --noheader 2>/dev/null)" ] || break
        sleep 0.2
    done
    for ((i = ${#daemons[@]} - 1; i >= 0; i--)); do
        kill "${daemons[i]}" 2>/dev/null || true
        wait "${daemons[i]}" 2>/dev/null || true
    done
}
slurm_idle() { [ "$(sinfo --noheader --format=%T)" = idle ]; }

slurm_start() {
    local host ports
    needs munged slurmctld slurmd sbatch scontrol squeue scancel sinfo setpriv python3
    debian slurm-wlm 22.05.8
    chmod 755 "$work"
    leaving+=(slurm_stop)
    mkdir "$work/munge" "$work/state" "$work/spool"
    head -c 1024 /dev/urandom >"$work/munge/key"
    chmod 400 "$work/munge/key"
    daemon munged.log munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" \
        --log-file="$work/munged.log" --pid-file="$work/munge/pid" --seed-file="$work/munge/seed"
    await 10 "munged listens" test -S "$work/munge/socket"
    host=$(uname -n)
    host=${host%%.*}
    read -r -a ports < <(python3 -c '
import socket
sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
print(*(s.getsockname()[1] for s in sockets))')
    cat >"$work/slurm.conf" <<CONF
ClusterName=finding
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
SlurmctldPort=${ports[0]}
SlurmdPort=${ports[1]}
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
NodeName=$host NodeAddr=127.0.0.1 CPUs=4 RealMemory=2000
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$work/slurm.conf
    daemon slurmctld.log slurmctld -D
    await 20 "slurmctld answers" scontrol ping
    daemon slurmd.log slurmd -D
    await 30 "slurmd is ready" slurm_idle
}
# One field of a job, as scontrol shows it: JOB FIELD.
job_field() { scontrol show job --oneliner "$1" | grep -o "\b$2=[^ ]*" | head -n 1 | cut -d= -f2; }
job_ended() { ! squeue --noheader --jobs="$1" --format=%T 2>/dev/null | grep -q .; }
