//! Projection of the opaque mesh and of the volume quads to pixels.

use glam::{BVec3, Mat4, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::raster::{Grid, Piece, ScreenPoint, clip_near};
use crate::mapping::Quad;
use crate::mapping::shell::HullFace;
use crate::picture::camera::{CENTRE, DepthRange, sample_offset};
use crate::place::tiles::{self, Tile};
use crate::place::{Mesh, Vertex};
use crate::scene::Scene;

/// Numbers of the corners of the largest tile.
const POINTS: usize = 3 * tiles::TRIANGLES as usize;
const _: () = assert!((tiles::SIDE + 1) * (tiles::SIDE + 1) <= POINTS as u32);

/// Tiles that a thread projects at a time. Those out of view take next to no time, so equal shares are
/// uneven.
const TILES: usize = 32;

/// Faces of a hull in one piece. The near plane cuts a triangle into two at most.
const HULL_PART: usize = 256;

/// The projection from the world to the pixels of a grid.
pub struct Projection<'a> {
    scene: &'a Scene,
    grid: &'a Grid,
    clip_from_world: Mat4,
    /// Width and height of the image, pixels.
    size: [usize; 2],
}

impl<'a> Projection<'a> {
    /// Returns the projection of a scene, whose z-buffer has this range of depths.
    pub fn new(scene: &'a Scene, depth: &DepthRange, grid: &'a Grid) -> Self {
        let [width, height] = [scene.image.width, scene.image.height];
        let centre = sample_offset(&scene.image, CENTRE);
        Projection {
            scene,
            grid,
            clip_from_world: scene.camera.clip_from_world(width, height, centre, depth),
            size: [width as usize, height as usize],
        }
    }

    /// Returns the triangles of each tile of the opaque mesh.
    pub fn rock(&self, mesh: &Mesh) -> Vec<Piece> {
        let steps = tiles::steps(&mesh.tiles, &self.scene.camera, &self.scene.image);
        // A piece grows in memory that the next one uses again, and is copied at its size. Memory of its own
        // would move several times as it grows.
        let piece = |room: &mut Piece, (i, tile): (usize, &Tile)| {
            if !self.may_show(tile.low, tile.high) {
                return Piece::default();
            }
            let corners = tile.triangles(steps[i], tiles::coarser(&mesh.tiles, &steps, i));
            room.clear();
            self.tile(tile, corners, &mesh.vertices, room);
            room.clone()
        };
        mesh.tiles.par_iter().enumerate().with_max_len(TILES).map_init(Piece::default, piece).collect()
    }

    /// Returns the triangles of each volume quad.
    pub fn water(&self) -> Vec<Piece> {
        let piece = |quad: &Quad| {
            let mut out = Piece::default();
            let [a, b, c, d] = quad.corners.map(|corner| self.point(corner, Vec2::ZERO, &mut out));
            self.triangle([a, b, c], &mut out);
            if !quad.is_triangle() {
                self.triangle([a, c, d], &mut out);
            }
            out
        };
        self.scene.quads.iter().map(piece).collect()
    }

    /// Returns the triangles of the hulls of shells that face the eye, in pieces. Faces are numbered after
    /// the quads, shell by shell.
    pub fn hulls(&self) -> Vec<Piece> {
        let mut first = self.scene.quads.len() as u32;
        let mut pieces = Vec::new();
        for shell in &self.scene.shells {
            let seen = self.scene.seen_hull(shell);
            let piece = |(part, faces): (usize, &[HullFace])| {
                let mut out = Piece::default();
                for (i, face) in (part * HULL_PART..).zip(faces) {
                    if let Some(corners) = seen(face) {
                        let points = corners.map(|corner| self.point(corner, Vec2::ZERO, &mut out));
                        self.triangle(points, &mut out);
                        out.set_face(first + i as u32);
                    }
                }
                out
            };
            pieces.par_extend(shell.hull.par_chunks(HULL_PART).enumerate().map(piece));
            first += shell.hull.len() as u32;
        }
        pieces
    }

    /// Adds the triangles between corners of a tile, three at a time.
    fn tile(&self, tile: &Tile, corners: &[u16], vertices: &[Vertex], out: &mut Piece) {
        // Six triangles meet in a vertex of a grid, which is projected once.
        let mut points = [None; POINTS];
        for &corners in corners.as_chunks::<3>().0 {
            let points = corners.map(|corner| {
                *points[usize::from(corner)].get_or_insert_with(|| {
                    let vertex = &vertices[tile.vertex_of(corner) as usize];
                    self.point(vertex.position.into(), tile.place_of(corner), out)
                })
            });
            self.triangle(points, out);
        }
    }

    /// Adds a point. Returns it in clip space, with its index.
    #[inline]
    fn point(&self, point: Vec3, place: Vec2, out: &mut Piece) -> (Vec4, u16) {
        let clip = self.clip_from_world * point.extend(1.0);
        (clip, out.add_point(ScreenPoint::new(clip, self.size, place)))
    }

    /// Adds the parts of a triangle that a sample may see. Its points are in clip space, with their indices.
    #[inline]
    fn triangle(&self, points: [(Vec4, u16); 3], out: &mut Piece) {
        let near = self.scene.camera.near;
        // Almost all triangles lie wholly in front.
        if points.iter().all(|(clip, _)| clip.w >= near) {
            return out.add(points.map(|(_, number)| number), self.grid);
        }
        let corners = points.map(|(clip, number)| (clip, out.place(number)));
        clip_near(corners, near, |part| {
            let points = part.map(|(clip, place)| out.add_point(ScreenPoint::new(clip, self.size, place)));
            out.add(points, self.grid);
        });
    }

    /// Whether a sample of the window may see anything in a box. Only boxes that lie wholly beyond one side
    /// of the view, or behind the eye, are left out.
    fn may_show(&self, low: Vec3, high: Vec3) -> bool {
        let [width, height] = self.size.map(|n| n as f32);
        // The sides of the window in clip space over w. Samples lie up to two pixels outside.
        const MARGIN: f32 = 3.0;
        let window = self.grid.window;
        let side = |pixels: f32, size: f32| 2.0 * pixels / size - 1.0;
        let [left, right] =
            [window.x as f32 - MARGIN, window.right() as f32 + MARGIN].map(|pixels| side(pixels, width));
        let [top, bottom] =
            [window.y as f32 - MARGIN, window.bottom() as f32 + MARGIN].map(|pixels| -side(pixels, height));
        let near = self.scene.camera.near;
        let mut beyond = [true; 5];
        for corner in 0..8 {
            let point =
                Vec3::select(BVec3::new(corner & 1 == 0, corner & 2 == 0, corner & 4 == 0), low, high);
            let c = self.clip_from_world * point.extend(1.0);
            let outside =
                [c.w < near, c.x < left * c.w, c.x > right * c.w, c.y > top * c.w, c.y < bottom * c.w];
            beyond = [0, 1, 2, 3, 4].map(|i| beyond[i] && outside[i]);
        }
        !beyond.contains(&true)
    }
}
