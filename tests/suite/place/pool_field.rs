//! Waves and foam of a pool with a field: closed forms, balances, loops, and parity of the engines.

use std::f32::consts::TAU;

use super::{of, small_seen_from};
use crate::engine::gpu::{assert_parity, both, renderer};
use glam::{DVec3, Vec2};
use taki::engine::pool_surface::{SlopeMap, slope_maps, surfaces};
use taki::place::pool::current::{self, balance, faces};
use taki::place::pool::field::{Basin, Grid, LENGTHS, MODES, PoolField};
use taki::place::pool::waves::{Incident, Run};
use taki::scene::Scene;

/// Water of 24 m × 12 m in cells of 1/18 m, solid from the column `wall` on.
fn basin(wall: usize) -> Basin {
    let grid = Grid { origin: [0.0, 0.0], cell: 1.0 / 18.0, size: [432, 216] };
    let solid = (0..grid.cells()).map(|i| i % 432 >= wall).collect();
    Basin { grid, solid, impacts: Vec::new() }
}

fn modulus([re, im]: [f32; 2]) -> f32 {
    re.hypot(im)
}

/// Straight waves of all modes along +x with the amplitude 1.
fn along_x() -> Vec<Incident> {
    (0..MODES).map(|mode| Incident { mode, toward: Vec2::X, amplitude: 1.0, phase: 0.3 }).collect()
}

/// Largest difference from the standing wave 2·|cos(2π·d/λ)| before a wall at column 300, of each mode.
fn off_the_standing_wave(basin: &Basin) -> [f32; MODES] {
    let from_outside = along_x();
    let mut run = Run::new(basin, 1.0);
    run.reflect(&from_outside);
    let mirrored = run.amplitudes();
    let mut worst = [0.0f32; MODES];
    for i in (0..basin.grid.cells()).filter(|i| (80..136).contains(&(i / 432))) {
        // Up to one wavelength from the wall.
        let cells = 299.5 - (i % 432) as f32;
        if !(0.0..=18.0).contains(&cells) {
            continue;
        }
        for k in 0..MODES {
            let own = from_outside[k].at(basin.grid.middle(i), 1.0);
            let sum = modulus([own[0] + mirrored[i][k][0], own[1] + mirrored[i][k][1]]);
            let truth = 2.0 * (TAU * cells / 18.0 / LENGTHS[k]).cos().abs();
            worst[k] = worst[k].max((sum - truth).abs());
        }
    }
    worst
}

#[test]
fn a_wall_makes_a_standing_wave_of_a_wave_that_meets_it() {
    let worst = off_the_standing_wave(&basin(300));
    // On its way of up to two wavelengths a mirrored wave loses 1 − e^(−2/12) = 0.15 of itself; 8 cells a
    // wave and the edges of a wall of 12 m take the rest.
    assert!(worst.iter().all(|worst| *worst < 0.35), "{worst:?}");
}

#[test]
fn without_a_wall_nothing_is_mirrored() {
    let open = basin(432);
    let mut run = Run::new(&open, 1.0);
    run.reflect(&along_x());
    assert!(run.amplitudes().iter().flatten().flatten().all(|part| *part == 0.0));
    assert!(off_the_standing_wave(&open).iter().all(|worst| *worst > 0.8), "the comparison can fail");
}

/// A pool of 24 m × 12 m in which a jet of 4 cm falls, at (−4, 0).
fn jet(more: &str) -> Scene {
    of(&format!(
        "[pools.p]\ncorners = [[-12,0,6],[12,0,6],[12,0,-6],[-12,0,-6]]\nwaves = \"field\"\n\
         wavelength = 1.0\nrings = 0.01\n{more}\n[materials.water]\n[[quads]]\n\
         corners = [[-4.02,2,0],[-3.98,2,0],[-3.98,-1,0],[-4.02,-1,0]]\n[image]\nwidth = 64\nheight = 64\n"
    ))
}

fn field_of(scene: &Scene) -> PoolField {
    scene.mesh().field(0).expect("a field").clone()
}

#[test]
fn rings_fall_with_the_root_of_the_distance_and_lose_a_twelfth_a_wave() {
    let field = field_of(&jet("height = 0.0"));
    let mean = |k: usize, away: f32| {
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..field.grid.cells() {
            let r = field.grid.middle(i).distance(Vec2::new(-4.0, 0.0));
            if (r - away).abs() < 0.25 {
                sum += modulus(field.amplitudes[i][k]).powi(2);
                count += 1;
            }
        }
        assert!(count > 50);
        (sum / count as f32).sqrt()
    };
    for k in 0..MODES {
        let (near, far) = (mean(k, 1.5), mean(k, 4.0));
        let truth = (4.0f32 / 1.5).sqrt() * (2.5f32 / 12.0).exp();
        assert!((near / far / truth - 1.0).abs() < 0.15, "{k}: {near} {far} {truth}");
    }
    // `rings` is the amplitude of waves of 0.4 times the longest, one of the longest away. The cells of the
    // jet have random phases, so that one jet differs from the mean of all.
    let size = mean(2, 1.0) / LENGTHS[2] * 0.4;
    assert!((0.003..0.03).contains(&size), "{size}");
}

