//! Kubernetes: an Indexed Job.

use super::yaml::{Node, document, list};
use super::{GRACE_SECONDS, HOPELESS, Job, RETRIED, utf8};
use crate::util::error::{Error, Result};

/// What only Kubernetes has.
#[derive(Clone, Debug)]
pub struct Options {
    /// The container image that holds taki.
    pub image: String,
    /// The persistent volume claim with the scenes, and for the frames; all shards write to it.
    pub claim: String,
    /// Where the claim is mounted, and where relative paths start.
    pub mount: String,
}

/// The manifest of a batch/v1 Job, for Kubernetes 1.29 or newer (`backoffLimitPerIndex`).
///
/// [`RETRIED`] codes count against `job.retries` of their shard, [`HOPELESS`] ones end the job, others their
/// shard. What the cluster itself disrupts (drained or lost nodes, preemption) is run again without counting.
/// GPUs are the resource `nvidia.com/gpu`.
pub fn manifest(job: &Job, options: &Options) -> Result<String> {
    job.check()?;
    check_label(&job.name)?;
    if !options.mount.starts_with('/') || options.mount.contains(':') {
        let why =
            format!("--mount {:?}: an absolute path without ':' is needed, such as /work", options.mount);
        return Err(Error::Usage(why));
    }
    let mut command: Vec<Node> = vec![argument(utf8(&job.taki, "a manifest")?)];
    command.extend(["batch".into(), "--shard".into()]);
    command.push(format!("$(JOB_COMPLETION_INDEX)/{}", job.shards).into());
    for word in &job.batch {
        command.push(argument(utf8(word, "a manifest")?));
    }

    let mut amounts: Vec<(&'static str, Node)> = Vec::new();
    amounts.extend(job.cpus.map(|n| ("cpu", n.to_string().into())));
    amounts.extend(job.memory.map(|mib| ("memory", format!("{mib}Mi").into())));
    amounts.extend(job.gpus.map(|n| ("nvidia.com/gpu", n.to_string().into())));
    let mut container = vec![
        ("name", "taki".into()),
        ("image", options.image.as_str().into()),
        ("workingDir", options.mount.as_str().into()),
        ("command", Node::List(command)),
    ];
    if !amounts.is_empty() {
        // Requests follow from limits.
        container.push(("resources", Node::Map(vec![("limits", Node::Map(amounts))])));
    }
    container.push((
        "volumeMounts",
        list([Node::Map(vec![("name", "work".into()), ("mountPath", options.mount.as_str().into())])]),
    ));

    let mut pod = vec![("restartPolicy", "Never".into())];
    pod.extend(job.minutes.map(|m| ("activeDeadlineSeconds", Node::Number(u64::from(m) * 60))));
    pod.extend([
        ("terminationGracePeriodSeconds", GRACE_SECONDS.into()),
        ("containers", list([Node::Map(container)])),
        (
            "volumes",
            list([Node::Map(vec![
                ("name", "work".into()),
                ("persistentVolumeClaim", Node::Map(vec![("claimName", options.claim.as_str().into())])),
            ])]),
        ),
    ]);
    let exit_codes = |action: &str, operator: &str, codes: &[u8]| {
        Node::Map(vec![
            ("action", action.into()),
            (
                "onExitCodes",
                Node::Map(vec![
                    ("containerName", "taki".into()),
                    ("operator", operator.into()),
                    ("values", list(codes.iter().map(|&code| u32::from(code)))),
                ]),
            ),
        ])
    };
    let disruption = Node::Map(vec![("type", "DisruptionTarget".into()), ("status", "True".into())]);
    let rules = list([
        Node::Map(vec![("action", "Ignore".into()), ("onPodConditions", list([disruption]))]),
        exit_codes("FailJob", "In", &HOPELESS),
        // What no rule names counts against backoffLimitPerIndex.
        exit_codes("FailIndex", "NotIn", &RETRIED),
    ]);
    let spec = vec![
        ("completionMode", "Indexed".into()),
        ("completions", job.shards.into()),
        ("parallelism", job.shards.into()),
        ("backoffLimitPerIndex", job.retries.into()),
        ("podFailurePolicy", Node::Map(vec![("rules", rules)])),
        ("template", Node::Map(vec![("spec", Node::Map(pod))])),
    ];
    Ok(document(
        &[
            format!("One taki batch in {} shards, written by taki farm kubernetes.", job.shards),
            "Finished frames are kept: a shard that is run again goes on where it was.".into(),
            "I/O error, device lost, driver hang, killed, SIGTERM: the shard is run again. Usage, bad input and".into(),
            "outputs that cannot be created end the job, other faults their shard.".into(),
        ],
        vec![
            ("apiVersion", "batch/v1".into()),
            ("kind", "Job".into()),
            ("metadata", Node::Map(vec![("name", job.name.as_str().into())])),
            ("spec", Node::Map(spec)),
        ],
    ))
}

/// One argument of a container's command, where `$(NAME)` would be replaced and `$$` is a `$`.
fn argument(word: &str) -> Node {
    word.replace('$', "$$").into()
}

/// Names of pods come from the job's: a DNS label.
fn check_label(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.chars().all(plain) && !name.ends_with('-') {
        Ok(())
    } else {
        let why =
            "in Kubernetes a name has lower-case letters, digits and '-', and ends with a letter or digit";
        Err(Error::Usage(format!("--name {name}: {why}")))
    }
}
