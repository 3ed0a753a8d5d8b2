//! Runs that are killed, stopped or out of disk space: no file is torn, no finished picture is lost, and the
//! next run renders the rest to the same bytes. With `TAKI_LONG` in the environment (`tests/run --long`) each
//! test repeats more often.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{batch, counts, files, folder};
use crate::cli::faults::{run, taki, wait};

const FRAMES: [&str; 7] = ["--frames", "0-7", "-o", "f.####.png", "-o", "f.####.exr", "--stale=1"];

fn long() -> bool {
    std::env::var_os("TAKI_LONG").is_some()
}

/// Files that an uninterrupted run makes.
fn expected() -> BTreeMap<String, Vec<u8>> {
    let dir = folder();
    run(&mut batch(dir.path(), FRAMES)).done();
    let made = files(dir.path());
    assert_eq!(made.len(), 16);
    made
}

/// Asserts that every file with a final name is complete.
fn none_is_torn(folder: &Path, expected: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in files(folder) {
        if !name.starts_with('.') {
            assert!(
                expected[&name] == bytes,
                "{name} has {} bytes of {}",
                bytes.len(),
                expected[&name].len()
            );
        }
    }
}

#[test]
fn killed_at_any_moment_nothing_is_torn_or_lost_and_the_next_run_completes() {
    let expected = expected();
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let start = Instant::now();
    run(&mut batch(folder().path(), FRAMES)).done();
    let whole = start.elapsed();
    let mut kept_some = 0;
    for kill in 0..if long() { 200 } else { 10 } {
        let dir = folder();
        let mut child =
            batch(dir.path(), FRAMES).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(whole.mul_f64(random.random_range(0.0..1.1)));
        child.kill().unwrap();
        wait(&mut child);
        none_is_torn(dir.path(), &expected);
        let finished = (0..8).filter(|f| {
            ["png", "exr"].iter().all(|kind| dir.path().join(format!("f.{f:04}.{kind}")).exists())
        });
        let finished = finished.count() as u64;
        kept_some += u64::from(finished > 0 && finished < 8);
        let next = run(batch(dir.path(), FRAMES).args(super::EVENTS));
        assert_eq!(counts(&next)[..3], [8, finished, 8 - finished], "kill {kill}: {next:?}");
        assert!(files(dir.path()) == expected, "kill {kill}: {:?}", files(dir.path()).keys());
    }
    assert!(kept_some > 0, "no kill fell into the work");
}

#[test]
fn a_signal_ends_the_run_with_its_code_and_the_next_run_goes_on() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let dir = folder();
        // Enough samples that the signal arrives during the work.
        let slow = || {
            let mut command = with_hangup("--default-signal=HUP", &taki(["batch", "front", "--engine=cpu"]));
            command.args(["--size=32x32", "--samples=4096", "--frames", "0-7", "-o", "f.####.png"]);
            command.arg("--events=json").current_dir(dir.path());
            command
        };
        let mut child = slow().stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let begun = Instant::now();
        while !dir.path().join("f.0000.png").exists() {
            assert!(begun.elapsed() < Duration::from_secs(60), "no picture");
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(wait(&mut child), Some(code));
        let left: Vec<String> = files(dir.path()).into_keys().collect();
        assert!(left.iter().all(|name| !name.starts_with('.')), "{left:?}");
        assert!(!left.is_empty() && left.len() < 8, "{left:?}");
        let mut said = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
        assert!(said.contains("run the same command again to continue"), "{said}");
        let next = run(&mut slow());
        assert_eq!(counts(&next)[..3], [8, left.len() as u64, 8 - left.len() as u64]);
    }
}

/// A command with an option of `env` for the signal SIGHUP, which the tests' own parent may ignore.
fn with_hangup(option: &str, command: &Command) -> Command {
    let mut with = Command::new("env");
    with.arg(option).arg(command.get_program()).args(command.get_args());
    with
}