#[test]
fn amplitudes_grow_with_rings_and_height() {
    let (one, two) = (field_of(&jet("height = 0.0")), field_of(&with_rings(jet("height = 0.0"), 2.0)));
    for (a, b) in one.amplitudes.iter().zip(&two.amplitudes) {
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((2.0 * a - b).abs() < 1e-4 * 0.02, "{a} {b}");
        }
    }
}

fn with_rings(mut scene: Scene, times: f32) -> Scene {
    scene.edit().pools[0].rings *= times;
    scene
}

#[test]
fn a_loop_closes_to_the_bit_and_moves_in_between() {
    let scene = with_rock(jet("height = 0.004"));
    let (mesh, pool) = (scene.mesh(), &scene.pools[0]);
    let field = mesh.field(0).expect("a field");
    let at = |flow: f32| {
        let mut scene = scene.clone();
        scene.edit().wave_flow = flow;
        let map = slope_maps(&scene, &mesh).remove(0).expect("slopes");
        (map.texels, surfaces(&scene, &mesh).remove(0))
    };
    let start = at(0.0);
    assert!(at(1.0) == start && at(7.0) == start);
    let differ = |flow: f32| {
        let (map, surface) = at(flow);
        let moved = map.iter().zip(&start.0).filter(|(a, b)| (a[0] - b[0]).abs() > 1e-5).count();
        (moved, surface != start.1)
    };
    assert!(differ(0.3).0 > 1000 && differ(0.3).1, "{:?}", differ(0.3));
    // Nothing jumps where the loop begins anew.
    let (before, _) = at(0.9999);
    let steepest = start.0.iter().map(|t| t[0].abs()).fold(0.0, f32::max);
    let jump = before.iter().zip(&start.0).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f32::max);
    assert!(jump < 0.01 * steepest, "{jump} of {steepest}");
    // An open shutter: the change is that of the closed forms at both its ends.
    let short = SlopeMap::new(pool, field, [0.2, 1e-3]);
    let ends = [0.2 - 5e-4, 0.2 + 5e-4].map(|flow| SlopeMap::new(pool, field, [flow, 0.0]));
    for i in 0..short.texels.len() {
        let truth = ends[1].texels[i][0] - ends[0].texels[i][0];
        assert!((short.texels[i][2] - truth).abs() < 1e-3 * steepest, "{i}");
    }
    // While the shutter is open for a whole loop, every wave passes and nothing is left of it.
    let long = SlopeMap::new(pool, field, [0.2, 1.0]);
    assert!(long.texels.iter().all(|t| t[0].abs() < 1e-4 * steepest));
}

/// Adds a rock that stands in the pool of [`jet`].
fn with_rock(mut scene: Scene) -> Scene {
    let text = "[rocks.r]\ncorners = [[-1,-2,2],[1,-2,2],[1,2,-2],[-1,2,-2]]\nlevels = 4\n";
    scene.edit().rocks = of(&format!("{text}[image]\nwidth = 64\nheight = 64\n")).rocks.clone();
    scene
}

