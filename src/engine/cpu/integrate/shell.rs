//! §3 to §5 on the CPU: the way of a ray through a shell, tetrahedron by tetrahedron.
//!
//! Angles in a shell are measured with the fibre's direction in the world, t = J·v. A quad turns light and
//! eye into its cells once for all cells of a ray; here J changes from cell to cell, and most are empty.

use glam::{Mat3, Vec2, Vec3};

use super::shell_scatter::{ScatterCell, color_of, depth_between};
use super::{FrameVolume, Integrator, Observer, RayResult, SheetOrder};
use crate::light::AngleFrame;
use crate::light::fibre::{Metric, Spread, psi_parts};
use crate::light::ramp::Ink;
use crate::light::scatter::optics::{Passage, within};
use crate::light::strand::ROOT_TO_TIP;
use crate::mapping::shell::{End, HullFace, Segment, Shell, ShellPath};
use crate::trace::lookup::{CellSample, Level, level_at};
use crate::trace::{Lookup, Prefilter, SheetDensity};
use crate::util::powers::exp2;
use crate::volume::{Cell, Moments};
use crate::walk::{Walk, floor_cell};

/// A face of the hull of a shell under a pixel.
pub struct Hull<'a> {
    /// Number of the shell.
    pub shell: usize,
    pub face: &'a HullFace,
    /// Distance of the face, and of the opaque scene (0: none), from the eye, metres.
    pub metres: f32,
    pub opaque: f32,
}

/// Start of a ray in a shell.
pub(super) struct ShellStart<'a> {
    /// Path, if the ray has one.
    pub path: Option<ShellPath<'a>>,
    /// Origin of the path, and its distance from the eye, metres.
    pub origin: Vec3,
    pub metres: f32,
    /// Distance of the opaque scene from the origin, metres.
    pub t_end: f32,
    /// Parameter where the ray begins, metres: that of the eye inside a box. Other rays begin with their
    /// path.
    pub t_begin: f32,
}

/// A place in a tetrahedron of a shell.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// Number of the shell.
    pub shell: usize,
    /// Prism, and number of the tetrahedron in it.
    pub tetrahedron: [usize; 2],
    /// Shares of the prism's vertices, and the depth from the outer surface, 0 to 1.
    pub shares: Vec3,
    pub depth: f32,
    /// The place in the world, metres.
    pub point: Vec3,
    /// Time of the ray; see [`SampleTimes`](crate::picture::SampleTimes).
    pub time: f32,
}

impl Place {
    /// Place on a ray in a tetrahedron, `t` metres behind the start of its `segment` of this `length`. The
    /// ray has an origin, a direction and a time.
    #[inline]
    pub fn on_ray(
        shell: usize,
        segment: &Segment,
        (origin, d, time): (Vec3, Vec3, f32),
        t: f32,
        length: f32,
    ) -> Place {
        let along = t / length;
        Place {
            shell,
            tetrahedron: [segment.prism, segment.tetrahedron],
            shares: segment.shares[0].lerp(segment.shares[1], along),
            depth: segment.at[0].z + (segment.at[1].z - segment.at[0].z) * along,
            point: origin + d * (segment.t[0] + t),
            time,
        }
    }
}

/// A ray inside a shell.
struct ShellRay<'a> {
    number: usize,
    shell: &'a Shell,
    /// Origin of the path, near the face it enters through, and its distance from the eye, metres.
    origin: Vec3,
    metres: f32,
    d: Vec3,
    time: f32,
    /// T at the start, and here.
    start: f32,
    transmittance: f32,
    /// Places of the frame and of J in the last occupied cell, and its colour, if light scatters many times
    /// in the shell.
    last: Option<([Place; 2], Vec3)>,
    /// Linear radiance that cells of the volume itself, and coarser ones, have sent to the eye.
    radiance: [Vec3; 2],
    /// Cells walked by the view ray, and by its light rays.
    cells: [u32; 2],
}

