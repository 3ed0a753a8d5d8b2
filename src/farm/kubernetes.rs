//! Job file for Kubernetes: the manifest of an Indexed Job.

use super::yaml::{Node, document, list};
use super::{GRACE_SECONDS, HOPELESS, Job, RETRIED, utf8};
use crate::util::error::{Error, Result};

/// Options that only Kubernetes has.
#[derive(Clone, Debug)]
pub struct Options {
    /// Container image that contains taki.
    pub image: String,
    /// Persistent volume claim that holds the scenes and receives the frames. All shards write to it.
    pub claim: String,
    /// Absolute path where the claim is mounted. Relative paths start there.
    pub mount: String,
}

/// Writes the manifest of a batch/v1 Job. It needs Kubernetes 1.29 or newer, which has
/// `backoffLimitPerIndex`.
///
/// A shard that ends with a code of [`RETRIED`] is run again, up to `job.retries` times. A code of
/// [`HOPELESS`] ends the job, any other code ends its shard. Disruptions by the cluster (drained or lost
/// nodes, preemption) do not count as retries. GPUs are the resource `nvidia.com/gpu`.
///
/// # Errors
/// [`Error::Usage`] if the job, its name or the mount path is not valid for Kubernetes, or an argument is not
/// UTF-8.
pub fn manifest(job: &Job, options: &Options) -> Result<String> {
    job.check()?;
    check_label(&job.name)?;
    if !options.mount.starts_with('/') || options.mount.contains(':') {
        let why = format!("--mount {:?}: give an absolute path without ':', such as /work", options.mount);
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
        // Kubernetes sets the requests to the limits if none are given.
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
        // Codes that no rule names count against backoffLimitPerIndex.
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
            "Finished frames are kept: a shard that is run again continues where it stopped.".into(),
            "After an I/O error, lost device, driver hang, SIGKILL or SIGTERM, the shard is run again."
                .into(),
            "Usage errors, bad input and outputs that cannot be created end the job; any other fault ends"
                .into(),
            "only its shard.".into(),
        ],
        vec![
            ("apiVersion", "batch/v1".into()),
            ("kind", "Job".into()),
            ("metadata", Node::Map(vec![("name", job.name.as_str().into())])),
            ("spec", Node::Map(spec)),
        ],
    ))
}

/// Escapes an argument of a container's command: Kubernetes would replace `$(NAME)`, and reads `$$` as `$`.
fn argument(word: &str) -> Node {
    word.replace('$', "$$").into()
}

/// Checks that `name` is a DNS label, because Kubernetes derives the names of the pods from it.
fn check_label(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.chars().all(plain) && !name.ends_with('-') {
        Ok(())
    } else {
        let why =
            "a name in Kubernetes has lower-case letters, digits and '-', and ends with a letter or digit";
        Err(Error::Usage(format!("--name {name}: {why}")))
    }
}
