//! §2 Places spread evenly over a face of the volume: roots of hairs, middles of clumps and locks.
//!
//! Random places alone would leave bald patches. A grid of nearly square fields, with one place at random in
//! each, leaves none.

use glam::Vec2;
use rand::{Rng, RngExt};

/// Places on a face, one in each field of a grid.
#[derive(Clone, Copy)]
pub(super) struct Spots {
    /// Size of the face, cells.
    pub size: Vec2,
    /// Number of spots.
    pub count: u32,
    /// Whether the face goes on at its other side along y, as it always does along x.
    pub wraps: bool,
}

impl Spots {
    fn rows(&self) -> u32 {
        let rows = (f64::from(self.count) * f64::from(self.size.y / self.size.x)).sqrt().round();
        (rows as u32).clamp(1, self.count.max(1))
    }

    /// First spot of a row.
    fn first(&self, row: u32) -> u32 {
        (u64::from(self.count) * u64::from(row) / u64::from(self.rows())) as u32
    }

    /// Row of a spot.
    fn row(&self, i: u32) -> u32 {
        let guess = (u64::from(i) * u64::from(self.rows()) / u64::from(self.count)) as u32;
        if self.first(guess + 1) <= i { guess + 1 } else { guess }
    }

    /// Place of spot number `i`, cells.
    pub fn at(&self, i: u32, rng: &mut impl Rng) -> Vec2 {
        let row = self.row(i);
        let (first, end) = (self.first(row), self.first(row + 1));
        let x = ((i - first) as f32 + rng.random::<f32>()) / (end - first) as f32;
        Vec2::new(x, (row as f32 + rng.random::<f32>()) / self.rows() as f32) * self.size
    }

    /// Nearest of the spots, which stand at `middles`: its number, and the way from a place to it. The way
    /// may lead across a border where the face goes on. `None` without spots.
    pub fn nearest(&self, middles: &[Vec2], place: Vec2) -> Option<(usize, Vec2)> {
        let rows = i64::from(self.rows());
        let row = (place.y / self.size.y * rows as f32) as i64;
        let mut nearest: Option<(usize, Vec2)> = None;
        // A spot two fields away may be nearer than that of the own field; one three fields away is not.
        let is_there = |row: &i64| self.wraps || (0..rows).contains(row);
        for row in (row - 2..=row + 2).filter(is_there).map(|row| row.rem_euclid(rows) as u32) {
            let (first, end) = (self.first(row), self.first(row + 1));
            let count = i64::from(end - first);
            let column = (place.x / self.size.x * count as f32) as i64;
            for column in (column - 2..=column + 2).filter(|_| count > 0) {
                let number = first as usize + column.rem_euclid(count) as usize;
                let Some(&middle) = middles.get(number) else { continue };
                let way = middle - place;
                let turns = (way / self.size).round();
                let way = way - self.size * if self.wraps { turns } else { turns * Vec2::X };
                if nearest.is_none_or(|(_, least)| way.length_squared() < least.length_squared()) {
                    nearest = Some((number, way));
                }
            }
        }
        nearest
    }
}
