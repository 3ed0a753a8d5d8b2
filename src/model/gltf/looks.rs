//! Materials with their textures, images, cameras and lights.

use std::f32::consts::FRAC_PI_4;

use super::super::budget::Budget;
use super::super::{
    AlphaMode, CameraLens, LightKind, Model, ModelCamera, ModelLight, ModelMaterial, TextureRef,
    TextureTransform, Wrap,
};
use super::{Gltf, json};
use crate::model::paths::shorten;
use crate::util::error::Result;

const NEAREST: u32 = 9728;
const CLAMP_TO_EDGE: u32 = 33_071;
const MIRRORED_REPEAT: u32 = 33_648;

impl Gltf<'_> {
    /// Reads everything that does not depend on the buffers' geometry.
    pub fn read_looks(&self, model: &mut Model, budget: &mut Budget) -> Result<()> {
        for image in 0..self.document.images.len() {
            let image = self.image(image, budget)?;
            model.images.push(image);
        }
        for (i, material) in self.document.materials.iter().enumerate() {
            model.materials.push(self.material(&format!("materials[{i}]"), material)?);
        }
        for (i, camera) in self.document.cameras.iter().enumerate() {
            let lens = self.lens(&format!("cameras[{i}]"), camera)?;
            model.cameras.push(ModelCamera { name: camera.name.clone(), lens });
        }
        for (i, light) in self.document.extensions.lights.lights.iter().enumerate() {
            let place = format!("extensions.KHR_lights_punctual.lights[{i}]");
            model.lights.push(self.light(&place, light)?);
        }
        Ok(())
    }

    fn material(&self, place: &str, material: &json::Material) -> Result<ModelMaterial> {
        let pbr = &material.pbr_metallic_roughness;
        let own = format!("{place}.pbrMetallicRoughness");
        let texture = |info: &Option<json::TextureInfo>, place: String| match info {
            Some(info) => self.texture(&place, info),
            None => Ok(None),
        };
        let alpha = match material.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask { cutoff: material.alpha_cutoff.unwrap_or(0.5) },
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => {
                let why = format!("{} is neither OPAQUE, MASK nor BLEND", shorten(other));
                return Err(self.fault(&format!("{place}.alphaMode"), why));
            }
        };
        let out = ModelMaterial {
            name: material.name.clone(),
            base_color: pbr.base_color_factor.unwrap_or([1.0; 4]),
            base_color_texture: texture(&pbr.base_color_texture, format!("{own}.baseColorTexture"))?,
            roughness: pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            metallic: pbr.metallic_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            says_roughness: pbr.roughness_factor.is_some()
                || pbr.metallic_factor.is_some()
                || pbr.metallic_roughness_texture.is_some(),
            roughness_texture: texture(
                &pbr.metallic_roughness_texture,
                format!("{own}.metallicRoughnessTexture"),
            )?,
            normal_texture: texture(&material.normal_texture, format!("{place}.normalTexture"))?,
            normal_scale: material.normal_texture.as_ref().and_then(|info| info.scale).unwrap_or(1.0),
            double_sided: material.double_sided,
            alpha,
        };
        let numbers = [out.roughness, out.metallic, out.normal_scale];
        let color = out.base_color.iter().all(|x| x.is_finite() && *x >= 0.0);
        if !color || !numbers.iter().all(|x| x.is_finite()) {
            return Err(self.fault(place, "a factor is not finite, or a colour is below 0"));
        }
        Ok(out)
    }

    /// Finds the image of a texture. Returns `None` where the texture has none.
    fn texture(&self, place: &str, info: &json::TextureInfo) -> Result<Option<TextureRef>> {
        let textures = &self.document.textures;
        let index = self.index(place, info.index, textures.len(), "textures")?;
        let texture = &textures[index];
        let own = format!("textures[{index}]");
        let extended = texture.extensions.webp.as_ref().map(|webp| webp.source);
        let basisu = texture.extensions.basisu.as_ref().map(|basisu| basisu.source);
        // A fall-back of PNG or JPEG is read where KTX2 is not.
        let Some(image) = extended.or(texture.source).or(basisu) else { return Ok(None) };
        let image = self.index(&own, image, self.document.images.len(), "images")?;
        let mut wrap = [Wrap::Repeat; 2];
        let mut nearest = false;
        if let Some(sampler) = texture.sampler {
            let samplers = &self.document.samplers;
            let sampler = &samplers[self.index(&own, sampler, samplers.len(), "samplers")?];
            wrap = [sampler.wrap_s, sampler.wrap_t].map(|code| match code {
                Some(CLAMP_TO_EDGE) => Wrap::Clamp,
                Some(MIRRORED_REPEAT) => Wrap::Mirror,
                _ => Wrap::Repeat,
            });
            nearest = sampler.mag_filter == Some(NEAREST);
        }
        let mut transform = TextureTransform::default();
        let mut set = info.tex_coord;
        if let Some(given) = &info.extensions.transform {
            transform = TextureTransform {
                offset: given.offset.unwrap_or([0.0; 2]),
                rotation: given.rotation.unwrap_or(0.0),
                scale: given.scale.unwrap_or([1.0; 2]),
            };
            set = given.tex_coord.unwrap_or(set);
            let [a, b] = [transform.offset, transform.scale];
            if ![a[0], a[1], b[0], b[1], transform.rotation].iter().all(|x| x.is_finite()) {
                let place = format!("{place}.extensions.KHR_texture_transform");
                return Err(self.fault(&place, "a number is not finite"));
            }
        }
        Ok(Some(TextureRef { image, set, wrap, nearest, transform }))
    }

    fn lens(&self, place: &str, camera: &json::Camera) -> Result<CameraLens> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if let Some(lens) = &camera.perspective {
            if !positive(lens.yfov) || lens.yfov >= std::f64::consts::PI {
                let why = format!("yfov = {} is no angle between 0 and π", lens.yfov);
                return Err(self.fault(&format!("{place}.perspective"), why));
            }
            let aspect = lens.aspect_ratio.filter(|aspect| positive(*aspect));
            return Ok(CameraLens::Perspective { fov_y: lens.yfov, aspect });
        }
        let Some(lens) = &camera.orthographic else {
            return Err(self.fault(place, "it is neither perspective nor orthographic"));
        };
        let [half_width, half_height] = [lens.xmag, lens.ymag].map(f64::abs);
        if !positive(half_width) || !positive(half_height) {
            return Err(self.fault(&format!("{place}.orthographic"), "xmag and ymag must not be 0"));
        }
        Ok(CameraLens::Orthographic { half_width, half_height })
    }

    fn light(&self, place: &str, light: &json::Light) -> Result<ModelLight> {
        let kind = match light.kind.as_str() {
            "directional" => LightKind::Directional,
            "point" => LightKind::Point,
            "spot" => {
                let spot = light.spot.as_ref();
                let inner = spot.and_then(|spot| spot.inner_cone_angle).unwrap_or(0.0);
                let outer = spot.and_then(|spot| spot.outer_cone_angle).unwrap_or(FRAC_PI_4);
                if !(inner >= 0.0 && outer >= inner && outer <= std::f32::consts::FRAC_PI_2 + 1e-6) {
                    let why = format!("a cone from {inner} to {outer} radians");
                    return Err(self.fault(&format!("{place}.spot"), why));
                }
                LightKind::Spot { inner, outer }
            }
            other => {
                let why = format!("{} is neither directional, point nor spot", shorten(other));
                return Err(self.fault(&format!("{place}.type"), why));
            }
        };
        let color = light.color.unwrap_or([1.0; 3]);
        let intensity = light.intensity.unwrap_or(1.0);
        if !color.iter().chain([&intensity]).all(|x| x.is_finite() && *x >= 0.0) {
            return Err(self.fault(place, "its colour or intensity is below 0 or not finite"));
        }
        let range = light.range.filter(|range| range.is_finite() && *range > 0.0);
        Ok(ModelLight { name: light.name.clone(), kind, color, intensity, range })
    }
}
