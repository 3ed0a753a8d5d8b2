//! The cache on disk: it returns exactly what would have been built, whatever happens to its files.

use std::cell::Cell;
use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::{Duration, SystemTime};

use crate::cli::faults;
use taki::place::Mesh;
use taki::scene::{Limits, Scene};
use taki::util::cache::Cache;
use taki::util::monitor::Unwatched;
use taki::volume::{build_water, kept_water};
use tempfile::tempdir;

const ROOMY: u64 = 1 << 20;
const SLOW: Duration = Duration::from_secs(60);

/// Values of a key, and whether they had to be made.
fn get(cache: &Cache, key: &str) -> (Vec<u32>, bool) {
    let made = Cell::new(false);
    let make = || {
        made.set(true);
        Ok::<_, Infallible>(values())
    };
    let Ok(found) = cache.get("things", key, values().len(), make);
    (found, made.get())
}

fn values() -> Vec<u32> {
    (0..40).map(|i| i * 0x0101_0101 + 7).collect()
}

#[test]
fn what_was_slow_to_make_is_found_again_and_what_was_quick_is_not_kept() {
    let dir = tempdir().unwrap();
    let cache = Cache::new(dir.path(), ROOMY);
    assert_eq!(get(&cache, "a"), (values(), true));
    assert_eq!(get(&cache, "a"), (values(), true), "making them took less time than reading would");
    cache.keep_if_slow("things", "a", &values(), SLOW);
    assert_eq!(get(&cache, "a"), (values(), false));
    assert_eq!(get(&cache, "b"), (values(), true), "another key");
    // The limit is 10 ms plus 2 ns per byte: 12.1 ms.
    let mebibyte = vec![0u8; 1 << 20];
    let cache = Cache::new(dir.path(), 1 << 40);
    cache.keep_if_slow("things", "c", &mebibyte, Duration::from_micros(12_000));
    assert!(!cache.path("things", "c").exists());
}

#[test]
fn a_file_with_any_byte_changed_cut_off_or_added_is_as_if_it_were_not_there() {
    let dir = tempdir().unwrap();
    let cache = Cache::new(dir.path(), ROOMY);
    cache.keep_if_slow("things", "a", &values(), SLOW);
    let path = cache.path("things", "a");
    let whole = fs::read(&path).unwrap();
    for at in 0..whole.len() {
        for bit in [1, 0x80] {
            let mut damaged = whole.clone();
            damaged[at] ^= bit;
            fs::write(&path, damaged).unwrap();
            assert_eq!(get(&cache, "a"), (values(), true), "byte {at}");
        }
        fs::write(&path, &whole[..at]).unwrap();
        assert_eq!(get(&cache, "a"), (values(), true), "cut off at {at}");
    }
    fs::write(&path, [&whole[..], b"x"].concat()).unwrap();
    assert_eq!(get(&cache, "a"), (values(), true), "a byte more");
    fs::write(&path, &whole).unwrap();
    assert_eq!(get(&cache, "a"), (values(), false), "the whole file is read");
    // Two names may collide, or somebody may rename a file.
    fs::copy(&path, cache.path("things", "b")).unwrap();
    assert_eq!(get(&cache, "b"), (values(), true), "a whole file of another key");
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    assert_eq!(get(&cache, "a"), (values(), true), "a folder of this name");
}