#[test]
fn foam_keeps_its_balance_and_passes_no_rock() {
    let scene = with_rock(jet("foam = 0.8\nfoam_reach = 2.0\nfoam_life = 3.0"));
    let (mesh, pool) = (scene.mesh(), &scene.pools[0]);
    let whole = Basin::new(pool, &mesh, &scene.falls());
    let basin = whole.halved();
    let solids = basin.solid.iter().filter(|solid| **solid).count();
    assert!(solids > 20 && solids * 4 < basin.solid.len(), "{solids}");
    let faces = faces(pool, &basin);
    let foam = current::foam(pool, &basin, &faces);
    let [nx, _] = basin.grid.size;
    let (mut gained, mut lost, mut off) = (0.0f64, 0.0f64, 0.0f64);
    for i in 0..foam.len() {
        let row = i / nx * (nx + 1) + i % nx;
        if basin.solid[i] {
            let through = [faces.x[row], faces.x[row + 1], faces.z[i], faces.z[i + nx]];
            assert_eq!(through, [0.0; 4], "rock lets water through");
            assert_eq!(foam[i], 0.0);
            continue;
        }
        let near = basin.grid.neighbours(i).into_iter().flatten().any(|j| basin.solid[j]);
        // Where foam is made it is given, and at shores waves add to it.
        if foam[i] == pool.foam || near {
            continue;
        }
        let own = balance(pool, &basin, &faces, i, &foam);
        gained += f64::from(own.flows_in);
        lost += f64::from(own.leaves * foam[i]);
        off += f64::from((own.flows_in - own.leaves * foam[i]).abs());
    }
    assert!(gained > 1.0 && off < 1e-3 * gained, "{gained} {lost} {off}");
    // It thins against the drift.
    let at = |x: f32| foam[basin.grid.cell_at(Vec2::new(x, 0.0)).expect("in the pool")];
    assert!(at(-4.0) == 0.8 && at(-5.5) > 0.0 && at(-5.5) < 0.1, "{:?}", [-4.0, -5.5].map(at));
}

#[test]
fn water_leaves_where_it_was_pushed_out_or_sinks() {
    let scene = jet("current = 0.5\ndrift = 0.0\nfoam_reach = 2.0");
    let pool = &scene.pools[0];
    let basin = Basin::new(pool, &scene.mesh(), &scene.falls()).halved();
    let faces = faces(pool, &basin);
    let grid = basin.grid;
    // Outward through the sides of squares around the jet: it grows to the edge of what is churned and then
    // falls, as water sinks.
    let through = |half: f32| {
        let (nx, mut sum) = (grid.size[0], 0.0f32);
        for i in 0..grid.cells() {
            let p = grid.middle(i) - Vec2::new(-4.0, 0.0);
            if p.abs().max_element() < half {
                let row = i / nx * (nx + 1) + i % nx;
                sum += faces.x[row + 1] - faces.x[row] + faces.z[i + nx] - faces.z[i];
            }
        }
        sum * grid.cell
    };
    let (near, middle, far) = (through(0.8), through(2.5), through(5.0));
    assert!(near > middle && middle > far && far > 0.0, "{near} {middle} {far}");
    // A disc of radius r = 0.35·2 m with the divergence 0.5/r gives π·r·0.5 m²/s less what sinks at once.
    assert!(near < std::f32::consts::PI * 0.7 * 0.5 * 1.2 && near > 0.5, "{near}");
}

#[test]
fn rocks_are_found_where_they_cut_the_level_and_are_solid_inside() {
    let scene = with_rock(jet("height = 0.0"));
    let basin = Basin::new(&scene.pools[0], &scene.mesh(), &scene.falls());
    let solid = |x: f32, z: f32| basin.solid[basin.grid.cell_at(Vec2::new(x, z)).expect("in the pool")];
    // The rock is a leaning patch that cuts the level about z = 0, from x = −1 to 1.
    let column = |x: f32| (-40..40).any(|z| solid(x, z as f32 * 0.05));
    assert!(column(0.0) && column(-0.8) && column(0.8) && !column(-1.5) && !column(1.5));
    let mut ring = Basin { solid: vec![false; basin.grid.cells()], ..basin.clone() };
    assert!(ring.solid.iter().all(|solid| !solid));
    ring.impacts.clear();
    let field = PoolField::of(&scene.pools[0], &ring, DVec3::ZERO);
    assert!(field.amplitudes.iter().flatten().flatten().all(|part| *part == 0.0), "no jet, no height");
}

#[test]
fn a_cached_field_is_the_computed_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = taki::util::cache::Cache::new(folder.path(), 1 << 30).keeping_all();
    let scene = jet("height = 0.004");
    let made = field_of(&scene);
    for _ in 0..2 {
        let mesh = scene.cached_mesh(Some(&cache));
        assert!(mesh.field(0) == Some(&made));
    }
}

#[test]
fn the_engines_agree_on_pools_with_fields() {
    let Some(mut renderer) = renderer("pool field") else { return };
    for more in ["", "[environment]\nkind = \"sky\"\nlights = 3\n"] {
        let mut scene = small_seen_from("[0.3,1.5,0.6]", "[0,0,-1]", more);
        scene.edit().pools[0].waves = taki::place::PoolWaves::Field;
        scene.edit().wave_flow = 0.37;
        let frames = both(&mut renderer, &scene);
        assert_parity(more, &frames);
        let plain = both(&mut renderer, &small_seen_from("[0.3,1.5,0.6]", "[0,0,-1]", more));
        assert!(frames[0].radiance != plain[0].radiance, "another picture than that of a sum");
    }
}
