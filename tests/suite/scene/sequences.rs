//! Volumes that read another file for each frame: which file, where its cells stand, and every slip.

use glam::{DAffine3, DVec3};
use taki::grid::{Grid, write_vdb};
use taki::scene::{Animation, Limits};
use taki::util::monitor::Unwatched;

use super::meshes::{Folder, PLACE};

/// Bounds of the matter in each file, index of the first voxel and number of voxels, as of rising smoke.
const FILES: [([i32; 3], [u32; 3]); 3] =
    [([-3, 0, 1], [4, 3, 5]), ([-4, -1, 0], [7, 9, 6]), ([-7, 2, -2], [11, 14, 9])];
/// Number of the first file.
const FIRST: i32 = 7;

fn to_world() -> DAffine3 {
    let turn = glam::DQuat::from_rotation_z(0.3);
    DAffine3::from_scale_rotation_translation(DVec3::splat(0.125), turn, DVec3::new(0.5, -1.0, 2.0))
}

/// A folder with a sequence, of which the file before the first is empty.
fn folder() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("sim")).expect("a folder");
    let write = |number: i32, grid: Grid| {
        write_vdb(&folder.path(&format!("sim/smoke.{number:04}.vdb")), &[grid]).expect("a file");
    };
    for ((first, size), number) in FILES.into_iter().zip(FIRST..) {
        let count = size.iter().product::<u32>() as usize;
        write(number, Grid::from_dense("density", 1, first, size, vec![0.5; count], to_world()));
    }
    write(FIRST - 1, Grid::from_dense("density", 1, [0; 3], [0; 3], Vec::new(), to_world()));
    folder
}

fn text(own: &str, of_box: &str, more: &str) -> String {
    format!(
        "{PLACE}{more}[volumes.s]\nbuilder = \"flow\"\nsource = \"sim/smoke.####.vdb\"\n{own}[boxes.b]\n\
         volume = \"s\"\n{of_box}"
    )
}

fn animation(folder: &Folder, text: &str, sets: &[&str]) -> taki::Result<Animation> {
    folder.write("s.toml", text);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Animation::load(&folder.path("s.toml"), &sets, &Limits::default())
}

#[test]
fn every_frame_reads_its_own_file_in_the_place_that_it_had() {
    let folder = folder();
    let animation = animation(&folder, &text("frame = 7\n", "", ""), &[]).expect("an animation");
    for (frame, (first, size)) in FILES.into_iter().enumerate() {
        let scene = animation.at(frame as i32).expect("a scene");
        let recipe = &scene.recipes[0];
        let name = format!("smoke.{:04}.vdb", FIRST + frame as i32);
        assert!(recipe.file.as_ref().is_some_and(|file| file.ends_with(&name)), "{:?}", recipe.file);
        // One cell for each voxel, around its sample in the world.
        assert_eq!(recipe.water.size, size);
        let low = to_world().transform_point3(DVec3::from_array(first.map(f64::from)) - 0.5);
        assert!(scene.boxes[0].world_from_texture.translation.distance(low) < 1e-12, "frame {frame}");
        // The printed scene is that of the frame.
        let again = folder.scene(&scene.to_toml(), &[]);
        assert_eq!((&again.recipes, &again.boxes), (&scene.recipes, &scene.boxes));
    }
}

#[test]
fn larger_cells_keep_their_places_from_file_to_file() {
    let folder = folder();
    let animation = animation(&folder, &text("frame = 7\nvoxels = 3\n", "", ""), &[]).expect("an animation");
    let mut masses = Vec::new();
    for (frame, (first, size)) in FILES.into_iter().enumerate() {
        let scene = animation.at(frame as i32).expect("a scene");
        let place = scene.boxes[0].world_from_texture;
        let cells = scene.recipes[0].water.size.map(f64::from);
        // A corner of a cell lies half a voxel below an index that 3 divides, and an edge has 3 voxels.
        let corner = to_world().inverse().transform_point3(place.translation) + 0.5;
        let end = to_world().inverse().transform_point3(place.transform_point3(DVec3::ONE)) + 0.5;
        for a in 0..3 {
            assert!((corner[a] / 3.0 - (corner[a] / 3.0).round()).abs() < 1e-9, "{corner}");
            assert!((end[a] - corner[a] - 3.0 * cells[a]).abs() < 1e-9, "{end} {cells:?}");
            assert!(corner[a] <= f64::from(first[a]) + 1e-9);
            assert!(end[a] >= f64::from(first[a]) + f64::from(size[a]) - 1e-9);
            assert!(end[a] - corner[a] < f64::from(size[a]) + 5.0);
        }
        let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
        let mass: f64 = volume.cells.iter().map(|cell| f64::from(cell.rho() * volume.alpha)).sum();
        masses.push(27.0 * mass / (0.5 * f64::from(size.iter().product::<u32>())));
    }
    // ρ is exact to α/131070.
    assert!(masses.iter().all(|share| (share - 1.0).abs() < 1e-4), "{masses:?}");
}