#[test]
fn a_large_file_is_checked_to_its_end() {
    let dir = tempdir().unwrap();
    let cache = Cache::new(dir.path(), 1 << 30);
    let large: Vec<u32> = (0..300_001u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
    cache.keep_if_slow("things", "a", &large, SLOW);
    assert_eq!(cache.stored("things", "a", large.len()), Some(large.clone()));
    assert_eq!(cache.stored::<u32>("things", "b", large.len()), None, "another key");
    let path = cache.path("things", "a");
    let whole = fs::read(&path).unwrap();
    for at in [whole.len() - 1_200_004, whole.len() / 2, whole.len() - 1] {
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        fs::write(&path, damaged).unwrap();
        assert_eq!(cache.stored::<u32>("things", "a", large.len()), None, "byte {at}");
    }
}

#[test]
fn what_was_used_longest_ago_makes_room() {
    let dir = tempdir().unwrap();
    let one = {
        let cache = Cache::new(dir.path().join("measured"), ROOMY);
        cache.keep_if_slow("things", "0", &values(), SLOW);
        fs::metadata(cache.path("things", "0")).unwrap().len()
    };
    let cache = Cache::new(dir.path(), 3 * one);
    for (age, key) in [(40, "0"), (30, "1"), (20, "2")] {
        cache.keep_if_slow("things", key, &values(), SLOW);
        let file = fs::File::options().write(true).open(cache.path("things", key)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
    }
    let stale = dir.path().join("things/dead.tmp");
    fs::write(&stale, "left").unwrap();
    let file = fs::File::options().write(true).open(&stale).unwrap();
    file.set_modified(SystemTime::now() - Duration::from_secs(7200)).unwrap();
    fs::write(dir.path().join("things/readme.txt"), "somebody's own").unwrap();

    assert!(!get(&cache, "0").1, "used again");
    cache.keep_if_slow("things", "3", &values(), SLOW);
    let there = ["0", "1", "2", "3"].map(|key| cache.path("things", key).exists());
    assert_eq!(there, [true, false, true, true]);
    assert!(!stale.exists() && dir.path().join("things/readme.txt").exists());
    // Values larger than the whole cache do not evict the others.
    cache.keep_if_slow("things", "large", &vec![1u32; one as usize], SLOW);
    let there = ["0", "2", "3", "large"].map(|key| cache.path("things", key).exists());
    assert_eq!(there, [true, true, true, false]);
}

#[test]
fn a_folder_that_cannot_be_used_is_as_good_as_none() {
    let dir = tempdir().unwrap();
    fs::write(dir.path().join("file"), "").unwrap();
    for root in [Path::new("/proc/taki"), &dir.path().join("file"), &dir.path().join("file/below")] {
        let cache = Cache::new(root, ROOMY);
        cache.keep_if_slow("things", "a", &values(), SLOW);
        assert_eq!(get(&cache, "a"), (values(), true), "{}", root.display());
    }
}

#[test]
fn many_at_once_all_get_the_values() {
    let dir = tempdir().unwrap();
    let cache = &Cache::new(dir.path(), ROOMY);
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(move || {
                for i in 0..50 {
                    cache.keep_if_slow("things", "a", &values(), SLOW);
                    assert_eq!(get(cache, "a").0, values(), "{i}");
                }
            });
        }
    });
    assert_eq!(fs::read_dir(dir.path().join("things")).unwrap().count(), 1, "no temporary files");
}

#[test]
fn volumes_and_meshes_of_the_cache_are_those_that_are_made_whatever_changed() {
    let dir = tempdir().unwrap();
    let cache = Cache::new(dir.path(), 64 << 20).keeping_all();
    let base = ["volume.nx=16", "volume.ny=16", "volume.nz=8", "curves.across=5", "curves.deep=3"];
    let place = [
        "rocks.wall.levels=3",
        "rocks.bed.levels=2",
        "rocks.left.levels=2",
        "rocks.hills.levels=2",
        "rocks.boulder_a.levels=2",
        "rocks.boulder_b.levels=2",
        "rocks.boulder_c.levels=2",
        // A field would take most of the time.
        "pools.plunge.waves=sum",
    ];
    let changes = [
        &[][..],
        &["volume.alpha=0.5"],
        &["volume.seed=8"],
        &["volume.ny=8", "volume.nx=32"],
        &["curves.across=3", "curves.deep=5"],
        &["curves.h=1.1"],
        &["curves.breathe=0.2"],
        &["volume.crest=0.1"],
        &["volume.k_d=0.25"],
        &["rocks.wall.seed=2"],
        &["rocks.wall.color=[0.2,0.1,0.1]"],
        &["rocks.bed.wet_reach=0.3"],
        &["lights.sun.direction=[1,1,1]"],
        &["sheets.main.widths=[1,1,1,1,1,1]"],
        &["pools.plunge.foam=0.1"],
    ];
    // The occlusion of the rocks would take nearly all of the time.
    let rocks = ["wall", "bed", "left", "right", "far_right", "boulder_a", "boulder_b", "boulder_c"];
    let open = rocks.map(|rock| format!("rocks.{rock}.occlusion=0"));
    // Each change runs twice: it is made first and found the second time.
    for sets in changes.iter().chain(&changes) {
        let sets = base.iter().chain(&place).chain(*sets).map(|s| s.to_string()).chain(open.clone());
        let sets: Vec<String> = sets.collect();
        let scene = Scene::load(Path::new("waterfall"), &sets, &Limits::default()).expect("valid");
        let made = build_water(&scene.recipes[0].water, &Unwatched).expect("built");
        assert!(kept_water(&scene.recipes[0].water, &cache, &Unwatched).expect("found") == made, "{sets:?}");
        assert!(scene.cached_mesh(Some(&cache)) == scene.mesh(), "{sets:?}");
    }
    let files = |kind| fs::read_dir(dir.path().join(kind)).unwrap().count();
    // α is not stored in the cells. The last six changes leave the volume as it is, the first nine the mesh.
    // Beside each mesh lies the shade on its water.
    assert_eq!((files("volumes"), files("meshes")), (8, 14));
}

