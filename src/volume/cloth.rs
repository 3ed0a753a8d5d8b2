//! §2 Builder of cloth: yarns of twisted fibres that pass over and under one another.
//!
//! The warp runs along y and the weft along x. A weave says which of the two lies on top at each crossing.
//! Between crossings a yarn swings from one height to the next. Each yarn is a bundle of fibres that wind
//! around its middle, and it is the fibres, not the yarns, that give the cells their directions. So satin
//! shines across its long floats, and the highlight turns with the cloth.

use glam::{Vec2, Vec3};
use rand::RngExt;

use super::VolumeTexture;
use super::threads::{Look, Thread, Threads, cells_of_threads};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream, normal};
use crate::util::words::words;

/// Segments of a fibre from one crossing to the next.
const STEPS_PER_CROSSING: usize = 12;
/// Segments of a stray fibre.
const STRAY_STEPS: usize = 8;
/// Length of stray fibres, in distances between yarns.
const STRAY_LENGTH: f32 = 1.5;

/// Weaves that have a name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WeaveName {
    /// Over one, under one.
    #[default]
    Plain,
    /// Over two, under two, moved by one from yarn to yarn: a diagonal, as in denim.
    Twill,
    /// Warp over four, under one, moved by two: long floats that shine.
    Satin,
}

words!(WeaveName { Plain => "plain", Twill => "twill", Satin => "satin" });

/// Which yarn lies on top at each crossing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Weave {
    /// Rows of crossings along the weft, one after the other along the warp: whether the warp lies on top.
    rows: Vec<Vec<bool>>,
}

impl Weave {
    /// Weave with a name.
    pub fn named(name: WeaveName) -> Weave {
        let (size, over, shift) = match name {
            WeaveName::Plain => (2, 1, 1),
            WeaveName::Twill => (4, 2, 1),
            WeaveName::Satin => (5, 4, 2),
        };
        let row = |row: usize| (0..size).map(|column| (column + shift * row) % size < over).collect();
        Weave { rows: (0..size).map(row).collect() }
    }

    /// Weave of rows of the digits 0 and 1, parted by `/`, of equal length; 1 is the warp on top. `None` for
    /// any other text.
    pub fn of_text(text: &str) -> Option<Weave> {
        let row = |row: &str| row.trim().chars().map(|c| c.to_digit(2).map(|digit| digit == 1)).collect();
        let rows: Vec<Vec<bool>> = text.split('/').map(row).collect::<Option<_>>()?;
        let columns = rows.first()?.len();
        (columns > 0 && rows.iter().all(|row| row.len() == columns)).then_some(Weave { rows })
    }

    /// Number of yarns of warp and of weft after which the weave repeats.
    pub fn repeat(&self) -> [u32; 2] {
        [self.rows[0].len() as u32, self.rows.len() as u32]
    }

    /// Whether the warp lies on top where these yarns cross. The weave repeats.
    pub fn is_warp_on_top(&self, warp: usize, weft: usize) -> bool {
        let row = &self.rows[weft % self.rows.len()];
        row[warp % row.len()]
    }
}

/// Recipe of cloth. Equal recipes build equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Number of yarns of warp and of weft on a copy of the volume, multiples of the weave's repeat.
    pub yarns: [u32; 2],
    /// Which of them lies on top where.
    pub weave: Weave,
    /// Diameter of a yarn, in distances between the middles of neighbours.
    pub thickness: f32,
    /// Number of fibres in a yarn.
    pub fibres: u32,
    /// Diameter of a fibre, in diameters of its yarn.
    pub fibre_width: f32,
    /// Turns of the fibres around their yarn, from one crossing to the next.
    pub twist: f32,
    /// Distance of a yarn's middle from that of the cloth where it lies on top, in diameters of a yarn.
    pub crimp: f32,
    /// Number of stray fibres at each crossing.
    pub fuzz: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d.
    pub k_d: f32,
    /// Relative standard deviation of k_d from yarn to yarn.
    pub shade: f32,
    /// k_s of all cells. `None`: each cell has its place on a ramp of colours there, 0 for the warp and 1 for
    /// the weft.
    pub k_s: Option<f32>,
}

