//! Sheets of falling water: profiles from above the lip down to the foot, tessellated into quads.
//!
//! A point of a sheet is P(s) + w(s)·C(u), where P is the profile, w the width and C a cross-section whose
//! shape is the same everywhere. All rows are parallel, so every quad is a planar trapezoid, however the
//! profile bends.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::{Material, Quad, QuadFault, QuadMap, Surges, Tear, Tears};

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;
/// Number of straight pieces that stand for each span of the spline. Where a span turns by a right angle,
/// their length is 1e-4 shorter than the arc's.
const PIECES: usize = 64;
/// Smallest speed of thrown water, as a share of the speed at the first point. The steepest arc of a splash,
/// 87°, has 0.052 of it at the top.
const MIN_SPEED: f64 = 0.05;

/// Description of a sheet.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Points of the profile, metres. There are at least two, and no two neighbours coincide.
    pub points: Vec<Vec3>,
    /// Width at each point of the profile, metres.
    pub widths: Vec<f32>,
    /// Unit direction of the rows.
    pub across: Vec3,
    /// Number of quads along the profile.
    pub segments: u32,
    /// Least number of quads across. Eroded sides add borders of their own.
    pub columns: u32,
    /// Bend of the cross-section, as a share of a full turn: 0 is flat, 1 is a tube.
    pub round: f32,
    /// Speed of the water at the first point, m/s.
    pub v0: f32,
    /// Spread of the texture along the profile, from even in length (0) to even in the time of the fall (1).
    pub stretch: f32,
    /// Texture position of the first corner, in copies of the volume along u and v.
    pub offset: Vec2,
    /// Erosion towards the borders.
    pub ends: Ends,
    /// Erosion between surges.
    pub surges: Surges,
    /// Holes.
    pub tears: Tears,
    /// Material of all quads. Its numbers of copies count over the whole sheet.
    pub material: Material,
    /// [`Quad::mist`] of all quads.
    pub mist: f32,
}

/// Erosion of ρ towards a sheet's borders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ends {
    /// Share of the half width over which the sides are eroded.
    pub edge: f32,
    /// Erosion at the foot. It grows with the square of the way along the profile.
    pub breakup: f32,
    /// Share of the profile over which the foot fades to nothing.
    pub fade: f32,
    /// Share of the profile over which the head grows from nothing.
    pub head: f32,
    /// Whether what is left is squared, so that it ends without a kink: billows would show one as a border.
    pub is_soft: bool,
}

impl Ends {
    /// Erosion e at `u` across the sheet and at the share `way` along the profile, both 0 to 1. What is left,
    /// 1 − e, is the product of what the sides, the break-up and the two ends leave.
    pub fn erosion(&self, u: f32, way: f32) -> f32 {
        let ramp = |distance: f32, share: f32| match share > 0.0 {
            true => (distance / share).clamp(0.0, 1.0),
            false => 1.0,
        };
        let sides = ramp(2.0 * u.min(1.0 - u).max(0.0), self.edge);
        let broken = 1.0 - self.breakup * way * way;
        let left = sides * broken * ramp(1.0 - way, self.fade) * ramp(way, self.head);
        1.0 - if self.is_soft { left * left } else { left }
    }

    /// Values of u at which e has a kink.
    fn borders(&self) -> [f32; 2] {
        [0.5 * self.edge, 1.0 - 0.5 * self.edge]
    }
}

/// Point on the profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Position in the world, metres.
    pub point: DVec3,
    /// Width of the sheet, metres.
    pub width: f64,
    /// Arc length from the first point, metres.
    pub arc: f64,
    /// Time of the water's way from the first point, s.
    pub time: f64,
}

/// Reason why a sheet cannot be tessellated: one of its quads is invalid.
#[derive(Clone, Copy, Debug)]
pub struct SheetFault {
    /// Number of the quad along the profile, from 0 at the lip.
    pub segment: usize,
    /// Number of the quad across, from 0 at u = 0.
    pub column: usize,
    /// Fault of this quad.
    pub fault: QuadFault,
}

impl Sheet {
    /// Ends of the profile's straight pieces, with arc length and time.
    ///
    /// The speed is v(s) = √(v0² + 2 g Δh), where Δh is the fall since the first point. A profile that rises
    /// higher than this speed allows is no path of thrown water: a stream pushes the water over the rise. Its
    /// speed is never below v0. Otherwise the texture would pile up there, and little of it would be left for
    /// the fall. On a straight piece the acceleration is constant, so the time ∫ds/v is exactly 2Δs/(v + v′).
    pub fn stations(&self) -> Vec<Station> {
        let spline = spline(&self.points, &self.widths);
        let speed = Speed::new(self, spline.iter().map(|(point, _)| point.y));
        let mut stations: Vec<Station> = Vec::new();
        for (point, width) in spline {
            let next = match stations.last() {
                Some(last) => speed.next(last, point, width),
                None => Station { point, width, arc: 0.0, time: 0.0 },
            };
            stations.push(next);
        }
        stations
    }