/// Command that renders a scene with a mesh that is slow to make, with its caches in the folder `cache`.
fn render(cache: &Path, output: &Path, more: &[&str]) -> std::process::Command {
    let mut taki =
        faults::taki(["render", "waterfall", "--size", "32x18", "--samples", "1", "--engine", "cpu"]);
    taki.args(["--set", "volume.ny=64", "-o"]).arg(output).args(more).env("XDG_CACHE_HOME", cache);
    taki
}

fn done(out: Output) {
    let words = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success() && !words.contains("warning"), "{words}");
}

#[test]
fn renders_with_a_new_a_used_a_damaged_and_no_cache_make_the_same_file() {
    let dir = tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    done(render(&at("cache"), &at("plain.png"), &["--no-cache"]).output().unwrap());
    assert!(!at("cache").exists(), "--no-cache leaves nothing");
    // Two processes start at once and find nothing in the cache.
    let both = ["one.png", "two.png"].map(|name| render(&at("cache"), &at(name), &[]).spawn().unwrap());
    both.into_iter().for_each(|child| done(child.wait_with_output().unwrap()));
    let mesh = fs::read_dir(at("cache/taki/meshes")).unwrap().next().expect("a mesh is kept").unwrap().path();
    done(render(&at("cache"), &at("three.png"), &[]).output().unwrap());
    let mut bytes = fs::read(&mesh).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&mesh, bytes).unwrap();
    done(render(&at("cache"), &at("four.png"), &[]).output().unwrap());
    // A file lies where the folder should be.
    fs::write(at("file"), "").unwrap();
    done(render(&at("file"), &at("five.png"), &[]).output().unwrap());
    let plain = fs::read(at("plain.png")).unwrap();
    for name in ["one.png", "two.png", "three.png", "four.png", "five.png"] {
        assert!(fs::read(at(name)).unwrap() == plain, "{name}");
    }
}

/// Compares checksums of a volume with everything that its spec can hold, and of a mesh of rock and pools.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
#[test]
fn the_versions_of_the_builders_stand_for_what_they_make() {
    let scene = |name: &str, sets: &[&str]| Scene::preset(name).unwrap().with(sets).unwrap();
    let water = scene(
        "waterfall",
        &[
            "volume.nx=24",
            "volume.ny=20",
            "volume.nz=12",
            "volume.coherence=0.5",
            "volume.coverage=0.5",
            "curves.bundles=13",
            "curves.radius=0.034",
            "curves.wander=0.08",
            "curves.loose=0.22",
            "trace.lookup=nearest",
        ],
    );
    let volume = build_water(&water.recipes[0].water, &Unwatched).unwrap();
    let mesh = |sets: &[&str]| {
        let place = scene("waterfall", &[&crate::engine::gpu::COARSE_PLACE, sets].concat());
        place.mesh()
    };
    let vertices = |mesh: &Mesh| crc32fast::hash(bytemuck::cast_slice(&mesh.vertices));
    // Without the shadow of the water, and with it.
    let sun = "lights.sun.direction=[0.3,1,0.55]";
    let plain = vertices(&mesh(&["light.occlusion=0", "light.shadow=0", sun]));
    let shaded = mesh(&[]);
    let on_water = crc32fast::hash(bytemuck::cast_slice(&shaded.on_water));
    let made = format!("{:08x} {plain:08x} {:08x} {on_water:08x}", volume.checksum(), vertices(&shaded));
    let versions =
        [taki::volume::BUILDER_VERSION, taki::place::BUILDER_VERSION, taki::place::WATER_SHADE_VERSION];
    // Without a new version, a new checksum would leave users with their old volumes, meshes and shades.
    assert_eq!((versions, made.as_str()), ([1, 2, 1], "b972003d 0c471220 6367ebd5 8e539acd"));
}
