//! Shells over parts of a mesh.

use std::sync::Arc;

use glam::DVec2;

use super::build::{Cover, Key};
use super::coordinates::Coordinates;
use super::faces::unmapped_error;
use super::{Carrier, ThicknessFrom};
use crate::mapping::shell::{Shell, ShellFault, Side, SurfaceMesh};
use crate::scene::{Recipe, Values, volumes};
use crate::util::error::{Error, Result};

/// Returns the shells of a mesh, one for each material that has one.
pub(super) fn shells(key: &Key) -> Result<Vec<Arc<Shell>>> {
    let covers = key.covers.iter().filter(|cover| cover.carrier == Carrier::Shell);
    covers.map(|cover| shell(key, cover).map(Arc::new)).collect()
}

/// Returns the shell over all parts with a cover.
fn shell(key: &Key, cover: &Cover) -> Result<Shell> {
    let mut surface = SurfaceMesh::default();
    let repeats = DVec2::new(cover.material.repeat_u.into(), cover.material.repeat_v.into());
    for part in key.covered(cover) {
        let coordinates = Coordinates::of(key, cover, part)?;
        let colors = match cover.from {
            ThicknessFrom::None => None,
            ThicknessFrom::Color => match &part.primitive.colors {
                Some(colors) => Some(colors),
                None => return Err(no_colors(key, cover)),
            },
        };
        let thickness = |vertex: u32| {
            let share = colors.map_or(1.0, |colors| colors[vertex as usize][0].clamp(0.0, 1.0));
            cover.material.thickness_m * share
        };
        let mut add = |vertex: u32, uv: DVec2| {
            surface.positions.push(part.position(vertex));
            surface.uv.push((uv * repeats).as_vec2());
            surface.thickness.push(thickness(vertex));
            surface.positions.len() as u32 - 1
        };
        let mut triangles = Vec::with_capacity(part.primitive.triangles.len());
        if coordinates.are_shared() {
            let count = part.primitive.positions.len();
            let mut own = vec![u32::MAX; count];
            for corners in &part.primitive.triangles {
                let uv = coordinates.at(*corners);
                triangles.push([0, 1, 2].map(|k| {
                    let number = &mut own[corners[k] as usize];
                    if *number == u32::MAX {
                        *number = add(corners[k], uv[k]);
                    }
                    *number
                }));
            }
        } else {
            for corners in &part.primitive.triangles {
                let uv = coordinates.at(*corners);
                triangles.push([0, 1, 2].map(|k| add(corners[k], uv[k])));
            }
        }
        if part.flipped {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        surface.triangles.extend(triangles);
    }
    let fault = |fault: ShellFault| match fault {
        ShellFault::Unmapped => unmapped_error(key, cover),
        fault => Error::input(
            format!("{}: the mesh {}", key.words(cover), fault.words()),
            format!("mend it in the program that made it, or set materials.{}.carrier=face", cover.name),
        ),
    };
    let mut shell = Shell::new(&surface, cover.side).map_err(fault)?;
    shell.volume = cover.material.volume;
    shell.skin = cover.has_body;
    Ok(shell)
}

/// Share of a shell's prisms that may turn over untold: at a few edges it is not seen. Of the water of the
/// preset `cliff` 5 % do.
const MOST_TURNED: f64 = 0.1;

/// Returns a warning about each inward shell that turns over itself. Outward ones do so in narrow hollows,
/// and seldom show it.
pub(in crate::scene) fn turned_over(shells: &[Arc<Shell>], recipes: &[Recipe], v: &Values) -> Vec<String> {
    let materials = volumes::used_materials(v);
    let is_inward = |volume: &str| {
        materials.iter().any(|material| {
            let side = v.choice(&format!("materials.{material}.side"), Side::from_word);
            side == Side::Inward && volumes::volume_of(v, material) == volume
        })
    };
    let told = |shell: &Arc<Shell>| {
        if !is_inward(&recipes[shell.volume as usize].name) {
            return None;
        }
        let (turned, all) = (shell.turned_over(), shell.prisms.len());
        (turned as f64 > MOST_TURNED * all as f64).then(|| {
            format!(
                "the shell of the volume {} turns over itself at {turned} of {all} triangles, where it is \
                 thicker than half of the mesh: such parts look ragged and take long; lower the thickness of \
                 its material, or paint it thinner there (thickness_from)",
                recipes[shell.volume as usize].name
            )
        })
    };
    shells.iter().filter_map(told).collect()
}

fn no_colors(key: &Key, cover: &Cover) -> Error {
    Error::input(
        format!(
            "{}: thickness_from = \"color\", and {} has parts without colours of vertices",
            key.words(cover),
            key.mesh.file.display()
        ),
        format!(
            "paint the vertices and export their colours, or set materials.{}.thickness_from=none",
            cover.name
        ),
    )
}
