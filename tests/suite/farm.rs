//! Job files: their words survive bash, YAML and the job engines. The scripts in `tests/farm` run the files
//! on the engines themselves.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::cli::faults::{run, taki};
use proptest::prelude::*;
use taki::farm::{Job, bash_word, kubernetes, openjd, slurm};
use taki::util::error::Error;

fn job(batch: Vec<OsString>) -> Job {
    Job {
        name: "fall".into(),
        taki: "taki".into(),
        shards: 8,
        retries: 3,
        minutes: None,
        cpus: None,
        memory: None,
        gpus: None,
        batch,
    }
}

fn words(texts: &[&str]) -> Vec<OsString> {
    texts.iter().map(OsString::from).collect()
}

fn cluster() -> kubernetes::Options {
    kubernetes::Options { image: "taki".into(), claim: "scenes".into(), mount: "/work".into() }
}

/// Words that bash reads from the end of `command`.
fn read_by_bash(command: &str) -> Vec<OsString> {
    let script = format!("printf '%s\\0' {command}");
    let out = Command::new("bash").args(["--norc", "-c", &script]).output().expect("bash");
    assert!(out.status.success(), "{script}: {}", String::from_utf8_lossy(&out.stderr));
    let mut words: Vec<OsString> =
        out.stdout.split(|&b| b == 0).map(|w| OsString::from_vec(w.into())).collect();
    assert_eq!(words.pop().as_deref(), Some(OsStr::new("")), "each word ends with NUL");
    words
}

/// Bytes that are difficult for a shell and for YAML, often beside arbitrary others.
fn word() -> impl Strategy<Value = OsString> {
    let hard = prop::sample::select(b" '\"\\$`!{}\n\r\t#&*-:~[]()<>|;%=\x1b\x7f\xff\xc2\x85".to_vec());
    let byte = prop_oneof![3 => hard, 1 => 1..=255u8];
    prop::collection::vec(byte, 0..12).prop_map(OsString::from_vec)
}

