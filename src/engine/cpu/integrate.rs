//! §4 and §5 on the CPU: rays through the sheets of water, and the light they bring to the eye. Twin:
//! `shaders/engine/integrate.wgsl`, with the same operations in the same order.

mod light;
mod lockstep;
mod shell;
mod shell_light;
mod shell_scatter;
mod walk;

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::gbuffer::Gbuffer;
use super::visibility::{Filled, LightVolumeCache};
use crate::light::fibre::Metric;
use crate::light::haze::EyeHaze;
use crate::light::ramp::{Ink, Ramp};
use crate::light::scatter::media::{Media, MultipleMedium, kinds};
use crate::light::scatter::optics::ShellOptics;
use crate::light::strand::table::StrandShading;
use crate::light::visibility::{LightVolumes, Medium};
use crate::light::{AngleFrame, Light, Visibility};
use crate::mapping::shell::Inside;
use crate::mapping::{CellFrame, Quad, QuadMap};
use crate::picture::camera::{RayFrame, footprint, sample_offset};
use crate::picture::{Camera, SampleTimes};
use crate::place::{DiffuseOfShells, Mesh, QuadShade, ShellShadows};
use crate::scene::{Face, Scene};
use crate::trace::lookup::{Level, STRANDS, StrandTurn, level_at};
use crate::trace::{Attenuation, BillowTimes, Prefilter, SheetDensity, billow, extinction, flow_cells, tear};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::{Cell, Levels, VolumeTexture, levels_of};
use crate::walk::{Crossing, floor_cell};
pub use lockstep::Lanes;
use lockstep::Lockstep;
use shell::Hull;
pub use shell_light::ShellLight;
use shell_light::is_kept_in;
use walk::{LevelResult, Lit};

/// Everything that the rays of a frame share.
pub struct Integrator<'a> {
    scene: &'a Scene,
    volumes: Vec<FrameVolume>,
    per_cell: bool,
    /// Footprint of a sample; see [`footprint`].
    footprint: f32,
    lights: Vec<Light>,
    /// Number of the light that casts shadows, if there is one.
    shadow_light: Option<usize>,
    /// Visibility of the scene, or `Cached` where light volumes stand for walks to the lights.
    visibility: Visibility,
    light_volumes: Option<LightVolumes>,
    /// `None`: values of light volumes are walked on demand.
    filled: Option<Filled>,
    /// `None`: V at the vertices of shells is walked on demand.
    shell_light: Option<Arc<ShellLight>>,
    /// Shadows of opaque matter on shells, if there are any.
    shell_shadows: Option<Arc<ShellShadows>>,
    /// Shade on each quad; empty where there is none.
    on_water: Arc<Vec<QuadShade>>,
    /// How light scatters many times in the shells of each volume, if it does.
    optics: Vec<Option<ShellOptics>>,
    /// J in each shell, if light scatters many times in any.
    diffuse: Option<Arc<DiffuseOfShells>>,
    /// Whether V is kept at the vertices of each shell.
    kept_in: Vec<bool>,
    /// Places of the eye inside the shells.
    eyes: Vec<Option<Inside>>,
    medium: Medium,
    /// Model of the volumes that reflect as strands do. Use [`Integrator::strand_of`].
    strand: Option<StrandShading>,
    /// Whether cells of fibres in shells reflect as strands do. Where they differ, there are no lanes.
    strands_in_shells: bool,
    /// Whether any volume has colours.
    is_colored: bool,
    media: Option<Media>,
    /// Where the billows of mist are.
    billow_times: BillowTimes,
    /// Index of each quad's medium in `media`.
    medium_of_quad: Vec<u32>,
    haze: EyeHaze,
    /// Directions of the view rays.
    rays: RayFrame,
    lanes: Lanes,
}

/// A volume in one frame.
struct FrameVolume {
    levels: Levels,
    /// Number of cells along x, y and z.
    size: [u32; 3],
    /// Optical depth in bits per unit of ρ code (and per metre, unless attenuation is per cell).
    extinction: f32,
    /// Distance that the volume has moved down the flow at the time of the frame, cells.
    flow_cells: f32,
    /// Distance that it moves while the shutter is open, cells.
    flow_moves: f32,
    /// Colours of the cells.
    ramp: Ramp,
    /// Whether the cells reflect as strands do.
    has_strands: bool,
    /// Whether rays walk the lines of the strands where they see less than a cell.
    has_lines: bool,
    /// Ambient light that cells send on, but those of mist.
    ambient: Vec3,
}

