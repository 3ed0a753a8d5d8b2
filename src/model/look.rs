//! Materials, cameras and lights of a model.

use glam::{Mat2, Vec2};

/// Material of a primitive. Its name chooses what the primitive becomes in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMaterial {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Linear RGBA by which the texture is multiplied.
    pub base_color: [f32; 4],
    /// Texture of the base colour, coded in sRGB.
    pub base_color_texture: Option<TextureRef>,
    /// Roughness, 0 to 1.
    pub roughness: f32,
    /// How metallic it is, 0 to 1.
    pub metallic: f32,
    /// Whether the file says anything of the two. A file that does not leaves glTF's rough metal, which few
    /// authors mean.
    pub says_roughness: bool,
    /// Texture of roughness (green) and of how metallic it is (blue), linear.
    pub roughness_texture: Option<TextureRef>,
    /// Texture of normals in tangent space, linear.
    pub normal_texture: Option<TextureRef>,
    /// Factor of the normals' x and y.
    pub normal_scale: f32,
    /// Tells whether the back of a face is seen.
    pub double_sided: bool,
    /// Use of alpha.
    pub alpha: AlphaMode,
}

impl Default for ModelMaterial {
    /// glTF's default material.
    fn default() -> Self {
        ModelMaterial {
            name: String::new(),
            base_color: [1.0; 4],
            base_color_texture: None,
            roughness: 1.0,
            metallic: 1.0,
            says_roughness: false,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            double_sided: false,
            alpha: AlphaMode::Opaque,
        }
    }
}

/// Use of a material's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// What has an alpha below the cutoff is not seen.
    Mask {
        /// Least alpha that is seen.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

/// Reference to an image, with the way to look it up.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureRef {
    /// Index of the image.
    pub image: usize,
    /// Index of the set of texture coordinates.
    pub set: u32,
    /// Continuation along u and along v.
    pub wrap: [Wrap; 2],
    /// Tells whether a texel is enlarged without interpolation.
    pub nearest: bool,
    /// Transform of the coordinates (KHR_texture_transform).
    pub transform: TextureTransform,
}

/// Continuation of a texture beyond 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Wrap {
    /// The texture is repeated.
    #[default]
    Repeat,
    /// The texture is repeated, every second time mirrored.
    Mirror,
    /// The texels of the border go on.
    Clamp,
}

/// Transform of texture coordinates: scale, then rotation, then offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureTransform {
    /// Offset, in textures.
    pub offset: [f32; 2],
    /// Angle, radians: u' = u cos + v sin, v' = v cos − u sin, as Blender writes it. GLSL in the extension's
    /// text turns the other way, its prose and its example do not.
    pub rotation: f32,
    /// Factors of u and v.
    pub scale: [f32; 2],
}

impl Default for TextureTransform {
    fn default() -> Self {
        TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

impl TextureTransform {
    /// Returns the coordinates at which the image is looked up.
    pub fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        (turn * (Vec2::from(uv) * Vec2::from(self.scale)) + Vec2::from(self.offset)).into()
    }
}

/// Camera. It looks along −Z of its node, with +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelCamera {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Projection.
    pub lens: CameraLens,
}

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraLens {
    /// Perspective.
    Perspective {
        /// Vertical field of view, radians.
        fov_y: f64,
        /// Width over height, where the file fixes it.
        aspect: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the picture's width, metres.
        half_width: f64,
        /// Half of the picture's height, metres.
        half_height: f64,
    },
}

/// Light. It shines along −Z of its node.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelLight {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Kind.
    pub kind: LightKind,
    /// Linear colour.
    pub color: [f32; 3],
    /// Illuminance of a directional light, lx; luminous intensity of the others, cd.
    pub intensity: f32,
    /// Distance beyond which the light ends, metres; `None` where it does not.
    pub range: Option<f32>,
}

/// Kind of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Parallel light, as of the sun.
    Directional,
    /// Light to all sides.
    Point,
    /// Light into a cone.
    Spot {
        /// Angle from the axis within which the light is full, radians.
        inner: f32,
        /// Angle from the axis beyond which there is none, radians.
        outer: f32,
    },
}
