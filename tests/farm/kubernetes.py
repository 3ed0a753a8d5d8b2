"""Manifests of `taki farm kubernetes` against the schemas that Kubernetes publishes, unknown fields refused.

    python tests/farm/kubernetes.py TAKI      (python: with requirements.txt installed)

Exit code 0: all promises hold.
"""

import copy
import re
import subprocess
import sys

import kubernetes_validate
import yaml

TAKI = sys.argv[1]
# The first version with backoffLimitPerIndex on by default, and the newest that the validator knows.
VERSIONS = ["1.29", kubernetes_validate.latest_version()]
HARD = [
    "", " ", "a b", "it's", '"', "$HOME", "$(JOB_COMPLETION_INDEX)", "$$", "$$(HOME)", "$", "a$", "\\",
    "a\nb", "a\r\nb", "\t", "{{", "no", "on", "~", "null", "1:30", "0x1f", "0o7", "1e3", ".inf", "NaN",
    "2026-11-22", "=", "<<", "a: b", "a #b", "#x", "&a", "*a", "!a", "|", ">", "%", "@", "`", "\x1b[2J", "滝",
    "\u2028\u0085\ufeff", "😀", "x " * 200,
]
# taki checks its own options only. The scene checks their values.
WORDS = [word for hard in HARD for word in ("--set", hard)] + ["--set=- a", "front"]


def manifest(batch, *options):
    claim = ["--image", "registry/taki:1", "--claim", "scenes"]
    command = [TAKI, "farm", "kubernetes", *claim, *options, "--", *batch]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, timeout=60).stdout.decode()


def valid(job):
    try:
        for version in VERSIONS:
            kubernetes_validate.validate(job, version, strict=True)
        return True
    except kubernetes_validate.ValidationError:
        return False


def container(job):
    return job["spec"]["template"]["spec"]["containers"][0]


def expanded(word, variables):
    """What the kubelet makes of one word of a command."""
    def value(found):
        name = found.group(1)
        return "$" if name is None else variables.get(name, found.group())
    return re.sub(r"\$\$|\$\(([^)]*)\)", value, word)


text = manifest(
    ["fall.toml", "--frames", "0-239", "-o", "out/fall.####.exr"],
    "--shards", "8", "--retries", "2", "--time", "90",
    "--cpus", "4", "--memory", "8192", "--gpus", "1", "--name", "fall",
)
job = yaml.safe_load(text)
assert valid(job), text
spec = job["spec"]
assert (spec["completions"], spec["parallelism"], spec["completionMode"]) == (8, 8, "Indexed")
assert (spec["backoffLimitPerIndex"], spec["template"]["spec"]["restartPolicy"]) == (2, "Never")
assert container(job)["resources"]["limits"] == {"cpu": "4", "memory": "8192Mi", "nvidia.com/gpu": "1"}

# Action of the job controller after an exit code: that of the first rule that fits, or else Count.
def action(code):
    for rule in spec["podFailurePolicy"]["rules"]:
        codes = rule.get("onExitCodes")
        if codes and (code in codes["values"]) == (codes["operator"] == "In"):
            return rule["action"]
    return "Count"


actions = {code: action(code) for code in [2, 33, 65, 69, 73, 74, 75, 101, 124, 130, 137, 139, 143]}
again = {code for code in actions if actions[code] == "Count"}
assert again == {74, 75, 124, 137, 143}, actions
assert {code for code in actions if actions[code] == "FailJob"} == {2, 65, 73}, actions

# Without options, and with words that YAML or Kubernetes might misread.
job_of_words = yaml.safe_load(manifest(WORDS))
assert valid(job_of_words)
command = [expanded(word, {"JOB_COMPLETION_INDEX": "3"}) for word in container(job_of_words)["command"]]
assert command == ["taki", "batch", "--shard", "3/8", *WORDS], command

# The check must be able to fail.
def renamed(job):
    job["spec"]["backofLimitPerIndex"] = job["spec"].pop("backoffLimitPerIndex")


def mistyped(job):
    job["spec"]["completions"] = "eight"


def without_operator(job):
    del job["spec"]["podFailurePolicy"]["rules"][1]["onExitCodes"]["operator"]


def without_containers(job):
    del job["spec"]["template"]["spec"]["containers"]


for fault in [renamed, mistyped, without_operator, without_containers]:
    broken = copy.deepcopy(job)
    fault(broken)
    assert not valid(broken), fault.__name__

print("kubernetes.py: ok")