impl FrameVolume {
    /// Distance that the volume has moved down the flow at the time of a ray, cells; see [`SampleTimes`].
    #[inline]
    fn flow_at(&self, time: f32) -> f32 {
        self.flow_cells + time * self.flow_moves
    }
}

/// The result of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayResult {
    /// Linear radiance towards the eye, including the scene behind the water.
    pub radiance: Vec3,
    /// T at the end of the walk.
    pub transmittance: f32,
    /// Share of a backdrop behind the scene that shows through all of it: 1 − alpha of a picture that has an
    /// alpha channel.
    pub uncovered: f32,
    /// Number of cells walked by the view ray, and by its light rays.
    pub cells: [u32; 2],
}

/// Observes a ray cell by cell. The empty observer `()` compiles to nothing.
pub trait Observer {
    /// The ray meets a sheet. The following calls belong to it, until the next sheet.
    fn sheet(&mut self) {}
    /// The ray enters a cell, empty or not. `_rho` is the density after the sheet's erosion or mist, without
    /// α; `_transmittance` is T before the cell.
    fn enter(&mut self, _crossing: &Crossing, _cell: Cell, _rho: f32, _transmittance: f32) {}
    /// The cell sends `_radiance` of the ambient light to the eye; in shells in which light scatters many
    /// times, that of all diffuse light.
    fn ambient(&mut self, _radiance: Vec3) {}
    /// The cell sends `_radiance` of the scene's next light to the eye; `_visibility` is V of that light.
    fn light(&mut self, _visibility: f32, _radiance: Vec3) {}
}

impl Observer for () {}

/// The point where a ray meets a sheet, and everything that is constant along the ray behind it.
struct SheetHit<'a> {
    quad: usize,
    /// Number of the quad's volume.
    volume: usize,
    map: &'a QuadMap,
    uv: Vec2,
    frame: CellFrame,
    /// 1 where the ray runs against the quad's normal, −1 where it runs along it.
    side: f32,
    d_world: Vec3,
    /// Direction of the ray, cells per metre.
    d_cell: Vec3,
    /// Point on the face z = 0, cells.
    origin: Vec3,
    /// Point in the world, metres.
    point: Vec3,
    metric: Metric,
    /// Direction to the eye in the frame where angles are measured.
    e_v: Vec3,
    /// The sheet's erosion and mist for the volume's own cells, and for those of coarser levels.
    matter: [SheetDensity; 2],
}

impl SheetHit<'_> {
    fn matter(&self, level: &Level) -> &SheetDensity {
        &self.matter[usize::from(!level.is_whole)]
    }
}

/// Place where a ray meets a sheet.
struct SheetPlace {
    /// Number of the quad.
    quad: usize,
    uv: Vec2,
    /// Point in the world, metres.
    point: Vec3,
}

/// Shares of the light that shade leaves.
struct LightLeft {
    /// Share of the surroundings' light.
    sky: f32,
    /// Share of the light that casts shadows.
    sun: f32,
    shadow_light: Option<usize>,
    /// Number of the scene's own lights, which those of the surroundings follow.
    own: usize,
}

impl LightLeft {
    /// Share that is left of light number `i`.
    #[inline]
    fn of(&self, i: usize) -> f32 {
        match self.shadow_light {
            Some(light) if light == i => self.sun,
            _ if i >= self.own => self.sky,
            _ => 1.0,
        }
    }
}

/// Position of a sheet among those of its ray.
#[derive(Clone, Copy)]
struct SheetOrder {
    /// T before the sheet.
    before: f32,
    /// Whether no sheet follows.
    is_last: bool,
    /// Linear radiance behind all sheets.
    behind: Vec3,
    /// Time of the ray; see [`SampleTimes`].
    time: f32,
    /// Turn of its sample to walk strands.
    turn: StrandTurn,
}

/// Walks the rays of many pixels, in lockstep where that covers the scene.
pub struct Walker<'a> {
    integrator: &'a Integrator<'a>,
    lockstep: Option<Lockstep<'a>>,
}

