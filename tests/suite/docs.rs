//! Checks that README.md and the pages under docs/ are true: the generated tables match the code, and the
//! files, links, commands and options that they name exist.
//!
//! `TAKI_BLESS=1 tests/run docs` rewrites the generated tables.

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
        assert_eq!(&text[from..to], parameters_markdown(), "TAKI_BLESS=1 tests/run docs writes it anew");
    }
}

/// Path from the root and text of the README, the pages beside it, and the pages of `docs/`.
fn pages() -> Vec<(String, String)> {
    let mut names =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "assets/README.md"].map(String::from).to_vec();
    let docs =
        std::fs::read_dir(path("docs")).expect("docs/").map(|entry| entry.expect("an entry").file_name());
    let docs = docs.map(|name| name.into_string().expect("UTF-8")).filter(|name| name.ends_with(".md"));
    names.extend(docs.map(|name| format!("docs/{name}")));
    names.sort();
    let read = |name: &String| std::fs::read_to_string(path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    names.iter().map(|name| (name.clone(), read(name))).collect()
}

/// Text of the user documentation: the README and the pages of `docs/`.
fn documentation() -> String {
    let told = |name: &str| name == "README.md" || name.starts_with("docs/");
    pages().into_iter().filter(|(name, _)| told(name)).map(|(_, text)| text + "\n").collect()
}

/// Splits a page into the lines outside blocks of code and the lines that begin or end such a block.
fn prose_and_fences(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (mut prose, mut fences, mut code) = (Vec::new(), Vec::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fences.push(line.trim_start());
            code = !code;
        } else if !code {
            prose.push(line);
        }
    }
    assert!(!code, "a block of code has no end");
    (prose, fences)
}

/// Every text between `start` and `end`.
fn between<'a>(text: &'a str, start: &'a str, end: char) -> impl Iterator<Item = &'a str> {
    text.split(start).skip(1).map(move |rest| rest.split(end).next().unwrap_or(""))
}

/// Targets of a page's links and pictures.
fn targets(text: &str) -> Vec<String> {
    let prose = prose_and_fences(text).0.join("\n");
    // Text between backticks is not a link.
    let prose: String = prose.split('`').step_by(2).collect();
    between(&prose, "](", ')').chain(between(&prose, "src=\"", '"')).map(String::from).collect()
}

/// Anchors of a page's headings, as GitHub and rustdoc make them.
fn anchors(text: &str) -> Vec<String> {
    let mut anchors: Vec<String> = Vec::new();
    for line in prose_and_fences(text).0 {
        let title = line.trim_start_matches('#');
        if title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        let kept = title.trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let before = anchors.iter().filter(|a| **a == anchor).count();
        anchors.push(if before == 0 { anchor } else { format!("{anchor}-{before}") });
    }
    anchors
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

/// Every text between backticks in the descriptions of parameters and groups.
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
fn the_readme_is_a_front_door() {
    let text = readme();
    assert!(text.lines().count() <= 200, "{} lines", text.lines().count());
    assert!(text.len() <= 15_000, "{} bytes", text.len());
}

#[test]
fn every_link_leads_to_a_file_and_every_anchor_to_a_heading() {
    let pages = pages();
    let mut links = 0;
    for (name, text) in &pages {
        let folder = std::path::Path::new(name).parent().expect("a folder");
        for target in targets(text) {
            if target.contains("://") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let full = path(&folder.join(file).to_string_lossy());
            assert!(file.is_empty() || std::path::Path::new(&full).exists(), "{name}: {target}");
            if !anchor.is_empty() {
                let page = if file.is_empty() {
                    text.clone()
                } else {
                    std::fs::read_to_string(&full).expect("a page")
                };
                assert!(anchors(&page).iter().any(|a| a == anchor), "{name}: {target} is no heading");
            }
            links += 1;
        }
    }
    assert!(links > 40, "{links} links");
}

/// Paths between backticks. Commands and patterns are left out, because they contain other characters too.
fn named_paths(text: &str) -> Vec<&str> {
    let roots = ["src/", "shaders/", "tests/", "assets/", "docs/", "examples/", "findings/"];
    let is_path = |quoted: &&str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        roots.iter().any(|root| quoted.starts_with(root)) && quoted.chars().all(plain)
    };
    let lines = prose_and_fences(text).0.into_iter();
    lines.flat_map(|line| line.split('`').skip(1).step_by(2)).filter(is_path).collect()
}

#[test]
fn every_path_that_a_page_names_exists() {
    let pages = pages();
    let named: Vec<(&str, &str)> = pages
        .iter()
        .flat_map(|(name, text)| named_paths(text).into_iter().map(move |p| (name.as_str(), p)))
        .collect();
    assert!(named.len() > 40, "{named:?}");
    let missing = named.into_iter().filter(|(_, there)| !std::path::Path::new(&path(there)).exists());
    assert_eq!(missing.collect::<Vec<_>>(), []);
}

