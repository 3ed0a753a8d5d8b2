//! Multiple scattering of a whole scene: the data that is computed before rays are walked.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::{COSINES, Profile, Scattering, Similarity, layer_depths};
use crate::light::Reflection;
use crate::light::strand::table::StrandShading;
use crate::mapping::Quad;
use crate::trace::Attenuation;
use crate::volume::VolumeTexture;

/// Maximum albedo of Kajiya and Kay's fibres. A medium that gains light at every scattering has no finite
/// solution.
const MOST_ALBEDO: f32 = 0.99;

/// Number of cached profiles. A slider that moves back and forth finds them again.
const CACHED_PROFILES: usize = 16;

/// Multiple scattering of a scene.
pub struct Media {
    /// Constants of the reduced medium.
    pub similarity: Similarity,
    /// One profile for each thickness, in the order in which the quads first have them.
    pub profiles: Vec<Arc<Profile>>,
}

impl Media {
    /// Multiple scattering in the materials of `quads`. `p` is the exponent of the specular term.
    pub fn new(
        quads: &[Quad],
        attenuation: &Attenuation,
        reflection: &Reflection,
        p: f32,
        volume: &VolumeTexture,
    ) -> Media {
        let scattering = scattering(reflection, p, volume);
        let (thicknesses, _) = thicknesses(quads);
        let profiles = thicknesses.iter().map(|thickness_m| {
            let depths = layer_depths(volume, attenuation, thickness_m / volume.size[2] as f32);
            profile(depths, scattering)
        });
        Media { similarity: scattering.similarity(), profiles: profiles.collect() }
    }
}

/// Distinct thicknesses of the quads in metres, and for every quad the index of its thickness.
pub fn thicknesses(quads: &[Quad]) -> (Vec<f32>, Vec<u32>) {
    let (mut list, mut known) = (Vec::new(), HashMap::new());
    let indices = quads.iter().map(|quad| {
        let thickness_m = quad.material.thickness_m;
        *known.entry(thickness_m.to_bits()).or_insert_with(|| {
            list.push(thickness_m);
            list.len() as u32 - 1
        })
    });
    let indices = indices.collect();
    (list, indices)
}

/// Number of values in one profile of `layers` layers.
pub fn profile_length(layers: u32) -> u32 {
    2 * COSINES * layers
}

fn scattering(reflection: &Reflection, p: f32, volume: &VolumeTexture) -> Scattering {
    match reflection {
        Reflection::Strand(params) => {
            let moments = StrandShading::new(params).moments();
            let g = moments.mean_cosine.element_sum() / 3.0;
            Scattering { albedo: moments.albedo.as_vec3(), g: g as f32 }
        }
        Reflection::KajiyaKay => {
            let s = volume.statistics();
            Scattering::kajiya_kay(s.k_d_mean as f32, s.k_s_mean as f32, p, MOST_ALBEDO)
        }
    }
}

fn profile(depths: Vec<f64>, scattering: Scattering) -> Arc<Profile> {
    type CachedProfile = (Vec<f64>, Scattering, Arc<Profile>);
    static CACHE: Mutex<Vec<CachedProfile>> = Mutex::new(Vec::new());
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    let cached = match cache.iter().position(|cached| cached.0 == depths && cached.1 == scattering) {
        Some(i) => cache.remove(i),
        None => {
            let profile = Arc::new(Profile::new(&depths, &scattering));
            (depths, scattering, profile)
        }
    };
    let profile = cached.2.clone();
    cache.insert(0, cached);
    cache.truncate(CACHED_PROFILES);
    profile
}
