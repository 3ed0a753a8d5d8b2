//! The volume moves down the flow. Whole tile lengths change nothing, whole layers equal a volume with moved
//! layers, and down is the direction in which v increases.

use crate::engine::gpu::{renderer, scene};
use crate::tolerance::{PARITY_ABSOLUTE, PARITY_RELATIVE, PARITY_SHARE};
use taki::engine::gpu::GpuRenderer;
use taki::engine::{RenderOptions, cpu};
use taki::mapping::Quad;
use taki::output::frame::{Difference, Tolerance};
use taki::picture::Frame;
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture};

const SETS: [&str; 5] = [
    "image.width=96",
    "image.height=80",
    "light.visibility=march",
    "materials.water.repeat_u=1.5",
    "materials.water.repeat_v=0.7",
];

fn flowing(flow: &str) -> Scene {
    let flow = format!("volume.flow={flow}");
    scene("front", &SETS.into_iter().chain([flow.as_str()]).collect::<Vec<_>>())
}

/// Frames of the CPU and, if there is one, of the GPU.
fn frames(gpu: &mut Option<GpuRenderer>, scene: &Scene, volume: &VolumeTexture) -> Vec<Frame> {
    let mesh = scene.mesh();
    let mut frames = vec![cpu::render(scene, volume, &mesh, true, &Unwatched).expect("a frame")];
    if let Some(gpu) = gpu {
        let options = RenderOptions { surface: true, ..Default::default() };
        frames.push(gpu.render(scene, volume, &mesh, &options, &Unwatched).expect("a frame"));
    }
    frames
}

/// The volume with every layer moved `by` cells further down the flow.
fn rolled(volume: &VolumeTexture, by: u32) -> VolumeTexture {
    let [nx, ny, nz] = volume.size;
    let mut cells: Vec<Cell> = volume.cells.iter().copied().collect();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                cells[volume.index(x, (y + by) % ny, z)] = volume.cells[volume.index(x, y, z)];
            }
        }
    }
    VolumeTexture { size: volume.size, alpha: volume.alpha, cells: cells.into() }
}

fn rgb(frame: &Frame) -> Vec<[f32; 3]> {
    frame.radiance.iter().map(|r| [r[0], r[1], r[2]]).collect()
}

/// Share of pixels with equal radiance.
fn likeness(a: &Frame, b: &Frame) -> f64 {
    let tolerance = Tolerance { relative: PARITY_RELATIVE, absolute: PARITY_ABSOLUTE };
    1.0 - Difference::new(a.width, &rgb(a), &rgb(b), tolerance).share_outside()
}

#[test]
fn whole_lengths_of_flow_change_not_a_bit() {
    let mut gpu = renderer("whole lengths of flow");
    let still = flowing("0");
    let volume = still.volume(1 << 30, &Unwatched).expect("a volume");
    let before = frames(&mut gpu, &still, &volume);
    for flow in ["1", "-1", "7", "-1000000"] {
        for (before, after) in before.iter().zip(frames(&mut gpu, &flowing(flow), &volume)) {
            assert!(before.radiance == after.radiance && before.counts == after.counts, "{flow}");
            assert!(before.picture == after.picture && before.surface == after.surface, "{flow}");
        }
    }
}

#[test]
fn a_part_of_a_length_is_a_volume_with_its_layers_moved_down() {
    let mut gpu = renderer("parts of a length of flow");
    let still = flowing("0");
    let volume = still.volume(1 << 30, &Unwatched).expect("a volume");
    let plain = frames(&mut gpu, &still, &volume);
    let quarter = volume.size[1] / 4;
    for (flow, by) in [("0.25", quarter), ("-0.75", quarter), ("12.5", 2 * quarter), ("-0.25", 3 * quarter)] {
        let want = frames(&mut gpu, &still, &rolled(&volume, by));
        let got = frames(&mut gpu, &flowing(flow), &volume);
        for ((want, got), plain) in want.iter().zip(&got).zip(&plain) {
            assert!(likeness(want, got) >= PARITY_SHARE, "{flow}: {}", likeness(want, got));
            assert!(likeness(plain, got) < 0.9, "{flow} moves the picture");
            // The face, its depth and its coordinates stay the same.
            assert!(plain.surface == got.surface, "{flow}");
        }
    }
}

#[test]
fn water_flows_down_the_quad_by_that_share_of_its_length() {
    let mut gpu = renderer("direction of flow");
    let sets = |flow: &str| {
        let down = "quads.0.corners=[[-0.5,0.5,0.5],[0.5,0.5,0.5],[0.5,-0.5,0.5],[-0.5,-0.5,0.5]]";
        let thin = "materials.water.thickness=0.01";
        scene("front", &["image.width=32", "image.height=120", thin, "trace.sigma=100", down, flow])
    };
    let still = sets("volume.flow=0");
    let [nx, ny, nz] = [4, 40, 2];
    let mut layer = VolumeTexture { size: [nx, ny, nz], alpha: 1.0, cells: Default::default() };
    let cell = Cell::from_direction(glam::Vec3::Y).with_density(1.0, 0.5, 0.5);
    let cells: Vec<Cell> =
        (0..nx * ny * nz).map(|i| if i / nx % ny == 10 { cell } else { Cell::default() }).collect();
    layer.cells = cells.into();
    // Mean row of the pixels that hide the background, weighted by how much they hide.
    let row = |frame: &Frame| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (i, r) in frame.radiance.iter().enumerate() {
            let hidden = 1.0 - r[3] as f64;
            sum += hidden * ((i / 32) as f64 + 0.5);
            weight += hidden;
        }
        assert!(weight > 1.0, "the layer is seen");
        sum / weight
    };
    let row_of = |v: f32| {
        let Quad { map, .. } = still.quads[0];
        let depth = still.depth_range(&still.mesh());
        let clip =
            still.camera.clip_from_world(32, 120, [0.5, 0.5], &depth) * map.point_world(0.5, v).extend(1.0);
        (0.5 - clip.y as f64 / clip.w as f64 * 0.5) * 120.0
    };
    assert!(row_of(0.75) > row_of(0.25), "v runs down the picture");
    for (flow, v) in [("0", 10.5), ("0.25", 20.5), ("0.5", 30.5), ("-0.125", 5.5)] {
        for frame in frames(&mut gpu, &sets(&format!("volume.flow={flow}")), &layer) {
            let (got, want) = (row(&frame), row_of(v / 40.0));
            assert!((got - want).abs() < 1.0, "flow {flow}: row {got}, not {want}");
        }
    }
}