#[test]
fn links_anchors_paths_and_options_are_found() {
    let page = concat!(
        "# One: two\n[a](b.md#c) `[d](e)` ![f](g.png)\n```text\n[h](i)\n# No\n```\n",
        "<img src=\"j.png\">\n## 1. One\n## 1. One\n"
    );
    assert_eq!(targets(page), ["b.md#c", "g.png", "j.png"]);
    assert_eq!(anchors(page), ["one-two", "1-one", "1-one-1"]);
    assert_eq!(
        named_paths("`src/a.rs` src/b.rs `tests/` `-o docs/c`\n```text\n`src/d.rs`\n```\n"),
        ["src/a.rs", "tests/"]
    );
    assert!(names_option("`--size WxH`", "--size") && !names_option("`--sizes`", "--size"));
}

#[test]
fn every_page_of_the_docs_is_linked_from_the_readme_and_begins_with_its_purpose() {
    let linked = targets(&readme());
    for (name, text) in pages().into_iter().filter(|(name, _)| name.starts_with("docs/")) {
        assert!(linked.iter().any(|target| target.split('#').next() == Some(&name)), "{name}");
        let mut lines = text.lines();
        assert!(lines.next().is_some_and(|line| line.starts_with("# ")), "{name}: a title");
        assert_eq!(lines.next(), Some(""), "{name}");
        assert!(lines.next().is_some_and(|line| line.starts_with(char::is_alphabetic)), "{name}: a sentence");
    }
}

/// rustdoc also shows the pages. It takes a block of code as Rust if the block is indented or names no
/// language.
#[test]
fn every_block_of_code_names_its_language() {
    for (name, text) in pages() {
        for fence in prose_and_fences(&text).1.iter().step_by(2) {
            assert!(fence.len() > 3, "{name}: {fence}");
        }
        let lines = prose_and_fences(&text).0;
        let indented = |pair: &&[&str]| pair[0].is_empty() && pair[1].starts_with("    ");
        assert_eq!(lines.windows(2).find(indented), None, "{name}");
    }
}

#[test]
fn every_preset_is_named() {
    let text = documentation();
    for (name, _) in presets() {
        assert!(text.contains(&format!("`{name}`")), "{name}");
    }
}

fn help(command: &[String]) -> String {
    let out = std::process::Command::new(env!("CARGO_BIN_EXE_taki")).args(command).arg("--help").output();
    String::from_utf8(out.expect("help").stdout).expect("UTF-8")
}

/// Every command and its subcommands, as the help lists them.
fn commands(under: &[String]) -> Vec<Vec<String>> {
    let text = help(under);
    let list =
        text.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // Lines that are indented further continue the description.
    let names = list.filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')));
    let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    names
        .flat_map(|name| {
            let command = [under, &[name.to_owned()]].concat();
            let more = commands(&command);
            [vec![command], more].concat()
        })
        .collect()
}

/// Whether the text names an option itself, not just a longer option that begins with it.
fn names_option(text: &str, option: &str) -> bool {
    text.split(option).skip(1).any(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-'))
}

#[test]
fn every_subcommand_and_option_of_the_help_is_in_the_documentation() {
    let text = documentation();
    let commands = commands(&[]);
    assert!(commands.len() > 15, "{commands:?}");
    for command in commands {
        assert!(text.contains(&format!("taki {}", command.join(" "))), "{command:?}");
        for word in help(&command).split_whitespace().filter(|w| w.starts_with("--") && w.len() > 3) {
            let option =
                word.trim_end_matches([',', ';', '.', ')', ':', '`']).split('=').next().unwrap_or("");
            assert!(option == "--help" || names_option(&text, option), "{command:?} {option}");
        }
    }
}

#[test]
fn the_map_of_the_readme_is_that_of_the_crates_front_page() {
    let map = std::fs::read_to_string(path("src/map.md")).expect("the map");
    let text = readme();
    assert_eq!(between(&text, "<!-- map -->\n", '<').next(), Some(map.as_str()));
    let files = map.split('`').skip(1).step_by(2).collect::<Vec<_>>();
    assert!(files.len() > 40, "{files:?}");
    for file in files {
        assert!(std::path::Path::new(&path(file)).exists(), "the map names {file}");
    }
}

/// Paths and texts of the sources, shaders, documentation, tests and examples.
fn lines_of_the_house() -> Vec<(String, String)> {
    let mut folders: Vec<_> =
        ["src", "shaders", "docs", "tests", "examples"].map(|name| path(name).into()).to_vec();
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir::<std::path::PathBuf>(folder).expect("a folder") {
            let at = entry.expect("an entry").path();
            if at.is_dir() {
                folders.push(at);
            } else if at.extension().is_some_and(|e| e == "rs" || e == "wgsl" || e == "md") {
                found.push((at.display().to_string(), std::fs::read_to_string(&at).expect("a text")));
            }
        }
    }
    found
}

#[test]
fn no_line_is_wider_than_110_columns() {
    let allowed = |line: &str| {
        let told = line.trim_start().trim_start_matches(['/', '!', ' ']);
        told.starts_with('|') || line.contains("](") || line.contains("://")
    };
    let files = lines_of_the_house();
    assert!(files.len() > 200, "{} files", files.len());
    let mut wide = Vec::new();
    for (file, text) in &files {
        for (i, line) in
            text.lines().enumerate().filter(|(_, line)| line.chars().count() > 110 && !allowed(line))
        {
            wide.push(format!("{file}:{}: {} columns", i + 1, line.chars().count()));
        }
    }
    assert!(wide.is_empty(), "{}", wide.join("\n"));
}