impl Walker<'_> {
    /// Traces sample `sample` of several pixels inside the window of `gbuffer`, each with the bits of
    /// [`Integrator::pixel`], and calls `result` with the position of each in the list.
    pub fn pixels(
        &mut self,
        gbuffer: &Gbuffer,
        pixels: &[[u32; 2]],
        sample: u32,
        mut result: impl FnMut(usize, RayResult),
    ) {
        match &mut self.lockstep {
            Some(lockstep) => lockstep.pixels(gbuffer, pixels, sample, &mut result),
            None => pixels
                .iter()
                .enumerate()
                .for_each(|(i, &pixel)| result(i, self.integrator.pixel(gbuffer, pixel, sample, &mut ()))),
        }
    }
}

/// A ray through a pixel, on its way through the sheets.
struct PixelRay {
    /// Index of the pixel in the targets of the raster pass.
    i: usize,
    d: Vec3,
    /// Time of the ray; see [`SampleTimes`].
    time: f32,
    /// Turn of its sample to walk strands.
    turn: StrandTurn,
    /// Linear radiance behind all sheets.
    behind: Vec3,
    /// Share of a backdrop that shows behind them.
    shows: f32,
    /// Result so far.
    all: RayResult,
    /// Number of sheets passed.
    sheets: usize,
    /// Whether the ray ended in the last of them.
    ended: bool,
}

/// A quad or shell that a ray meets.
enum Carrier<'a> {
    /// A quad by its number, at u, v and metres from the eye.
    Quad(usize, [f32; 3]),
    /// A shell.
    Hull(Hull<'a>),
}

impl PixelRay {
    /// Returns the next quad or shell that the ray meets, and its position.
    #[inline]
    fn next_sheet<'a>(&self, scene: &'a Scene, gbuffer: &Gbuffer) -> Option<(Carrier<'a>, SheetOrder)> {
        if self.ended {
            return None;
        }
        let (number, hit) = gbuffer.face(self.i, self.sheets)?;
        let is_last = gbuffer.face(self.i, self.sheets + 1).is_none();
        let &PixelRay { behind, time, turn, .. } = self;
        let order = SheetOrder { before: self.all.transmittance, is_last, behind, time, turn };
        let met = match scene.face(number) {
            Face::Quad(_) => Carrier::Quad(number, hit),
            Face::Hull(shell, face) => {
                Carrier::Hull(Hull { shell, face, metres: hit[2], opaque: gbuffer.opaque[self.i][3] })
            }
        };
        Some((met, order))
    }
}

impl<'a> Integrator<'a> {
    /// Prepares a scene, its volumes and its opaque mesh for many rays. With cached visibility the light
    /// volumes come from `cache`, which fills them if they changed; otherwise `cache` drops the old ones.
    ///
    /// # Errors
    /// Errors of `monitor`. With cached visibility, [`Error::Memory`] if the light volumes do not fit into
    /// their budget.
    ///
    /// [`Error::Memory`]: crate::util::error::Error::Memory
    pub fn prepared(
        scene: &'a Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        cache: &mut LightVolumeCache,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        Integrator::prepared_volumes(scene, volumes.as_ref(), mesh, cache, monitor)
    }

    fn prepared_volumes(
        scene: &'a Scene,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
        cache: &mut LightVolumeCache,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let levels = cache.levels.get(volumes, &scene.pyramid_specs(volumes));
        let mut integrator = Integrator::of_levels(scene, volumes, &levels);
        match scene.light_plan(volumes)? {
            Some(plan) => {
                integrator.filled = Some(cache.get(&plan, &levels, scene.trace.lookup, monitor)?);
                integrator.visibility = Visibility::Cached;
                integrator.light_volumes = Some(plan);
            }
            None => cache.forget(),
        }
        if scene.visibility == Visibility::Cached && !scene.shells.is_empty() {
            integrator.shell_light = Some(cache.shell_light(&integrator));
        }
        integrator.with_shadows_of(volumes, mesh, monitor)
    }

