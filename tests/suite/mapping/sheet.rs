//! Sheets of falling water: positions of their quads, layout of the texture on them, and erosion.

mod engines;

use std::path::{Path, PathBuf};

use crate::tolerance::{CLOSED_FORM_RELATIVE, close};
use glam::{DVec3, Vec2, Vec3};
use taki::engine::cpu::integrate::{Integrator, RayResult};
use taki::light::{Light, Visibility};
use taki::mapping::{Billow, CellFrame, GRAVITY, Material, Quad};
use taki::scene::{Limits, Scene, Source};
use taki::trace::{Attenuation, BillowTimes, MIST_OF_CELLS, MIST_RHO};
use taki::volume::{Cell, VolumeTexture};

/// The preset `front` with the text's sheets or splashes in place of its quads.
pub fn read(text: &str) -> Result<Scene, String> {
    let text = format!("version = 1\nbase = \"front\"\nquads = []\n{text}");
    let source = Source { name: "s".into(), origin: "s.toml".into(), folder: PathBuf::from("."), text };
    let checked =
        source.values().and_then(|v| Scene::from_values("s", v, Some(Path::new(".")), &Limits::default()));
    checked.map_err(|e| {
        assert_eq!(e.exit_code(), 65, "{e}");
        e.to_string()
    })
}

fn scene(text: &str) -> Scene {
    read(text).unwrap_or_else(|e| panic!("{e}"))
}

/// A vertical sheet from y = 3 to y = −2, 2 m wide.
pub fn plumb(more: &str) -> Scene {
    scene(&format!("[sheets.a]\npoints = [[0, 3, 0], [0, 1, 0], [0, -2, 0]]\nwidths = [2.0]\n{more}\n"))
}

/// A ragged sheet that bends over a lip and sideways, and that is wider at its foot.
const CURVED: &str = "[materials.water]\nrepeat_u = 1.5\nrepeat_v = 2.5
[sheets.a]\npoints = [[0, 1.2, -1.4], [0.1, 1.2, -0.6], [0.2, 0.4, 0.3], [0.1, -1.2, 0.8]]
widths = [0.8, 0.8, 1.1, 1.7]\nsegments = 13\ncolumns = 4\nround = 0.3\noffset_u = 0.3\noffset_v = 0.7
v0 = 0.7\nedge = 0.6\nbreakup = 0.5\nfade = 0.2\nhead = 0.1\n";

/// Corners of a quad with their texture coordinates and erosion.
fn corners(quad: &Quad) -> [(Vec3, Vec2, f32); 4] {
    let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let extent = Vec2::new(quad.material.repeat_u, quad.material.repeat_v);
    [0, 1, 2, 3].map(|i| (quad.corners[i], quad.offset + uv[i] * extent, quad.erosion[i]))
}

#[test]
fn the_texture_of_a_free_fall_lies_by_the_time_of_the_fall() {
    for (v0, copies) in [(1.0f64, 1.0f64), (0.05, 2.5), (8.0, 0.5)] {
        let scene = plumb(&format!("segments = 11\nv0 = {v0}\n[materials.water]\nrepeat_v = {copies}"));
        let time = |fallen: f64| ((v0 * v0 + 2.0 * GRAVITY * fallen).sqrt() - v0) / GRAVITY;
        assert_eq!(scene.quads.len(), 11);
        for quad in &scene.quads {
            for (corner, place, _) in corners(quad) {
                let want = copies * time(3.0 - f64::from(corner.y)) / time(5.0);
                // Texture coordinates and corners are float32.
                assert!(
                    (f64::from(place.y) - want).abs() < 2e-6 * copies.max(1.0),
                    "{corner}: {place}, {want}"
                );
            }
        }
    }
}

