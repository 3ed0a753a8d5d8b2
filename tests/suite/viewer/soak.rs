//! Hours of use in seconds: many changes without pause must not make memory grow.

use std::process::Command;

use super::*;
use rand::{RngExt, SeedableRng};
use taki::picture::Layer;
use taki::scene::{Kind, Param};

const CHANGES: usize = 2_000;
/// After this number of changes, everything that is kept has its final size: buffers, textures, most of the
/// undo steps.
const WARM: usize = 500;
/// Allowed growth. Undo steps still grow, and the allocator keeps memory at its discretion. A leaked picture
/// or volume per change would be ten times this. The test compares the largest values, because the renderer
/// may hold the targets of a large picture at one moment and those of a small one at another.
const MAX_GROWTH_MIB: f64 = 60.0;
const ALONE: &str = "TAKI_TEST_SOAK_ALONE";

fn resident_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// A value for a key that is quick to render.
fn some(rng: &mut rand_pcg::Pcg64Mcg, param: &Param) -> Option<Raw> {
    Some(match param.kind {
        Kind::Float(min, max, _) => {
            let (low, high) = param.slider.unwrap_or((min, max));
            // Some ranges, such as that of kelvins, begin above the limit for other values.
            let most = if low < 1e3 { high.min(1e3) } else { high };
            Raw::Float(rng.random_range(low.max(-1e3)..=most))
        }
        Kind::Int(_, i64::MAX, _) => Raw::Int(rng.random_range(0..1_000_000)),
        Kind::Int(min, max, _) => Raw::Int(rng.random_range(min..=max.min(12))),
        Kind::Choice(words) => Raw::Text(words[rng.random_range(0..words.len())].into()),
        Kind::Switch(_) => Raw::Switch(rng.random_bool(0.5)),
        Kind::Color(_) => Raw::List((0..3).map(|_| Raw::Float(rng.random_range(0.0..2.0))).collect()),
        Kind::Point(_) => Raw::List((0..3).map(|_| Raw::Float(rng.random_range(-8.0..8.0))).collect()),
        Kind::Text(_) | Kind::Corners | Kind::Frames | Kind::Series => return None,
    })
}

fn soak() {
    let mut window = Setup { size: [260.0, 220.0], ..Setup::bare() }.open();
    let mut keys = window.viewer().document().scene().keys();
    // The memory of light volumes is a parameter. At its default, the light volumes of lamps that come near a
    // quad would look like a leak. A rock of ten levels takes a hundred MiB on host and device, a rock of
    // seven levels a few.
    keys.retain(|key| key != "light.cache" && !(key.starts_with("rocks.") && key.ends_with(".levels")));
    window.set("light.cache", Raw::Int(8));
    // Large things that are kept exist before the measurement starts: a sky, light volumes, tables.
    for (key, word) in [
        ("environment.kind", "sky"),
        ("light.reflection", "strand"),
        ("light.visibility", "cached"),
        ("light.scattering", "multiple"),
    ] {
        window.set(key, Raw::Text(word.into()));
        window.settle();
    }
    for elevation in [10.0, 20.0, 30.0, 40.0] {
        window.set("sky.elevation", Raw::Float(elevation));
        window.set("strand.roughness_m", Raw::Float(0.01 * elevation));
        window.settle();
    }
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    let (mut warm, mut late): (Option<f64>, Option<f64>) = (None, None);
    for i in 0..CHANGES {
        match rng.random_range(0..20) {
            0 => window.undo(),
            1 => window.redo(),
            2 => {
                let key = keys[rng.random_range(0..keys.len())].clone();
                window.harness.state_mut().document_mut().reset(&[key]);
            }
            3 => {
                let keys = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7];
                window.key(keys[rng.random_range(0..Layer::ALL.len())]);
            }
            4 => {
                let size = [rng.random_range(60.0..300.0), rng.random_range(80.0..260.0)];
                window.harness.set_size(size.into());
            }
            5 => window.key([Key::V, Key::Space, Key::F, Key::Home, Key::T][rng.random_range(0..5)]),
            _ => {
                let key = &keys[rng.random_range(0..keys.len())];
                let param = Param::find(key).expect("a parameter");
                if let Some(raw) = some(&mut rng, param) {
                    window.set(key, raw);
                }
            }
        }
        window.harness.step();
        let now = resident_mib();
        if i <= WARM {
            warm = now.map(|now| warm.map_or(now, |most| most.max(now)));
        } else if i + WARM > CHANGES {
            late = now.map(|now| late.map_or(now, |most| most.max(now)));
        }
    }
    if let (Some(warm), Some(late)) = (warm, late) {
        eprintln!("resident in the first {WARM} changes {warm:.0} MiB, in the last {late:.0} MiB");
        assert!(late - warm <= MAX_GROWTH_MIB, "{warm:.0} MiB became {late:.0} MiB");
    }
    keys.push("light.cache".into());
    window.harness.state_mut().document_mut().reset(&keys);
    window.harness.set_size([300.0, 300.0].into());
    window.harness.run_steps(2);
    let playing = window.harness.query_by_label("Pause the water").is_some();
    if playing {
        window.key(Key::Space);
    }
    window.harness.state_mut().document_mut().reset(&keys);
    window.settle();
    assert!(window.viewer().document().fault().is_none() && !window.viewer().document().is_changed());
    assert_eq!(window.picture().scale, 1);
    assert!(!window.reads("bug"), "the renderer reports no fault");
}

#[test]
fn thousands_of_changes_neither_panic_nor_fill_the_memory() {
    if std::env::var_os(ALONE).is_some() {
        return soak();
    }
    // The test runs in a process of its own, so that it does not measure the memory of other tests.
    let mut alone = Command::new(std::env::current_exe().expect("this program"));
    alone.args(["--exact", "--nocapture", "--test-threads=1"]);
    alone.arg("viewer::soak::thousands_of_changes_neither_panic_nor_fill_the_memory").env(ALONE, "1");
    let out = alone.output().expect("it runs");
    let said = String::from_utf8_lossy(&out.stderr);
    eprintln!("{said}");
    assert!(out.status.success() && !said.contains("panicked"), "{said}");
}