#[test]
fn a_run_that_is_to_outlive_its_terminal_does() {
    let dir = folder();
    let command = taki(["batch", "front", "--engine=cpu", "--size=32x32", "--samples=4096"]);
    let mut command = with_hangup("--ignore-signal=HUP", &command);
    command.args(["--frames", "0-2", "-o", "f.####.png"]).current_dir(dir.path());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !dir.path().join("f.0000.png").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no picture");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-HUP", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(wait(&mut child), Some(0));
    assert_eq!(files(dir.path()).len(), 3);
}

#[test]
fn a_movie_alone_that_is_stopped_does_not_claim_that_it_continues() {
    let dir = folder();
    let mut command = taki(["batch", "front", "--engine=cpu", "--size=32x32", "--samples=512"]);
    command.args(["--frames", "0-7", "-o", "f.gif", "--events=json"]).current_dir(dir.path());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let events = std::io::BufReader::new(child.stdout.take().unwrap());
    let mut lines = std::io::BufRead::lines(events).map(Result::unwrap);
    assert!(lines.any(|line| line.contains("\"saved\"")), "no picture");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    lines.for_each(drop);
    assert_eq!(wait(&mut child), Some(130));
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
    assert!(said.contains("begins anew") && said.contains("-o NAME.####.png"), "{said}");
    assert!(!said.contains("to continue"), "{said}");
}