#[test]
fn finer_cells_keep_their_size_and_places_from_file_to_file() {
    let folder = folder();
    for (edge, fine) in [(1, 3), (2, 3), (4, 2)] {
        let own = format!("frame = 7\nvoxels = {edge}\nfine = {fine}\n");
        let animation = animation(&folder, &text(&own, "", ""), &[]).expect("an animation");
        let mut masses = Vec::new();
        for (frame, (first, size)) in FILES.into_iter().enumerate() {
            let scene = animation.at(frame as i32).expect("a scene");
            let place = scene.boxes[0].world_from_texture;
            let cells = scene.recipes[0].water.size;
            // An edge has edge/fine voxels in every file, and the first corner is a multiple of it.
            let corner = to_world().inverse().transform_point3(place.translation) + 0.5;
            let end = to_world().inverse().transform_point3(place.transform_point3(DVec3::ONE)) + 0.5;
            let cell = f64::from(edge) / f64::from(fine);
            for a in 0..3 {
                assert!((end[a] - corner[a] - cell * f64::from(cells[a])).abs() < 1e-9, "{end} {cells:?}");
                assert!((corner[a] / cell - (corner[a] / cell).round()).abs() < 1e-9, "{corner}");
                assert!(corner[a] <= f64::from(first[a]) + 1e-9);
                assert!(end[a] >= f64::from(first[a]) + f64::from(size[a]) - 1e-9);
            }
            let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
            assert_eq!(volume.size, cells);
            let mass: f64 = volume.cells.iter().map(|cell| f64::from(cell.rho() * volume.alpha)).sum();
            masses.push(cell.powi(3) * mass / (0.5 * f64::from(size.iter().product::<u32>())));
        }
        assert!(masses.iter().all(|share| (share - 1.0).abs() < 1e-4), "{masses:?}");
    }
}

#[test]
fn a_file_without_matter_is_an_empty_frame_of_a_sequence_alone() {
    let folder = folder();
    let scene = folder.scene(&text("frame = 6\n", "", ""), &[]);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    assert_eq!((volume.size, volume.cell(0, 0, 0).has_direction()), ([1; 3], false));
    let single = text("", "", "").replace("####", "0006");
    let said = format!("{:?}", folder.load(&single, &[]).expect_err("refused"));
    assert!(said.contains("no active samples"), "{said}");
}

#[test]
fn a_track_or_a_loop_chooses_the_files() {
    let folder = folder();
    let number = |animation: &Animation, frame: i32| {
        let scene = animation.at(frame).expect("a scene");
        let file = scene.recipes[0].file.clone().expect("a file");
        let stem = file.file_stem().expect("a name").to_string_lossy().into_owned();
        stem.rsplit('.').next().expect("a number").parse::<i32>().expect("a number")
    };
    let track = "[[animate.tracks]]\nkey = \"volumes.s.frame\"\nframes = [0, 4]\nvalues = [9, 7]\n";
    let tracked = animation(&folder, &text("", "", track), &[]).expect("an animation");
    assert_eq!([0, 1, 2, 4, 9].map(|frame| number(&tracked, frame)), [9, 9, 8, 7, 7]);
    tracked.check_files(&[0, 4]).expect("all there");
    let looped = animation(&folder, &text("frame = 7\n", "", "[animate]\nloop = 3\n"), &[]).expect("a loop");
    assert_eq!([0, 1, 2, 3, -1].map(|frame| number(&looped, frame)), [7, 8, 9, 7, 9]);
    looped.check_files(&[0, 300, -2]).expect("all there");
}

