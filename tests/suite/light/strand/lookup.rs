//! The lookup table against the model, and the shader against the table.

use std::f64::consts::PI;
use std::sync::Arc;

use super::hair::hairs;
use super::{clear, cosines, directions, strands};
use crate::engine::gpu::renderer;
use glam::Vec3;
use taki::engine::gpu::layout::Strand as Uniform;
use taki::engine::gpu::shader::resolve;
use taki::engine::gpu::{Gpu, StrandTexture};
use taki::light::strand::hair::Hair;
use taki::light::strand::table::{StrandShading, StrandTable};
use taki::light::strand::water::Water;
use taki::light::strand::{Strand, StrandParams};

/// Sorted errors of Φ from the table in units of Φ + 1/4π, and the mean error divided by the mean Φ.
fn errors(params: &StrandParams) -> (Vec<f64>, f64) {
    let (strand, table) = (Strand::new(params), StrandTable::of(params));
    let (mut error, mut all) = (0.0, 0.0);
    let mut relative: Vec<f64> = directions(4000, params.roughness_m as f64)
        .into_iter()
        .map(|[theta_i, theta_o, phi]| {
            let want = strand.lobes(theta_i, theta_o, phi).total();
            let [l, e, le] = cosines(theta_i, theta_o, phi);
            let difference = (table.psi(l, e, le).as_dvec3() / PI - want).abs().max_element();
            error += difference;
            all += want.max_element();
            difference / (want.max_element() + 0.25 / PI)
        })
        .collect();
    relative.sort_unstable_by(f64::total_cmp);
    (relative, error / all)
}

#[test]
fn the_table_is_the_model_within_its_stated_error() {
    // Roughnesses, largest error, error of 99 of 100 directions, and error of the mean. The remaining error
    // is that of the bow, which moves with θ_d between two nodes of y.
    for (roughness, largest, usual, mean) in [
        ([0.3, 0.2], 0.02, 0.012, 0.004),
        ([0.1, 0.1], 0.07, 0.035, 0.006),
        ([0.1, 0.5], 0.07, 0.02, 0.006),
        ([0.5, 0.1], 0.07, 0.035, 0.006),
        ([1.0, 1.0], 0.005, 0.002, 0.002),
    ] {
        for radius_m in [5e-4, 0.3] {
            let (errors, of_mean) = errors(&Water { radius_m, ..clear(roughness, 1.0) }.strand());
            let (worst, most) = (errors[errors.len() - 1], errors[errors.len() * 99 / 100]);
            assert!(
                worst < largest && most < usual && of_mean < mean,
                "{worst}, {most}, {of_mean} for {roughness:?}"
            );
        }
    }
}

#[test]
fn the_table_of_hairs_is_the_model_within_its_stated_error() {
    // Tilt and roughnesses, with errors as above. With a tilt of 10° the narrowest lobe stands where nodes of
    // x are as far apart as it is wide.
    for (tilt, roughness, largest, usual, mean) in [
        (3.0, [0.3, 0.3], 0.02, 0.012, 0.004),
        (-3.0, [0.3, 0.2], 0.02, 0.012, 0.004),
        (3.0, [0.1, 0.1], 0.12, 0.035, 0.006),
        (3.0, [0.5, 0.1], 0.07, 0.035, 0.006),
        (3.0, [1.0, 1.0], 0.005, 0.002, 0.002),
        (10.0, [0.3, 0.3], 0.03, 0.012, 0.004),
        (10.0, [0.1, 0.5], 0.1, 0.05, 0.01),
    ] {
        for melanin in [0.0, 1.3] {
            let (errors, of_mean) = errors(&hairs(1.55, tilt, roughness, melanin));
            let (worst, most) = (errors[errors.len() - 1], errors[errors.len() * 99 / 100]);
            assert!(
                worst < largest && most < usual && of_mean < mean,
                "{worst}, {most}, {of_mean} for α = {tilt}°, {roughness:?}"
            );
        }
    }
}

#[test]
fn light_along_the_strand_and_every_corner_are_finite() {
    let ends = [-1.0f32, -1.0 + 1e-7, -1e-20, 0.0, 0.5, 1.0 - 1e-7, 1.0, 1.000001];
    for params in [Water::default().strand(), Hair::default().strand(), hairs(1.1, -10.0, [0.1; 2], 100.0)] {
        let shading = StrandShading::new(&params);
        for l in ends {
            for e in ends {
                for le in ends {
                    let psi = shading.psi(0.5, 0.5, l, e, le);
                    assert!(psi.is_finite() && psi.min_element() >= 0.0, "{psi} at {l}, {e}, {le}");
                }
            }
        }
    }
}

