//! §4 and §5 on the CPU. Twin: `shaders/integrate.wgsl`, the same operations in the same order.

use glam::{IVec3, UVec2, Vec2, Vec3};

use super::gbuffer::Gbuffer;
use super::matter::Matter;
use super::visibility::{Filled, KeptVolumes, number, optical_depth};
use crate::camera::sample_offset;
use crate::error::Result;
use crate::gpu::layout::{extinction, flow_cells};
use crate::haze::EyeHaze;
use crate::job::Monitor;
use crate::mapping::CellFrame;
use crate::scatter::media::{Media, thicknesses};
use crate::scatter::{ORDERS, Row, forward_peak, multiple};
use crate::scene::{AngleFrame, Attenuation, Light, Reflection, Scattering, Scene, Visibility};
use crate::shading::{Metric, fibre_angles, specular_power};
use crate::strand::table::StrandShading;
use crate::visibility::{Form, LightVolumes, Medium};
use crate::volume::{Cell, VolumeTexture};
use crate::walk::{Crossing, NEVER, Walk};

/// What all pixels of a frame share.
pub struct Integrator<'a> {
    scene: &'a Scene,
    volume: &'a VolumeTexture,
    cells: &'a [Cell],
    size: IVec3,
    extinction: f32,
    flow_cells: f32,
    per_cell: bool,
    lights: Vec<Light>,
    light_volumes: Option<LightVolumes>,
    /// None: what they hold is walked when it is asked for.
    filled: Option<Filled>,
    medium: Medium,
    strand: Option<StrandShading>,
    media: Option<Media>,
    /// Number of each quad's profile.
    profile_of_quad: Vec<u32>,
    haze: EyeHaze,
}

/// What one ray brings home.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traced {
    /// Radiance towards the eye, what is behind included.
    pub radiance: Vec3,
    /// T at the end of the walk.
    pub transmittance: f32,
    /// Cells of the view ray and of its light rays.
    pub cells: [u32; 2],
}

/// Watches a ray on its way, cell by cell. With the empty one, `()`, nothing is left of it.
pub trait Observer {
    /// The ray meets a sheet: what follows is of this one, until the next.
    fn sheet(&mut self) {}
    /// The ray is in a cell, empty or not, of which the sheet leaves or makes `rho` before α, and has
    /// `transmittance` left.
    fn enter(&mut self, _crossing: &Crossing, _cell: Cell, _rho: f32, _transmittance: f32) {}
    /// The cell sends this much of the ambient light to the eye.
    fn ambient(&mut self, _radiance: Vec3) {}
    /// The cell sees the next of the scene's lights by `_visibility` (V), and sends this much of it to
    /// the eye.
    fn light(&mut self, _visibility: f32, _radiance: Vec3) {}
}

impl Observer for () {}

/// One light as a ray sees it.
#[derive(Clone, Copy)]
struct RayLight {
    /// Jᵀl, or J⁻¹l normalised.
    l_v: Vec3,
    /// J⁻¹l.
    l_cell: Vec3,
    places: LightPlaces,
    intensity: Vec3,
    sum: f32,
    /// Where light has a colour of its own in every cell.
    colour: Vec3,
    /// Cosine between light and eye, in the frame where angles are measured.
    l_dot_e: f32,
    row: Row,
    peak: [f32; ORDERS - 1],
}

/// A light's volumes at the corners of a patch, and where in the patch a ray is.
#[derive(Clone, Copy, Default)]
struct LightPlaces {
    /// At (0, 0), (1, 0), (0, 1) and (1, 1) of the patch; all alike where it has one.
    numbers: [u32; 4],
    at: Vec2,
}

impl<'a> Integrator<'a> {
    /// For a scene and its volume, and many rays: light volumes are walked now if there are to be any and `kept`
    /// has not got them; if there are to be none it lets go of the old ones.
    pub fn prepared(
        scene: &'a Scene,
        volume: &'a VolumeTexture,
        kept: &mut KeptVolumes,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let mut integrator = Integrator::new(scene, volume);
        if scene.visibility == Visibility::Cached {
            let light_volumes = LightVolumes::new(scene, volume.size, volume.alpha, scene.light_cache)?;
            integrator.filled = Some(kept.get(&light_volumes, volume, monitor)?);
            integrator.light_volumes = Some(light_volumes);
        } else {
            *kept = KeptVolumes::default();
        }
        Ok(integrator)
    }

