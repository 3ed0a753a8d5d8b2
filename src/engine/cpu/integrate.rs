//! §4 and §5 on the CPU. Twin: `shaders/integrate.wgsl`, the same operations in the same order.

mod light;

use glam::{Vec2, Vec3};

use super::gbuffer::Gbuffer;
use super::visibility::{Filled, LightVolumeCache};
use crate::light::fibre::{Metric, Spread, fibre_angles, specular_power};
use crate::light::haze::EyeHaze;
use crate::light::scatter::media::{Media, thicknesses};
use crate::light::scatter::multiple;
use crate::light::strand::table::StrandShading;
use crate::light::visibility::{LightVolumes, Medium};
use crate::light::{AngleFrame, Light, Reflection, Visibility};
use crate::mapping::{CellFrame, Quad, QuadMap};
use crate::picture::camera::{footprint, sample_offset};
use crate::scene::Scene;
use crate::trace::lookup::{CellSample, Level, level_at};
use crate::trace::{Attenuation, Lookup, Prefilter, SheetDensity, extinction, flow_cells};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{Cell, Levels, VolumeTexture, large_box, levels_of};
use crate::walk::{Crossing, Walk};
use light::RayLight;

/// What all pixels of a frame share.
pub struct Integrator<'a> {
    scene: &'a Scene,
    levels: Levels,
    extinction: f32,
    flow_cells: f32,
    per_cell: bool,
    /// Of a sample, see [`footprint`].
    footprint: f32,
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
pub struct RayResult {
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

/// Where a ray meets a sheet: what is constant along it.
struct SheetHit<'a> {
    quad: usize,
    map: &'a QuadMap,
    uv: Vec2,
    frame: CellFrame,
    side: f32,
    d_world: Vec3,
    /// In cells per metre.
    d_cell: Vec3,
    /// On the face, in cells.
    origin: Vec3,
    point: Vec3,
    metric: Metric,
    e_v: Vec3,
    /// What the sheet makes of the volume's own cells, and of coarser ones.
    matter: [SheetDensity; 2],
}

impl SheetHit<'_> {
    fn matter(&self, level: &Level) -> &SheetDensity {
        &self.matter[usize::from(!level.is_whole)]
    }
}

/// What a walk brings home.
struct LevelResult {
    transmittance: f32,
    lights: Vec<RayLight>,
    cells: [u32; 2],
}

impl LevelResult {
    /// Between two levels.
    fn mixed(mut self, other: LevelResult, share: f32) -> LevelResult {
        let own = 1.0 - share;
        self.transmittance = self.transmittance * own + other.transmittance * share;
        for (light, next) in self.lights.iter_mut().zip(other.lights) {
            light.sum = light.sum * own + next.sum * share;
            light.colour = light.colour * own + next.colour * share;
        }
        self.cells = [0, 1].map(|c| self.cells[c] + other.cells[c]);
        self
    }
}

impl<'a> Integrator<'a> {
    /// For a scene and its volume, and many rays: light volumes are walked now if there are to be any and
    /// `kept` has not got them; if there are to be none it lets go of the old ones.
    pub fn prepared(
        scene: &'a Scene,
        volume: &VolumeTexture,
        kept: &mut LightVolumeCache,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let mut integrator =
            Integrator::with_levels(scene, volume, kept.levels.get(volume, scene.pyramid_spec(volume)));
        if scene.visibility == Visibility::Cached {
            let light_volumes = scene.light_volumes(volume.size, volume.alpha, scene.light_cache)?;
            integrator.filled =
                Some(kept.get(&light_volumes, &integrator.levels, scene.trace.lookup, monitor)?);
            integrator.light_volumes = Some(light_volumes);
        } else {
            kept.forget();
        }
        Ok(integrator)
    }

    /// For a scene and its volume, and few rays: with cached visibility they walk to the lights as those
    /// would from whom the light volumes are made.
    pub fn new(scene: &'a Scene, volume: &VolumeTexture) -> Self {
        Integrator::with_levels(scene, volume, levels_of(volume, scene.pyramid_spec(volume)))
    }

    fn with_levels(scene: &'a Scene, volume: &VolumeTexture, levels: Levels) -> Self {
        Integrator {
            scene,
            extinction: extinction(&scene.trace.attenuation, volume.alpha),
            flow_cells: flow_cells(scene.flow, volume.size[1]),
            per_cell: matches!(scene.trace.attenuation, Attenuation::PerCell { .. }),
            footprint: footprint(&scene.camera, &scene.image),
            lights: scene.volume_lights(),
            light_volumes: (scene.visibility == Visibility::Cached).then(|| {
                scene.light_volumes(volume.size, volume.alpha, u64::MAX).expect("what is not kept fits")
            }),
            filled: None,
            medium: Medium::of(&scene.trace),
            strand: match &scene.reflection {
                Reflection::Strand(params) => Some(StrandShading::new(params)),
                Reflection::KajiyaKay => None,
            },
            media: scene.media(volume),
            profile_of_quad: thicknesses(&scene.quads).1,
            haze: scene.haze.seen_from(scene.camera.eye),
            levels,
        }
    }

