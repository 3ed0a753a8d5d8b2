//! Binding numbers of the passes, named as the shaders' variables are. A test compares them with the shaders
//! through naga.

/// Declares a module of constants for each stage.
macro_rules! bindings {
    ($($(#[$doc:meta])* $stage:ident { $($name:ident = $number:literal)* })*) => {$(
        $(#[$doc])*
        #[allow(missing_docs)] // The shaders' variables describe them.
        pub mod $stage {
            $(pub const $name: u32 = $number;)*
            /// Name and number of each.
            pub const ALL: &[(&str, u32)] = &[$((stringify!($name), $number)),*];
        }
    )*};
}

bindings! {
    /// `shaders/engine/gbuffer.wgsl`, and pools in `shaders/engine/pool.wgsl` and `pool_field.wgsl`.
    gbuffer {
        FRAME = 0
        LIGHTS = 1
        QUADS = 2
        KNOWN_DEPTH = 3
        KNOWN_IDS = 4
        ENVIRONMENT = 5
        ENVIRONMENT_MAP = 6
        POOL = 7
        POSITIONS = 8
        TILES = 9
        ROCK_SURFACE = 10
        COATS = 11
        HULL_FACES = 12
        PAINTS = 13
        CORNER_UVS = 14
        TEXELS = 15
        STONES = 16
        POOL_SLOPES = 17
        POOL_CARRIED = 18
    }
    /// `shaders/engine/integrate.wgsl`; `shaders/engine/bare.wgsl` has some of them.
    integrate {
        FRAME = 0
        LIGHTS = 1
        QUADS = 2
        GROUPS = 3
        VOLUME = 4
        SURFACE = 5
        QUAD_ID = 6
        OPAQUE_RADIANCE = 7
        RADIANCE = 8
        COUNTS = 9
        LIGHT_VOLUMES = 10
        LIGHT_PLACES = 11
        REFLECTION = 12
        STRAND_TABLE = 13
        LINEAR = 14
        PROFILES = 15
        GROUP_LIST = 16
        BRICKS = 17
        OPAQUE_NORMAL = 18
        UNCOVERED = 19
        VOLUMES = 20
        SHELLS = 21
        SHELL_LIGHT = 22
    }
    /// `shaders/picture/resolve.wgsl`.
    resolve {
        FRAME = 0
        RADIANCE = 1
        PICTURE = 2
        TILE = 3
        DEVELOP = 4
        UNCOVERED = 5
    }
    /// `shaders/light/visibility.wgsl`.
    visibility {
        FRAME = 0
        LIGHT_VOLUME = 1
        VOLUME = 2
        COLUMNS = 3
        LIGHT_VOLUMES = 4
        BRICKS = 5
    }
    /// `shaders/light/shell_light.wgsl`.
    shell_light {
        PART = 0
        LIGHTS = 1
        VOLUME = 2
        BRICKS = 3
        SHELLS = 4
        SHELL_LIGHT = 5
    }
}

/// Binds a resource.
pub(super) fn bind(binding: u32, resource: wgpu::BindingResource) -> wgpu::BindGroupEntry {
    wgpu::BindGroupEntry { binding, resource }
}

/// Binds a texture.
pub(super) fn bind_texture(binding: u32, view: &wgpu::TextureView) -> wgpu::BindGroupEntry<'_> {
    bind(binding, wgpu::BindingResource::TextureView(view))
}

/// Binds a whole buffer.
pub(super) fn bind_buffer(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    bind(binding, buffer.as_entire_binding())
}
