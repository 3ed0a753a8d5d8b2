//! The surface of a pool with `pools.*.waves = field`: waves and foam on a grid that knows the rocks.

use std::convert::Infallible;

use glam::{DVec3, Vec2, Vec3};

use super::current::{self, Current};
use super::waves;
use super::{Pool, PoolWaves};
use crate::place::Mesh;
use crate::util::cache::Cache;

/// Most cells along a side of the grid.
const MOST: usize = 512;
/// Cells along the longest wave, where the pool is small enough for [`MOST`].
const CELLS_OF_WAVE: f32 = 18.0;
/// Fewest cells along the longest wave. Larger pools get longer waves.
const FEWEST_OF_WAVE: f32 = 10.0;
/// Fewest cells along the shorter side.
const SHORTEST_SIDE: f32 = 32.0;
/// Number of frequencies. Each has a field of complex amplitudes.
pub const MODES: usize = 4;
/// Waves of each mode in four lengths of the longest: whole numbers, so that one run in time tells them
/// apart.
pub const HARMONICS: [u32; MODES] = [4, 5, 7, 9];
/// Wavelengths of the modes relative to the longest.
pub const LENGTHS: [f32; MODES] = [1.0, 0.8, 4.0 / 7.0, 4.0 / 9.0];
/// Version of the fields' builder, a part of their key in the cache. Raise it with every change to them.
pub const FIELD_VERSION: u32 = 2;
/// Folder of the fields in the cache.
const KIND: &str = "pools";

/// A grid of square cells over the pool, with sides along x and z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grid {
    /// x and z of the corner where cell (0, 0) begins, metres.
    pub origin: [f32; 2],
    /// Side of a cell, metres.
    pub cell: f32,
    /// Cells along x and z.
    pub size: [usize; 2],
}

/// Complex amplitudes of the modes in one cell, metres: the height is the real part of Σ A·e^(2πi·n·t), where
/// n·t are the mode's turns.
pub type Amplitudes = [[f32; 2]; MODES];

/// Waves and foam of a pool.
#[derive(Clone, Debug, PartialEq)]
pub struct PoolField {
    /// Cells of the waves.
    pub grid: Grid,
    /// Length of the longest wave, metres: `pools.*.wavelength`, or more in a wide pool.
    pub longest: f32,
    /// Amplitudes in each cell, row by row along x. Rock has those of the water beside it.
    pub amplitudes: Vec<Amplitudes>,
    /// Cells of the foam, twice as wide.
    pub coarse: Grid,
    /// Density of the foam, 0 to 1, velocity along x and z in metres per second, and noise from −1 to 1 that
    /// is smooth over a wave's length.
    pub carried: Vec<[f32; 4]>,
}

/// Which cells of a grid hold rock, and where water falls in.
#[derive(Clone, Debug, PartialEq)]
pub struct Basin {
    /// The grid.
    pub grid: Grid,
    /// Whether a cell holds rock, row by row along x.
    pub solid: Vec<bool>,
    /// Segments where water falls in, x and z of their ends; metres.
    pub impacts: Vec<[Vec2; 2]>,
}

impl Grid {
    /// Returns the grid of a pool's waves.
    pub fn of(pool: &Pool) -> Grid {
        let [low, high] = [f32::min as fn(f32, f32) -> f32, f32::max].map(|of| {
            [|c: &Vec3| c.x, |c: &Vec3| c.z]
                .map(|axis| pool.corners.iter().map(axis).reduce(of).unwrap_or(0.0))
        });
        let sides = [high[0] - low[0], high[1] - low[1]];
        let (short, long) = (sides[0].min(sides[1]), sides[0].max(sides[1]));
        let cell = (pool.wavelength / CELLS_OF_WAVE).min(short / SHORTEST_SIDE).max(long / MOST as f32);
        // An even number, for the coarse grid.
        let cells = |side: f32| (((side / cell).ceil() as usize).div_ceil(2) * 2).clamp(8, MOST + 2);
        Grid { origin: low, cell, size: sides.map(cells) }
    }

