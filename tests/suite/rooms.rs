//! The modules form rooms in a fixed order: a file imports only from rooms below its own.

use std::path::{Path, PathBuf};

/// The rooms, from the ground up. Rooms on one line must not import each other.
const FLOORS: &[&[&str]] = &[
    &["util"],
    &["curve", "walk", "model", "grid"],
    &["volume"],
    &["mapping"],
    &["trace"],
    &["light"],
    &["picture"],
    &["place"],
    &["output"],
    &["scene"],
    &["engine/options", "engine/overlap", "engine/pool_surface"],
    &["engine/lens"],
    &["engine/cpu", "engine/gpu"],
    &["engine/exposure", "engine/long_walks"],
    &["engine"],
    &["job", "farm"],
    &["viewer"],
    &["cli"],
    &["guide", "lib", "main"],
];

/// Floor and name of the room of a file or module, given as a path below `src/`. The longest room name that
/// matches counts.
fn room(path: &str) -> Option<(usize, &'static str)> {
    let holds =
        |room: &str| path.strip_prefix(room).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let rooms =
        FLOORS.iter().enumerate().flat_map(|(floor, rooms)| rooms.iter().map(move |room| (floor, *room)));
    rooms.filter(|(_, room)| holds(room)).max_by_key(|(_, room)| room.len())
}

/// Paths below `src/` that a file's text names: each path after `crate::`, and each name of a group
/// separately.
fn named(text: &str) -> Vec<String> {
    let code: String =
        text.lines().filter(|l| !l.trim_start().starts_with("//")).flat_map(|l| [l, "\n"]).collect();
    let mut paths = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(rest.len());
        let path = rest[..end].trim_end_matches(':').replace("::", "/");
        match rest[end..].strip_prefix('{') {
            Some(group) if end == 0 || rest[..end].ends_with("::") => {
                let group = group.split('}').next().unwrap_or("");
                let names = group.split(',').map(|name| format!("{path}/{}", name.trim().replace("::", "/")));
                paths.extend(names.map(|path| path.trim_start_matches('/').to_owned()));
            }
            _ => paths.push(path),
        }
    }
    paths
}

/// Imports of a file that lead up, or to another room on the same floor.
fn upward(file: &str, text: &str) -> Vec<String> {
    let Some((floor, own)) = room(file) else { panic!("src/{file}.rs is in no room: add it to FLOORS") };
    let mut faults = Vec::new();
    for path in named(text) {
        // Every room may use items of the crate's root.
        let Some((other, name)) = room(&path) else { continue };
        if name != own && other >= floor {
            faults.push(format!(
                "src/{file}.rs imports {path} of src/{name}, which does not stand below src/{own}"
            ));
        }
    }
    faults
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn no_import_runs_upward() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 200, "{} files", files.len());
    let mut faults = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("a source");
        let name = file.strip_prefix(&root).expect("below src").with_extension("");
        let name = name.to_str().expect("UTF-8").replace('\\', "/");
        faults.extend(upward(name.strip_suffix("/mod").unwrap_or(&name), &text));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn an_import_that_runs_upward_is_seen_however_it_is_written() {
    assert_eq!(upward("volume/cell", "use crate::scene::Scene;").len(), 1);
    assert_eq!(upward("volume/cell", "use crate::{curve::CurveShape, walk};").len(), 0);
    assert_eq!(upward("curve", "use crate::{walk::Walk, util::random::Stream};").len(), 1);
    assert_eq!(upward("engine/cpu/mod", "fn f() { crate::engine::gpu::adapters() }").len(), 1);
    assert_eq!(upward("engine/gpu/mod", "use crate::engine::{RenderOptions, cpu};").len(), 2);
    assert_eq!(upward("light/fibre", "// as crate::scene does it\nuse crate::trace::Trace;").len(), 0);
}

#[test]
fn the_viewers_parts_know_one_another_only_downward() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/viewer");
    let mut files = Vec::new();
    sources(&root, &mut files);
    for file in files {
        let name = file.strip_prefix(&root).expect("below").with_extension("");
        let name = name.to_str().expect("UTF-8").replace('\\', "/");
        let text = std::fs::read_to_string(&file).expect("a source");
        let first = name.split('/').next().unwrap_or("");
        if ["app", "drive", "mod"].contains(&first) {
            continue;
        }
        for above in ["app", "drive"] {
            assert!(
                !text.contains(&format!("viewer::{above}")),
                "src/viewer/{name}.rs imports viewer/{above}"
            );
            assert!(
                !text.contains(&format!("super::{above}")),
                "src/viewer/{name}.rs imports viewer/{above}"
            );
        }
    }
}
