//! The README says what is so: its tables come from the code, its files and links exist.
//!
//! `TAKI_BLESS=1 tests/run readme` writes the generated parts anew.

use taki::scene::{markdown_table, presets};

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    std::fs::read_to_string(path("README.md")).expect("a README")
}

#[test]
fn the_parameter_table_is_the_codes_own() {
    let text = readme();
    let (start, end) = ("<!-- parameters -->\n", "<!-- /parameters -->");
    let from = text.find(start).expect("a marker") + start.len();
    let to = text.find(end).expect("a marker");
    if std::env::var_os("TAKI_BLESS").is_some() {
        let new = format!("{}{}{}", &text[..from], markdown_table(), &text[to..]);
        std::fs::write(path("README.md"), new).expect("written");
    } else {
        assert_eq!(&text[from..to], markdown_table(), "TAKI_BLESS=1 tests/run readme writes it anew");
    }
}

#[test]
fn every_linked_file_exists_and_every_preset_is_named() {
    let text = readme();
    let mut links = 0;
    for part in text.split("](").skip(1) {
        let target = part.split(')').next().unwrap_or("");
        if !target.contains("://") && !target.starts_with('#') {
            assert!(std::path::Path::new(&path(target)).exists(), "{target}");
            links += 1;
        }
    }
    assert!(links > 4, "the pictures are links");
    for (name, _) in presets() {
        assert!(text.contains(&format!("`{name}`")), "{name}");
    }
}

#[test]
fn every_subcommand_and_option_of_the_help_is_in_the_readme() {
    let text = readme();
    let help = |args: &[&str]| {
        let out = std::process::Command::new(env!("CARGO_BIN_EXE_taki")).args(args).arg("--help").output();
        String::from_utf8(out.expect("help").stdout).expect("UTF-8")
    };
    let commands = [
        "render",
        "batch",
        "scene",
        "volume",
        "bench",
        "stitch",
        "compare",
        "presets",
        "devices",
        "completions",
        "farm",
    ];
    for command in commands {
        assert!(help(&[]).contains(command) && text.contains(&format!("taki {command}")), "{command}");
    }
    for command in [
        &["render"][..],
        &["batch"],
        &["scene"],
        &["bench"],
        &["stitch"],
        &["compare"],
        &["volume", "build"],
        &["volume", "info"],
        &["farm", "slurm"],
        &["farm", "openjd"],
        &["farm", "kubernetes"],
    ] {
        for option in help(command).split_whitespace().filter(|w| w.starts_with("--") && w.len() > 3) {
            let option =
                option.trim_end_matches([',', ';', '.', ')', ':', '`']).split('=').next().unwrap_or("");
            assert!(option == "--help" || text.contains(option), "{command:?} {option}");
        }
    }
}