    /// Returns the grid of cells twice as wide.
    pub fn halved(&self) -> Grid {
        Grid { cell: 2.0 * self.cell, size: self.size.map(|n| n / 2), ..*self }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Returns x and z of the middle of a cell, metres.
    pub fn middle(&self, i: usize) -> Vec2 {
        let at = Vec2::new((i % self.size[0]) as f32, (i / self.size[0]) as f32);
        Vec2::from(self.origin) + (at + 0.5) * self.cell
    }

    /// Returns the cell that holds a point, if one does.
    pub fn cell_at(&self, p: Vec2) -> Option<usize> {
        let at = (p - Vec2::from(self.origin)) / self.cell;
        let inside = at.min_element() >= 0.0 && at.x < self.size[0] as f32 && at.y < self.size[1] as f32;
        inside.then(|| at.y as usize * self.size[0] + at.x as usize)
    }

    /// Returns the neighbours of a cell across its four sides: −x, +x, −z and +z.
    pub fn neighbours(&self, i: usize) -> [Option<usize>; 4] {
        let [nx, nz] = self.size;
        let (x, z) = (i % nx, i / nx);
        [
            (x > 0).then(|| i - 1),
            (x + 1 < nx).then_some(i + 1),
            (z > 0).then(|| i - nx),
            (z + 1 < nz).then_some(i + nx),
        ]
    }
}

impl Basin {
    /// Finds the rock of a pool's grid in the opaque mesh: a cell is solid where a triangle cuts the water's
    /// level in it, and where such cells enclose it and no water falls in.
    pub fn new(pool: &Pool, mesh: &Mesh, water: &[[Vec3; 4]]) -> Basin {
        let grid = Grid::of(pool);
        let flat = |p: Vec3| Vec2::new(p.x, p.z);
        let impacts = pool.impacts(water).into_iter().map(|ends| ends.map(flat)).collect();
        let mut basin = Basin { grid, solid: vec![false; grid.cells()], impacts };
        let level = pool.level();
        let low = Vec2::from(grid.origin);
        let high = low + Vec2::new(grid.size[0] as f32, grid.size[1] as f32) * grid.cell;
        for tile in mesh.tiles.iter().filter(|tile| tile.pool == 0) {
            let is_near = tile.low.y <= level
                && tile.high.y >= level
                && flat(tile.high).cmpge(low).all()
                && flat(tile.low).cmple(high).all();
            if !is_near {
                continue;
            }
            let (corners, _) = tile.triangles(1, [false; 4]).as_chunks::<3>();
            for corners in corners {
                let corner = |c: u16| Vec3::from(mesh.vertices[tile.vertex_of(c) as usize].position);
                if let Some(ends) = cut(corners.map(corner), level) {
                    basin.draw(ends);
                }
            }
        }
        basin.close();
        basin
    }

    /// Marks the cells along a segment as solid.
    fn draw(&mut self, [a, b]: [Vec2; 2]) {
        let steps = (3.0 * a.distance(b) / self.grid.cell).ceil().min(4.0 * MOST as f32) as u32;
        for i in 0..=steps {
            let at = a.lerp(b, i as f32 / steps.max(1) as f32);
            if let Some(cell) = self.grid.cell_at(at) {
                self.solid[cell] = true;
            }
        }
    }

    /// Fills the insides of rocks: water that neither reaches the grid's border nor an impact.
    fn close(&mut self) {
        let mut seen = self.solid.clone();
        let mut falls = vec![false; seen.len()];
        for [a, b] in &self.impacts {
            for i in 0..=16 {
                if let Some(cell) = self.grid.cell_at(a.lerp(*b, i as f32 / 16.0)) {
                    falls[cell] = true;
                }
            }
        }
        for start in 0..seen.len() {
            if seen[start] {
                continue;
            }
            let (mut found, mut next, mut is_open) = (vec![start], 0, false);
            seen[start] = true;
            while next < found.len() {
                let i = found[next];
                next += 1;
                is_open |= falls[i];
                for neighbour in self.grid.neighbours(i) {
                    let Some(j) = neighbour else {
                        is_open = true;
                        continue;
                    };
                    if !seen[j] {
                        seen[j] = true;
                        found.push(j);
                    }
                }
            }
            if !is_open {
                found.into_iter().for_each(|i| self.solid[i] = true);
            }
        }
    }

    /// Returns the basin in cells twice as wide; they are solid where any of their quarters is.
    pub fn halved(&self) -> Basin {
        let grid = self.grid.halved();
        let nx = self.grid.size[0];
        let is_solid = |i: usize| {
            let first = 2 * (i / grid.size[0]) * nx + 2 * (i % grid.size[0]);
            [0, 1, nx, nx + 1].iter().any(|step| self.solid[first + step])
        };
        let solid = (0..grid.cells()).map(is_solid).collect();
        Basin { grid, solid, impacts: self.impacts.clone() }
    }

    /// Returns the distance of a point from where water falls in, metres; infinite without such a place.
    pub fn from_impact(&self, p: Vec2) -> f32 {
        let away2 = |[a, b]: &[Vec2; 2]| {
            let edge = *b - *a;
            let along = ((p - *a).dot(edge) / edge.length_squared().max(1e-30)).clamp(0.0, 1.0);
            (*a + edge * along).distance_squared(p)
        };
        self.impacts.iter().map(away2).fold(f32::INFINITY, f32::min).sqrt()
    }