/// Text that is difficult for YAML.
fn text() -> impl Strategy<Value = String> {
    let hard = prop::sample::select(
        " '\"\\$(){}\n\r\t#&*-:~[]|>,?!%@`=0x1enoyf.滝\u{85}\u{2028}\u{feff}\u{ffff}\u{1b}"
            .chars()
            .collect::<Vec<_>>(),
    );
    let letter = prop_oneof![4 => hard, 1 => any::<char>().prop_filter("no NUL", |&c| c != '\0')];
    prop::collection::vec(letter, 0..12).prop_map(|letters| letters.into_iter().collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_words_go_through_bash_as_they_are(words in prop::collection::vec(word(), 1..20)) {
        let quoted: Vec<String> = words.iter().map(|w| bash_word(w).expect("no NUL")).collect();
        for word in &quoted {
            let plain = !word.contains("{{") && !word.contains("}}") && !word.contains(char::is_control);
            prop_assert!(plain, "{word:?}");
        }
        prop_assert_eq!(read_by_bash(&quoted.join(" ")), words);
    }

    #[test]
    fn any_words_go_through_a_job_template_as_they_are(words in prop::collection::vec(word(), 1..20)) {
        let text = openjd::template(&job(words.clone())).expect("a template");
        let template: serde_json::Value = serde_saphyr::from_str(&text).expect("YAML");
        let script = template["steps"][0]["script"]["embeddedFiles"][0]["data"].as_str().expect("text");
        let start = "\"$program\" batch --shard \"$shard/8\"";
        let line = script.lines().find_map(|l| l.trim().strip_prefix(start)).expect("a command");
        prop_assert_eq!(read_by_bash(line.strip_suffix(" &").expect("in the background")), words);
    }

    #[test]
    fn any_text_goes_through_a_manifest_as_it_is(texts in prop::collection::vec(text(), 1..20)) {
        let job = job(texts.iter().map(OsString::from).collect());
        let manifest = kubernetes::manifest(&job, &cluster()).expect("a manifest");
        let manifest: serde_json::Value = serde_saphyr::from_str(&manifest).expect("YAML");
        let container = &manifest["spec"]["template"]["spec"]["containers"][0];
        let command = container["command"].as_array().expect("a list");
        let shown: Vec<String> =
            command.iter().map(|w| w.as_str().expect("text").replace("$$", "$")).collect();
        prop_assert_eq!(&shown[..4], ["taki", "batch", "--shard", "$(JOB_COMPLETION_INDEX)/8"]);
        prop_assert_eq!(&shown[4..], texts);
    }
}

#[test]
fn options_are_in_the_job_files_and_only_if_given() {
    let plain = job(words(&["fig5", "--frames", "0-9"]));
    let full = Job {
        minutes: Some(90),
        cpus: Some(4),
        memory: Some(2000),
        gpus: Some(1),
        retries: 7,
        taki: "/opt/my taki".into(),
        ..plain.clone()
    };
    let options = slurm::Options { partition: Some("gpu,spare".into()) };
    let script = |job| slurm::script(job, &options).expect("a script");
    for line in [
        "#SBATCH --array=0-7\n",
        "#SBATCH --partition=gpu,spare\n",
        "#SBATCH --cpus-per-task=4\n",
        "#SBATCH --gres=gpu:1\n",
        "#SBATCH --mem=2000M\n",
        "#SBATCH --time=90\n",
        "-lt 7 ]",
        "\n'/opt/my taki' batch --shard \"$SLURM_ARRAY_TASK_ID/8\" fig5 --frames 0-9 &\n",
    ] {
        assert!(script(&full).contains(line), "{line}");
    }
    for word in ["cpus-per-task=", "gres", "--mem", "--time"] {
        assert!(!script(&plain).contains(word), "{word}");
    }
    let yaml = |text: String| -> serde_json::Value { serde_saphyr::from_str(&text).expect("YAML") };
    let template = |job| yaml(openjd::template(job).expect("a template"));
    let step = &template(&full)["steps"][0];
    assert_eq!(step["script"]["actions"]["onRun"]["timeout"], 5400);
    assert_eq!(step["hostRequirements"]["amounts"].as_array().map(Vec::len), Some(3));
    assert_eq!(template(&full)["parameterDefinitions"][1]["default"], "/opt/my taki");
    assert!(template(&plain)["steps"][0].get("hostRequirements").is_none());
    let spec = |job| yaml(kubernetes::manifest(job, &cluster()).expect("a manifest"))["spec"].clone();
    assert_eq!(spec(&full)["backoffLimitPerIndex"], 7);
    assert_eq!(spec(&full)["template"]["spec"]["activeDeadlineSeconds"], 5400);
    let limits = serde_json::json!({ "cpu": "4", "memory": "2000Mi", "nvidia.com/gpu": "1" });
    assert_eq!(spec(&full)["template"]["spec"]["containers"][0]["resources"]["limits"], limits);
    assert!(spec(&plain)["template"]["spec"]["containers"][0].get("resources").is_none());
}

#[test]
fn what_no_engine_could_run_is_refused() {
    let good = job(words(&["fig5"]));
    let refused = |result: taki::Result<String>, word: &str| match result {
        Err(e @ Error::Usage(_)) => assert!(e.to_string().contains(word), "{e}"),
        other => panic!("{word}: {other:?}"),
    };
    let plain = slurm::Options::default();
    for shard in [&["--shard", "0/8"][..], &["--shard=0/8"]] {
        refused(slurm::script(&job(words(shard)), &plain), "--shard");
    }
    refused(openjd::template(&Job { shards: 0, ..good.clone() }), "--shards 1");
    for name in ["", "-x", "a b", "a\nb", "a$b", &"x".repeat(51)] {
        refused(slurm::script(&Job { name: name.into(), ..good.clone() }, &plain), "a name has");
    }
    refused(kubernetes::manifest(&Job { name: "Fall_v2".into(), ..good.clone() }, &cluster()), "lower-case");
    for partition in ["", "a b", "a\n#SBATCH --x", "$(id)"] {
        let options = slurm::Options { partition: Some(partition.into()) };
        refused(slurm::script(&good, &options), "--partition");
    }
    for mount in ["work", "", "/a:b"] {
        let options = kubernetes::Options { mount: mount.into(), ..cluster() };
        refused(kubernetes::manifest(&good, &options), "--mount");
    }
    let stray = OsString::from_vec(vec![b'a', 0xff]);
    refused(kubernetes::manifest(&job(vec![stray.clone()]), &cluster()), "UTF-8");
    refused(openjd::template(&Job { taki: stray, ..good.clone() }), "UTF-8");
    refused(openjd::template(&Job { taki: "a\nb".into(), ..good }), "--taki");
    refused(slurm::script(&job(words(&["a\0b"])), &plain), "NUL");
}

#[test]
fn a_job_file_goes_to_stdout_or_replaces_a_job_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("fall.sbatch");
    let batch = ["--", "front", "--frames", "0-1", "-o", "a b.####.png"];
    let slurm = || taki(["farm", "slurm", "--shards", "2"]);
    let text = run(slurm().args(batch)).done().to_owned();
    assert!(text.starts_with("#!/bin/bash\n") && text.contains("'a b.####.png'"), "{text}");
    let write = |more: &[&str]| run(slurm().arg("-o").arg(&file).args(more).args(batch));
    for other in ["old", "#!/bin/bash\nrm -r build\n"] {
        fs::write(&file, other).unwrap();
        write(&[]).refused(73, &["fall.sbatch", "no job file", "--overwrite"]);
        assert_eq!(fs::read_to_string(&file).unwrap(), other);
    }
    assert_eq!(write(&["--overwrite"]).done(), "");
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
    assert_eq!(write(&["--name", "again"]).done(), "");
    assert!(fs::read_to_string(&file).unwrap().contains("again"));
    run(slurm().arg("-o").arg(folder.path().join("none/x")).args(batch)).refused(73, &["none/x"]);
}

