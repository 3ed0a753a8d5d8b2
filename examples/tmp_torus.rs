#![allow(missing_docs)]
use glam::{Vec2, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::volume::{Cell, VolumeTexture};
use taki::{Engine, EngineChoice, RenderOptions, Scene, Unwatched};
const N: i32 = 64;
fn torus(n: u32, m: u32, h: f32, skin: f32, ku: f32, kv: f32) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    for j in 0..=m {
        for i in 0..=n {
            let [a, b] = [(i % n, n), (j % m, m)].map(|(k, n)| std::f32::consts::TAU * k as f32 / n as f32);
            let r = 2.0 + (0.8 - skin) * b.cos();
            mesh.positions.push(Vec3::new(r * a.cos(), (0.8 - skin) * b.sin(), r * a.sin()));
            mesh.uv.push(Vec2::new(ku * i as f32 / n as f32, kv * j as f32 / m as f32));
            mesh.thickness.push(h);
        }
    }
    for j in 0..m {
        for i in 0..n {
            let at = |i: u32, j: u32| j * (n + 1) + i;
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}
fn main() -> taki::Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let (w, h, samples): (u32, u32, u32) =
        (args[1].parse().unwrap(), args[2].parse().unwrap(), args[3].parse().unwrap());
    let sets: Vec<&str> = args[5..].iter().map(|s| s.as_str()).collect();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut cells = vec![Cell::default(); (N * N * N) as usize];
    for _ in 0..220 {
        let root = Vec2::new(rng.random_range(0.0..N as f32), rng.random_range(0.0..N as f32));
        let bend = Vec2::new(rng.random_range(-6.0..6.0f32), rng.random_range(4.0..16.0f32));
        let len = rng.random_range(0.7..1.0f32);
        let tone = rng.random_range(0.5..1.0f32);
        for s in 0..400 {
            let t = s as f32 / 400.0 * len; // 0 root
            let p = root + bend * t * t;
            let tangent = Vec3::new(2.0 * bend.x * t, 2.0 * bend.y * t, -(N as f32)).normalize();
            let z = (N as f32 * (1.0 - t)) as i32;
            if z < 0 || z >= N {
                continue;
            }
            let [x, y] = [p.x as i32, p.y as i32].map(|v| v.rem_euclid(N));
            let i = (x + N * (y + N * z)) as usize;
            cells[i] = Cell::from_direction(tangent).with_density(1.0 - 0.6 * t, tone, 0.4 * tone);
        }
    }
    let volume = VolumeTexture { size: [N as u32; 3], alpha: 1.0, cells: cells.into() };
    let mut base = vec![
        format!("image.width={w}"),
        format!("image.height={h}"),
        format!("image.samples={samples}"),
        "camera.eye=[0,3.6,5.2]".into(),
        "camera.target=[0,0,0]".into(),
        "camera.fov=38".into(),
        "trace.sigma=60".into(),
        "light.visibility=march".into(),
    ];
    base.extend(sets.iter().map(|s| s.to_string()));
    let base: Vec<&str> = base.iter().map(|s| s.as_str()).collect();
    let mut scene = Scene::preset("front")?.with(&base)?;
    let (n, m) = if args[4] == "big" { (160, 64) } else { (48, 20) };
    let mut shell = Shell::new(&torus(n, m, 0.25, 0.25, 24.0, 8.0), Side::Outward).unwrap();
    shell.skin = true;
    let parts = scene.edit();
    parts.quads.clear();
    parts.shells = vec![Arc::new(shell)];
    parts.trace.layers = 4;
    let mut engine = Engine::new(EngineChoice::Cpu)?;
    let t = std::time::Instant::now();
    let frame =
        engine.render_volume(&scene, &volume, &scene.mesh(), &RenderOptions::default(), &Unwatched)?;
    println!(
        "{:?} {:?} cells {:?}",
        t.elapsed(),
        frame.seconds,
        frame.counts.iter().fold([0u64; 2], |a, c| [a[0] + c[0] as u64, a[1] + c[1] as u64])
    );
    frame.write_png(std::path::Path::new("/tmp/sp/torus.png"))?;
    Ok(())
}