#[test]
fn water_runs_at_the_speed_of_its_fall() {
    // The texture passes at a constant rate, so a quad's length divided by its share of the texture is its
    // mean speed.
    let scene = plumb("segments = 20\nv0 = 1.5");
    let speed = |y: f32| (1.5f64 * 1.5 + 2.0 * GRAVITY * (3.0 - f64::from(y))).sqrt();
    let whole = (speed(-2.0) - 1.5) / GRAVITY;
    for quad in &scene.quads {
        let [top, bottom] = [quad.corners[0].y, quad.corners[3].y];
        let got = f64::from(top - bottom) / (f64::from(quad.material.repeat_v) * whole);
        let want = 0.5 * (speed(top) + speed(bottom));
        assert!((got / want - 1.0).abs() < 1e-4, "{got} {want}");
    }
    assert!(scene.quads[19].material.repeat_v < 0.5 * scene.quads[0].material.repeat_v);
}

#[test]
fn water_that_rises_slows_down_by_gravity() {
    // The water is thrown up at 8 m/s to 2 m: t = (v0 − √(v0² − 2 g h))/g. It could reach v0²/2g = 3.26 m.
    let up = |height: f64| {
        let text = format!(
            "[sheets.a]\npoints = [[0, 0, 0], [0, {}, 0], [0, {height}, 0]]\nsegments = 12\nv0 = 8.0",
            height / 2.0
        );
        scene(&text)
    };
    let time = |h: f64| (8.0 - (64.0 - 2.0 * GRAVITY * h).sqrt()) / GRAVITY;
    for quad in &up(2.0).quads {
        for (corner, place, _) in corners(quad) {
            // The speed's square root is taken at float32 corners. The error is 1e-7 of 2 m over the least
            // speed, 5 m/s.
            let want = time(f64::from(corner.y)) / time(2.0);
            assert!((f64::from(place.y) - want).abs() < 2e-6, "{corner}: {place}, {want}");
        }
    }
    // To 9 m, a stream must push it. It moves at v0 throughout, so texture and distance are proportional.
    let high = up(9.0);
    let rates: Vec<f32> =
        high.quads.iter().map(|q| q.material.repeat_v / (q.corners[3].y - q.corners[0].y)).collect();
    assert_eq!(rates.len(), 12);
    assert!(rates.iter().all(|x| (x / rates[0] - 1.0).abs() < 1e-4), "{rates:?}");
}

#[test]
fn a_spline_that_rises_before_the_lip_leaves_the_texture_to_the_fall() {
    // Through these points the spline passes 8 cm above the lip, but 0.3 m/s is enough for 5 mm alone.
    let scene = scene(
        "[sheets.a]\npoints = [[0, 2, -1], [0, 2, 0], [0, -1, 1.2]]\nwidths = [0.5, 0.5, 0.9]\nv0 = 0.3",
    );
    let highest = scene.quads.iter().flat_map(|q| q.corners).map(|c| c.y).fold(0.0, f32::max);
    assert!(highest > 2.03, "{highest}");
    let rate = |quad: &Quad| quad.material.repeat_v / (quad.corners[3] - quad.corners[0]).length();
    let first = rate(&scene.quads[0]);
    for quad in &scene.quads {
        assert!(rate(quad) < 1.01 * first, "{} after {first} at {}", rate(quad), quad.corners[0]);
    }
}

#[test]
fn without_stretch_the_texture_is_even() {
    let scene = plumb("segments = 5\nstretch = 0.0");
    for quad in &scene.quads {
        for (corner, place, _) in corners(quad) {
            assert!((place.y - (3.0 - corner.y) / 5.0).abs() < 1e-6);
            assert!((place.x - (corner.x / 2.0 + 0.5)).abs() < 1e-6);
        }
    }
}