    /// Texture position, 0 to 1, of the station `at` on a profile that ends at `last`.
    pub fn along(&self, at: &Station, last: &Station) -> f64 {
        let stretch = f64::from(self.stretch);
        (1.0 - stretch) * at.arc / last.arc + stretch * at.time / last.time
    }

    /// Stations of the rows. They are even in the mean of arc length and texture position, so that neither
    /// the bend at the lip nor the long streaks at the foot are cut too coarsely.
    pub fn rows(&self) -> Vec<Station> {
        let stations = self.stations();
        let last = stations[stations.len() - 1];
        let speed = Speed::new(self, stations.iter().map(|at| at.point.y));
        let position = |at: &Station| 0.5 * at.arc / last.arc + 0.5 * self.along(at, &last);
        let mut piece = 0;
        let row = |n: u32| {
            if n == self.segments {
                return last;
            }
            let wanted = f64::from(n) / f64::from(self.segments);
            while piece + 2 < stations.len() && position(&stations[piece + 1]) <= wanted {
                piece += 1;
            }
            let (a, b) = (&stations[piece], &stations[piece + 1]);
            let part = ((wanted - position(a)) / (position(b) - position(a))).clamp(0.0, 1.0);
            speed.next(a, a.point.lerp(b.point, part), a.width + (b.width - a.width) * part)
        };
        (0..=self.segments).map(row).collect()
    }

    /// Values of u, from 0 to 1, at the borders of the columns.
    pub fn borders(&self) -> Vec<f32> {
        let mut borders: Vec<f32> = (0..=self.columns).map(|i| i as f32 / self.columns as f32).collect();
        if self.ends.edge > 0.0 {
            for border in self.ends.borders() {
                if borders.iter().all(|b| (b - border).abs() > 1e-3) {
                    borders.push(border);
                }
            }
            borders.sort_by(f32::total_cmp);
        }
        borders
    }

    /// Cross-section at u, in widths: its coordinates along `across` and out of the sheet. It is an arc as
    /// wide as the sheet.
    fn section(&self, u: f32) -> DVec2 {
        let turn = std::f64::consts::TAU * f64::from(self.round);
        let angle = (f64::from(u) - 0.5) * turn;
        if turn < 1e-3 {
            return DVec2::new(f64::from(u) - 0.5, 0.0);
        }
        let radius = 0.5 / (0.5 * turn.min(std::f64::consts::PI)).sin();
        DVec2::new(angle.sin(), angle.cos() - 1.0) * radius
    }

    /// Share of the water that is torn at a row between those at the `ends`. By continuity the thickness is
    /// as 1/(speed × width).
    fn torn(&self, speed: &Speed, row: &Station, [first, last]: &[Station; 2]) -> f32 {
        let flux = |row: &Station| speed.at(row.point) * row.width;
        self.tears.open(flux(first) / flux(row), row.time / last.time)
    }

    /// Quads of the sheet, row by row from the lip, each row from u = 0. Neighbours share corners, texture
    /// coordinates and erosion to the last bit.
    ///
    /// # Errors
    /// Returns the [`SheetFault`] of the first quad that cannot be mapped.
    pub fn quads(&self) -> Result<Vec<Quad>, SheetFault> {
        let rows = self.rows();
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        let across = self.across.as_dvec3();
        let speed = Speed::new(self, self.stations().iter().map(|at| at.point.y));
        let out = (last.point - first.point).cross(across).normalize_or_zero();
        let borders = self.borders();
        let corner = |row: &Station, u: f32| {
            let section = self.section(u) * row.width;
            (row.point + across * section.x + out * section.y).as_vec3()
        };
        let repeat = Vec2::new(self.material.repeat_u, self.material.repeat_v);
        let texture = |row: &Station, u: f32| {
            let position = DVec2::new(f64::from(u), self.along(row, &last));
            self.offset.as_dvec2() + position * repeat.as_dvec2()
        };
        let torn = rows.iter().map(|row| self.torn(&speed, row, &[first, last]));
        let torn: Vec<f32> = torn.collect();
        let width = self.widths.iter().map(|&w| f64::from(w)).sum::<f64>() / self.widths.len() as f64;
        let lattice = self.tears.lattice(width / f64::from(repeat.x), last.arc / f64::from(repeat.y));
        let mut quads = Vec::new();
        for (segment, ends) in rows.windows(2).enumerate() {
            for (column, sides) in borders.windows(2).enumerate() {
                let (u0, u1) = (sides[0], sides[1]);
                let at = [(0, u0), (0, u1), (1, u1), (1, u0)];
                let corners = at.map(|(row, u)| corner(&ends[row], u));
                let map = QuadMap::new(corners).map_err(|fault| SheetFault { segment, column, fault })?;
                let (from, to) = (texture(&ends[0], u0), texture(&ends[1], u1));
                let extent = (to - from).as_vec2();
                let material = Material { repeat_u: extent.x, repeat_v: extent.y, ..self.material };
                let way = |row: usize| (ends[row].arc / last.arc) as f32;
                let worn = at.map(|(row, u)| self.ends.erosion(u, way(row)));
                let lack = at.map(|(row, u)| self.surges.lack(u, texture(&ends[row], u).y));
                let erosion = std::array::from_fn(|i| worn[i] + (1.0 - worn[i]) * lack[i]);
                let tear = Tear { open: [torn[segment], torn[segment + 1]], lattice };
                let (offset, mist) = (from.as_vec2(), self.mist);
                quads.push(Quad { corners, map, material, offset, erosion, worn, tear, mist });
            }
        }
        Ok(quads)
    }
}