#[test]
fn workers_that_share_a_folder_make_every_picture_once_even_if_some_are_killed() {
    let arguments = ["--frames", "0-39", "-o", "f.####.png", "--events", "json", "--stale", "2"];
    let alone = folder();
    run(&mut batch(alone.path(), arguments)).done();
    let expected = files(alone.path());
    for round in 0..if long() { 20 } else { 2 } {
        let dir = folder();
        let start =
            || batch(dir.path(), arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut workers: Vec<_> = (0..4).map(|_| start()).collect();
        while fs::read_dir(dir.path()).unwrap().count() < 10 + round % 10 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let mut killed = 0;
        for victim in [1, 2] {
            workers[victim].kill().unwrap();
            killed += usize::from(wait(&mut workers[victim]).is_none());
        }
        let mut saved = Vec::new();
        for (i, mut worker) in workers.into_iter().enumerate() {
            let mut out = String::new();
            std::io::Read::read_to_string(&mut worker.stdout.take().unwrap(), &mut out).unwrap();
            let code = wait(&mut worker);
            assert!(code == Some(0) || (i == 1 || i == 2), "worker {i}: {code:?}");
            for line in out.lines() {
                // The last line of a killed worker may be cut off.
                let Ok(event) = serde_json::from_str::<serde_json::Value>(line) else { continue };
                if event["event"] == "saved" {
                    saved.push(event["frame"].as_u64().unwrap());
                }
            }
        }
        assert!(files(dir.path()) == expected, "{:?}", files(dir.path()).keys());
        let total = saved.len();
        saved.sort_unstable();
        saved.dedup();
        assert_eq!(total, saved.len(), "a picture was made twice");
        assert!(saved.len() <= 40 && saved.len() >= 40 - killed, "{} told as saved", saved.len());
    }
}

#[test]
fn a_claim_of_another_machine_is_taken_over_when_it_is_not_touched() {
    let dir = folder();
    let claim = |n: u32| dir.path().join(format!(".f.000{n}.png.taki-claim-0"));
    let elsewhere = r#"{"host":"far","machine":"00000000","pid":7,"started":1}"#;
    let arguments = ["--frames", "0-2", "-o", "f.####.png", "--events", "json", "--stale", "1.5"];
    fs::write(claim(1), elsewhere).unwrap();
    let target = xxhash_rust::xxh3::xxh3_64(b"f.0001.png");
    fs::write(dir.path().join(format!(".taki-abc.00000000-7.{target:016x}.tmp")), "half").unwrap();
    let begun = Instant::now();
    let ended = run(&mut batch(dir.path(), arguments));
    assert_eq!(counts(&ended), [3, 0, 3, 0, 0]);
    assert!(begun.elapsed() >= Duration::from_millis(1500), "taken over at once");
    assert!(ended.stdout().contains("process 7 on far"), "{}", ended.stdout());
    assert_eq!(files(dir.path()).len(), 3, "{:?}", files(dir.path()).keys());

    // A claim that is touched is not taken over: the run waits for its work.
    fs::remove_file(dir.path().join("f.0001.png")).unwrap();
    fs::write(claim(1), elsewhere).unwrap();
    let mut child = batch(dir.path(), arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(4) {
        let touched = fs::File::options().write(true).open(claim(1)).unwrap();
        touched.set_modified(std::time::SystemTime::now()).unwrap();
        std::thread::sleep(Duration::from_millis(100));
        assert!(child.try_wait().unwrap().is_none(), "it did not wait");
    }
    assert!(!dir.path().join("f.0001.png").exists());
    child.kill().unwrap();
    wait(&mut child);
}

#[test]
fn what_is_no_claim_in_a_claims_place_does_not_stop_the_work_for_long() {
    let dir = folder();
    fs::create_dir(dir.path().join(".f.0000.png.taki-claim-0")).unwrap();
    fs::write(dir.path().join(".f.0001.png.taki-claim-0"), "").unwrap();
    let ended =
        run(&mut batch(dir.path(), ["--frames", "0-2", "-o", "f.####.png", "--stale=1", "--events=json"]));
    assert_eq!(counts(&ended), [3, 0, 3, 0, 0]);
    // A shard without pictures of its own has nothing to do, and that is no error.
    let none = ["--frames", "0-2", "-o", "g.####.exr", "--shard", "5/8", "--layers", "rgb", "--events=json"];
    assert_eq!(counts(&run(&mut batch(dir.path(), none))), [0; 5]);
}

/// Runs a command under strace, which makes the `when`-th call of `call` in every thread fail with "no space
/// left". Returns the exit code, and whether any call failed. Returns `None` where strace cannot trace.
fn without_room(command: &Command, call: &str, when: usize) -> Option<(Option<i32>, bool)> {
    let log = tempfile::NamedTempFile::new().unwrap();
    let mut strace = Command::new("strace");
    strace.args(["-f", "--seccomp-bpf", "-o"]).arg(log.path());
    strace.args(["-e", &format!("trace={call}"), "-e", &format!("inject={call}:error=ENOSPC:when={when}")]);
    strace.arg(command.get_program()).args(command.get_args());
    strace.current_dir(command.get_current_dir().unwrap());
    let ended = run(&mut strace);
    let text = fs::read_to_string(log.path()).unwrap();
    assert!(!ended.stderr().contains("panicked"), "{ended:?}");
    text.contains("exited with").then(|| (ended.exit_code(), text.contains("INJECTED")))
}

#[test]
fn no_room_at_any_write_tears_nothing_and_the_next_run_completes() {
    let arguments = ["--frames", "3", "-o", "f.####.png", "-o", "f.####.exr"];
    let whole = folder();
    run(&mut batch(whole.path(), arguments)).done();
    let expected = files(whole.path());
    let (mut failed, mut places) = (0, 0);
    for call in ["write", "fsync", "rename"] {
        for when in 1.. {
            if !long() && when > 10 {
                break;
            }
            let dir = folder();
            let Some((code, struck)) = without_room(&batch(dir.path(), arguments), call, when) else {
                assert!(std::env::var_os("CI").is_none(), "strace cannot trace here");
                eprintln!("not run: strace cannot trace here");
                return;
            };
            none_is_torn(dir.path(), &expected);
            if !struck {
                break;
            }
            places += 1;
            // The work goes on if the failed write was a line on stderr or the contents of a claim.
            assert!(matches!(code, Some(0 | 74)), "{call} {when}: {code:?}");
            failed += usize::from(code == Some(74));
            run(&mut batch(dir.path(), arguments)).done();
            assert!(files(dir.path()) == expected, "{call} {when}: {:?}", files(dir.path()).keys());
        }
    }
    assert!(failed >= 4 && places >= 7, "{failed} of {places} writes ended the run");
}

/// Memory in KiB, number of threads and number of open files of a process; `None` once it has ended.
fn footprint(pid: u32) -> Option<[u64; 3]> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let field = |name: &str| {
        status.lines().find_map(|l| l.strip_prefix(name))?.split_whitespace().next()?.parse::<u64>().ok()
    };
    let open = fs::read_dir(format!("/proc/{pid}/fd")).ok()?.count() as u64;
    Some([field("VmRSS:")?, field("Threads:")?, open])
}

/// Asserts that memory, threads and open files do not grow between the second and the last quarter of a
/// batch.
fn grows_not(engine: &str, frames: usize) {
    let dir = folder();
    let last = format!("0-{}", frames - 1);
    let mut command =
        taki(["batch", "front", "--size=16x12", "--engine", engine, "-o", "f.####.png", "--frames", &last]);
    command.current_dir(dir.path()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    let mut largest = [[0u64; 3]; 4];
    while child.try_wait().unwrap().is_none() {
        let made = fs::read_dir(dir.path()).unwrap().count();
        if let Some(now) = footprint(child.id()) {
            let slot = &mut largest[(4 * made / frames).min(3)];
            (0..3).for_each(|i| slot[i] = slot[i].max(now[i]));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(wait(&mut child), Some(0));
    let [_, early, _, late] = largest;
    eprintln!("{engine}, {frames} frames: second quarter {early:?}, last {late:?} (KiB, threads, files)");
    assert!(early[0] > 0 && late[0] > 0, "no footprint seen");
    assert!(late[0] <= early[0] + early[0] / 50 + 1024, "memory grew: {early:?} {late:?}");
    // Chance decides which files are open at that moment. Files that are never closed would number hundreds
    // by now.
    assert!(late[1] <= early[1] && late[2] <= early[2] + 8, "threads or files grew: {early:?} {late:?}");
}

#[test]
fn memory_threads_and_files_stay_flat() {
    grows_not("cpu", 2000);
    grows_not("auto", if long() { 2000 } else { 400 });
}

/// A process that has ended and is not waited for, and what its claims hold.
fn dead_owner() -> (std::process::Child, String) {
    let zombie = Command::new("true").spawn().unwrap();
    std::thread::sleep(Duration::from_millis(200));
    let machine = &taki::output::frame::Owner::me().machine;
    let owner = format!(r#"{{"host":"here","machine":"{machine}","pid":{},"started":0}}"#, zombie.id());
    (zombie, owner)
}

#[test]
fn a_claim_of_a_process_that_has_ended_is_taken_over_at_once_even_if_nobody_buried_it() {
    let dir = folder();
    let (mut zombie, owner) = dead_owner();
    fs::write(dir.path().join(".f.0000.png.taki-claim-0"), owner).unwrap();
    let ended = run(&mut batch(dir.path(), ["--frames", "0-1", "-o", "f.####.png", "--events=json"]));
    assert_eq!(counts(&ended), [2, 0, 2, 0, 0]);
    assert!(!ended.stdout().contains("waiting"), "{}", ended.stdout());
    assert_eq!(files(dir.path()).len(), 2);
    zombie.wait().unwrap();
}

#[test]
fn a_claim_that_a_killed_process_left_on_a_finished_picture_is_gone_at_the_end() {
    let dir = folder();
    let (mut zombie, owner) = dead_owner();
    let mut command = taki(["batch", "front", "--engine=cpu", "--size=32x32", "--samples=4096"]);
    command.args(["--frames", "0-2", "-o", "f.####.png", "--events=json"]).current_dir(dir.path());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let events = std::io::BufReader::new(child.stdout.take().unwrap());
    let mut lines = std::io::BufRead::lines(events).map(Result::unwrap);
    assert!(lines.any(|line| line.contains("\"saved\"")), "no picture");
    fs::write(dir.path().join(".f.0000.png.taki-claim-0"), owner).unwrap();
    assert!(lines.any(|line| line.contains("\"saved\"")), "the run had ended before the claim was there");
    lines.for_each(drop);
    assert_eq!(wait(&mut child), Some(0));
    assert_eq!(files(dir.path()).into_keys().collect::<Vec<_>>(), ["f.0000.png", "f.0001.png", "f.0002.png"]);
    zombie.wait().unwrap();
}