#[test]
fn a_profile_along_a_circle_is_as_long_as_the_arc() {
    let points: Vec<String> = (0..=8)
        .map(|i| {
            let (sin, cos) = (f64::from(i) / 8.0 * std::f64::consts::FRAC_PI_2).sin_cos();
            format!("[0, {}, {}]", 2.0 * cos, 2.0 * sin)
        })
        .collect();
    let text = format!("[sheets.a]\npoints = [{}]\nsegments = 64\n", points.join(", "));
    let length: f64 =
        scene(&text).quads.iter().map(|q| q.corners[0].as_dvec3().distance(q.corners[3].as_dvec3())).sum();
    let arc = std::f64::consts::PI;
    // The spans are 11.25°. A chord would be shorter than its arc by 1.6e-3, and a spline that turns evenly
    // by a tenth of that.
    assert!((length / arc - 1.0).abs() < 4e-4, "{length} {arc}");
    // It is nowhere further from the circle than the chords between its points are: 2 m · (1 − cos 5.6°).
    for quad in &scene(&text).quads {
        let r = quad.corners[0].as_dvec3().distance(DVec3::new(f64::from(quad.corners[0].x), 0.0, 0.0));
        assert!((r - 2.0).abs() < 9.6e-3, "{r}");
    }
}

#[test]
fn neighbours_share_corners_texture_coordinates_and_erosion() {
    let scene = scene(CURVED);
    // There are four columns, and the eroded sides have borders at 0.3 and 0.7.
    let (columns, rows) = (6, 13);
    assert_eq!(scene.quads.len(), columns * rows);
    let mut shared = 0;
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: usize, column: usize| corners(&scene.quads[row * columns + column]);
            let same = |a: (Vec3, Vec2, f32), b: (Vec3, Vec2, f32)| {
                assert_eq!((a.0, a.2), (b.0, b.2));
                // Offset and extent are each rounded once.
                assert!((a.1 - b.1).abs().max_element() < 5e-7, "{} {}", a.1, b.1);
            };
            let own = at(row, column);
            if column + 1 < columns {
                let right = at(row, column + 1);
                same(own[1], right[0]);
                same(own[2], right[3]);
                shared += 1;
            }
            if row + 1 < rows {
                let below = at(row + 1, column);
                same(own[3], below[0]);
                same(own[2], below[1]);
                shared += 1;
            }
        }
    }
    assert_eq!(shared, 5 * 13 + 6 * 12);
    let (first, last) = (corners(&scene.quads[0])[0], corners(&scene.quads[columns * rows - 1])[2]);
    assert!((first.1 - Vec2::new(0.3, 0.7)).length() < 1e-6);
    assert!((last.1 - Vec2::new(1.8, 3.2)).length() < 1e-6);
}

#[test]
fn streaks_go_on_across_the_borders_of_quads() {
    let text = CURVED.replace("round = 0.3", "round = 0.0").replace("[0.8, 0.8, 1.1, 1.7]", "[1.2]");
    let scene = scene(&text);
    let world = |quad: &Quad, uv: Vec2, x: f32| {
        let frame = CellFrame::new(&quad.map, &quad.material, [40, 40, 40], uv);
        let (map, v) = (&quad.map, frame.cx * x + frame.cy);
        map.e1_world * v.x + map.e2_world * v.y
    };
    let columns = 6;
    for row in 0..12 {
        for column in 0..columns {
            let at = |row: usize| &scene.quads[row * columns + column];
            let (upper, lower) = (at(row), at(row + 1));
            // Along the flow, the cells turn by the same angle as the sides of the quads.
            let along = |q: &Quad| q.corners[3] - q.corners[0];
            let turn = along(upper).angle_between(along(lower));
            let [a, b] = [world(upper, Vec2::new(0.5, 1.0), 0.0), world(lower, Vec2::new(0.5, 0.0), 0.0)];
            assert!((a.angle_between(b) - turn).abs() < 1e-3, "{row}: {a} {b} {turn}");
            // The length of a cell is the quad's length divided by the number of its cells.
            let metres = along(upper).length() / (upper.material.repeat_v * 40.0);
            assert!((a.length() / metres - 1.0).abs() < 1e-4);
        }
        for column in 0..columns - 1 {
            let [left, right] = [0, 1].map(|i| &scene.quads[row * columns + column + i]);
            let [a, b] = [world(left, Vec2::new(1.0, 0.5), 0.2), world(right, Vec2::new(0.0, 0.5), 0.2)];
            assert!((a - b).length() < 1e-4 * a.length(), "{row}: {a} {b}");
        }
    }
}

