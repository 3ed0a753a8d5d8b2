//! Slurm: an array job for `sbatch`.

use super::{GRACE_SECONDS, Job, RETRIED, bash_word, bash_words, pattern};
use crate::util::error::{Error, Result};

/// What only Slurm has.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Partitions, separated by commas.
    pub partition: Option<String>,
}

/// The script. It runs in the folder that `sbatch` was called in; a task that ends with one of [`RETRIED`]
/// is requeued up to `job.retries` times, and every other exit code becomes the task's.
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
        // A requeued task goes on with its log.
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
# Submit it with sbatch in the folder that the relative paths start from, on a disk that all nodes share.
# Finished frames are kept: a shard that is run again goes on where it was.
{settings}set -u

# Where this folder is missing, Slurm starts the task in /tmp, and its frames would stay there.
cd -- "$SLURM_SUBMIT_DIR" || exit 73
export RAYON_NUM_THREADS="${{SLURM_CPUS_PER_TASK:-0}}"

{program} batch --shard "$SLURM_ARRAY_TASK_ID/{shards}"{arguments} &
taki=$!
# Slurm signals this shell {GRACE_SECONDS} s before the time limit. The signal ends wait before taki has ended.
signals=0
trap 'signals=$((signals + 1)); kill -TERM "$taki" 2>/dev/null' TERM
seen=-1
while [ "$seen" != "$signals" ]; do
    seen=$signals
    wait "$taki"
    code=$?
done

# I/O error, device lost, driver hang, killed, SIGTERM: these may pass. Other codes would come again.
case $code in
{retried})
    # Not SLURM_JOB_ID: of the last task it names the whole array.
    task="${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
    # A cancelled task would come back if it were requeued. While the signal of the time limit is under way,
    # running is called signaling.
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

fn partition(names: &str) -> Result<String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-' | ',');
    if names.is_empty() || !names.chars().all(plain) {
        let why = format!("--partition {names:?}: a partition's name has letters, digits, '.', '_' and '-'");
        return Err(Error::Usage(why));
    }
    Ok(format!("--partition={names}"))
}
