//! Multiple scattering of a whole scene: the data that is computed before rays are walked.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::{COSINES, Layers, Profile, Scattering, Similarity, VIEWS, full_depth, layer_means};
use crate::light::Reflection;
use crate::mapping::{Material, Quad};
use crate::trace::{Attenuation, MIST_OF_CELLS, MIST_RHO};
use crate::volume::VolumeTexture;

/// Maximum albedo of Kajiya and Kay's fibres. A medium that gains light at every scattering has no finite
/// solution.
const MOST_ALBEDO: f32 = 0.99;

/// Number of cached profiles. A slider that moves back and forth finds them again.
const CACHED_PROFILES: usize = 16;

/// Multiple scattering of a scene.
pub struct Media {
    /// Constants of the reduced medium of flowing water in each volume.
    pub waters: Vec<Similarity>,
    /// One medium for each kind of sheet, in the order in which the quads first have them.
    pub media: Vec<MultipleMedium>,
}

/// Multiple scattering of the sheets of one kind.
pub struct MultipleMedium {
    /// Constants of the reduced medium.
    pub similarity: Similarity,
    /// Tables of the slab.
    pub profile: Arc<Profile>,
}

/// Properties that sheets with the same multiple scattering share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// Thickness of the slab in metres.
    pub thickness_m: f32,
    /// Ψ of mist, or 0 for flowing water.
    pub mist: f32,
    /// Number of the volume.
    pub volume: u32,
}

impl Media {
    /// Multiple scattering in the materials of `quads`. `reflections` are the models of the volumes, and `p`
    /// is the exponent of the specular term.
    pub fn new(
        quads: &[Quad],
        attenuation: &Attenuation,
        reflections: &[&Reflection],
        p: f32,
        volumes: &[VolumeTexture],
    ) -> Media {
        let waters = volumes.iter().zip(reflections).map(|(v, own)| scattering(own, p, v, None));
        let waters: Vec<Scattering> = waters.collect();
        let own = if matches!(attenuation, Attenuation::PerCell { .. }) { 0.5 } else { 0.0 };
        let medium = |Kind { thickness_m, mist, volume }: &Kind| {
            let (water, volume) = (waters[*volume as usize], &volumes[*volume as usize]);
            let full = full_depth(volume, attenuation, thickness_m / volume.size[2] as f32);
            let shares = layer_means(volume);
            let (layers, scattering) = match *mist > 0.0 {
                true => {
                    let depths = shares.iter().map(|rho| full * mist_rho(*rho));
                    // Light rays take mist to be even.
                    let lit = vec![full * MIST_RHO as f64 / 65535.0; shares.len()];
                    (Layers { depths: depths.collect(), lit, own: 0.0 }, Scattering::mist(*mist))
                }
                false => {
                    let depths: Vec<f64> = shares.iter().map(|rho| full * rho).collect();
                    (Layers { lit: depths.clone(), depths, own }, water)
                }
            };
            MultipleMedium { similarity: scattering.similarity(), profile: profile(layers, scattering) }
        };
        let media = kinds(quads).0.iter().map(medium).collect();
        Media { waters: waters.iter().map(Scattering::similarity).collect(), media }
    }
}

/// Distinct kinds of the quads, and for every quad the index of its kind.
pub fn kinds(quads: &[Quad]) -> (Vec<Kind>, Vec<u32>) {
    let (mut list, mut known) = (Vec::new(), HashMap::new());
    let indices = quads.iter().map(|quad| {
        let Material { thickness_m, volume, .. } = quad.material;
        let kind = Kind { thickness_m, mist: quad.mist, volume };
        *known.entry((kind.thickness_m.to_bits(), kind.mist.to_bits(), volume)).or_insert_with(|| {
            list.push(kind);
            list.len() as u32 - 1
        })
    });
    let indices = indices.collect();
    (list, indices)
}

/// ρ of mist in a cell of density `rho`: [`SheetDensity`](crate::trace::SheetDensity) without erosion.
fn mist_rho(rho: f64) -> f64 {
    let [of_cells, even] = [MIST_OF_CELLS as f64, MIST_RHO as f64 / 65535.0];
    of_cells * rho + (1.0 - of_cells) * even
}

/// Number of values in one profile of `layers` layers.
pub fn profile_length(layers: u32) -> u32 {
    2 * COSINES * (layers + VIEWS)
}

/// Scattering by the matter of a volume over the colour of its cells. `p` is the exponent of the specular
/// term, and `k_s` that of all cells where colours take the place of it.
pub fn scattering(reflection: &Reflection, p: f32, volume: &VolumeTexture, k_s: Option<f32>) -> Scattering {
    match reflection.shading() {
        Some(shading) => {
            let moments = shading.moments();
            let g = moments.mean_cosine.element_sum() / 3.0;
            Scattering { albedo: moments.albedo.as_vec3(), g: g as f32 }
        }
        None => {
            let s = volume.statistics();
            Scattering::kajiya_kay(s.k_d_mean as f32, k_s.unwrap_or(s.k_s_mean as f32), p, MOST_ALBEDO)
        }
    }
}

fn profile(layers: Layers, scattering: Scattering) -> Arc<Profile> {
    type CachedProfile = (Layers, Scattering, Arc<Profile>);
    static CACHE: Mutex<Vec<CachedProfile>> = Mutex::new(Vec::new());
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    let cached = match cache.iter().position(|cached| cached.0 == layers && cached.1 == scattering) {
        Some(i) => cache.remove(i),
        None => {
            let profile = Arc::new(Profile::new(&layers, &scattering));
            (layers, scattering, profile)
        }
    };
    let profile = cached.2.clone();
    cache.insert(0, cached);
    cache.truncate(CACHED_PROFILES);
    profile
}
