//! Paths of eight rays side by side. Twin of [`ShellPath`]: a ray has the segments that it has alone, bit for
//! bit, unless distances below 1e-15 m decide which tetrahedron comes next.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd::u32x8;

use super::{Corner, End, Segment, ShellPath};
use crate::mapping::shell::{AT_SIDES, FACES, Face, Shell};
use crate::util::lanes::{Floats, LANES, Lanes3, Mask, Stored, Stored3, Words, lanes_of};

/// Rays on their way through shells, one a lane.
#[derive(Default)]
pub struct LanePaths<'a> {
    shells: [Option<&'a Shell>; LANES],
    origin: Stored3,
    direction: Stored3,
    across: [Stored3; 2],
    /// Prism and tetrahedron that each ray enters next.
    prism: [usize; LANES],
    tetrahedron: [usize; LANES],
    /// Vertices and texture coordinates of the prism.
    vertices: [[u32; LANES]; 3],
    uv: [[Stored; 2]; 3],
    /// See the fields of [`ShellPath`] with these names.
    corners: [Corners; 3],
    shares: [Stored; 3],
    t: Stored,
    left: [u32; LANES],
}

/// See [`Corner`].
#[derive(Clone, Copy, Default)]
struct Corners {
    point: [u32; LANES],
    at: [Stored; 2],
    t: Stored,
}

/// The parts of rays inside one tetrahedron each; see [`Segment`](super::Segment).
#[derive(Default)]
pub struct LaneSegments {
    /// Prism.
    pub prism: [usize; LANES],
    /// Tetrahedron in the prism.
    pub tetrahedron: [usize; LANES],
    /// Parameters where the rays enter and leave, metres from their origins.
    pub t: [Stored; 2],
    /// Texture coordinates there.
    pub at: [Stored3; 2],
    /// Shares of the prism's vertices there.
    pub shares: [Stored3; 2],
    /// Spaces behind the segments.
    pub end: [End; LANES],
}

impl LaneSegments {
    /// The segment of a lane.
    #[inline]
    pub fn get(&self, lane: usize) -> Segment {
        Segment {
            prism: self.prism[lane],
            tetrahedron: self.tetrahedron[lane],
            t: [self.t[0].0[lane], self.t[1].0[lane]],
            at: [self.at[0].get(lane), self.at[1].get(lane)],
            shares: [self.shares[0].get(lane), self.shares[1].get(lane)],
            end: self.end[lane],
        }
    }

    /// Keeps the parts of the segments behind the parameters `least`, where these lie inside. Twin:
    /// [`Segment::from`](super::Segment::from).
    #[inline(always)]
    pub fn begin_at<S: Simd>(&mut self, simd: S, least: Floats<S>) {
        let [t_in, t_out] = [self.t[0].load(simd), self.t[1].load(simd)];
        let begins = least.simd_gt(t_in) & least.simd_le(t_out);
        if !begins.any_true() {
            return;
        }
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let share = ((least - t_in) / (t_out - t_in)).max(zero).min(one);
        for begins_of in [&mut self.at, &mut self.shares] {
            let [from, to] = [begins_of[0].load(simd), begins_of[1].load(simd)];
            let part = from.times(one - share).plus(to.times(share));
            begins_of[0].store(part.or(begins, from));
        }
        self.t[0].store(begins.select(least, t_in));
    }

    /// Keeps the parts of the segments before the parameters `most`.
    #[inline(always)]
    pub fn end_at<S: Simd>(&mut self, simd: S, most: Floats<S>) {
        let [t_in, t_out] = [self.t[0].load(simd), self.t[1].load(simd)];
        let ends = most.simd_lt(t_out);
        if !ends.any_true() {
            return;
        }
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let share = ((most - t_in) / (t_out - t_in)).max(zero).min(one);
        for ends_of in [&mut self.at, &mut self.shares] {
            let [from, to] = [ends_of[0].load(simd), ends_of[1].load(simd)];
            let part = from.times(one - share).plus(to.times(share));
            ends_of[1].store(part.or(ends, to));
        }
        self.t[1].store(ends.select(most.max(t_in), t_out));
    }
}

impl<'a> LanePaths<'a> {
    /// Gives a lane a path. Returns whether the path has any segments.
    pub fn start(&mut self, lane: usize, path: &ShellPath<'a>) -> bool {
        self.shells[lane] = Some(path.shell);
        self.origin.set(lane, path.origin);
        self.direction.set(lane, path.direction);
        (0..2).for_each(|axis| self.across[axis].set(lane, path.across[axis]));
        for (own, Corner { point, at, t }) in self.corners.iter_mut().zip(path.corners) {
            own.point[lane] = point;
            (own.at[0].0[lane], own.at[1].0[lane], own.t.0[lane]) = (at.x, at.y, t);
        }
        (0..3).for_each(|k| self.shares[k].0[lane] = path.shares[k]);
        self.t.0[lane] = path.t;
        self.left[lane] = path.left;
        self.tetrahedron[lane] = path.tetrahedron;
        self.enter(lane, path.shell, path.prism);
        path.left > 0
    }