    /// One pixel (column, row of the whole image, inside the window of `gbuffer`) of sample `sample`.
    pub fn pixel<O: Observer>(
        &self,
        gbuffer: &Gbuffer,
        pixel: [u32; 2],
        sample: u32,
        observer: &mut O,
    ) -> RayResult {
        let image = &self.scene.image;
        let i = gbuffer.window.index(pixel);
        let behind = Vec3::from_slice(&gbuffer.opaque[i]);
        let mut faces = gbuffer.faces(i).peekable();
        if faces.peek().is_none() {
            return RayResult { radiance: behind, transmittance: 1.0, cells: [0, 0] };
        }
        let offset = sample_offset(image, sample);
        let d = self.scene.camera.view_ray(image.width, image.height, pixel, offset);
        let mut all = RayResult { radiance: Vec3::ZERO, transmittance: 1.0, cells: [0, 0] };
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
    ) -> RayResult {
        self.sheet(quad, d_world, hit, behind, 1.0, true, observer)
    }

    /// One of the sheets of a ray, composited face by face: the ray comes with T = `before` to the face and
    /// goes through the whole slab, though that may reach behind the face of the next. The radiance is that
    /// of this sheet, and what is left of `behind` if the ray ends here: `is_last`, or early.
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
    ) -> RayResult {
        let ray = self.passage(quad, d_world, hit);
        let (level, share) = self.level_of(&ray, hit[2]);
        let mut home = self.walk(&ray, &Level::of(&self.levels, level), before, observer);
        if share > 0.0 {
            let next = self.walk(&ray, &Level::of(&self.levels, level + 1), before, observer);
            home = home.mixed(next, share);
        }
        let LevelResult { transmittance, lights, cells } = home;
        let ends = is_last || transmittance < self.scene.trace.early_end;
        let passed = if ends { behind * transmittance } else { Vec3::ZERO };
        let mut radiance = self.scene.ambient * (before - transmittance) + passed;
        for light in &lights {
            let sum = if self.in_colour() { light.colour } else { Vec3::splat(light.sum * (1.0 / 255.0)) };
            radiance += light.intensity * sum;
        }
        RayResult { radiance, transmittance, cells }
    }

    fn in_colour(&self) -> bool {
        self.strand.is_some() || self.media.is_some()
    }

    fn extinction_in(&self, level: &Level) -> f32 {
        if self.per_cell { self.extinction * level.deep() } else { self.extinction }
    }

    /// `hit` = (u, v, metres).
    fn passage(&self, number: usize, d_world: Vec3, hit: [f32; 3]) -> SheetHit<'_> {
        let scene = self.scene;
        let quad = &scene.quads[number];
        let map = &quad.map;
        let uv = Vec2::new(hit[0], hit[1]);
        let size = self.levels[0].size;
        let frame = CellFrame::new(map, &quad.material, size, uv);

        let d_n = d_world.dot(map.n_world);
        let side = if d_n > 0.0 { -1.0 } else { 1.0 };
        let d = Vec3::new(d_world.dot(map.e1_world), d_world.dot(map.e2_world), (d_n * side).min(-1e-6));
        let d_cell = frame.cell_from_plane(d);

        let mut metric = Metric {
            m: [
                frame.cx.dot(frame.cx),
                2.0 * frame.cx.dot(frame.cy),
                frame.cy.dot(frame.cy),
                frame.depth * frame.depth,
            ],
        };
        let mut e_v = -frame.transposed(d);
        if scene.angles == AngleFrame::Texture {
            metric = Metric { m: [1.0, 0.0, 1.0, 1.0] };
            e_v = -d_cell / d_cell.dot(d_cell).sqrt();
        }
        SheetHit {
            quad: number,
            map,
            uv,
            frame,
            side,
            d_world,
            d_cell,
            origin: self.face_point(quad, uv),
            point: scene.camera.eye + d_world * hit[2],
            metric,
            e_v,
            matter: [SheetDensity::new(quad, uv), SheetDensity::of_coarse(quad, uv)],
        }
    }

    /// Where on the face z = 0 the walk begins, inside the tile.
    fn face_point(&self, quad: &Quad, uv: Vec2) -> Vec3 {
        let [nx, ny, _] = self.levels[0].size.map(|n| n as f32);
        let x = (uv.x * quad.material.repeat_u + quad.offset.x) * nx;
        // Where the volume has moved down, what is met lies further up in it.
        let y = (uv.y * quad.material.repeat_v + quad.offset.y) * ny - self.flow_cells;
        Vec3::new(x - nx * (x / nx).floor(), y - ny * (y / ny).floor(), 0.0)
    }

    /// The finer of the two levels that suit the ray `t` metres away, and the share of the coarser.
    fn level_of(&self, ray: &SheetHit, t: f32) -> (u32, f32) {
        if self.scene.trace.filter == Prefilter::None {
            return (0, 0.0);
        }
        let forward = self.scene.camera.forward;
        let level = level_at(self.footprint, forward, ray.d_world, t, &ray.frame, ray.d_cell);
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        (level as u32, level - level.floor())
    }

    /// Through one level of the volume.
    fn walk<O: Observer>(&self, ray: &SheetHit, level: &Level, before: f32, observer: &mut O) -> LevelResult {
        let scene = self.scene;
        let mut lights = self.ray_lights(ray, level);
        let matter = ray.matter(level);
        let extinction = self.extinction_in(level);
        let (origin, d_cell) = (ray.origin * level.scale, ray.d_cell * level.scale);
        let filtered = !level.is_whole || scene.trace.lookup == Lookup::Trilinear;
        let mut transmittance = before;
        let mut depth = -before.max(1e-30).log2();
        let mut walked = [0u32; 2];
        let mut walk = Walk::new(level.size, origin, d_cell, f32::INFINITY);
        let octant = walk.octant();
        let leaps = level.leaps && matter.keeps_empty();
        let most = scene.trace.max_cells;
        while walked[0] < most && walk.cell().z < level.size.z && transmittance >= scene.trace.early_end {
            let cell = level.cell(walk.cell());
            if leaps
                && cell.rho_code() == 0
                && let Some(exponents) = large_box(cell, octant)
            {
                walked[0] = (walked[0] + walk.leap(exponents) + 1).min(most);
                walk.next();
                continue;
            }
            let Some(crossing) = walk.next() else { break };
            walked[0] += 1;
            let found = match scene.trace.lookup {
                Lookup::Trilinear => level.between(&crossing, origin, d_cell, matter),
                Lookup::Nearest => level.found(cell, matter),
            };
            let CellSample { rho, k: [k_d, k_s], moments } = found;
            observer.enter(&crossing, cell, rho / 65535.0, transmittance);
            if rho <= 0.0 {
                continue;
            }
            let mut tau_bits = rho * extinction;
            if !self.per_cell {
                tau_bits *= crossing.t_exit - crossing.t_enter;
            }
            let passed = transmittance * (-tau_bits).exp2();
            let weight = transmittance - passed;
            observer.ambient(scene.ambient * weight);

            let v = cell.v_code();
            let inverse_q = 1.0 / ray.metric.squared(v).max(1e-30);
            let t_dot_e = v.dot(ray.e_v);
            let root = inverse_q.sqrt();
            let spread = filtered.then(|| {
                let moments = moments.unwrap_or_else(|| level.moments(cell));
                Spread::new(&ray.metric, moments, ray.e_v)
            });
            for light in &mut lights {
                let (seen, light_depth) =
                    self.visibility_of(ray, level, crossing.cell, light, &mut walked[1]);
                let fibre = || {
                    if matter.mist > 0.0 {
                        return matter.mist;
                    }
                    if let Some(spread) = &spread {
                        return spread.psi(k_d, k_s, scene.p, light.l_v, light.l_dot_e);
                    }
                    let (sin_l, base) = fibre_angles(v.dot(light.l_v), t_dot_e, inverse_q);
                    k_d * sin_l + k_s * specular_power(base.max(0.0), scene.p)
                };
                if !self.in_colour() {
                    let lit = weight * fibre() * seen;
                    light.sum += lit;
                    observer.light(seen, light.intensity * (lit * (1.0 / 255.0)));
                    continue;
                }
                let mut lit = match &self.strand {
                    Some(strand) if matter.mist == 0.0 => {
                        let [t_dot_l, t_dot_e] = match &spread {
                            Some(spread) => spread.of_one(light.l_v),
                            None => [v.dot(light.l_v) * root, t_dot_e * root],
                        };
                        strand.psi(k_d, k_s, t_dot_l, t_dot_e, light.l_dot_e) * (weight * seen)
                    }
                    _ => Vec3::splat(weight * seen * fibre() * (1.0 / 255.0)),
                };
                if let Some(media) = &self.media {
                    let profile = &media.profiles[self.profile_of_quad[ray.quad] as usize];
                    let diffuse = profile.at(&light.row, self.layer_in(level, crossing.cell.z));
                    lit += multiple(&media.similarity, &light.peak, diffuse, depth, tau_bits, light_depth);
                }
                light.colour += lit;
                observer.light(seen, light.intensity * lit);
            }
            transmittance = passed;
            depth += tau_bits;
        }
        LevelResult { transmittance, lights, cells: walked }
    }

    /// The volume's own layer in the middle of layer `z` of a level.
    fn layer_in(&self, level: &Level, z: i32) -> u32 {
        if level.is_whole {
            return z as u32;
        }
        (((z as f32 + 0.5) * level.deep()) as u32).min(self.levels[0].size[2] - 1)
    }
}