#[test]
fn a_tube_is_round_and_closed() {
    let scene = scene(
        "[sheets.a]\npoints = [[3, 2, 1], [3, 0, 1]]\nwidths = [0.4, 0.8]\n\
         round = 1.0\ncolumns = 12\nsegments = 4\n",
    );
    assert_eq!(scene.quads.len(), 48);
    for row in scene.quads.chunks(12) {
        assert!(row[0].corners[0].distance(row[11].corners[1]) < 1e-6);
        assert!(row[0].corners[3].distance(row[11].corners[2]) < 1e-6);
        // Opposite corners are one width apart.
        let width = 0.4 + 0.4 * f64::from(2.0 - row[0].corners[0].y) / 2.0;
        let apart = f64::from(row[0].corners[0].distance(row[6].corners[0]));
        assert!((apart - width).abs() < 1e-5, "{apart} {width}");
    }
    let flat = plumb("columns = 4\nround = 0.0");
    let half = plumb("columns = 4\nround = 0.5");
    let wide = |scene: &Scene| {
        let x = |q: &Quad| q.corners.map(|c| c.x);
        let all: Vec<f32> = scene.quads.iter().flat_map(x).collect();
        all.iter().copied().fold(f32::MIN, f32::max) - all.iter().copied().fold(f32::MAX, f32::min)
    };
    assert!((wide(&flat) - 2.0).abs() < 1e-6 && (wide(&half) - 2.0).abs() < 1e-6);
    // The sheet bulges towards the outside of the fall. That is +z where water falls down −y and `across` is
    // +x.
    let front = half.quads.iter().flat_map(|q| q.corners.map(|c| c.z)).fold(f32::MIN, f32::max);
    let back = half.quads.iter().flat_map(|q| q.corners.map(|c| c.z)).fold(f32::MAX, f32::min);
    assert!(front.abs() < 1e-6 && (back + 1.0).abs() < 1e-6, "{front} {back}");
}

#[test]
fn erosion_grows_to_the_sides_and_the_foot() {
    let scene =
        plumb("segments = 10\ncolumns = 2\nedge = 0.5\nbreakup = 0.6\nfade = 0.2\nhead = 0.1\nstretch = 0.0");
    for quad in &scene.quads {
        for (corner, _, e) in corners(quad) {
            let (x, way) = (f64::from(corner.x), f64::from(3.0 - corner.y) / 5.0);
            let side = ((1.0 - x.abs()) / 0.5).clamp(0.0, 1.0);
            let ends = ((1.0 - way) / 0.2).clamp(0.0, 1.0) * (way / 0.1).clamp(0.0, 1.0);
            let want = 1.0 - side * (1.0 - 0.6 * way * way) * ends;
            assert!((f64::from(e) - want).abs() < 1e-5, "{corner}: {e} {want}");
        }
    }
    assert!(plumb("").quads.iter().all(|q| q.erosion == [0.0; 4] && q.mist == 0.0));
}

fn uniform(rho: f32) -> VolumeTexture {
    let cell = Cell::from_direction(Vec3::Y).with_density(rho, 0.5, 0.5);
    VolumeTexture { size: [8, 9, 10], alpha: 1.0, cells: vec![cell; 8 * 9 * 10].into() }
}