    /// For a scene and its volume, and few rays: with cached visibility they walk to the lights as those would
    /// from whom the light volumes are made.
    pub fn new(scene: &'a Scene, volume: &'a VolumeTexture) -> Self {
        Integrator {
            scene,
            volume,
            cells: &volume.cells,
            size: IVec3::from_array(volume.size.map(|n| n as i32)),
            extinction: extinction(&scene.trace.attenuation, volume.alpha),
            flow_cells: flow_cells(scene.flow, volume.size[1]),
            per_cell: matches!(scene.trace.attenuation, Attenuation::PerCell { .. }),
            lights: scene.volume_lights(),
            light_volumes: (scene.visibility == Visibility::Cached).then(|| {
                LightVolumes::new(scene, volume.size, volume.alpha, u64::MAX).expect("what is not kept fits")
            }),
            filled: None,
            medium: Medium::of(scene),
            strand: match &scene.reflection {
                Reflection::Strand(params) => Some(StrandShading::new(params)),
                Reflection::KajiyaKay => None,
            },
            media: (scene.scattering == Scattering::Multiple).then(|| Media::new(scene, volume)),
            profile_of_quad: thicknesses(scene).1,
            haze: scene.haze.seen_from(scene.camera.eye),
        }
    }

    /// One pixel (column, row of the whole image, inside the window of `gbuffer`) of sample `sample`.
    pub fn pixel<O: Observer>(
        &self,
        gbuffer: &Gbuffer,
        pixel: [u32; 2],
        sample: u32,
        observer: &mut O,
    ) -> Traced {
        let image = &self.scene.image;
        let i = gbuffer.window.index(pixel);
        let behind = Vec3::from_slice(&gbuffer.opaque[i]);
        let mut faces = gbuffer.faces(i).peekable();
        if faces.peek().is_none() {
            return Traced { radiance: behind, transmittance: 1.0, cells: [0, 0] };
        }
        let offset = sample_offset(image, sample);
        let d = self.scene.camera.view_ray(image.width, image.height, pixel, offset);
        let mut all = Traced { radiance: Vec3::ZERO, transmittance: 1.0, cells: [0, 0] };
        while let Some((quad, hit)) = faces.next() {
            observer.sheet();
            let is_last = faces.peek().is_none();
            let sheet = self.sheet(quad, d, hit, behind, all.transmittance, is_last, observer);
            all.radiance += sheet.radiance;
            all.transmittance = sheet.transmittance;
            all.cells = [0, 1].map(|c| all.cells[c] + sheet.cells[c]);
            if all.transmittance < self.scene.trace.early_end {
                break;
            }
        }
        if self.haze.density != 0.0
            && let Some((_, [.., t])) = gbuffer.faces(i).next()
        {
            let haze = self.haze.transmittance(d.y, t);
            all.radiance = self.haze.over_water(all.radiance, behind, all.transmittance, haze);
        }
        all
    }

    /// Walks the volume of quad number `quad` from its point `hit` = (u, v, metres) along the world
    /// direction `d_world`, with nothing in front of it and `behind` behind it.
    pub fn trace<O: Observer>(
        &self,
        quad: usize,
        d_world: Vec3,
        hit: [f32; 3],
        behind: Vec3,
        observer: &mut O,
    ) -> Traced {
        self.sheet(quad, d_world, hit, behind, 1.0, true, observer)
    }