/// Speed of the water along a profile.
struct Speed {
    /// Square of the speed at the first point, m²/s².
    square: f64,
    /// Height of the first point, metres.
    top: f64,
    /// Square of the smallest speed, m²/s².
    min_square: f64,
}

impl Speed {
    /// Speed along a profile with points at the given `heights`, metres.
    fn new(sheet: &Sheet, heights: impl Iterator<Item = f64>) -> Self {
        let (square, top) = (f64::from(sheet.v0).powi(2), f64::from(sheet.points[0].y));
        let mut speed = Speed { square, top, min_square: square * MIN_SPEED * MIN_SPEED };
        let highest = heights.fold(top, f64::max);
        if square + 2.0 * GRAVITY * (top - highest) < speed.min_square {
            speed.min_square = square;
        }
        speed
    }

    /// Speed at a point, m/s.
    fn at(&self, point: DVec3) -> f64 {
        (self.square + 2.0 * GRAVITY * (self.top - point.y)).max(self.min_square).sqrt()
    }

    /// Station at the end `point` of the straight piece that begins at `last`.
    fn next(&self, last: &Station, point: DVec3, width: f64) -> Station {
        let step = point.distance(last.point);
        let time = last.time + 2.0 * step / (self.at(last.point) + self.at(point));
        Station { point, width, arc: last.arc + step, time }
    }
}

/// Points and widths on the centripetal Catmull–Rom spline through `points` (Catmull and Rom 1974), which has
/// no loops and no cusps (Yuksel, Schaefer and Keyser 2011). It is evaluated by Barry and Goldman's pyramid.
/// Beyond either end it is continued by reflecting the second point about the first, and the last but one
/// about the last. Widths are splines with the same knots, clamped to the widths at both ends of a span.
fn spline(points: &[Vec3], widths: &[f32]) -> Vec<(DVec3, f64)> {
    let n = points.len();
    let node = |i: usize| points[i].as_dvec3().extend(f64::from(widths[i]));
    let reflected = |end: usize, next: usize| node(end) * 2.0 - node(next);
    let mut out = Vec::with_capacity((n - 1) * PIECES + 1);
    for i in 0..n - 1 {
        let before = if i == 0 { reflected(0, 1) } else { node(i - 1) };
        let after = if i + 2 == n { reflected(n - 1, n - 2) } else { node(i + 2) };
        let p = [before, node(i), node(i + 1), after];
        let mut t = [0.0; 4];
        for k in 1..4 {
            t[k] = t[k - 1] + p[k].truncate().distance(p[k - 1].truncate()).sqrt();
        }
        for piece in 0..PIECES {
            let at = t[1] + (t[2] - t[1]) * piece as f64 / PIECES as f64;
            let mix = |a, b, from: usize, to: usize| -> glam::DVec4 {
                let part = (at - t[from]) / (t[to] - t[from]);
                a * (1.0 - part) + b * part
            };
            let [a1, a2, a3] = [mix(p[0], p[1], 0, 1), mix(p[1], p[2], 1, 2), mix(p[2], p[3], 2, 3)];
            let here = mix(mix(a1, a2, 0, 2), mix(a2, a3, 1, 3), 1, 2);
            out.push((here.truncate(), here.w.clamp(p[1].w.min(p[2].w), p[1].w.max(p[2].w))));
        }
    }
    let last = node(n - 1);
    out.push((last.truncate(), last.w));
    out
}
