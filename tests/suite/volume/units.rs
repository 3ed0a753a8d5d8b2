//! Units and axes of files of simulations: level sets in voxels, velocities, z up, and a place that the file
//! does not tell.

use glam::{DAffine3, DVec3};
use taki::grid::{Class, Grid, write_vdb};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, LevelSetUnit, Up, VolumeTexture};

use crate::scene::meshes::{Folder, PLACE};

/// Samples along each axis.
const SIDE: u32 = 24;

/// Edge of a voxel, metres.
const EDGE: f64 = 0.05;

/// A grid of the values of a function of the indices.
fn grid<const N: usize>(name: &str, of: impl Fn(DVec3) -> [f64; N]) -> Grid {
    let side = SIDE as i32;
    let index = |i: i32| DVec3::new((i % side).into(), (i / side % side).into(), (i / side / side).into());
    let values = (0..side.pow(3)).flat_map(|i| of(index(i)).map(|x| x as f32)).collect();
    let place = DAffine3::from_scale(DVec3::splat(EDGE));
    Grid::from_dense(name, N, [0; 3], [SIDE; 3], values, place)
}

/// Distance from a sphere, in voxels.
fn sphere(at: DVec3) -> f64 {
    (at - DVec3::new(11.2, 12.7, 11.9)).length() - 7.3
}

/// Writes a level set of a sphere and a velocity that turns, its distances times `unit`.
fn write(folder: &Folder, name: &str, unit: f64) {
    // As Blender has it: cut above, 0 as the background, and all samples active.
    let mut phi = grid("phi", |at| [sphere(at).min(5.0) * unit]);
    phi.class = Class::LevelSet;
    let mut velocity = grid("velocity", |at| [at.y - 12.0, 11.0 - at.x, 0.3]);
    velocity.class = Class::Staggered;
    write_vdb(&folder.path(name), &[phi, velocity]).expect("written");
}

fn scene(folder: &Folder, file: &str, keys: &str) -> Scene {
    let text = format!(
        "{PLACE}[volumes.s]\nbuilder = \"flow\"\nsource = {file:?}\ngrid = \"phi\"\n{keys}[boxes.b]\n\
         volume = \"s\"\n"
    );
    folder.scene(&text, &[])
}

fn build(scene: &Scene) -> VolumeTexture {
    scene.volume(1 << 28, &Unwatched).expect("a volume")
}

fn cells(volume: &VolumeTexture) -> Vec<Cell> {
    volume.cells.iter().copied().collect()
}

/// Largest difference of ρ between two volumes.
fn apart(one: &VolumeTexture, other: &VolumeTexture) -> f32 {
    let pairs = one.cells.iter().zip(other.cells.iter());
    pairs.map(|(a, b)| (a.rho() * one.alpha - b.rho() * other.alpha).abs()).fold(0.0, f32::max)
}

#[test]
fn the_unit_of_a_level_set_is_found_or_said() {
    let folder = Folder::new();
    write(&folder, "voxels.vdb", 1.0);
    write(&folder, "metres.vdb", EDGE);
    let of = |file: &str, keys: &str| build(&scene(&folder, file, keys));
    let truth = of("metres.vdb", "level_set_unit = \"metres\"\n");
    // Water inside, a share of a voxel at the surface, air outside.
    let rho = |x, y, z| f64::from(truth.cell(x, y, z).rho() * truth.alpha);
    for at in [[12, 12, 12], [4, 12, 12], [3, 12, 12], [18, 13, 12], [11, 5, 12], [0, 0, 0]] {
        let share = (0.5 - sphere(DVec3::from_array(at.map(f64::from)))).clamp(0.0, 1.0);
        assert!((rho(at[0], at[1], at[2]) - share).abs() < 2e-5, "{at:?}: {share}");
    }
    assert!(cells(&of("metres.vdb", "")) == cells(&truth));
    for keys in ["", "level_set_unit = \"voxels\"\n"] {
        assert!(apart(&of("voxels.vdb", keys), &truth) < 2e-5);
    }
    // Metres taken for voxels are fog, and voxels taken for metres are bricks.
    assert!(apart(&of("metres.vdb", "level_set_unit = \"voxels\"\n"), &truth) > 0.4);
    let bricks = of("voxels.vdb", "level_set_unit = \"metres\"\n");
    let partial = |volume: &VolumeTexture| {
        volume.cells.iter().filter(|cell| (0.01..0.99).contains(&cell.rho())).count()
    };
    assert!(apart(&bricks, &truth) > 0.4);
    assert!(10 * partial(&bricks) < partial(&truth), "{} {}", partial(&bricks), partial(&truth));
}

#[test]
fn every_word_of_a_unit_and_an_axis_gives_the_variant_of_its_name() {
    let folder = Folder::new();
    write(&folder, "a.vdb", 1.0);
    for word in LevelSetUnit::WORDS {
        let scene = scene(&folder, "a.vdb", &format!("level_set_unit = {word:?}\n"));
        assert_eq!(scene.recipes[0].measured.as_ref().expect("measured").level_set_unit.word(), *word);
    }
    for word in Up::WORDS {
        let scene = scene(&folder, "a.vdb", &format!("up = {word:?}\n"));
        let turned = scene.boxes[0].world_from_texture.matrix3.z_axis.normalize();
        let truth = if *word == "z" { DVec3::Y } else { DVec3::Z };
        assert!((turned - truth).length() < 1e-12, "{word}: {turned}");
    }
}

#[test]
fn a_file_with_z_up_stands_at_its_origin() {
    let folder = Folder::new();
    write(&folder, "a.vdb", 1.0);
    let as_it_is = scene(&folder, "a.vdb", "");
    let own = &as_it_is.boxes[0];
    // The first sample lies at 0, so the corner of its voxel lies half an edge before.
    let corner = own.world_from_texture.transform_point3(DVec3::ZERO);
    assert!((corner + EDGE / 2.0).length() < 1e-12, "{corner}");

    let keys = "up = \"z\"\norigin = [-0.6, 0.4, 2.0]\n";
    let turned = scene(&folder, "a.vdb", keys);
    let place = turned.boxes[0].world_from_texture;
    let side = f64::from(SIDE) * EDGE;
    for share in [DVec3::ZERO, DVec3::ONE, DVec3::new(0.25, 0.5, 0.125)] {
        let file = DVec3::new(-0.6, 0.4, 2.0) + share * side;
        let truth = DVec3::new(file.x, file.z, -file.y);
        assert!((place.transform_point3(share) - truth).length() < 1e-12);
    }
    // The cells are the same: components on faces stay on their faces, and the box turns them.
    assert!(cells(&build(&turned)) == cells(&build(&as_it_is)));
    // What is printed stands there again.
    let again = folder.scene(&turned.to_toml(), &[]);
    assert_eq!(again.boxes, turned.boxes);
    assert!(turned.to_toml().contains("origin = [-0.6") && !as_it_is.to_toml().contains("origin"));
}

#[test]
fn the_scale_of_the_velocity_moves_what_follows_speed() {
    let folder = Folder::new();
    write(&folder, "a.vdb", 1.0);
    for by in ["speed", "vorticity"] {
        let of = |own: &str| cells(&build(&scene(&folder, "a.vdb", &format!("reflect = {by:?}\n{own}"))));
        let fast = of("velocity_scale = 0.25\nreflect_low = 0.5\nreflect_high = 12.5\n");
        let slow = of("reflect_low = 2\nreflect_high = 50\n");
        assert!(fast == slow);
        assert!(slow != of("reflect_low = 0.5\nreflect_high = 12.5\n"), "{by}");
    }
}
