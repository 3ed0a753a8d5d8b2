"""Templates of `taki farm openjd`, checked and run by openjd-cli.

    python tests/farm/openjd.py TAKI          (python: with requirements.txt installed)

Exit code 0: all promises hold.
"""

import pathlib
import subprocess
import sys
import tempfile

import yaml

TAKI = str(pathlib.Path(sys.argv[1]).resolve())
OPENJD = str(pathlib.Path(sys.executable).with_name("openjd"))

# A program that fails as the file `fault` says (SHARD CODE TIMES), and then runs taki.
FAULTY = """#!/bin/bash
[ "$1 $2" = "batch --shard" ] || exit 2
shard=${3%/*}
echo run >>"runs.$shard"
read -r faulty code times <fault
if [ "$shard" = "$faulty" ] && [ "$(wc -l <"runs.$shard")" -le "$times" ]; then
    [ "$code" != 137 ] || kill -KILL $$
    # Waits until it is cancelled.
    [ "$code" != 143 ] || { trap 'echo stopped; kill $!; exit 143' TERM; sleep 600 & wait; }
    exit "$code"
fi
exec TAKI "$@"
"""
# A program that stores its arguments.
ECHO = """#!/bin/bash
printf '%s\\0' "$@" >words
"""
HARD = [
    b"", b" ", b"a b", b"it's", b'"', b"$HOME", b"$(id)", b"`id`", b"\\", b"a\\nb", b"a\nb", b"a\r\nb", b"\t",
    b"{{Param.Folder}}", b"}}", b"{", b"!", b"*", b"~", b"#x", b"a: b", b"no", b"\x1b[2J", "滝".encode(),
    "\u2028\u0085\ufeff\uffff".encode(), b"&", b";", b"|", b">f", b"%s", b"'\"'\"'",
]
# taki checks its own options only. The scene checks their values.
WORDS = [word for hard in HARD for word in (b"--set", hard)]
WORDS += [b"--set=- a", b"-o", b"\xff\xfe {{#}}.png", b"front"]


def run(*command, code=0):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100)
    text = done.stdout.decode(errors="replace")
    assert done.returncode == code, f"{command}: exit code {done.returncode}, expected {code}\n{text}"
    return text


def program(folder, text):
    path = folder / "ta ki"
    path.write_text(text.replace("TAKI", f"'{TAKI}'"))
    path.chmod(0o755)
    return str(path)


def template(folder, taki, options, batch):
    path = folder / "job.yaml"
    run(TAKI, "farm", "openjd", "--output", str(path), "--taki", taki, *options, "--", *batch)
    run(OPENJD, "check", str(path))
    return path


def batch(folder, frames):
    pattern = f"{folder}/o'f $HOME.####.png"
    return ["front", "--size", "24x16", "--engine", "cpu", "--frames", frames, "-o", pattern]


def case(root, name, fault, shards, frames, retries, code, change=lambda job: None):
    folder = root / name
    (folder / "out").mkdir(parents=True)
    (folder / "fault").write_text(fault)
    path = template(
        folder,
        program(folder, FAULTY),
        ["--shards", str(shards), "--retries", str(retries), "--time", "2", "--cpus", "1", "--memory", "100"],
        batch("out", frames),
    )
    job = yaml.safe_load(path.read_text())
    change(job)
    path.write_text(yaml.safe_dump(job))
    text = run(OPENJD, "run", str(path), "--step", "Render", code=code)
    runs = {s: len(f.read_text().split()) for s in range(shards) if (f := folder / f"runs.{s}").exists()}
    return folder, text, runs


def pictures(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


with tempfile.TemporaryDirectory() as temporary:
    root = pathlib.Path(temporary)
    alone = root / "alone"
    alone.mkdir()
    run(TAKI, "batch", *batch(alone, "0-23"))

    # One shard loses its device once. It runs again, and the farm's frames equal those of the batch.
    folder, text, runs = case(root, "lost", "5 75 1", 8, "0-23", 3, 0)
    assert runs == {shard: 2 if shard == 5 else 1 for shard in range(8)}, (runs, text)
    frames = pictures(folder / "out")
    assert len(frames) == 24 and frames == pictures(alone), sorted(frames)

    # Bad input is not tried again. The task has its exit code.
    folder, text, runs = case(root, "bad", "0 65 9", 1, "0-0", 3, 1)
    assert runs == {0: 1}, runs
    assert "exited with code: 65 " in text and "openjd_fail: taki ended with exit code 65" in text, text

    # A temporary fault is not tried for ever.
    folder, text, runs = case(root, "always", "0 137 9", 1, "0-0", 1, 1)
    assert runs == {0: 2}, runs
    assert "exited with code: 137 " in text, text

    # A cancelled or overdue task stops its program with SIGTERM, and does not start it again.
    def soon(job):
        job["steps"][0]["script"]["actions"]["onRun"]["timeout"] = 2

    folder, text, runs = case(root, "overdue", "0 143 9", 1, "0-0", 3, 1, soon)
    assert runs == {0: 1} and "stopped" in text and "exited with code: 143 " in text, (runs, text)

    # YAML, the format strings and bash leave every word unchanged.
    folder = root / "words"
    folder.mkdir()
    path = template(folder, program(folder, ECHO), ["--shards", "1"], WORDS)
    run(OPENJD, "run", str(path), "--step", "Render")
    words = (folder / "words").read_bytes().split(b"\0")[:-1]
    assert words == [b"batch", b"--shard", b"0/1", *WORDS], words

    # The check must be able to fail.
    job = yaml.safe_load(path.read_text())
    for change in [{"unknown": 1}, {"specificationVersion": "jobtemplate-1999-01"}, {"steps": []}]:
        path.write_text(yaml.safe_dump({**job, **change}))
        run(OPENJD, "check", str(path), code=1)

print("openjd.py: ok")