/// Directions of the fibres in a cell, in the frame where angles are measured.
pub(super) enum Fibres {
    /// One direction, of any length.
    One(Vec3),
    /// Second moments of several.
    Many(Moments),
}

/// A part of a ray in cells: where it begins, inside the tile, and its direction per metre.
pub(super) fn in_cells(segment: &Segment, size: [u32; 3], flow_cells: f32) -> (Vec3, Vec3) {
    let n = Vec3::from_array(size.map(|n| n as f32));
    let [from, to] = segment.at.map(|at| at * n);
    let length = segment.t[1] - segment.t[0];
    let direction = if length > 0.0 { (to - from) / length } else { Vec3::Z };
    (wrapped(from - Vec3::Y * flow_cells, n.truncate()), direction)
}

/// Way from root to tip in the world, a covector of any length, of cells with the Jacobian `j`.
#[inline]
fn way_of(j: &Mat3) -> Vec3 {
    // The rows of J⁻¹ times the determinant.
    let (row_x, row_y, row_z) =
        (j.y_axis.cross(j.z_axis), j.z_axis.cross(j.x_axis), j.x_axis.cross(j.y_axis));
    let way = row_x * ROOT_TO_TIP.x + row_y * ROOT_TO_TIP.y + row_z * ROOT_TO_TIP.z;
    if j.x_axis.dot(row_x) < 0.0 { -way } else { way }
}

/// A point in cells, moved into a tile of `n` cells.
pub(super) fn wrapped(at: Vec3, n: Vec2) -> Vec3 {
    let copies = at.truncate() / n;
    Vec3::new(at.x - n.x * floor_cell(copies.x) as f32, at.y - n.y * floor_cell(copies.y) as f32, at.z)
}