    /// Returns the integrator with the shadows that the scene's opaque `mesh` and the skins of shells cast on
    /// shells, with the shade on falling water, and with the diffuse light in shells. Only
    /// [`Integrator::prepared`] has them already.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn with_shadows_of(
        self,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        mesh: &Mesh,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let shell_shadows = self.scene.shadows_on_shells(mesh, monitor)?;
        let shadows = shell_shadows.as_ref();
        let diffuse = self.scene.diffuse_on_shells(volumes.as_ref(), mesh, shadows, monitor)?;
        Ok(Integrator { shell_shadows, on_water: mesh.on_water.clone(), diffuse, ..self })
    }

    /// Prepares a scene and its volumes for a few rays. With cached visibility, the values of light volumes
    /// are walked on demand.
    ///
    /// # Panics
    /// If the scene has another number of volumes.
    pub fn new(scene: &'a Scene, volumes: &(impl AsRef<[VolumeTexture]> + ?Sized)) -> Self {
        let volumes = volumes.as_ref();
        let levels = volumes.iter().zip(scene.pyramid_specs(volumes));
        let levels: Vec<Levels> = levels.map(|(volume, spec)| levels_of(volume, spec)).collect();
        Integrator::of_levels(scene, volumes, &levels)
    }

    /// Prepares a scene, its volumes and the levels of each for a few rays, as [`Integrator::new`].
    ///
    /// # Panics
    /// If the scene has another number of volumes.
    pub fn with_levels(
        scene: &'a Scene,
        volumes: &(impl AsRef<[VolumeTexture]> + ?Sized),
        levels: &[Levels],
    ) -> Self {
        Integrator::of_levels(scene, volumes.as_ref(), levels)
    }

    fn of_levels(scene: &'a Scene, volumes: &[VolumeTexture], levels: &[Levels]) -> Self {
        let (flows, moves) = (scene.flows(volumes), scene.flow_moves(volumes));
        let frame_volume = |(i, (volume, levels)): (usize, (&VolumeTexture, &Levels))| FrameVolume {
            levels: levels.clone(),
            size: volume.size,
            extinction: extinction(&scene.trace.attenuation, volume.alpha),
            flow_cells: flow_cells(flows[i], volume.size[1]),
            flow_moves: moves[i],
            ramp: scene.recipes[i].ramp,
            has_strands: scene.reflection_of(i).strands().is_some(),
            has_lines: scene.recipes[i].has_lines(),
            ambient: scene.ambient * scene.reflection_of(i).ambient_share(),
        };
        let integrator = Integrator {
            scene,
            volumes: volumes.iter().zip(levels).enumerate().map(frame_volume).collect(),
            per_cell: matches!(scene.trace.attenuation, Attenuation::PerCell { .. }),
            footprint: footprint(&scene.camera, &scene.image),
            lights: scene.volume_lights(),
            shadow_light: scene.shadow_light(),
            light_volumes: (scene.visibility == Visibility::Cached)
                .then(|| scene.light_volumes(volumes, u64::MAX).expect("the largest budget fits")),
            visibility: scene.visibility,
            filled: None,
            shell_light: None,
            shell_shadows: None,
            on_water: Arc::default(),
            optics: scene.shell_optics(volumes),
            diffuse: None,
            kept_in: scene
                .shells
                .iter()
                .map(|shell| is_kept_in(shell, volumes[shell.volume as usize].size))
                .collect(),
            eyes: scene.shells.iter().map(|shell| scene.eye_inside(shell)).collect(),
            medium: Medium::of(&scene.trace),
            strand: scene.has_strands().then(|| scene.reflection.shading()).flatten(),
            strands_in_shells: false,
            is_colored: scene.is_colored(),
            media: scene.media(volumes),
            billow_times: BillowTimes::new(scene.wave_flow),
            medium_of_quad: kinds(&scene.quads).1,
            haze: scene.haze.seen_from(scene.camera.eye_local()),
            rays: scene.camera.ray_frame(scene.image.width, scene.image.height),
            lanes: Lanes::best(),
        };
        Integrator { strands_in_shells: integrator.models_in_shells()[1], ..integrator }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Returns the integrator with other lanes for [`Integrator::walker`].
    pub fn with_lanes(self, lanes: Lanes) -> Self {
        Integrator { lanes, ..self }
    }

    /// Traces sample `sample` of a pixel, given by column and row of the whole image. The pixel lies inside
    /// the window of `gbuffer`.
    pub fn pixel<O: Observer>(
        &self,
        gbuffer: &Gbuffer,
        pixel: [u32; 2],
        sample: u32,
        observer: &mut O,
    ) -> RayResult {
        let mut ray = match self.pixel_ray(gbuffer, pixel, sample) {
            Ok(ray) => ray,
            Err(dry) => return dry,
        };
        while let Some((met, order)) = ray.next_sheet(self.scene, gbuffer) {
            observer.sheet();
            let sheet = match met {
                Carrier::Quad(quad, hit) => self.sheet(quad, ray.d, hit, order, observer),
                Carrier::Hull(hull) => self.shell(&hull, ray.d, order, observer),
            };
            self.add(&mut ray, sheet);
        }
        self.seen(gbuffer, ray)
    }

    /// Returns a walker of the rays of many pixels. Each thread has its own.
    pub fn walker(&self) -> Walker<'_> {
        Walker { integrator: self, lockstep: Lockstep::of(self) }
    }

    /// Ray of a pixel before its first sheet, or its result if it meets none.
    #[inline]
    fn pixel_ray(
        &self,
        gbuffer: &Gbuffer,
        pixel: [u32; 2],
        sample: u32,
    ) -> std::result::Result<PixelRay, RayResult> {
        let image = &self.scene.image;
        let i = gbuffer.window.index(pixel);
        let behind = Vec3::from_slice(&gbuffer.opaque[i]);
        let shows = gbuffer.normal[i].w;
        if gbuffer.face(i, 0).is_none() {
            return Err(RayResult { radiance: behind, transmittance: 1.0, uncovered: shows, cells: [0, 0] });
        }
        let offset = sample_offset(image, sample);
        let d = self.rays.direction(Camera::image_point(image.width, image.height, pixel, offset));
        let all = RayResult { radiance: Vec3::ZERO, transmittance: 1.0, uncovered: 1.0, cells: [0, 0] };
        let time = SampleTimes::new(image, sample).of(pixel);
        let turn = StrandTurn::new(image.samples, sample);
        Ok(PixelRay { i, d, time, turn, behind, shows, all, sheets: 0, ended: false })
    }

    /// Adds a sheet to those that a ray has passed.
    #[inline]
    fn add(&self, ray: &mut PixelRay, sheet: RayResult) {
        ray.all.radiance += sheet.radiance;
        ray.all.transmittance = sheet.transmittance;
        ray.all.cells = [0, 1].map(|c| ray.all.cells[c] + sheet.cells[c]);
        ray.sheets += 1;
        ray.ended = ray.all.transmittance < self.scene.trace.early_end;
    }

    /// Result of a ray that has passed all its sheets.
    #[inline]
    fn seen(&self, gbuffer: &Gbuffer, ray: PixelRay) -> RayResult {
        let PixelRay { i, d, behind, shows, mut all, .. } = ray;
        if self.haze.density != 0.0
            && let Some((_, [.., t])) = gbuffer.face(i, 0)
        {
            let haze = self.haze.transmittance(d.y, t);
            all.radiance = self.haze.over_water(all.radiance, behind, all.transmittance, haze);
        }
        all.uncovered = all.transmittance * shows;
        all
    }

    /// Walks the volume of quad number `quad` from its point `hit` = (u, v, metres from the eye) along the
    /// unit world direction `d_world`. Nothing is in front of the quad; `behind` is the linear radiance
    /// behind it. The water stands where it does at the time of the frame.
    pub fn trace<O: Observer>(
        &self,
        quad: usize,
        d_world: Vec3,
        hit: [f32; 3],
        behind: Vec3,
        observer: &mut O,
    ) -> RayResult {
        let turn = StrandTurn::new(self.scene.image.samples, 0);
        let order = SheetOrder { before: 1.0, is_last: true, behind, time: 0.0, turn };
        self.sheet(quad, d_world, hit, order, observer)
    }

    /// Traces one sheet of a ray. Sheets are composited face by face: if a slab extends behind the next
    /// quad's face, it is traced to its end before that quad is entered. The radiance is that of this sheet;
    /// if the ray ends here, it includes the transmitted share of the scene behind.
    fn sheet<O: Observer>(
        &self,
        quad: usize,
        d_world: Vec3,
        hit: [f32; 3],
        order: SheetOrder,
        observer: &mut O,
    ) -> RayResult {
        let before = order.before;
        let ray = self.sheet_hit(quad, d_world, hit, order.time);
        let (level, share) = self.level_of(&ray, hit[2], order.turn);
        let mut result = self.walk_numbered(&ray, level, before, observer);
        if share > 0.0 {
            let next = self.walk_numbered(&ray, level + 1, before, observer);
            result = result.mixed(next, share);
        }
        let LevelResult { transmittance, lit, tint, cells } = result;
        let place = SheetPlace { quad, uv: ray.uv, point: ray.point };
        self.composed(&place, transmittance, cells, (&lit, tint), order)
    }

    /// Walks level `number` of a ray's volume, or its strands, which are level [`STRANDS`].
    fn walk_numbered<O: Observer>(
        &self,
        ray: &SheetHit,
        number: i32,
        before: f32,
        observer: &mut O,
    ) -> LevelResult {
        let levels = &self.volumes[ray.volume].levels;
        if number == STRANDS {
            return self.walk_strands(ray, &Level::new(levels, 0), before, observer);
        }
        self.walk(ray, &Level::new(levels, number as u32), before, observer)
    }

    /// Result of a sheet that a ray meets at a place and that lets `transmittance` pass, in which the lights
    /// send `lit` to the eye. The second part of `lit` is [`LevelResult::tint`].
    #[inline]
    fn composed(
        &self,
        place: &SheetPlace,
        transmittance: f32,
        cells: [u32; 2],
        (lit, tint): (&[Lit], Vec3),
        SheetOrder { before, is_last, behind, .. }: SheetOrder,
    ) -> RayResult {
        let ends = is_last || transmittance < self.scene.trace.early_end;
        let passed = if ends { behind * transmittance } else { Vec3::ZERO };
        let quad = &self.scene.quads[place.quad];
        let shares = self.light_left(place.quad, place.uv);
        let ambient = self.ambient_of(quad.material.volume as usize, quad.mist > 0.0) * shares.sky;
        let mut radiance = ambient * (before - transmittance) + passed;
        if self.is_colored {
            radiance += self.scene.ambient * shares.sky * tint;
        }
        for (i, (light, lit)) in self.lights.iter().zip(lit).enumerate() {
            let intensity = light.at(place.point).1 * shares.of(i);
            let sum = if self.in_colour() { lit.colour } else { Vec3::splat(lit.sum * (1.0 / 255.0)) };
            radiance += intensity * sum;
        }
        RayResult { radiance, transmittance, uncovered: transmittance, cells }
    }

    /// Shares of the light that the shade on quad number `quad` leaves at `uv`.
    #[inline]
    fn light_left(&self, quad: usize, uv: Vec2) -> LightLeft {
        let [sky, sun] = self.on_water.get(quad).map_or([1.0; 2], |shade| shade.left(uv));
        LightLeft { sky, sun, shadow_light: self.shadow_light, own: self.scene.lights.len() }
    }

    /// Ambient light that cells of a volume, of mist or not, send on.
    #[inline]
    fn ambient_of(&self, volume: usize, is_mist: bool) -> Vec3 {
        if is_mist { self.scene.ambient } else { self.volumes[volume].ambient }
    }

    /// Whether cells of fibres in any shell reflect as Kajiya and Kay's, and whether any reflect as strands.
    fn models_in_shells(&self) -> [bool; 2] {
        let mut models = [false; 2];
        for shell in &self.scene.shells {
            if self.optics_of(shell).is_none_or(|optics| optics.surface.is_none()) {
                models[usize::from(self.volume_of(shell).has_strands)] = true;
            }
        }
        models
    }

    /// Model of the cells of a volume, if they reflect as strands do.
    #[inline]
    fn strand_of(&self, volume: usize) -> Option<&StrandShading> {
        self.strand.as_ref().filter(|_| self.volumes[volume].has_strands)
    }

    /// Multiple scattering in a quad, if the scene asks for it.
    fn medium_of(&self, quad: usize) -> Option<&MultipleMedium> {
        self.media.as_ref().map(|media| &media.media[self.medium_of_quad[quad] as usize])
    }

    /// Whether the light of a cell has a colour of its own.
    #[inline]
    fn in_colour(&self) -> bool {
        self.strand.is_some() || self.media.is_some() || self.is_colored
    }

    /// Ink of a cell of volume `volume` with this k_s, if any volume has colours.
    #[inline]
    fn ink(&self, volume: usize, k_s: f32) -> Option<Ink> {
        self.is_colored.then(|| self.volumes[volume].ramp.ink(k_s))
    }

    /// Extinction in the cells of a level of volume `volume`.
    #[inline]
    fn extinction_in(&self, volume: usize, level: &Level) -> f32 {
        let extinction = self.volumes[volume].extinction;
        if self.per_cell { extinction * level.depth_in_cells() } else { extinction }
    }

    /// Maps a ray to the cells of quad number `number`, which it meets at `hit` = (u, v, metres from the
    /// eye) at this time ([`SampleTimes`]).
    #[inline]
    fn sheet_hit(&self, number: usize, d_world: Vec3, hit: [f32; 3], time: f32) -> SheetHit<'_> {
        let scene = self.scene;
        let quad = &scene.quads[number];
        let map = &quad.map;
        let uv = Vec2::new(hit[0], hit[1]);
        let volume = quad.material.volume as usize;
        let frame = CellFrame::new(map, &quad.material, self.volumes[volume].size, uv);

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
            metric = Metric::IDENTITY;
            e_v = -d_cell / d_cell.dot(d_cell).sqrt();
        }
        // A distant eye leaves float32 no digits along the ray.
        let point = map.point_world(uv.x, uv.y);
        let origin = self.face_point(quad, uv, time);
        let torn = match quad.is_torn() {
            true => {
                let [nx, ny, _] = self.volumes[volume].size.map(|n| n as f32);
                let place = Vec2::new(origin.x / nx, origin.y / ny);
                let seen = self.seen_level(volume, &frame, [d_world, d_cell], hit[2]);
                tear::erosion(&quad.tear, uv.y, place, nx, seen.unwrap_or(0.0))
            }
            false => 0.0,
        };
        let mut matter = [SheetDensity::new(quad, uv, torn), SheetDensity::of_coarse(quad, uv, torn)];
        if quad.mist > 0.0 && quad.material.billow.strength > 0.0 {
            let factor = billow::factor(&quad.material.billow, &self.billow_times, point);
            matter = matter.map(|matter| matter.billowed(factor));
        }
        SheetHit {
            quad: number,
            volume,
            map,
            uv,
            frame,
            side,
            d_world,
            d_cell,
            origin,
            point,
            metric,
            e_v,
            matter,
        }
    }

    /// Returns the point on the face z = 0 where the walk begins, in cells, inside the tile.
    #[inline]
    fn face_point(&self, quad: &Quad, uv: Vec2, time: f32) -> Vec3 {
        let volume = &self.volumes[quad.material.volume as usize];
        let [nx, ny, _] = volume.size.map(|n| n as f32);
        let x = (uv.x * quad.material.repeat_u + quad.offset.x) * nx;
        // After the volume has moved down the flow, the ray meets a point further up in it.
        let y = (uv.y * quad.material.repeat_v + quad.offset.y) * ny - volume.flow_at(time);
        let copy = |at: f32, n: f32| floor_cell(at / n) as f32;
        Vec3::new(x - nx * copy(x, nx), y - ny * copy(y, ny), 0.0)
    }

    /// Returns the level, no whole number, whose cells suit a ray `t` metres from the eye. `None` where all
    /// rays walk the volume itself. `directions` are those in the world and in cells.
    #[inline]
    fn seen_level(&self, volume: usize, frame: &CellFrame, directions: [Vec3; 2], t: f32) -> Option<f32> {
        if self.scene.trace.filter == Prefilter::None && !self.volumes[volume].has_lines {
            return None;
        }
        let [d_world, d_cell] = directions;
        let forward = self.scene.camera.forward.as_vec3();
        let area = frame.det.abs() * frame.depth * d_cell.length();
        Some(level_at(self.footprint, forward, d_world, t, area))
    }

    /// Returns the finer of the two levels whose cells suit the ray `t` metres from the eye, and the share of
    /// the coarser. Where a pixel sees less than a cell, it walks the strands, level [`STRANDS`], if there
    /// are any.
    #[inline]
    fn level_of(&self, ray: &SheetHit, t: f32, turn: StrandTurn) -> (i32, f32) {
        let volume = &self.volumes[ray.volume];
        let seen = self.seen_level(ray.volume, &ray.frame, [ray.d_world, ray.d_cell], t);
        let Some(level) = seen else { return (0, 0.0) };
        let keeps_lines = volume.has_lines && ray.matter[0].mist == 0.0;
        let coarsest = (volume.levels.len() - 1) as f32;
        let level = turn.level(level, keeps_lines, coarsest);
        (level.floor() as i32, level - level.floor())
    }
}
