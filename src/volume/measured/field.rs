//! Values of other grids at the voxels of the density.

use glam::{DAffine3, DMat3, DVec3};

use super::VelocityAt;
use crate::grid::{Class, Grid, Reader};

/// Largest distance from a whole number of voxels at which two grids count as aligned. Transforms have been
/// rounded to float32 by some programs.
const ALIGNED: f64 = 1e-3;

/// One grid as the voxels of the density see it.
#[derive(Clone)]
pub(super) struct Source<'a> {
    reader: Reader<'a>,
    /// Transform from an index of the density to one of this grid.
    from_density: DAffine3,
    /// That transform, if it only adds whole numbers.
    steps: Option<[i32; 3]>,
}

impl<'a> Source<'a> {
    /// A grid whose samples lie `shift` (in its own voxels) below the centres of its voxels.
    pub fn new(grid: &'a Grid, density: DAffine3, shift: DVec3) -> Source<'a> {
        let relative = grid.to_world.inverse() * density;
        let steps = relative.translation.round();
        let is_even = (relative.matrix3 - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-6);
        let is_aligned = is_even && (relative.translation - steps).abs().max_element() < ALIGNED;
        let aligned = if is_aligned { DAffine3::from_translation(steps) } else { relative };
        let from_density = DAffine3::from_translation(shift) * aligned;
        let whole = (is_aligned && shift == DVec3::ZERO && steps.abs().max_element() < 1e9)
            .then(|| steps.to_array().map(|x| x as i32));
        Source { reader: grid.reader(), from_density, steps: whole }
    }

    /// Value at a voxel of the density.
    #[inline]
    pub fn at(&mut self, index: [i32; 3]) -> [f32; 3] {
        match self.steps {
            Some(steps) => self.reader.at([0, 1, 2].map(|a| index[a].saturating_add(steps[a]))),
            None => self.between(DVec3::from_array(index.map(f64::from))),
        }
    }

    /// Value at a place between the voxels of the density, interpolated.
    pub fn between(&mut self, place: DVec3) -> [f32; 3] {
        let at = self.from_density.transform_point3(place);
        let low = at.floor();
        if !low.is_finite() || low.abs().max_element() > 1e9 {
            return self.reader.at([i32::MIN / 2; 3]);
        }
        let (base, share) = (low.to_array().map(|x| x as i32), at - low);
        let mut sum = [0.0f64; 3];
        for corner in 0..8 {
            let far = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight: f64 = (0..3).map(|a| if far[a] == 1 { share[a] } else { 1.0 - share[a] }).product();
            if weight != 0.0 {
                let value = self.reader.at([0, 1, 2].map(|a| base[a] + far[a]));
                (0..3).for_each(|a| sum[a] += weight * f64::from(value[a]));
            }
        }
        sum.map(|x| x as f32)
    }
}

/// The velocity at the voxels of the density.
#[derive(Clone)]
pub(super) enum Field<'a> {
    /// All components at one place.
    Vector(Source<'a>),
    /// The components in grids of their own, or at places of their own. Of each, the number of the component
    /// in its grid.
    Components(Box<[(Source<'a>, usize); 3]>),
}

impl<'a> Field<'a> {
    /// The velocity of one grid of vectors or three of numbers; `None` for no grids.
    pub fn new(grids: &'a [Grid], density: DAffine3, at: VelocityAt) -> Option<Field<'a>> {
        let first = grids.first()?;
        let at = match at {
            VelocityAt::Auto if first.class == Class::Staggered => VelocityAt::Staggered,
            VelocityAt::Auto => VelocityAt::Centre,
            at => at,
        };
        // A sample half a voxel below the centre of its voxel is found half an index above the centre's.
        let shift = |component: usize| match at {
            VelocityAt::Node => DVec3::splat(0.5),
            VelocityAt::Staggered => DVec3::AXES[component] * 0.5,
            _ => DVec3::ZERO,
        };
        if grids.len() == 1 && at != VelocityAt::Staggered {
            return Some(Field::Vector(Source::new(first, density, shift(0))));
        }
        Some(Field::Components(Box::new([0, 1, 2].map(|a| match grids.get(a) {
            Some(grid) if grids.len() == 3 => (Source::new(grid, density, shift(a)), 0),
            _ => (Source::new(first, density, shift(a)), a),
        }))))
    }

    /// Velocity at a voxel of the density.
    #[inline]
    pub fn at(&mut self, index: [i32; 3]) -> DVec3 {
        DVec3::from_array(match self {
            Field::Vector(source) => source.at(index).map(f64::from),
            Field::Components(parts) => {
                parts.each_mut().map(|(source, own)| f64::from(source.at(index)[*own]))
            }
        })
    }

    /// Length of the curl at a voxel of the density, 1/s. `density` is that grid's transform: differences are
    /// taken between the voxels on both sides.
    pub fn vorticity(&mut self, index: [i32; 3], density: &DAffine3) -> f64 {
        let step = |a: usize, by: i32| {
            let mut at = index;
            at[a] = at[a].saturating_add(by);
            at
        };
        // Columns: change of the velocity per index along each axis.
        let per_index = [0, 1, 2].map(|a| (self.at(step(a, 1)) - self.at(step(a, -1))) * 0.5);
        curl(per_index, density.matrix3)
    }
}

/// Length of the curl, 1/s, where the velocity changes by `per_index` (m/s) per index along each axis.
/// `to_world` gives the metres per index.
pub(super) fn curl(per_index: [DVec3; 3], to_world: DMat3) -> f64 {
    let [a, b, c] = per_index;
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = DMat3::from_cols(a, b, c) * to_world.inverse();
    DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x).length()
}