#[test]
fn arguments_that_batch_would_not_take_are_refused_before_the_nodes_do() {
    let slurm = |batch: &[&str]| run(taki(["farm", "slurm", "--"]).args(batch));
    slurm(&["front", "--shard", "0/2"]).refused(2, &["--shard"]);
    slurm(&["front", "--fram", "0-9"]).refused(2, &["taki batch", "--fram"]);
    slurm(&["front", "--frames", "9-0"]).refused(2, &["9-0"]);
    slurm(&["--help"]).refused(2, &["help"]);
    slurm(&["front", "-o", "fall.####.exr", "-o", "fall.mp4"]).refused(2, &["fall.mp4", "without --shard"]);
    slurm(&["front", "--sheet", "all.png"]).refused(2, &["all.png", "without --shard"]);
    slurm(&["front", "--manifest", "all.csv"]).refused(2, &["all.csv", "without --shard"]);
    slurm(&["front", "-o", "fall.png"]).refused(2, &["fall.png", "without --shard"]);
    slurm(&["front", "-o", "fall.####.exr", "-o", "fall.####.PNG"]).done();
    slurm(&["front", "--sweep", "h=1,2", "-o", "{h}.png"]).done();
}

/// Reports that the tools of a test are missing. In continuous integration (CI set) that fails the test.
fn absent(test: &str, why: &str) {
    assert!(std::env::var("CI").is_err(), "continuous integration needs the tools of {test}: {why}");
    eprintln!("{test}: not run: {why}");
}

/// Runs a test of `tests/farm` with the program. Exit code 77 means that its tools are missing.
fn on_the_engine(test: &str, interpreter: &Path) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/farm").join(test);
    // The script has time limits of its own; this one covers what they miss.
    let mut command = Command::new("timeout");
    command.args(["--kill-after=20", "400"]).arg(interpreter).arg(script).arg(env!("CARGO_BIN_EXE_taki"));
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    let out = command.output().expect("timeout, of coreutils");
    let text = String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned();
    match out.status.code() {
        Some(0) => {}
        Some(77) => absent(test, text.trim()),
        code => panic!("{test}: {code:?}\n{text}"),
    }
}

/// A Python with the packages of `tests/farm/requirements.txt`, installed once for each version of that list.
fn python(test: &str) -> Option<PathBuf> {
    static MAKING: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _one = MAKING.lock().unwrap_or_else(|e| e.into_inner());
    let list = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/farm/requirements.txt");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("farm-python");
    let (python, made) = (folder.join("bin/python"), folder.join("requirements.txt"));
    if fs::read(&made).ok() == fs::read(&list).ok() {
        return Some(python);
    }
    let steps = [
        Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).output(),
        Command::new(&python).args(["-m", "pip", "install", "--quiet", "--requirement"]).arg(&list).output(),
    ];
    for step in steps {
        let why = match step {
            Ok(out) if out.status.success() => continue,
            Ok(out) => String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).trim().to_owned(),
            Err(e) => format!("python3: {e}"),
        };
        absent(test, &why);
        return None;
    }
    fs::copy(&list, &made).expect("a copy of the list");
    Some(python)
}

#[test]
fn slurm_runs_the_shards_and_requeues_what_may_pass() {
    on_the_engine("slurm.sh", Path::new("bash"));
}

#[test]
fn open_job_description_checks_and_runs_the_template() {
    if let Some(python) = python("openjd.py") {
        on_the_engine("openjd.py", &python);
    }
}

#[test]
fn the_manifest_is_valid_by_the_schemas_of_kubernetes() {
    if let Some(python) = python("kubernetes.py") {
        on_the_engine("kubernetes.py", &python);
    }
}