    /// One of the sheets of a ray, composited face by face: the ray comes with T = `before` to the face and
    /// goes through the whole slab, though that may reach behind the face of the next. The radiance is that of
    /// this sheet, and what is left of `behind` if the ray ends here: `is_last`, or early.
    #[allow(clippy::too_many_arguments)]
    fn sheet<O: Observer>(
        &self,
        quad: usize,
        d_world: Vec3,
        hit: [f32; 3],
        behind: Vec3,
        before: f32,
        is_last: bool,
        observer: &mut O,
    ) -> Traced {
        let scene = self.scene;
        let quad_number = quad;
        let quad = &scene.quads[quad];
        let map = &quad.map;
        let cells = self.size.as_vec3();
        let frame = CellFrame::new(map, &quad.material, self.volume.size, Vec2::new(hit[0], hit[1]));

        let d_n = d_world.dot(map.n_world);
        let side = if d_n > 0.0 { -1.0 } else { 1.0 };
        let plane = |w: Vec3, n: f32| Vec3::new(w.dot(map.e1_world), w.dot(map.e2_world), n);
        let d = plane(d_world, (d_n * side).min(-1e-6));
        let d_cell = frame.cell_from_plane(d);

        let texture_frame = scene.frame == AngleFrame::Texture;
        let mut metric = Metric {
            m: [
                frame.cx.dot(frame.cx),
                2.0 * frame.cx.dot(frame.cy),
                frame.cy.dot(frame.cy),
                frame.depth * frame.depth,
            ],
        };
        let mut e_v = -frame.transposed(d);
        if texture_frame {
            metric = Metric { m: [1.0, 0.0, 1.0, 1.0] };
            e_v = -d_cell / d_cell.dot(d_cell).sqrt();
        }
        let point = scene.camera.eye + d_world * hit[2];
        let matter = Matter::new(quad, Vec2::new(hit[0], hit[1]));
        // What is left of light volumes' ρ, in the mean over the cells that count.
        let depth_bits = self.extinction * matter.left * if self.per_cell { 1.0 } else { frame.depth };
        let mut lights: Vec<RayLight> = self
            .lights
            .iter()
            .enumerate()
            .map(|(i, light)| {
                let (to_light, intensity) = light.at(point);
                let l = plane(to_light, to_light.dot(map.n_world) * side);
                let l_cell = frame.cell_from_plane(l);
                let l_v =
                    if texture_frame { l_cell / l_cell.dot(l_cell).sqrt() } else { frame.transposed(l) };
                let places = match &self.light_volumes {
                    Some(volumes) => light_places_of(volumes, quad_number, i, Vec2::new(hit[0], hit[1])),
                    None => LightPlaces::default(),
                };
                let cosine = to_light.dot(d_world);
                let l_dot_e = if texture_frame { l_v.dot(e_v) } else { -cosine };
                let mut l_n = to_light.dot(map.n_world) * side;
                if self.per_cell {
                    let c = l_cell.abs();
                    l_n = -l_cell.z / (c.x + c.y + c.z);
                }
                let row = Row::new(l_n, self.volume.size[2]);
                let peak = forward_peak(self.media.as_ref().map_or(0.0, |m| m.similarity.g), cosine);
                let (sum, colour) = (0.0, Vec3::ZERO);
                RayLight { l_v, l_cell, places, intensity, sum, colour, l_dot_e, row, peak }
            })
            .collect();

        let x = (hit[0] * quad.material.repeat_u + quad.offset.x) * cells.x;
        // Where the volume has moved down, what is met lies further up in it.
        let y = (hit[1] * quad.material.repeat_v + quad.offset.y) * cells.y - self.flow_cells;
        let origin = Vec3::new(x - cells.x * (x / cells.x).floor(), y - cells.y * (y / cells.y).floor(), 0.0);
        let mut transmittance = before;
        let mut depth = -before.max(1e-30).log2();
        let mut walked = [0u32; 2];
        let in_colour = self.strand.is_some() || self.media.is_some();
        for crossing in
            Walk::new(self.size, origin, d_cell, f32::INFINITY).take(scene.trace.max_cells as usize)
        {
            if crossing.cell.z >= self.size.z || transmittance < scene.trace.early_end {
                break;
            }
            walked[0] += 1;
            let cell = self.cell(crossing.cell);
            let rho = matter.rho(cell.rho_code());
            observer.enter(&crossing, cell, rho / 65535.0, transmittance);
            if rho <= 0.0 {
                continue;
            }
            let mut tau_bits = rho * self.extinction;
            if !self.per_cell {
                tau_bits *= crossing.t_exit - crossing.t_enter;
            }
            let passed = transmittance * (-tau_bits).exp2();
            let weight = transmittance - passed;
            observer.ambient(scene.ambient * weight);

            let (k_d, k_s) = cell.k_codes();
            let v = cell.v_code();
            let inverse_q = 1.0 / metric.squared(v).max(1e-30);
            let t_dot_e = v.dot(e_v);
            let root = inverse_q.sqrt();
            for light in &mut lights {
                let t_dot_l = v.dot(light.l_v);
                let (seen, light_depth) =
                    self.visibility_of(crossing.cell, light, &matter, depth_bits, &mut walked[1]);
                let fibre = || {
                    if matter.mist > 0.0 {
                        return matter.mist;
                    }
                    let (sin_l, base) = fibre_angles(t_dot_l, t_dot_e, inverse_q);
                    k_d as f32 * sin_l + k_s as f32 * specular_power(base.max(0.0), scene.p)
                };
                if !in_colour {
                    let lit = weight * fibre() * seen;
                    light.sum += lit;
                    observer.light(seen, light.intensity * (lit * (1.0 / 255.0)));
                    continue;
                }
                let mut lit = match &self.strand {
                    Some(strand) if matter.mist == 0.0 => {
                        let [k_d, k_s] = [k_d, k_s].map(|k| k as f32);
                        strand.psi(k_d, k_s, t_dot_l * root, t_dot_e * root, light.l_dot_e) * (weight * seen)
                    }
                    _ => Vec3::splat(weight * seen * fibre() * (1.0 / 255.0)),
                };
                if let Some(media) = &self.media {
                    let profile = &media.profiles[self.profile_of_quad[quad_number] as usize];
                    let diffuse = profile.at(&light.row, crossing.cell.z as u32);
                    lit += multiple(&media.similarity, &light.peak, diffuse, depth, tau_bits, light_depth);
                }
                light.colour += lit;
                observer.light(seen, light.intensity * lit);
            }
            transmittance = passed;
            depth += tau_bits;
        }

        let ends = is_last || transmittance < scene.trace.early_end;
        let passed = if ends { behind * transmittance } else { Vec3::ZERO };
        let mut radiance = scene.ambient * (before - transmittance) + passed;
        for light in &lights {
            let sum = if in_colour { light.colour } else { Vec3::splat(light.sum * (1.0 / 255.0)) };
            radiance += light.intensity * sum;
        }
        Traced { radiance, transmittance, cells: walked }
    }

