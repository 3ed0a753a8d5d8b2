//! The pages of `docs/`, to read beside the modules.

macro_rules! pages {
    ($($name:ident $file:literal)*) => {
        $(#[doc = include_str!(concat!("../docs/", $file))] pub mod $name {})*
    };
}

pages! {
    tutorial "tutorial.md"
    meshes "meshes.md"
    materials "materials.md"
    grids "grids.md"
    simulation "simulation.md"
    method "method.md"
    look "look.md"
    parameters "parameters.md"
    scenes_and_files "scenes-and-files.md"
    aces "aces.md"
    viewer "viewer.md"
    batch "batch.md"
    compositing "compositing.md"
    farms "farms.md"
    speed "speed.md"
    architecture "architecture.md"
}