#[test]
fn other_notations_count_and_a_file_of_that_name_stays_a_single_one() {
    let folder = folder();
    for name in ["smoke.%04d.vdb", "smoke.$F4.vdb", "smoke.@@@@.vdb", "smoke.####.vdb"] {
        let scene = folder.scene(&text("frame = 8\n", "", "").replace("smoke.####.vdb", name), &[]);
        assert!(scene.recipes[0].file.as_ref().is_some_and(|file| file.ends_with("smoke.0008.vdb")));
    }
    std::fs::copy(folder.path("sim/smoke.0009.vdb"), folder.path("sim/take#2.vdb")).expect("copied");
    let own = text("", "position = [1.0, 2.0, 3.0]\n", "").replace("smoke.####", "take#2");
    let animation = animation(&folder, &own, &[]).expect("an animation");
    let scene = animation.at(1).expect("a scene");
    assert!(scene.recipes[0].file.as_ref().is_some_and(|file| file.ends_with("take#2.vdb")));
    assert!(!scene.recipes[0].is_sequence);
}

#[test]
fn a_sequence_beside_a_file_given_by_hand_is_still_one() {
    let folder = folder();
    let other = format!("volume.file={}", folder.path("v.npz").display());
    // The volume `water` is not shown, so its file need not exist.
    let animation = animation(&folder, &text("frame = 7\n", "", ""), &[&other]).expect("an animation");
    let scene = animation.at(2).expect("a scene");
    assert!(scene.recipes[0].file.as_ref().is_some_and(|file| file.ends_with("smoke.0009.vdb")));
    animation.check_files(&[0, 1, 2]).expect("all there");
    #[cfg(unix)]
    {
        let outside = tempfile::NamedTempFile::new().expect("a file");
        std::os::unix::fs::symlink(outside.path(), folder.path("sim/smoke.0010.vdb")).expect("a link");
        let said =
            format!("{:?}", folder.load(&text("frame = 7\n", "", ""), &[&other]).expect_err("refused"));
        assert!(said.contains("leads out of the scene's folder"), "{said}");
    }
}

#[test]
fn every_slip_is_told_with_the_way_out() {
    let folder = folder();
    let fault = |text: &str, words: &[&str]| {
        let said = format!("{:?}", folder.load(text, &[]).expect_err("refused"));
        words.iter().for_each(|word| assert!(said.contains(word), "{said}: no {word:?}"));
    };
    fault(&text("", "", ""), &["smoke.0000.vdb", "set volumes.s.frame to the number of a file"]);
    for own in ["position = [1.0, 2.0, 3.0]\n", "size = [1.0, 2.0, 3.0]\n", "turn = [0, 90, 0]\n"] {
        let key = format!("boxes.b.{}", own.split(' ').next().expect("a key"));
        fault(&text("frame = 7\n", own, ""), &[&key, "is a sequence", "leave"]);
    }
    let many = folder.path("sim/many.vdb");
    write_vdb(&many, &[Grid::from_dense("density", 1, [0; 3], [65, 1, 1], vec![1.0; 65], to_world())])
        .expect("a file");
    let fine = text("fine = 64\n", "", "").replace("smoke.####", "many");
    fault(
        &fine,
        &["4160 cells along a side", "at most 4096", "lower volumes.s.fine", "raise volumes.s.voxels"],
    );
    let scene = folder.scene(&text("frame = 7\n", "", ""), &[]);
    let without = |key: &str| taki::scene::without_effect(scene.values().expect("its values"), key);
    assert_eq!(without("volumes.s.frame"), None);
    let single = folder.scene(&text("frame = 7\n", "", "").replace("####", "0007"), &[]);
    let without = taki::scene::without_effect(single.values().expect("its values"), "volumes.s.frame");
    assert!(without.is_some_and(|why| why.contains("volumes.s.source has no ####")));
    let animation = animation(&folder, &text("frame = 7\n", "", ""), &[]).expect("an animation");
    let said = animation.check_files(&(0..40).collect::<Vec<_>>()).expect_err("missing").to_string();
    for word in ["37 of 40 files are missing: sim/smoke.0010.vdb, sim/smoke.0011.vdb", "…", "volumes.s.frame"]
    {
        assert!(said.contains(word), "{said}: no {word:?}");
    }
}
