//! Memory that a scene's picture takes besides its volume.

use super::Parts;
use crate::light::scatter::shell::{DIFFUSE_BYTES, diffuse_work_bytes};
use crate::light::{Scattering, Visibility};
use crate::picture::{LEAST_ROWS, WORK_BYTES, canvas, row_bytes};
use crate::place::{CASTER_BYTES, Pool, PoolField, PoolWaves, Vertex};

impl Parts {
    /// Returns the bytes that rocks, pools, the environment and the raster window take on host and device,
    /// where up to `layers` quads of the volume lie under a pixel.
    pub(crate) fn bytes_beside_volume(&self, layers: u32) -> u64 {
        let vertices: u64 = self.rocks.iter().map(|rock| rock.vertex_count()).sum();
        let triangles: u64 = self.triangles.iter().map(|own| own.vertices.len() as u64).sum();
        let vertices = vertices + triangles + (self.pools.len() * Pool::VERTICES) as u64;
        let rocks = vertices.saturating_mul(2 * (size_of::<Vertex>() as u64 + 24));
        let environment = self.environment.as_ref().map_or(0, |e| e.map.bytes().saturating_mul(2));
        let paintings = self.triangles.iter().filter_map(|own| own.painting.as_ref());
        let painted = paintings.map(|painting| 2 * painting.bytes()).sum::<u64>();
        let shells = self.shells.iter().map(|shell| shell.bytes()).sum::<u64>();
        let on_shells = [self.bytes_of_shadows_on_shells(), self.bytes_of_diffuse_on_shells()];
        let has_field = |pool: &&Pool| pool.waves == PoolWaves::Field;
        let fields = self.pools.iter().filter(has_field).map(PoolField::bytes).sum::<u64>();
        let all = [rocks, environment, shells, painted, fields].into_iter().chain(on_shells);
        all.fold(canvas(&self.image, layers), u64::saturating_add)
    }

    /// Returns the bytes of the shadows that opaque matter casts on shells: what casts them, and their shares
    /// of each light at the vertices, on host and device.
    fn bytes_of_shadows_on_shells(&self) -> u64 {
        if self.visibility == Visibility::None {
            return 0;
        }
        let skins = self.shells.iter().filter(|shell| shell.skin).map(|shell| shell.prisms.len() as u64);
        let triangles = self.triangles.iter().map(|own| own.vertices.len() as u64 / 3);
        let casters: u64 = skins.chain(triangles).sum();
        let vertices: u64 = self.shells.iter().map(|shell| shell.vertices() as u64).sum();
        let lights = (self.lights.len() + self.environment_lights.len()) as u64;
        if vertices == 0 { 0 } else { casters * CASTER_BYTES + 16 * lights * vertices }
    }

    /// Returns the bytes of the diffuse light in shells: its values on host and device, and what the host
    /// needs while it solves for them in one shell.
    fn bytes_of_diffuse_on_shells(&self) -> u64 {
        let (mut kept, mut work) = (0, 0);
        for shell in &self.shells {
            let recipe = &self.recipes[shell.volume as usize];
            if self.scattering == Scattering::Single && recipe.skin.is_none() {
                continue;
            }
            let layers = recipe.water.size[2].div_ceil(2);
            let vertices = shell.vertices() as u64;
            kept += 2 * vertices * u64::from(layers + 1) * DIFFUSE_BYTES;
            work = vertices.saturating_mul(diffuse_work_bytes(layers as usize)).max(work);
        }
        work.saturating_add(kept)
    }

    /// Returns the bytes that a picture of the whole image needs besides the volume, with every layer of an
    /// EXR and as many quads under a pixel as the scene allows. So it is the same for all frames of an
    /// animation and for all files that may be written.
    pub(super) fn least_bytes_beside_volume(&self) -> u64 {
        let most = if self.shells.is_empty() { self.quads.len().max(1) as u32 } else { u32::MAX };
        let layers = self.trace.layers.clamp(1, most);
        let rows = LEAST_ROWS.min(u64::from(self.image.height));
        let strip = rows.saturating_mul(row_bytes(&self.image, self.image.width, true));
        self.bytes_beside_volume(layers).saturating_add(WORK_BYTES).saturating_add(strip)
    }
}