    /// V_i(k); and −log₂ of it, which is 0 where codes are kept.
    fn visibility_of(
        &self,
        cell: IVec3,
        light: &RayLight,
        matter: &Matter,
        depth_bits: f32,
        walked: &mut u32,
    ) -> (f32, f32) {
        let depth = match self.scene.visibility {
            Visibility::None => 0.0,
            _ if matter.mist > 0.0 => {
                matter.depth(cell.z, light.l_cell, self.size.z, self.per_cell) * self.extinction
            }
            Visibility::March => {
                optical_depth(self.volume, matter, cell, light.l_cell, self.medium, NEVER, walked)
                    * self.extinction
            }
            Visibility::Cached => {
                let kept = self.kept_of(cell, &light.places);
                if self.light_volumes.as_ref().is_some_and(|volumes| volumes.form == Form::Codes) {
                    let transmittance = kept * kept * (1.0 / 65025.0);
                    if matter.left < 1.0 {
                        return ((matter.left * transmittance.max(1e-9).log2()).exp2(), 0.0);
                    }
                    return (transmittance, 0.0);
                }
                kept * depth_bits
            }
        };
        ((-depth).exp2(), depth)
    }

    /// From the light volumes at the corners of the ray's patch.
    fn kept_of(&self, cell: IVec3, places: &LightPlaces) -> f32 {
        let kept = |number: u32| self.kept_at(number as usize, cell);
        let [p00, p10, p01, p11] = places.numbers;
        if places.numbers == [p00; 4] {
            return kept(p00);
        }
        let mix = |a: f32, b: f32, x: f32| a * (1.0 - x) + b * x;
        let near = mix(kept(p00), kept(p10), places.at.x);
        let far = mix(kept(p01), kept(p11), places.at.x);
        mix(near, far, places.at.y)
    }

    fn kept_at(&self, i: usize, cell: IVec3) -> f32 {
        let plan = self.light_volumes.as_ref().expect("visibility is cached");
        match &self.filled {
            Some(filled) => filled[i].at(self.volume.index(cell.x as u32, cell.y as u32, cell.z as u32)),
            None => number(self.volume, cell, &plan.volumes[i], plan.medium, plan.form),
        }
    }

    #[inline]
    fn cell(&self, c: IVec3) -> Cell {
        self.cells[self.volume.index(c.x as u32, c.y as u32, c.z as u32)]
    }
}

fn light_places_of(volumes: &LightVolumes, quad: usize, light: usize, uv: Vec2) -> LightPlaces {
    let patches = volumes.patches[quad * volumes.lights + light];
    let [nu, nv] = patches.count;
    let at = uv * Vec2::new(nu as f32, nv as f32);
    let patch = at.as_uvec2().min(UVec2::new(nu - 1, nv - 1));
    let number = |x: u32, y: u32, row: u32| volumes.numbers[(patches.first + y * row + x) as usize];
    if !patches.cornered {
        return LightPlaces { numbers: [number(patch.x, patch.y, nu); 4], at: Vec2::ZERO };
    }
    let [x, y] = patch.to_array();
    let numbers = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| number(x, y, nu + 1));
    LightPlaces { numbers, at: at - patch.as_vec2() }
}
