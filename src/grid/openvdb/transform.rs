//! Transforms of grids.

use glam::{DAffine3, DMat3, DVec3};

use super::super::source::Source;
use super::head::Refusal;
use crate::util::error::Result;

/// Reads the transform of a grid. What follows a transform of another kind cannot be found.
pub(super) fn read_transform(source: &mut Source) -> Result<std::result::Result<DAffine3, Refusal>> {
    let kind = source.text()?;
    let transform = match kind.as_str() {
        // Scale, voxel, and three more of the same that are kept for speed.
        "UniformScaleMap" | "ScaleMap" => {
            let numbers: [f64; 15] = source.f64s()?;
            DAffine3::from_scale(DVec3::from_slice(&numbers))
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let numbers: [f64; 18] = source.f64s()?;
            let scale = DMat3::from_diagonal(DVec3::from_slice(&numbers[3..]));
            DAffine3::from_mat3_translation(scale, DVec3::from_slice(&numbers))
        }
        "TranslationMap" => DAffine3::from_translation(DVec3::from(source.f64s::<3>()?)),
        // Rows of a matrix that an index is multiplied with from the left.
        "AffineMap" | "UnitaryMap" => {
            let numbers: [f64; 16] = source.f64s()?;
            let row = |i: usize| DVec3::from_slice(&numbers[4 * i..]);
            DAffine3 { matrix3: DMat3::from_cols(row(0), row(1), row(2)), translation: row(3) }
        }
        "NonlinearFrustumMap" => {
            let fix = "resample it to a grid with equal voxels in the program that made it";
            return Ok(Err(("its voxels widen like a camera's view (a frustum)".into(), fix.into())));
        }
        _ => {
            let kind: String = kind.chars().take(48).collect();
            let fix = "resample it to a grid with equal voxels in the program that made it";
            return Ok(Err((format!("its transform is {kind:?}, which is not read"), fix.into())));
        }
    };
    Ok(super::super::checked(transform))
}