    /// Puts a lane into a prism.
    #[inline(always)]
    fn enter(&mut self, lane: usize, shell: &Shell, prism: usize) {
        self.prism[lane] = prism;
        let prism = &shell.prisms[prism];
        for k in 0..3 {
            self.vertices[k][lane] = prism.vertices[k];
            (self.uv[k][0].0[lane], self.uv[k][1].0[lane]) = prism.uv[k].into();
        }
    }

    /// Finds the next segments of the lanes `bits`, which have some. Returns the lanes that still have some
    /// behind these.
    #[inline(always)]
    pub fn next<S: Simd>(&mut self, simd: S, bits: u8, out: &mut LaneSegments) -> u8 {
        // The fourth point of a tetrahedron is what remains of the sum of all.
        let mut points = [[0; 4]; LANES];
        let mut new = [0u32; LANES];
        let mut world = Stored3::default();
        for lane in lanes_of(bits) {
            let Some(shell) = self.shells[lane] else { continue };
            let own = shell.tetrahedron(self.prism[lane], self.tetrahedron[lane]);
            let [a, b, c] = [0, 1, 2].map(|k: usize| self.corners[k].point[lane]);
            let sum = own[0].wrapping_add(own[1]).wrapping_add(own[2]).wrapping_add(own[3]);
            points[lane] = own;
            new[lane] = sum.wrapping_sub(a).wrapping_sub(b).wrapping_sub(c);
            world.set(lane, shell.points[new[lane] as usize]);
        }
        out.prism = self.prism;
        out.tetrahedron = self.tetrahedron;

        let away = world.load(simd).minus(self.origin.load(simd));
        let d = Seen {
            point: u32x8::load_array(simd, new),
            x: away.dot(self.across[0].load(simd)),
            y: away.dot(self.across[1].load(simd)),
            t: away.dot(self.direction.load(simd)),
        };
        let [a, b, c] = [self.seen(simd, 0), self.seen(simd, 1), self.seen(simd, 2)];
        let (left_a, left_b, left_c) = (d.is_left(simd, &a), d.is_left(simd, &b), d.is_left(simd, &c));
        let first = left_a & !left_b;
        let second = left_b & !left_c;
        let near = a.or(first, &b.or(second, &c));
        let far = b.or(first, &c.or(second, &a));
        let dropped: [u32; LANES] = first.select(c.point, second.select(a.point, b.point)).to_array();

        let shares_in = [self.shares[0].load(simd), self.shares[1].load(simd), self.shares[2].load(simd)];
        let (from, of_vertices) = self.texture(simd, [&a, &b, &c], shares_in);
        out.at[0].store(from);
        out.shares[0].store(of_vertices);
        let (shares, t) = point_of(simd, [&near, &far, &d]);
        let (to, of_vertices) = self.texture(simd, [&near, &far, &d], shares);
        out.at[1].store(to);
        out.shares[1].store(of_vertices);
        let t_in = self.t.load(simd);
        let t_out = t.max(t_in);
        out.t[0].store(t_in);
        out.t[1].store(t_out);
        self.t.store(t_out);
        (0..3).for_each(|k| self.shares[k].store(shares[k]));
        near.store(&mut self.corners[0]);
        far.store(&mut self.corners[1]);
        d.store(&mut self.corners[2]);

        let mut goes_on = 0;
        for lane in lanes_of(bits) {
            let Some(shell) = self.shells[lane] else { continue };
            let [p, q, r, _] = points[lane].map(|point| point == dropped[lane]);
            let opposite = if p {
                0
            } else if q {
                1
            } else if r {
                2
            } else {
                3
            };
            out.end[lane] = End::Segment;
            match FACES[self.tetrahedron[lane]][opposite] {
                Face::Tetrahedron(next) => self.tetrahedron[lane] = next,
                Face::Side(edge, half) => match shell.prisms[self.prism[lane]].beyond[edge].get() {
                    Some((prism, edge)) => {
                        self.tetrahedron[lane] = AT_SIDES[edge][half];
                        self.enter(lane, shell, prism);
                    }
                    None => out.end[lane] = End::Border,
                },
                Face::Surface if self.tetrahedron[lane] == 0 => out.end[lane] = End::Outer,
                Face::Surface => out.end[lane] = End::Inner,
            }
            self.left[lane] -= 1;
            goes_on |= u8::from(out.end[lane] == End::Segment && self.left[lane] > 0) << lane;
        }
        goes_on
    }

    /// The corners number `k`.
    #[inline(always)]
    fn seen<S: Simd>(&self, simd: S, k: usize) -> Seen<S> {
        let Corners { point, at, t } = &self.corners[k];
        Seen {
            point: u32x8::load_array(simd, *point),
            x: at[0].load(simd),
            y: at[1].load(simd),
            t: t.load(simd),
        }
    }