#[test]
fn one_strand_has_one_table_whatever_the_air() {
    let params = Water { radius_m: 0.123, ..Water::default() }.strand();
    let table = StrandTable::of(&params);
    assert!(Arc::ptr_eq(&table, &StrandTable::of(&StrandParams { aeration: 0.1, g: 0.0, ..params })));
    let thicker = Water { radius_m: 0.124, ..Water::default() }.strand();
    for other in [thicker, StrandParams { eta: 1.4, ..params }, StrandParams { tilt: 0.01, ..params }] {
        assert!(!Arc::ptr_eq(&table, &StrandTable::of(&other)));
    }
}

/// Ψ of the shader for (t·l, t·e, l·e, k_d), with k_s = 1 − k_d.
fn on_gpu(gpu: &Gpu, shading: &StrandShading, inputs: &[[f32; 4]]) -> Vec<Vec3> {
    let stage = "#import light::strand
        @group(0) @binding(0) var<uniform> strand: Strand;
        @group(0) @binding(1) var table: texture_3d<f32>;
        @group(0) @binding(2) var linear: sampler;
        @group(0) @binding(3) var<storage, read_write> values: array<vec4<f32>>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&values) {
                let v = values[id.x];
                values[id.x] = vec4<f32>(\
                    strand_psi(table, linear, strand, v.w, 1.0 - v.w, v.x, v.y, v.z), 0.0);
            }
        }";
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(resolve(stage).into()),
    });
    let tilted = [("TILTED", f64::from(u8::from(shading.table.is_tilted())))];
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions { constants: &tilted, ..Default::default() },
        cache: None,
    });
    let texture = StrandTexture::new(gpu, &shading.table);
    let uniform =
        gpu.buffer_with("strand", bytemuck::bytes_of(&Uniform::from(shading)), wgpu::BufferUsages::UNIFORM);
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let values = gpu.buffer_with("values", bytemuck::cast_slice(inputs), usage);
    let read = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let back = gpu.buffer("back", values.size(), read);
    let resources = [
        uniform.as_entire_binding(),
        wgpu::BindingResource::TextureView(&texture.view),
        wgpu::BindingResource::Sampler(&texture.sampler),
        values.as_entire_binding(),
    ];
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = gpu.encoder("strand");
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&values, 0, &back, 0, values.size());
    gpu.run(encoder).expect("run");
    back.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    gpu.run(gpu.encoder("map")).expect("run");
    let view = back.get_mapped_range(..).expect("mapped");
    let texels: &[[f32; 4]] = bytemuck::cast_slice(&view);
    texels.iter().map(|t| Vec3::from_slice(t)).collect()
}

#[test]
fn the_shader_looks_up_what_the_cpu_does() {
    let Some(renderer) = renderer("the_shader_looks_up_what_the_cpu_does") else { return };
    let tilted = [Hair::default().strand(), hairs(1.55, -10.0, [0.1; 2], 0.3)];
    for params in [Water::default().strand(), strands([0.1, 0.1], 1.0)].into_iter().chain(tilted) {
        let shading = StrandShading::new(&params);
        let inputs: Vec<[f32; 4]> = directions(4096, 0.2)
            .into_iter()
            .enumerate()
            .map(|(i, [theta_i, theta_o, phi])| {
                let [l, e, le] = cosines(theta_i, theta_o, phi);
                [l, e, le, (i % 17) as f32 / 16.0]
            })
            .collect();
        let got = on_gpu(&renderer.gpu, &shading, &inputs);
        let mut worst = 0.0f32;
        for (&[l, e, le, k_d], got) in inputs.iter().zip(got) {
            let want = shading.psi(k_d, 1.0 - k_d, l, e, le);
            worst = worst.max(((got - want).abs() / (want + 0.25)).max_element());
        }
        // The coordinates differ through fused products, by 1e-6 on software Vulkan. Most of the bound is for
        // devices whose filters place a sample on one of 256 steps between two texels. Their error is half a
        // step of a difference as large as a texel itself.
        assert!(worst < 2e-3, "{worst}");
    }
}