/// Transmittance and radiance of one rectangle of 2 m × 3 m, 0.4 m thick, seen along −z at `uv`.
fn through(
    quad: impl Fn(Quad) -> Quad,
    visibility: Visibility,
    volume: &VolumeTexture,
    uv: [f32; 2],
) -> RayResult {
    let mut scene = plumb("segments = 1");
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let rectangle = [corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)];
    scene.edit().quads = vec![quad(Quad::new(rectangle, scene.quads[0].material).unwrap())];
    scene.edit().quads[0].material.thickness_m = 0.4;
    scene.edit().trace.attenuation = Attenuation::PathLength { sigma: 5.0 };
    scene.edit().trace.early_end = 0.0;
    scene.edit().ambient = Vec3::ZERO;
    scene.edit().visibility = visibility;
    scene.edit().lights = vec![Light::Directional { to_light: Vec3::Z, intensity: Vec3::ONE }];
    Integrator::new(&scene, volume).trace(0, Vec3::NEG_Z, [uv[0], uv[1], 3.0], Vec3::ZERO, &mut ())
}

#[test]
fn eroded_water_transmits_by_what_is_left_of_its_density() {
    let erosion = [0.1f32, 0.3, 0.9, 0.5];
    for rho in [0.2f32, 0.7, 1.0] {
        let volume = uniform(rho);
        let rho = f64::from(volume.cells[0].rho());
        for uv in [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.3, 0.8], [0.5, 0.5]] {
            let [u, v] = uv.map(f64::from);
            let [a, b, c, d] = erosion.map(f64::from);
            let e = (a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + c * u) * v;
            let want = (-5.0 * 0.4 * (rho - e).max(0.0)).exp();
            for visibility in [Visibility::None, Visibility::March] {
                let traced = through(|q| Quad { erosion, ..q }, visibility, &volume, uv);
                let got = f64::from(traced.transmittance);
                // e is subtracted from ρ in float32, to 2^-24 of 1.
                assert!(close(got, want, CLOSED_FORM_RELATIVE, 1e-6), "ρ {rho} at {uv:?}: {got} {want}");
            }
        }
    }
}

#[test]
fn billows_multiply_the_density_of_mist_at_each_ray() {
    let billow = Billow { strength: 0.8, inverse_size: 3.0, rise: 1.0 };
    let (mut thinned, volume) = (0, uniform(0.5));
    for i in 0..20 {
        let uv = [0.05 * i as f32, 0.5];
        let mist = |billow: Billow| {
            through(
                |q| Quad { mist: 0.3, material: Material { billow, ..q.material }, ..q },
                Visibility::None,
                &volume,
                uv,
            )
        };
        let (even, own) = (mist(Billow::default()), mist(billow));
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let point = corner(2.0 * uv[0], 3.0 * uv[1]);
        let truth = f64::from(taki::trace::billow::factor(&billow, &BillowTimes::new(0.0), point));
        let ratio = f64::from(own.transmittance).ln() / f64::from(even.transmittance).ln();
        assert!(close(ratio, truth, 1e-4, 1e-5), "{uv:?}: {ratio} {truth}");
        thinned += u32::from(truth < 0.9);
    }
    assert!(thinned > 0, "some rays meet thinner mist");
}

#[test]
fn light_is_dimmed_by_what_is_left_of_the_density_too() {
    // Even water with the light behind the eye has L = Ψ·Σ w·e^(−τ to the light). Water eroded by e equals
    // water of density ρ − e, except for rounding.
    for visibility in [Visibility::March, Visibility::None] {
        let eroded = through(|q| Quad { erosion: [0.25; 4], ..q }, visibility, &uniform(0.75), [0.5, 0.5]);
        let thin = through(|q| q, visibility, &uniform(0.5), [0.5, 0.5]);
        // The codes of ρ have steps of 2^-16.
        assert!((eroded.radiance - thin.radiance).abs().max_element() < 2e-5);
        assert!(thin.radiance.x > 0.1);
    }
}