    /// See [`ShellPath::texture`].
    #[inline(always)]
    fn texture<S: Simd>(
        &self,
        simd: S,
        corners: [&Seen<S>; 3],
        shares: [Floats<S>; 3],
    ) -> (Lanes3<S>, Lanes3<S>) {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let mut of_vertices = Lanes3 { x: zero, y: zero, z: zero };
        let mut depth = zero;
        let [a, b, c] = &self.vertices;
        let (a, b, c) =
            (u32x8::load_array(simd, *a), u32x8::load_array(simd, *b), u32x8::load_array(simd, *c));
        for k in 0..3 {
            let vertex = corners[k].point >> 1;
            of_vertices.x += vertex.simd_eq(a).select(shares[k], zero);
            of_vertices.y += vertex.simd_eq(b).select(shares[k], zero);
            of_vertices.z += vertex.simd_eq(c).select(shares[k], zero);
            depth += (corners[k].point & 1).simd_eq(1).select(shares[k], zero);
        }
        let [[u_a, v_a], [u_b, v_b], [u_c, v_c]] = &self.uv;
        let Lanes3 { x, y, z } = of_vertices;
        let u = u_a.load(simd) * x + u_b.load(simd) * y + u_c.load(simd) * z;
        let v = v_a.load(simd) * x + v_b.load(simd) * y + v_c.load(simd) * z;
        (Lanes3 { x: u, y: v, z: depth.min(one) }, of_vertices)
    }
}

/// Corners as their rays see them; see [`Corner`].
#[derive(Clone, Copy)]
struct Seen<S: Simd> {
    point: Words<S>,
    x: Floats<S>,
    y: Floats<S>,
    t: Floats<S>,
}

impl<S: Simd> Seen<S> {
    /// This where `is` holds, or another.
    #[inline(always)]
    fn or(&self, is: Mask<S>, other: &Seen<S>) -> Seen<S> {
        Seen {
            point: is.select(self.point, other.point),
            x: is.select(self.x, other.x),
            y: is.select(self.y, other.y),
            t: is.select(self.t, other.t),
        }
    }

    #[inline(always)]
    fn store(&self, out: &mut Corners) {
        self.point.store_array(&mut out.point);
        out.at[0].store(self.x);
        out.at[1].store(self.y);
        out.t.store(self.t);
    }

    /// Cross product of the positions of this and another corner.
    #[inline(always)]
    fn cross(&self, other: &Seen<S>) -> Floats<S> {
        self.x * other.y - self.y * other.x
    }

    /// Whether each ray passes to the left of the edge from this corner to another. Twin of
    /// [`is_left`](super::is_left), and of the shader's, which explains why float32 suffices.
    #[inline(always)]
    fn is_left(&self, simd: S, to: &Seen<S>) -> Mask<S> {
        let one = self.x * to.y;
        let other = self.y * to.x;
        let left = one.simd_gt(other);
        let close = one.simd_eq(other);
        if !close.any_true() {
            return left;
        }
        let zero = f32x8::splat(simd, 0.0);
        let [one_error, other_error] = [product_error(self.x, to.y, one), product_error(self.y, to.x, other)];
        let (x, y) = (to.x - self.x, to.y - self.y);
        let along_ray = (x.simd_eq(zero) & self.point.simd_lt(to.point)) | x.simd_lt(zero);
        let on_edge = (y.simd_eq(zero) & along_ray) | y.simd_gt(zero);
        let same = one_error.simd_eq(other_error);
        (!close & left) | (close & ((same & on_edge) | one_error.simd_gt(other_error)))
    }
}

/// x·y − product, where `product` is x·y as rounded; exact.
#[inline(always)]
fn product_error<S: Simd>(x: Floats<S>, y: Floats<S>, product: Floats<S>) -> Floats<S> {
    let (x_high, y_high) = (high_half(x), high_half(y));
    let (x_low, y_low) = (x - x_high, y - y_high);
    ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low
}

/// Number with the upper 12 bits of the digits.
#[inline(always)]
fn high_half<S: Simd>(x: Floats<S>) -> Floats<S> {
    f32x8::from_bits(x.to_bits() & 0xffff_f000)
}

/// See [`super::point_of`].
#[inline(always)]
fn point_of<S: Simd>(simd: S, [a, b, c]: [&Seen<S>; 3]) -> ([Floats<S>; 3], Floats<S>) {
    let zero = f32x8::splat(simd, 0.0);
    let (of_a, of_b, of_c) = (b.cross(c).max(zero), c.cross(a).max(zero), a.cross(b).max(zero));
    let sum = of_a + of_b + of_c;
    let is_any = sum.simd_gt(zero);
    let third = f32x8::splat(simd, 1.0 / 3.0);
    let of_a = is_any.select(of_a / sum, third);
    let of_b = is_any.select(of_b / sum, third);
    let of_c = is_any.select(of_c / sum, third);
    ([of_a, of_b, of_c], of_a * a.t + of_b * b.t + of_c * c.t)
}
