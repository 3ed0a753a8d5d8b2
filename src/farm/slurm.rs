//! Job file for Slurm: the script of an array job, for `sbatch`.

use super::{GRACE_SECONDS, Job, RETRIED, bash_word, bash_words, pattern};
use crate::util::error::{Error, Result};

/// Options that only Slurm has.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Names of partitions, separated by commas. `None`: the site's default.
    pub partition: Option<String>,
}

/// Writes the script. Each task runs in the folder where `sbatch` was called. A task that ends with a code of
/// [`RETRIED`] is requeued up to `job.retries` times; any other exit code becomes that of the task.
///
/// # Errors
/// [`Error::Usage`] if the job or the partition is not valid for Slurm.
pub fn script(job: &Job, options: &Options) -> Result<String> {
    job.check()?;
    let Job { name, shards, retries, .. } = job;
    let mut lines = vec![
        format!("--job-name={name}"),
        format!("--array=0-{}", shards - 1),
        "--nodes=1".into(),
        "--ntasks=1".into(),
    ];
    lines.extend(options.partition.as_ref().map(|p| partition(p)).transpose()?);
    lines.extend(job.cpus.map(|n| format!("--cpus-per-task={n}")));
    lines.extend(job.gpus.map(|n| format!("--gres=gpu:{n}")));
    lines.extend(job.memory.map(|mib| format!("--mem={mib}M")));
    lines.extend(job.minutes.map(|minutes| format!("--time={minutes}")));
    lines.extend([
        format!("--signal=B:TERM@{GRACE_SECONDS}"),
        "--requeue".into(),
        // A requeued task appends to its log.
        "--open-mode=append".into(),
        format!("--output={name}-%A_%a.log"),
    ]);
    let settings: String = lines.iter().map(|line| format!("#SBATCH {line}\n")).collect();
    let program = bash_word(&job.taki)?;
    let arguments = bash_words(&job.batch)?;
    let retried = pattern(&RETRIED);
    Ok(format!(
        r#"#!/bin/bash
# One taki batch in {shards} shards, written by taki farm slurm.
# Submit it with sbatch from the folder where relative paths start, on a disk that all nodes share.
# Finished frames are kept: a shard that is run again continues where it stopped.
{settings}set -u

# If this folder is missing on the node, Slurm starts the task in /tmp, and its frames would stay there.
cd -- "$SLURM_SUBMIT_DIR" || exit 73
export RAYON_NUM_THREADS="${{SLURM_CPUS_PER_TASK:-0}}"

{program} batch --shard "$SLURM_ARRAY_TASK_ID/{shards}"{arguments} &
taki=$!
# Slurm signals this shell {GRACE_SECONDS} s before the time limit. A signal interrupts wait before taki has
# ended, so wait again after each signal.
signals=0
trap 'signals=$((signals + 1)); kill -TERM "$taki" 2>/dev/null' TERM
seen=-1
while [ "$seen" != "$signals" ]; do
    seen=$signals
    wait "$taki"
    code=$?
done

# I/O error, lost device, driver hang, SIGKILL and SIGTERM may be temporary. Other codes would occur again.
case $code in
{retried})
    # SLURM_JOB_ID would not do: in the array's last task it is the ID of the whole array.
    task="${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
    # Requeueing a cancelled task would revive it, so requeue only a task that still runs. Slurm calls the
    # state SIGNALING while it sends the signal of the time limit.
    state=$(squeue --noheader --jobs="$task" --format=%T)
    if [ "${{SLURM_RESTART_COUNT:-0}}" -lt {retries} ] && [[ $state == RUNNING || $state == SIGNALING ]]; then
        echo "taki ended with $code: task $task is requeued" >&2
        scontrol requeue "$task"
    fi
    ;;
esac
exit "$code"
"#
    ))
}

/// Formats `--partition`, and refuses names that sbatch would read as something else.
fn partition(names: &str) -> Result<String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-' | ',');
    if names.is_empty() || !names.chars().all(plain) {
        let why = format!("--partition {names:?}: use only letters, digits, '.', '_' and '-' in a name");
        return Err(Error::Usage(why));
    }
    Ok(format!("--partition={names}"))
}