    /// Gives solid cells the mean of what the cells beside them hold, `times` cells deep.
    pub fn spread<const N: usize>(&self, values: &mut [[f32; N]], times: usize) {
        let mut is_set: Vec<bool> = self.solid.iter().map(|solid| !solid).collect();
        for _ in 0..times {
            let before = is_set.clone();
            for i in (0..values.len()).filter(|&i| !before[i]) {
                let (mut sum, mut count) = ([0.0; N], 0.0);
                for j in self.grid.neighbours(i).into_iter().flatten().filter(|&j| before[j]) {
                    (0..N).for_each(|k| sum[k] += values[j][k]);
                    count += 1.0;
                }
                if count > 0.0 {
                    values[i] = sum.map(|sum| sum / count);
                    is_set[i] = true;
                }
            }
        }
    }
}

/// Returns the segment in which a triangle cuts a level, by x and z of its ends.
fn cut(corners: [Vec3; 3], level: f32) -> Option<[Vec2; 2]> {
    let mut ends = [Vec2::ZERO; 2];
    let mut count = 0;
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        if (a.y > level) != (b.y > level) {
            let p = a.lerp(b, (level - a.y) / (b.y - a.y));
            ends[count.min(1)] = Vec2::new(p.x, p.z);
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

/// Returns the length of a pool's longest wave that a grid can hold, metres.
fn longest(pool: &Pool, grid: &Grid) -> f32 {
    pool.wavelength.max(FEWEST_OF_WAVE * grid.cell)
}

impl PoolField {
    /// Computes the field of a pool that asks for one. `water` are the quads that fall, and `origin` is the
    /// place in the world from which positions are measured.
    pub fn new(pool: &Pool, mesh: &Mesh, water: &[[Vec3; 4]], origin: DVec3) -> Option<PoolField> {
        (pool.waves == PoolWaves::Field).then(|| PoolField::of(pool, &Basin::new(pool, mesh, water), origin))
    }

    /// Returns the bytes that a pool's field and its textures take on host and device.
    pub fn bytes(pool: &Pool) -> u64 {
        let grid = Grid::of(pool);
        let texel = size_of::<[f32; 4]>();
        (grid.cells() * (size_of::<Amplitudes>() + 2 * texel) + grid.halved().cells() * 2 * texel) as u64
    }

    /// Returns [`PoolField::new`], from the cache where it is stored there under a key.
    pub fn cached(
        pool: &Pool,
        mesh: &Mesh,
        water: &[[Vec3; 4]],
        origin: DVec3,
        (cache, key): (&Cache, &str),
    ) -> Option<PoolField> {
        if pool.waves == PoolWaves::Sum {
            return None;
        }
        let make = || {
            let made = PoolField::of(pool, &Basin::new(pool, mesh, water), origin);
            let [mut all, carried] =
                [made.amplitudes.as_flattened().as_flattened(), made.carried.as_flattened()]
                    .map(<[f32]>::to_vec);
            all.extend(carried);
            Ok::<_, Infallible>(all)
        };
        let Ok(all) = cache.get(KIND, key, PoolField::numbers(pool), make);
        Some(PoolField::of_numbers(pool, &all))
    }

    /// Returns what [`PoolField::cached`] returns, if it is stored in the cache. The mesh is not needed then.
    pub fn stored(pool: &Pool, cache: &Cache, key: &str) -> Option<PoolField> {
        if pool.waves == PoolWaves::Sum {
            return None;
        }
        let all = cache.stored(KIND, key, PoolField::numbers(pool))?;
        Some(PoolField::of_numbers(pool, &all))
    }

    /// How many numbers of a pool's field are stored.
    fn numbers(pool: &Pool) -> usize {
        let grid = Grid::of(pool);
        grid.cells() * 2 * MODES + grid.halved().cells() * 4
    }

    /// Returns the field of the numbers that are stored: the amplitudes, then what is carried.
    fn of_numbers(pool: &Pool, all: &[f32]) -> PoolField {
        let grid = Grid::of(pool);
        let (waves, carried) = all.split_at(grid.cells() * 2 * MODES);
        PoolField {
            grid,
            longest: longest(pool, &grid),
            amplitudes: bytemuck::cast_slice(waves).to_vec(),
            coarse: grid.halved(),
            carried: bytemuck::cast_slice(carried).to_vec(),
        }
    }

    /// Computes the field of a pool in a basin.
    pub fn of(pool: &Pool, basin: &Basin, origin: DVec3) -> PoolField {
        let grid = basin.grid;
        let longest = longest(pool, &grid);
        let mut flat: Vec<[f32; 2 * MODES]> =
            bytemuck::cast_vec(waves::amplitudes(pool, basin, longest, origin));
        basin.spread(&mut flat, 3);
        let amplitudes = bytemuck::cast_vec(flat);
        let coarse = basin.halved();
        let Current { velocity, foam } = current::of(pool, &coarse);
        let noise = |i: usize| current::noise(coarse.grid.middle(i) / longest, pool.seed ^ 1);
        let mut carried: Vec<[f32; 4]> =
            (0..foam.len()).map(|i| [foam[i], velocity[i].x, velocity[i].y, noise(i)]).collect();
        coarse.spread(&mut carried, 2);
        PoolField { grid, longest, amplitudes, coarse: coarse.grid, carried }
    }
}
