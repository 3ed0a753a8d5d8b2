//! Job file for Open Job Description: a job template of the revision 2023-09.

use super::yaml::{Node, document, list};
use super::{GRACE_SECONDS, Job, RETRIED, bash_words, pattern, utf8};
use crate::util::error::{Error, Result};

/// Seconds before a shard is run again, so that a driver or a file system can recover.
const PAUSE_SECONDS: u32 = 5;

/// Writes the job template. It has one step `Render` with the task parameter `Shard`, 0 to N − 1. Three job
/// parameters can be set at submission: `Folder` (relative paths start there; default: the template's
/// folder), `Taki` (the program) and `Retries`.
///
/// The specification knows no retry by exit code: the scheduler alone decides whether it runs a failed task
/// again. The task's script therefore runs the shard again itself after a code of [`RETRIED`], except 143:
/// SIGTERM is how a task is cancelled.
///
/// # Errors
/// [`Error::Usage`] if the job or the path of the program is not valid for a job template.
pub fn template(job: &Job) -> Result<String> {
    job.check()?;
    let taki = utf8(&job.taki, "a job template")?;
    if taki.chars().count() > 1024 || taki.chars().any(char::is_control) {
        let why = "--taki: use at most 1024 printable characters, or a link with a plain name";
        return Err(Error::Usage(why.into()));
    }
    let parameter = |name: &str, kind: &str, about: &str, mut more: Vec<(&'static str, Node)>| {
        let mut entries = vec![("name", name.into()), ("type", kind.into()), ("description", about.into())];
        entries.append(&mut more);
        Node::Map(entries)
    };
    let parameters = vec![
        parameter(
            "Folder",
            "PATH",
            "Folder where relative paths start, on a disk that all workers share.",
            vec![("objectType", "DIRECTORY".into()), ("dataFlow", "INOUT".into()), ("default", ".".into())],
        ),
        parameter("Taki", "STRING", "Path of taki on the workers.", vec![("default", taki.into())]),
        parameter(
            "Retries",
            "INT",
            "Number of times that a shard is run again after a temporary fault.",
            vec![("minValue", 0.into()), ("default", job.retries.into())],
        ),
    ];
    let shard = Node::Map(vec![
        ("name", "Shard".into()),
        ("type", "INT".into()),
        ("range", format!("0-{}", job.shards - 1).into()),
    ]);
    let mut action = vec![
        ("command", "bash".into()),
        // Values are passed as arguments, because bash would interpret values inside the script.
        (
            "args",
            list([
                "{{Task.File.Run}}",
                "{{Param.Folder}}",
                "{{Param.Taki}}",
                "{{Param.Retries}}",
                "{{Task.Param.Shard}}",
            ]),
        ),
    ];
    if let Some(minutes) = job.minutes {
        action.push(("timeout", Node::Number(u64::from(minutes) * 60)));
    }
    action.push((
        "cancelation",
        Node::Map(vec![
            ("mode", "NOTIFY_THEN_TERMINATE".into()),
            ("notifyPeriodInSeconds", GRACE_SECONDS.into()),
        ]),
    ));
    let mut step = vec![
        ("name", "Render".into()),
        ("parameterSpace", Node::Map(vec![("taskParameterDefinitions", Node::List(vec![shard]))])),
        (
            "script",
            Node::Map(vec![
                ("actions", Node::Map(vec![("onRun", Node::Map(action))])),
                (
                    "embeddedFiles",
                    Node::List(vec![Node::Map(vec![
                        ("name", "Run".into()),
                        ("type", "TEXT".into()),
                        ("data", Node::Block(script(job)?)),
                    ])]),
                ),
            ]),
        ),
    ];
    let amounts: Vec<Node> = [
        ("amount.worker.vcpu", job.cpus),
        ("amount.worker.memory", job.memory),
        ("amount.worker.gpu", job.gpus),
    ]
    .into_iter()
    .filter_map(|(name, least)| Some(Node::Map(vec![("name", name.into()), ("min", least?.into())])))
    .collect();
    if !amounts.is_empty() {
        step.push(("hostRequirements", Node::Map(vec![("amounts", Node::List(amounts))])));
    }
    Ok(document(
        &[
            format!("One taki batch in {} shards, written by taki farm openjd.", job.shards),
            "Finished frames are kept: a shard that is run again continues where it stopped.".into(),
        ],
        vec![
            ("specificationVersion", "jobtemplate-2023-09".into()),
            ("name", job.name.as_str().into()),
            ("parameterDefinitions", Node::List(parameters)),
            ("steps", Node::List(vec![Node::Map(step)])),
        ],
    ))
}

/// The bash script that a task runs. Its arguments are folder, program, retries and shard.
fn script(job: &Job) -> Result<String> {
    let shards = job.shards;
    let arguments = bash_words(&job.batch)?;
    // SIGTERM (143) is how a task is cancelled, so the script must not start the shard again.
    let retried = pattern(&RETRIED.into_iter().filter(|&code| code != 143).collect::<Vec<_>>());
    Ok(format!(
        r#"#!/bin/bash
set -u
folder=$1 program=$2 retries=$3 shard=$4
cd -- "$folder" || exit 73
signals=0 taki=
trap 'signals=$((signals + 1)); [ -z "$taki" ] || kill -TERM "$taki" 2>/dev/null' TERM

run() {{
    "$program" batch --shard "$shard/{shards}"{arguments} &
    taki=$!
    # A signal interrupts wait before taki has ended, so wait again after each signal.
    local seen=-1
    while [ "$seen" != "$signals" ]; do
        seen=$signals
        wait "$taki"
        code=$?
    done
    taki=
}}

run
# Open Job Description has no retry by exit code, so this script runs the shard again itself.
while [ "$signals" = 0 ] && [ "$retries" -gt 0 ]; do
    # I/O error, lost device, driver hang and SIGKILL may be temporary. Other codes would occur again.
    case $code in
    {retried}) ;;
    *) break ;;
    esac
    echo "taki ended with $code: shard $shard is run again"
    retries=$((retries - 1))
    sleep {PAUSE_SECONDS}
    [ "$signals" = 0 ] || break
    run
done
[ "$code" = 0 ] || echo "openjd_fail: taki ended with exit code $code"
exit "$code"
"#
    ))
}