impl ClothSpec {
    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let cells = cells_of_threads(self.size, self.threads(), self.k_s, monitor)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells })
    }

    /// The fibres, stray ones behind those of the yarns.
    pub(super) fn threads(&self) -> Threads<impl Fn(usize, &mut Thread) + Sync> {
        let [warp, weft] = self.yarns.map(|n| n as usize);
        let fibres = (warp + weft) * self.fibres as usize;
        let strays = (self.fuzz * (warp * weft) as f32).round() as usize;
        let draw = move |number: usize, thread: &mut Thread| match number.checked_sub(fibres) {
            None => self.fibre(number / self.fibres as usize, number, thread),
            Some(stray) => self.stray(stray, thread),
        };
        Threads { count: fibres + strays, draw }
    }

    /// Depth that the yarns take, cells. What lies outside the volume is cut off.
    pub fn depth_cells(&self) -> f32 {
        let diameter = |axis: usize| self.thickness * self.size[axis] as f32 / self.yarns[axis] as f32;
        diameter(0).max(diameter(1)) * (1.0 + 2.0 * self.crimp)
    }

    /// The yarn number `yarn`: those of the warp first.
    fn yarn(&self, yarn: usize) -> Yarn<'_> {
        let warp = self.yarns[0] as usize;
        let axis = usize::from(yarn >= warp);
        let [own, other] = if axis == 0 { self.yarns } else { [self.yarns[1], self.yarns[0]] };
        // Cells are as large along x as along y only where the scene wants that, so both are kept.
        let [across, along] = if axis == 0 { [0, 1] } else { [1, 0] };
        let pitch = self.size[across] as f32 / own as f32;
        Yarn {
            spec: self,
            axis,
            number: if axis == 0 { yarn } else { yarn - warp },
            middle: ((if axis == 0 { yarn } else { yarn - warp }) as f32 + 0.5) * pitch,
            diameter: self.thickness * pitch,
            crossing: self.size[along] as f32 / other as f32,
            crossings: other as usize,
        }
    }

    /// Writes a fibre of a yarn, from one end of the volume to the other.
    fn fibre(&self, yarn: usize, number: usize, thread: &mut Thread) {
        let mut rng = Family::new(self.seed, Stream::Hair).member(number as u64);
        let yarn_rng = &mut Family::new(self.seed, Stream::Bundle).member(yarn as u64);
        let yarn = self.yarn(yarn);
        let k_d = self.k_d * (1.0 + self.shade * normal(yarn_rng)).max(0.0);
        let width = self.fibre_width * yarn.diameter;
        // Even in the disc, and inside of it with the whole width.
        let radius = (0.5 * yarn.diameter - 0.5 * width).max(0.0) * rng.random::<f32>().sqrt();
        let turn = rng.random::<f32>();
        // A fibre ends where it began, one copy of the cloth further, so its turns are whole.
        let turns = (self.twist * yarn.crossings as f32).round();
        let steps = yarn.crossings * STEPS_PER_CROSSING;
        for i in 0..=steps {
            let way = i as f32 / steps as f32;
            let (sin, cos) = ((turn + turns * way) * std::f32::consts::TAU).sin_cos();
            thread.points.push(yarn.place(way * yarn.crossings as f32, Vec2::new(cos, sin) * radius));
            thread.looks.push(Look { width, place: yarn.axis as f32, k_d });
        }
    }

    /// Writes a stray fibre, which leaves the cloth's outer face.
    fn stray(&self, number: usize, thread: &mut Thread) {
        let mut rng = Family::new(self.seed, Stream::Child).member(number as u64);
        let yarn = self.yarn(rng.random_range(0..(self.yarns[0] + self.yarns[1]) as usize));
        let from = rng.random::<f32>() * yarn.crossings as f32;
        let width = self.fibre_width * yarn.diameter;
        let aside = normal(&mut rng) * 0.6;
        let lift = rng.random::<f32>() * yarn.diameter;
        for i in 0..=STRAY_STEPS {
            let way = i as f32 / STRAY_STEPS as f32;
            let out = Vec2::new(aside * way * way * yarn.diameter, -(0.5 * yarn.diameter + lift * way));
            thread.points.push(yarn.place(from + STRAY_LENGTH * way, out));
            thread.looks.push(Look { width: width * (1.0 - way), place: yarn.axis as f32, k_d: self.k_d });
        }
    }
}

/// A yarn.
struct Yarn<'a> {
    spec: &'a ClothSpec,
    /// 0 for the warp, 1 for the weft.
    axis: usize,
    /// Number among those of its kind.
    number: usize,
    /// Place of its middle across, cells.
    middle: f32,
    /// Cells.
    diameter: f32,
    /// Distance from one crossing to the next, cells, and their number.
    crossing: f32,
    crossings: usize,
}

impl Yarn<'_> {
    /// Whether it lies on top at a crossing.
    fn is_on_top(&self, crossing: usize) -> bool {
        match self.axis {
            0 => self.spec.weave.is_warp_on_top(self.number, crossing),
            _ => !self.spec.weave.is_warp_on_top(crossing, self.number),
        }
    }

    /// Place at `along` crossings from the edge and `out` of the middle (sideways, and inwards), cells.
    fn place(&self, along: f32, out: Vec2) -> Vec3 {
        // Crossings lie in the middles of their fields.
        let at = along - 0.5;
        let before = at.floor();
        let height = |crossing: f32| {
            let crossing = (crossing as i64).rem_euclid(self.crossings as i64) as usize;
            if self.is_on_top(crossing) { -self.spec.crimp } else { self.spec.crimp }
        };
        let share = at - before;
        let smooth = share * share * (3.0 - 2.0 * share);
        let [low, high] = [height(before), height(before + 1.0)];
        let z = 0.5 * self.spec.size[2] as f32 + (low + (high - low) * smooth) * self.diameter + out.y;
        let (across, along) = (self.middle + out.x, along * self.crossing);
        if self.axis == 0 { Vec3::new(across, along, z) } else { Vec3::new(along, across, z) }
    }
}
