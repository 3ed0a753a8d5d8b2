//! Parity of `shaders/light/scatter.wgsl` with `taki::light::scatter`: equal input gives equal output.

use crate::engine::gpu::SURFACE;
use glam::Vec3;
use taki::engine::gpu::shader::resolve;
use taki::engine::gpu::{DeviceOptions, Gpu};
use taki::light::scatter::media::profile_length;
use taki::light::scatter::{Profile, Row, Scattering, forward_peak, multiple};
use taki::util::monitor::Unwatched;
use wgpu::BufferUsages;

const STAGE: &str = "#import light::scatter
#import layout

struct Case {
    similarity: Similarity,
    near: vec3<f32>,
    cos: f32,
    far: vec3<f32>,
    l_n: f32,
    view: f32,
    cell: f32,
    light: f32,
    e_n: f32,
    mist: f32,
    pad_0: f32,
    pad_1: f32,
    pad_2: f32,
}
@group(0) @binding(0) var<storage, read> cases: array<Case>;
@group(0) @binding(1) var<storage, read_write> results: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> profiles: array<vec4<f32>>;
@compute @workgroup_size(1)
fn run(@builtin(global_invocation_id) id: vec3<u32>) {
    let c = cases[id.x];
    let row = scatter_row(c.l_n, 40u);
    let diffuse = scatter_diffuse(c.near, c.far, row);
    let similarity = scatter_similarity(c.similarity, c.mist);
    let peak = scatter_peak(similarity.g, c.cos);
    let rgb = scatter_multiple(similarity, peak, diffuse, c.view, c.cell, c.light);
    results[2u * id.x] = vec4<f32>(rgb, f32(row.near) + row.share + 1000.0 * f32(row.far - row.near));
    let column = scatter_column(c.e_n);
    let at = row.gain + column.below;
    results[2u * id.x + 1u] = scatter_gain(array(profiles[at], profiles[at + 1u]),
        array(profiles[at + VIEWS], profiles[at + VIEWS + 1u]), row, column);
}
";

#[test]
fn the_shaders_multiple_scattering_is_the_hosts() {
    let gpu = match Gpu::open(&DeviceOptions::default()) {
        Ok(gpu) => gpu,
        Err(e) => {
            assert!(std::env::var("CI").is_err(), "continuous integration needs an adapter: {e}");
            return eprintln!("not run: {e}");
        }
    };
    let (mut input, mut want): (Vec<f32>, Vec<[f32; 4]>) = (Vec::new(), Vec::new());
    // Unrelated numbers between 0 and 1.
    let unrelated = |n: u32, k: u32| (0.5 + n as f32 * (k as f32 * 2.0 + 3.0).sqrt()).fract();
    let values = (0..profile_length(40)).map(|n| [0, 1, 2, 3].map(|k| 8.0 * unrelated(n, k))).collect();
    let profile = Profile { layers: 40, values };
    for n in 0..500 {
        let x = |k: u32| unrelated(n, k);
        let scattering = Scattering { albedo: Vec3::new(1.0, x(0), x(1)), g: 1.1 * x(2) - 0.2 };
        let (near, far) = (Vec3::new(x(3), x(4), x(5)), Vec3::new(x(6), x(7), x(8)));
        let (cos, l_n) = (2.0 * x(9) - 1.0, 2.0 * x(10) - 1.0);
        let (view, cell, light) = (9.0 * x(11), x(12), 20.0 * x(13) * x(14));
        let (e_n, mist) = (2.0 * x(15) - 1.0, (x(16) - 0.6).max(0.0));
        let s = scattering.similarity();
        for (v, w) in [(s.extinction, s.g), (s.albedo, 0.0), (s.reduced, 0.0), (s.isotropic, 0.0)] {
            input.extend([v.x, v.y, v.z, w]);
        }
        input.extend([near.x, near.y, near.z, cos, far.x, far.y, far.z, l_n, view, cell, light, e_n]);
        input.extend([mist, 0.0, 0.0, 0.0]);
        let s = if mist > 0.0 { Scattering::mist(mist).similarity() } else { s };
        let row = Row::new(l_n, 40);
        let diffuse = near + (far - near) * row.share;
        let rgb = multiple(&s, &forward_peak(s.g, cos), diffuse, view, cell, light);
        let place = row.near as f32 + row.share + 1000.0 * (row.far - row.near) as f32;
        want.push([rgb.x, rgb.y, rgb.z, place]);
        want.push(profile.gain(&row, e_n).to_array());
    }
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("scatter"),
        source: wgpu::ShaderSource::Wgsl(resolve(STAGE).into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("scatter"),
        layout: None,
        module: &module,
        entry_point: Some("run"),
        compilation_options: Default::default(),
        cache: None,
    });
    let cases = gpu.buffer_with("cases", bytemuck::cast_slice(&input), BufferUsages::STORAGE);
    let profiles = gpu.buffer_with("profiles", bytemuck::cast_slice(&profile.values), BufferUsages::STORAGE);
    let bytes = want.len() as u64 * 16;
    let results = gpu.buffer("results", bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let staging = gpu.buffer("staging", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scatter"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: cases.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: results.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 2, resource: profiles.as_entire_binding() },
        ],
    });
    let mut encoder = gpu.encoder("scatter");
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(want.len() as u32 / 2, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&results, 0, &staging, 0, bytes);
    gpu.run(encoder).expect("a result");
    staging.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    gpu.run(gpu.encoder("map")).expect("mapped");
    let view = staging.get_mapped_range(..).expect("mapped");
    let got: &[[f32; 4]] = bytemuck::cast_slice(&view);
    for (i, (got, want)) in got.iter().zip(&want).enumerate() {
        for c in 0..4 {
            // The results are differences of exponentials near 1. Each exponential may be a few ulp off, and
            // terms of both signs of up to 5 cancel.
            let allowed = 3e-6 * want[c].abs().max(5.0);
            assert!((got[c] - want[c]).abs() <= allowed, "case {i}, {c}: {got:?}, not {want:?}");
        }
    }
}

#[test]
fn profiles_that_the_device_cannot_bind_are_refused_before_they_are_computed() {
    let Some(mut renderer) = crate::engine::gpu::renderer("profiles") else { return };
    let small = ["image.width=8", "image.height=8", "volume.nx=4", "volume.ny=4", "volume.nz=512"];
    let sets =
        [&small[..], &["curves.across=4", "light.scattering=multiple", "light.visibility=march"]].concat();
    let mut scene = crate::engine::gpu::scene("front", &sets);
    let volume = scene.volume(1 << 30, &Unwatched).expect("a volume");
    let limit = renderer.gpu.device.limits().max_storage_buffer_binding_size;
    // Each quad has a thickness of its own.
    let count = limit / (16 * u64::from(profile_length(512))) + 1;
    let quad = scene.quads[0];
    let thin = |n: u64| {
        let mut quad = quad;
        quad.material.thickness_m += n as f32 * 1e-3;
        quad
    };
    scene.edit().quads = (0..count).map(thin).collect();
    let refused = renderer.render(&scene, &volume, &scene.mesh(), &SURFACE, &Unwatched);
    let said = refused.expect_err("more than the device binds").to_string();
    assert!(said.contains("multiple scattering") && said.contains("--engine cpu"), "{said}");
}
