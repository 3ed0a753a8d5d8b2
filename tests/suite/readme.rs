//! The README and docs/parameters.md say what is so: tables come from the code, files and links exist.
//!
//! `TAKI_BLESS=1 tests/run readme` writes the generated parts anew.

use taki::scene::{GROUPS, Kind, PARAMS, Param, parameters_markdown, presets};

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    std::fs::read_to_string(path("README.md")).expect("a README")
}

#[test]
fn the_parameter_table_is_the_codes_own() {
    let name = path("docs/parameters.md");
    let text = std::fs::read_to_string(&name).expect("docs/parameters.md");
    let (start, end) = ("<!-- parameters -->\n", "<!-- /parameters -->");
    let from = text.find(start).expect("a marker") + start.len();
    let to = text.find(end).expect("a marker");
    if std::env::var_os("TAKI_BLESS").is_some() {
        let new = format!("{}{}{}", &text[..from], parameters_markdown(), &text[to..]);
        std::fs::write(name, new).expect("written");
    } else {
        assert_eq!(&text[from..to], parameters_markdown(), "TAKI_BLESS=1 tests/run readme writes it anew");
    }
}

#[test]
fn parameters_are_told_in_whole_sentences_that_fit_a_table() {
    for param in PARAMS {
        for words in [param.doc, param.when] {
            let key = param.key;
            assert!(words.starts_with(|c: char| c.is_uppercase() || c == 'Ψ'), "{key}: {words}");
            assert!(words.ends_with('.') && !words.contains(['|', '\n']), "{key}: {words}");
            assert!(!words.contains("  ") && words.matches('`').count() % 2 == 0, "{key}: {words}");
        }
    }
}

/// What stands between backticks, of every parameter and group.
fn quoted() -> Vec<&'static str> {
    let words = PARAMS.iter().flat_map(|p| [p.doc, p.when]).chain(GROUPS.iter().map(|g| g.about));
    words.flat_map(|words| words.split('`').skip(1).step_by(2)).collect()
}

#[test]
fn keys_and_choices_that_the_parameters_words_name_exist() {
    let mut named = 0;
    for quoted in quoted().into_iter().filter(|quoted| quoted.contains('.')) {
        let (key, value) = quoted.split_once('=').unwrap_or((quoted, ""));
        let param = PARAMS.iter().find(|p| p.key == key).or(Param::find(key));
        let Some(param) = param else { panic!("{quoted} names no parameter") };
        if let (Kind::Choice(choices), false) = (param.kind, value.is_empty()) {
            assert!(choices.contains(&value), "{quoted}");
        }
        named += 1;
    }
    assert!(named > 40, "{named}");
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
