//! The tutorial keeps its promise: following docs/tutorial.md gives the scenes and pictures that it shows.

use std::path::PathBuf;

use taki::Unwatched;
use taki::engine::cpu;
use taki::scene::{Limits, Scene};
use toml::{Table, Value};

/// Largest size of a step's picture in bytes.
const MAX_PICTURE_BYTES: u64 = 80 << 10;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn read(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Texts of steps 1 to 8. The last ends before the next heading.
fn steps() -> Vec<String> {
    let page = read("docs/tutorial.md");
    let numbered = |part: &&str| part.starts_with(|c: char| c.is_ascii_digit());
    page.split("\n## ").filter(numbered).map(String::from).collect()
}

/// TOML blocks of a step.
fn blocks(step: &str) -> impl Iterator<Item = &str> {
    step.split("```toml\n").skip(1).map(|rest| rest.split("```").next().expect("a block that ends"))
}

/// Puts every value of `new` into `old`, table by table.
fn merge(old: &mut Table, new: Table) {
    for (key, value) in new {
        match (old.get_mut(&key), value) {
            (Some(Value::Table(old)), Value::Table(new)) => merge(old, new),
            (_, value) => drop(old.insert(key, value)),
        }
    }
}

/// Removes a table named `a.b`, and also `a` if that is then empty.
fn remove(scene: &mut Table, name: &str) {
    match name.split_once('.') {
        None => assert!(scene.remove(name).is_some(), "[{name}] cannot be deleted: it does not exist"),
        Some((outer, inner)) => {
            let table = scene[outer].as_table_mut().expect("a table");
            remove(table, inner);
            if table.is_empty() {
                scene.remove(outer);
            }
        }
    }
}

/// Does what a step says: deletes the tables that its sentence "Delete …" names, then adds its blocks.
fn follow(scene: &mut Table, step: &str) {
    if let Some(rest) = step.split("Delete the tables ").nth(1) {
        let sentence = rest.split(':').next().expect("a sentence");
        for name in sentence.split("`[").skip(1) {
            remove(scene, name.split("]`").next().expect("a name"));
        }
    }
    for block in blocks(step) {
        merge(scene, block.parse().unwrap_or_else(|e| panic!("{e} in\n{block}")));
    }
}

#[test]
fn following_the_page_step_by_step_gives_the_files() {
    let (mut scene, steps) = (Table::new(), steps());
    assert_eq!(steps.len(), 8);
    for (i, step) in (1..).zip(&steps) {
        follow(&mut scene, step);
        let file: Table = read(&format!("docs/tutorial/{i}.toml")).parse().expect("TOML");
        assert_eq!(scene, file, "step {i}");
    }
}

#[test]
fn a_line_that_the_page_forgets_is_noticed() {
    let mut scene = Table::new();
    follow(&mut scene, &steps()[0].replace("v0 = 2.2\n", ""));
    let file: Table = read("docs/tutorial/1.toml").parse().expect("TOML");
    assert_ne!(scene, file);
}

#[test]
fn every_step_renders_water_in_light() {
    for i in 1..=8 {
        let file = path(&format!("docs/tutorial/{i}.toml"));
        let load = |sets: &[String]| {
            Scene::load(&file, sets, &Limits::default()).unwrap_or_else(|e| panic!("step {i}: {e}"))
        };
        let rocks = load(&[]).values().expect("as written").names("rocks").into_iter();
        let mut sets: Vec<String> = rocks.map(|rock| format!("rocks.{rock}.levels=4")).collect();
        // For so few pixels, walking to the lights from each is quicker than filling light volumes.
        let small = ["image.width=64", "image.height=36", "image.samples=1", "light.visibility=march"];
        sets.extend(small.map(String::from));
        let scene = load(&sets);
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let frame = cpu::render(&scene, &volume, &scene.mesh(), false, &Unwatched).expect("a frame");
        assert_eq!(frame.non_finite_pixels(), 0, "step {i}");
        assert!(frame.covered_pixels() > 64 * 36 / 25, "step {i}: the water covers almost nothing");
        assert!(frame.picture.iter().any(|p| p[..3].iter().all(|&x| x > 150)), "step {i} is dark");
    }
}

#[test]
fn every_step_shows_its_picture_and_every_link_leads_somewhere() {
    for (i, step) in (1..).zip(steps()) {
        let picture = format!("assets/images/tutorial/{i}.jpg");
        assert!(step.contains(&format!("](../{picture})")), "step {i} shows {picture}");
        let bytes = std::fs::metadata(path(&picture)).expect("a picture").len();
        assert!(bytes <= MAX_PICTURE_BYTES, "{picture}: {bytes} bytes");
    }
    let page = read("docs/tutorial.md");
    for part in page.split("](").skip(1) {
        let target = part.split([')', '#']).next().unwrap_or("");
        assert!(path("docs").join(target).exists(), "{target}");
    }
}