impl Integrator<'_> {
    /// Walks through a shell until the ray leaves it or ends at the opaque scene.
    pub(super) fn shell<O: Observer>(
        &self,
        hull: &Hull,
        d: Vec3,
        order: SheetOrder,
        observer: &mut O,
    ) -> RayResult {
        let scene = self.scene;
        let shell = &*scene.shells[hull.shell];
        let ShellStart { path, origin, metres, t_end, t_begin } = self.shell_start(hull, d);
        let mut ray = ShellRay {
            number: hull.shell,
            shell,
            origin,
            metres,
            d,
            time: order.time,
            start: order.before,
            transmittance: order.before,
            last: None,
            radiance: [Vec3::ZERO; 2],
            cells: [0; 2],
        };
        for segment in path.into_iter().flatten() {
            if segment.t[0] >= t_end || ray.transmittance < scene.trace.early_end {
                break;
            }
            self.through(&mut ray, &segment.from(t_begin).until(t_end), observer);
        }
        let beyond = match &ray.last {
            Some((places, color)) if ray.transmittance < scene.trace.early_end => {
                self.beyond_end(places, *color, d, [ray.start, ray.transmittance])
            }
            _ => Vec3::ZERO,
        };
        self.left_shell(shell, order, ray.transmittance, (ray.radiance, beyond), ray.cells)
    }

    /// Start of a ray in the direction `d` from a hull's face on, or from the eye inside a box.
    pub(super) fn shell_start(&self, hull: &Hull, d: Vec3) -> ShellStart<'_> {
        let shell = &*self.scene.shells[hull.shell];
        let end = |metres: f32| if hull.opaque > 0.0 { hull.opaque - metres } else { f32::INFINITY };
        if hull.face.is_eye() {
            let path =
                self.eyes[hull.shell].and_then(|eye| ShellPath::inside(shell, eye.tetrahedron, eye.point, d));
            let origin = self.eyes[hull.shell].map_or(Vec3::ZERO, |eye| eye.point);
            return ShellStart { path, origin, metres: 0.0, t_end: end(0.0), t_begin: 0.0 };
        }
        let metres = hull.metres;
        let origin = (self.scene.camera.eye_local() + d.as_dvec3() * f64::from(metres)).as_vec3();
        let path = Some(ShellPath::new(shell, hull.face, origin, d));
        ShellStart { path, origin, metres, t_end: end(metres), t_begin: f32::NEG_INFINITY }
    }

    /// Result of a ray behind a shell. `radiance` is what cells of the volume itself, and coarser ones, have
    /// sent to the eye, and `beyond` comes from behind the ray's end ([`Integrator::beyond_end`]).
    pub(super) fn left_shell(
        &self,
        shell: &Shell,
        SheetOrder { before, is_last, behind, .. }: SheetOrder,
        transmittance: f32,
        (radiance, beyond): ([Vec3; 2], Vec3),
        cells: [u32; 2],
    ) -> RayResult {
        let ends = is_last || transmittance < self.scene.trace.early_end;
        let passed = if ends { behind * transmittance } else { Vec3::ZERO };
        // Diffuse light in a medium with optics holds the ambient light.
        let even = match self.optics_of(shell) {
            Some(_) => beyond,
            None => self.volume_of(shell).ambient * (before - transmittance),
        };
        let radiance = radiance[0] + radiance[1] + even + passed;
        RayResult { radiance, transmittance, uncovered: transmittance, cells }
    }

    /// Walks through a tetrahedron.
    fn through<O: Observer>(&self, ray: &mut ShellRay, segment: &Segment, observer: &mut O) {
        // A triangle without an area in the texture shows nothing of it.
        let Some(volumes) = &ray.shell.prisms[segment.prism].volumes else { return };
        // Where a ray only touches a tetrahedron, mixing two levels would round T.
        if segment.t[1] <= segment.t[0] {
            return;
        }
        let volume = self.volume_of(ray.shell);
        let (origin, d_cell) = in_cells(segment, volume.size, volume.flow_at(ray.time));
        let (mut level, mut share) = (0, 0.0);
        if self.scene.trace.filter != Prefilter::None {
            let [nx, ny, nz] = volume.size.map(|n| n as f32);
            let forward = self.scene.camera.forward.as_vec3();
            let area = volumes[segment.tetrahedron] / (nx * ny * nz) * d_cell.length();
            let exact = level_at(self.footprint, forward, ray.d, ray.metres + segment.t[0], area);
            let exact = exact.clamp(0.0, (volume.levels.len() - 1) as f32);
            (level, share) = (exact as u32, exact - exact.floor());
        }
        let before = ray.transmittance;
        let walk = (origin, d_cell);
        self.in_level(ray, segment, walk, &Level::new(&volume.levels, level), 1.0 - share, observer);
        if share > 0.0 {
            let fine = std::mem::replace(&mut ray.transmittance, before);
            self.in_level(ray, segment, walk, &Level::new(&volume.levels, level + 1), share, observer);
            ray.transmittance = fine * (1.0 - share) + ray.transmittance * share;
        }
    }

    /// Walks through the cells of one level in a tetrahedron. Their light counts by `share`.
    fn in_level<O: Observer>(
        &self,
        ray: &mut ShellRay,
        segment: &Segment,
        (origin, d_cell): (Vec3, Vec3),
        level: &Level,
        share: f32,
        observer: &mut O,
    ) {
        let scene = self.scene;
        let optics = self.optics_of(ray.shell);
        let (origin, d_cell) = (origin * level.scale, d_cell * level.scale);
        let length = segment.t[1] - segment.t[0];
        let mut walk = Walk::new(level.size, origin, d_cell, length);
        while ray.cells[0] < scene.trace.max_cells
            && (0..level.size.z).contains(&walk.cell().z)
            && ray.transmittance >= scene.trace.early_end
        {
            let cell = level.cell(walk.cell());
            let Some(crossing) = walk.next() else { break };
            ray.cells[0] += 1;
            let sample = match scene.trace.lookup {
                Lookup::Trilinear => level.sample_trilinear(
                    &crossing,
                    origin,
                    d_cell,
                    &SheetDensity::WHOLE,
                    ray.shell.is_single,
                ),
                Lookup::Nearest | Lookup::Strand => level.sample_cell(cell, &SheetDensity::WHOLE),
            };
            observer.enter(&crossing, cell, sample.rho / 65535.0, ray.transmittance);
            if sample.rho <= 0.0 {
                continue;
            }
            let tau_bits =
                sample.rho * self.volume_of(ray.shell).extinction * (crossing.t_exit - crossing.t_enter);
            let passed = ray.transmittance * exp2(-tau_bits);
            let weight = (ray.transmittance - passed) * share;
            let ink = self.ink(ray.shell.volume as usize, sample.k[1]);
            let k = [sample.k[0], ink.map_or(sample.k[1], |ink| ink.k_s)];
            let place_at =
                |t: f32| Place::on_ray(ray.number, segment, (ray.origin, ray.d, ray.time), t, length);
            let place = match optics {
                Some(_) => {
                    place_at(crossing.t_enter + (crossing.t_exit - crossing.t_enter) * within(tau_bits)[0])
                }
                None => place_at(0.5 * (crossing.t_enter + crossing.t_exit)),
            };
            let j = self.frame(ray.shell, &place);
            let fibres = self.fibres(level, cell, &sample, &j);
            if let Some(optics) = optics {
                let view = depth_between(ray.start, ray.transmittance);
                let deep =
                    place_at(crossing.t_enter + (crossing.t_exit - crossing.t_enter) * within(tau_bits)[1]);
                let cell = ScatterCell {
                    place: &place,
                    deep: &deep,
                    d: ray.d,
                    j: &j,
                    k,
                    ink,
                    fibres: &fibres,
                    moments: sample.moments.unwrap_or_else(|| level.moments(cell)),
                    weight,
                    passage: Passage { start: ray.start * share, view, cell: tau_bits },
                };
                let sum = self.scattered(optics, level, &cell, &mut ray.cells[1], observer);
                ray.radiance[usize::from(!level.is_whole)] += sum;
                ray.transmittance = passed;
                ray.last = Some(([place, deep], color_of(ink)));
                continue;
            }
            let more = ink.map_or(Vec3::ZERO, |ink| scene.ambient * ((ink.color - Vec3::ONE) * weight));
            observer.ambient(self.volume_of(ray.shell).ambient * weight + more);
            let mut sum = more;
            for i in 0..self.lights.len() {
                let visibility = self.shell_visibility(level, &place, i, &mut ray.cells[1]);
                let lit = self.shell_light_of(&fibres, (k, ink), &j, (&place, ray.d), i);
                let radiance = lit * (weight * visibility);
                observer.light(visibility, radiance);
                sum += radiance;
            }
            ray.radiance[usize::from(!level.is_whole)] += sum;
            ray.transmittance = passed;
        }
    }

    /// The volume of a shell.
    pub(super) fn volume_of(&self, shell: &Shell) -> &FrameVolume {
        &self.volumes[shell.volume as usize]
    }

    /// J at a place in a prism that has an area in the texture; see [`Shell::frame`].
    pub(super) fn frame(&self, shell: &Shell, place: &Place) -> Mat3 {
        let [nx, ny, nz] = self.volume_of(shell).size.map(|n| 1.0 / n as f32);
        let [x, y, z] = shell.frame(place.tetrahedron[0], place.shares, place.depth);
        Mat3::from_cols(x * nx, y * ny, z * nz)
    }

    /// Directions in a cell, in the frame where angles are measured.
    fn fibres(&self, level: &Level, cell: Cell, sample: &CellSample, j: &Mat3) -> Fibres {
        let j = if self.scene.angles == AngleFrame::Texture { Mat3::IDENTITY } else { *j };
        if level.is_whole && self.scene.trace.lookup != Lookup::Trilinear {
            return Fibres::One(j * cell.v_code());
        }
        Fibres::Many(sample.moments.unwrap_or_else(|| level.moments(cell)).mapped(&j))
    }

    /// Light of light number `i` that a cell at `place` sends against the direction `d`, without the share of
    /// the cell and without V.
    pub(super) fn shell_light_of(
        &self,
        fibres: &Fibres,
        ([k_d, k_s], ink): ([f32; 2], Option<Ink>),
        j: &Mat3,
        (place, d): (&Place, Vec3),
        i: usize,
    ) -> Vec3 {
        let (to_light, intensity) = self.lights[i].at(place.point);
        let frame = |v: Vec3| match self.scene.angles {
            AngleFrame::World => v,
            AngleFrame::Texture => (j.inverse() * v).normalize_or_zero(),
        };
        let (l, e) = (frame(to_light), frame(-d));
        let l_dot_e = l.dot(e);
        let (p, identity) = (self.scene.p, Metric::IDENTITY);
        let volume = self.scene.shells[place.shell].volume as usize;
        let parts = match (self.strand_of(volume), fibres) {
            (None, Fibres::One(t)) => {
                let inverse_q = 1.0 / t.length_squared().max(1e-30);
                psi_parts([k_d, k_s], p, t.dot(l), t.dot(e), inverse_q)
            }
            (None, Fibres::Many(moments)) => {
                Spread::new(&identity, *moments, e).psi_parts([k_d, k_s], p, l, l_dot_e)
            }
            (Some(strand), fibres) => {
                let [t_dot_l, t_dot_e] = match fibres {
                    Fibres::One(t) => {
                        let root = (1.0 / t.length_squared().max(1e-30)).sqrt();
                        [t.dot(l) * root, t.dot(e) * root]
                    }
                    Fibres::Many(moments) => {
                        let way =
                            if self.scene.angles == AngleFrame::Texture { ROOT_TO_TIP } else { way_of(j) };
                        strand.cosines(&Spread::new(&identity, *moments, e), l, way)
                    }
                };
                return intensity * strand.psi(k_d, k_s, t_dot_l, t_dot_e, l_dot_e);
            }
        };
        match ink {
            Some(ink) => intensity * (ink.lit(parts) * (1.0 / 255.0)),
            None => intensity * ((parts[0] + parts[1]) * (1.0 / 255.0)),
        }
    }

    /// Optical depth, Σ ρ code × metres, from a place to where the light ray along the unit vector `l` leaves
    /// the shell, or to the light `far` metres away. Infinite where the ray leaves into opaque matter. The
    /// ray ends in the tetrahedron where the depth reaches `enough`.
    pub(super) fn shell_depth(
        &self,
        level: &Level,
        place: &Place,
        (l, far): (Vec3, f32),
        enough: f32,
        walked: &mut u32,
    ) -> f32 {
        let shell = &*self.scene.shells[place.shell];
        let Some(path) = ShellPath::inside(shell, place.tetrahedron, place.point, l) else { return 0.0 };
        let volume = self.volume_of(shell);
        let (size, flow_cells) = (volume.size, volume.flow_at(place.time));
        let n = Vec2::new(size[0] as f32, size[1] as f32);
        let most = self.scene.trace.max_cells;
        let (mut depth, mut count) = (0.0, 0);
        for segment in path {
            if segment.t[0] >= far || count >= most || depth >= enough {
                break;
            }
            let (origin, direction) = in_cells(&segment, size, flow_cells);
            let start = (-segment.t[0]).max(0.0);
            let end = segment.t[1].min(far) - segment.t[0] - start;
            if end > 0.0 && shell.is_mapped(segment.prism) {
                let origin = wrapped(origin + direction * start, n) * level.scale;
                let mut walk = Walk::new(level.size, origin, direction * level.scale, end);
                while count < most && (0..level.size.z).contains(&walk.cell().z) {
                    let rho = level.cell(walk.cell()).rho_code() as f32;
                    let Some(crossing) = walk.next() else { break };
                    depth += rho * (crossing.t_exit - crossing.t_enter);
                    count += 1;
                }
            }
            if segment.end == End::Inner && shell.skin && segment.t[1] < far {
                depth = f32::INFINITY;
            }
        }
        *walked += count;
        depth
    }
}
