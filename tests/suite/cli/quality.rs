//! `--quality`: what each word sets, and what wins over it.

use super::faults::{run, taki};
use tempfile::tempdir;

#[test]
fn a_quality_sets_what_it_says_and_settings_win_over_it() {
    let dir = tempdir().unwrap();
    let said = |more: &[&str]| {
        let command = ["render", "front", "--engine", "cpu", "--size", "16x12", "-o", "a.png", "--overwrite"];
        let run = run(taki(command).args(["--json"]).args(more).current_dir(&dir));
        let report: serde_json::Value = serde_json::from_str(run.done()).unwrap();
        assert_eq!(run.lines("taki: warning"), [""; 0], "{more:?}");
        let again = super::faults::run(taki(["scene", "a.png"]).current_dir(&dir));
        (run.lines("taki: quality").concat(), report["samples"].as_u64(), again.done().to_owned())
    };
    let (line, samples, scene) = said(&["--quality", "draft"]);
    assert_eq!(samples, Some(1));
    for part in ["draft", "image.samples=1", "image.filter=box", "trace.lookup=nearest", "trace.layers=2"] {
        assert!(line.contains(part), "{line}");
    }
    assert!(scene.contains("filter = \"pyramid\"") && scene.contains("layers = 2"), "{scene}");
    let (line, samples, scene) =
        said(&["--quality", "final", "--samples", "3", "--set", "lookup=nearest", "--set", "trace.layers=5"]);
    assert_eq!(samples, Some(3));
    assert_eq!(line, "taki: quality final: image.filter=blackman-harris, trace.filter=pyramid");
    assert!(scene.contains("lookup = \"nearest\"") && scene.contains("layers = 5"), "{scene}");
    let (line, samples, _) = said(&[]);
    assert_eq!((line.as_str(), samples), ("", Some(1)));
}

#[test]
fn a_batch_takes_a_quality_too_and_an_unknown_word_is_refused() {
    let batch = |word: &str| {
        run(&mut taki(["batch", "front", "--frames", "0", "-o", "x.##.png", "--dry-run", "--quality", word]))
    };
    let preview = batch("preview");
    preview.done();
    assert!(preview.lines("taki: quality preview: image.samples=4").len() == 1, "{preview:?}");
    let unknown = batch("best");
    assert_eq!(unknown.exit_code(), Some(2), "{unknown:?}");
    assert!(unknown.stderr().contains("possible values: draft, preview, final"), "{unknown:?}");
}