#[test]
fn mist_is_even_and_sends_light_everywhere_alike() {
    for (rho, left) in [(0.0f32, 1.0f32), (0.6, 1.0), (1.0, 0.4)] {
        let volume = uniform(rho);
        let rho = f64::from(volume.cells[0].rho());
        let cells = f64::from(MIST_OF_CELLS);
        let even = f64::from(MIST_RHO) / 65535.0;
        let density = (cells * rho + (1.0 - cells) * even) * f64::from(left);
        let quad = |q| Quad { mist: 0.8, erosion: [1.0 - left; 4], ..q };
        let traced = through(quad, Visibility::None, &volume, [0.4, 0.4]);
        let want = (-5.0 * 0.4 * density).exp();
        assert!(close(f64::from(traced.transmittance), want, CLOSED_FORM_RELATIVE, 1e-6));
        // Σ w = 1 − T. Ψ is that of the mist, whatever the cells hold.
        assert!(close(f64::from(traced.radiance.x), 0.8 * (1.0 - want), 2e-5, 0.0), "{}", traced.radiance);

        // With light walks, V is that of even mist from the middle of each cell.
        let lit = through(quad, Visibility::March, &volume, [0.4, 0.4]);
        let (mut t, mut sum) = (1.0f64, 0.0);
        for z in 0..10 {
            let next = t * (-5.0 * 0.04 * density).exp();
            sum += (t - next) * (-5.0 * 0.04 * (f64::from(z) + 0.5) * even * f64::from(left)).exp();
            t = next;
        }
        assert!(close(f64::from(lit.radiance.x), 0.8 * sum, 2e-5, 0.0), "{} {sum}", lit.radiance);
        assert_eq!(lit.cells[1], 0, "nothing is walked");
    }
}

#[test]
fn faulty_sheets_are_refused_with_their_name() {
    let bad = |text: &str, words: &[&str]| {
        let error = read(text).expect_err(text);
        assert!(words.iter().all(|word| error.contains(word)), "{text}: {error}");
    };
    let sheet = |more: &str| format!("[sheets.a]\npoints = [[0, 1, 0], [0, 0, 1]]\n{more}\n");
    bad("[sheets.a]\n", &["s.toml:", "sheets.a has no points", "give sheets.a.points"]);
    bad("[sheets.a]\npoints = [[0, 0, 0]]\n", &["sheet a", "at least two"]);
    bad("[sheets.a]\npoints = [1.0, 2.0]\n", &["sheet a", "three numbers"]);
    bad("[sheets.a]\npoints = [[0, 0, 0], [0, 2e7, 0]]\n", &["sheet a", "±1e7"]);
    bad("[sheets.a]\npoints = [[0, 0, 0], [0, 1, 0], [0, 1, 0]]\n", &["sheet a", "points 1 and 2"]);
    bad(&sheet("widths = [1.0, 2.0, 3.0]"), &["sheet a", "3 widths and 2 points"]);
    bad(&sheet("widths = [1.0, 0.0]"), &["sheet a", "sheets.a.widths"]);
    bad(&sheet("widths = [[1, 1, 1]]"), &["sheet a", "sheets.a.widths"]);
    bad(&sheet("across = [0, 0, 0]"), &["sheet a", "sheets.a.across"]);
    bad(&sheet("across = [0, -1, 1]"), &["sheet a", "quad 0 along, 0 across", "sheets.a.across"]);
    bad(&sheet("material = \"mud\""), &["s.toml:6: ", "sheets.a.material", "mud", "water"]);
    bad(&sheet("round = 1.0\ncolumns = 2"), &["sheet a", "tube", "3 columns"]);
    bad(&sheet("round = 1.0\ncolumns = 8\n[materials.water]\nrepeat_u = 1.5"), &["tube", "whole number"]);
    bad(&sheet("segments = 1024\ncolumns = 256"), &["262144 quads", "at most 65536"]);
    bad(&sheet("segments = 0"), &["sheets.a.segments = 0", "1 to 1024"]);
    bad(&sheet("v0 = 0.0"), &["sheets.a.v0 = 0", "0.01 to 100"]);
    bad("[materials.water]\nmist = -1.0\n", &["materials.water.mist = -1", "0 to 4"]);
}
